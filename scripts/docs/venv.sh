#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes the Python environment of 'make docs' (MkDocs): the packages of scripts/docs/requirements.txt, by version, from
# the Python Package Index. Once it is there, no network is needed, and this returns at once.
#
#   scripts/docs/venv.sh [--check]      --check: make nothing; exit code 1 if it is missing or another version
#
# It lies in build/docs-venv; DOCS_VENV names another place. pip takes proxy, certificates (PIP_CERT) and index from the
# environment or its own configuration. Needs no root; scripts/setup.sh docs installs python3-venv first.
set -euo pipefail
cd "$(dirname "$0")/../.."
venv=${DOCS_VENV:-build/docs-venv}
wanted=scripts/docs/requirements.txt
case "${1:-}" in
  -h | --help) sed -n '3,/^[^#]/{s/^# \{0,1\}//p}' "$0"; exit 0 ;;
  '' | --check) ;;
  *) echo "venv: unknown argument '$1'; see --help" >&2; exit 2 ;;
esac
# The list that was installed is kept beside the packages: it is complete only if pip came to its end.
if [ -x "$venv/bin/mkdocs" ] && cmp -s "$wanted" "$venv/requirements.txt"; then exit 0; fi
if [ "${1:-}" = --check ]; then echo "venv: $venv is missing or old: scripts/setup.sh docs" >&2; exit 1; fi
echo "venv: making $venv (about 160 MB)"
rm -rf "$venv"
mkdir -p "$(dirname "$venv")"
if ! python3 -m venv "$venv" || ! "$venv/bin/python3" -m pip install -q --disable-pip-version-check -r "$wanted"; then
  echo "venv: needs Debian's python3-venv, and the Python Package Index once; behind a proxy or with a certificate" >&2
  echo "venv: of one's own, set https_proxy, PIP_CERT or pip's configuration and run it again" >&2
  rm -rf "$venv"
  exit 1
fi
cp "$wanted" "$venv/requirements.txt"
