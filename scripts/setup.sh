#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs what psweep needs, by scripts/packages.txt: scripts/setup.sh --help. This part only brings Python to a bare
# Debian; the rest is written in it (scripts/psweep_tools/setup.py).
set -eu
cd "$(dirname "$0")/.."

fail() {
  printf 'setup: %s\n' "$@" >&2
  exit 1
}

if ! command -v python3 > /dev/null; then
  # Not our business then: CMake names what it does not find.
  [ "${SETUP:-yes}" != no ] || exit 0
  case " $* " in *' --check '*) fail 'missing: python3' ;; esac
  command -v apt-get > /dev/null || fail 'missing: python3' 'This is no Debian: install it, run make with SETUP=no.'
  root=''
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo > /dev/null ||
      fail 'missing: python3' 'Neither root nor sudo. As root: apt-get install --no-install-recommends python3'
    root='sudo -n'
    if [ -t 0 ]; then root=sudo; fi
  fi
  echo 'setup: missing: python3'
  get="$root env DEBIAN_FRONTEND=noninteractive apt-get -q -o DPkg::Lock::Timeout=300"
  log=$(mktemp)
  $get update > "$log" 2>&1 || echo 'setup: the package lists could not be renewed, trying with the old ones'
  if ! $get install -y --no-install-recommends python3 > "$log" 2>&1; then
    tail -n 15 "$log" >&2
    fail 'missing: python3' 'As root: apt-get install --no-install-recommends python3'
  fi
  rm -f "$log"
fi
exec scripts/tools.py setup "$@"
