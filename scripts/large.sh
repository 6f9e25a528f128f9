#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The largest engine that this project promises: tiles of 2048x2048 cells, 1024 planes. Builds that configuration,
# sweeps one tile of full size over a few planes and a small one over all planes, bit by bit against the model.
#
#   scripts/large.sh [--planes N]     of the full-size tile (default 3; 4.2 M clocks each)
set -euo pipefail
cd "$(dirname "$0")/.."
planes=3
while [ $# -gt 0 ]; do
  case $1 in
    --planes) planes=$2; shift ;;
    -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
    *) echo "large.sh: unknown option '$1'" >&2; exit 2 ;;
  esac
  shift
done

# Not left behind: the command line would take it for any request that it serves.
trap 'rm -f build/configs/large.json' EXIT
scripts/configurations.py new NAME=large PLANE_COLS=2048 PLANE_ROWS=2048 PLANES=1024
scripts/build.sh one_tile
build/tb/engine/one_tile large "$planes"
build/tb/engine/one_tile large 1024 64 40
