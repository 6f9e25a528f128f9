#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes the Python environment of 'make dse' (Snakemake): the packages of scripts/dse/requirements.txt, by version,
# from the Python Package Index. Once it is there, no network is needed, and this returns at once.
#
#   scripts/dse/venv.sh [--check]      --check: make nothing; exit code 1 if it is missing or another version
#
# It lies in build/dse/venv; DSE_VENV names another place. pip takes proxy, certificates (PIP_CERT) and index from the
# environment or its own configuration. Needs no root; scripts/setup.sh dse installs python3-venv first.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
venv=${DSE_VENV:-$(dirname "$(dirname "$here")")/build/dse/venv}
wanted=$here/requirements.txt
say() { printf 'venv: %s\n' "$*"; }
case "${1:-}" in
  -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
  '' | --check) ;;
  *) say "unknown argument '$1'; see --help" >&2; exit 2 ;;
esac

# The list that was installed is kept beside the packages: it is complete only if pip came to its end.
if [ -x "$venv/bin/python3" ] && cmp -s "$wanted" "$venv/requirements.txt"; then exit 0; fi
if [ "${1:-}" = --check ]; then say "$venv is missing or old: scripts/setup.sh dse" >&2; exit 1; fi

say "making $venv (about 250 MB)"
SECONDS=0
rm -rf "$venv"
mkdir -p "$(dirname "$venv")"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
if ! python3 -m venv "$venv" > "$log" 2>&1; then
  tail -n 5 "$log" >&2
  say "python3 cannot make a virtual environment; Debian: apt-get install python3-venv" >&2
  exit 1
fi
if ! "$venv/bin/python3" -m pip install -q --disable-pip-version-check -r "$wanted" > "$log" 2>&1; then
  tail -n 5 "$log" >&2
  say "pip could not install $wanted. It needs the Python Package Index once; behind a proxy or" >&2
  say "with a certificate of one's own, set https_proxy, PIP_CERT or pip's configuration and run it again." >&2
  rm -rf "$venv"
  exit 1
fi
cp "$wanted" "$venv/requirements.txt"
say "made in $SECONDS s"
