#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Waves of one cell on its way through the engine, with a GTKWave save file, and its values at every stage beside the
# model's (docs/waves.md). Writes build/waves/<cfg>_<stage>_p<plane>_c<column>_<row>.fst and .gtkw.
#
#   scripts/waves.sh [OPTION ...]      options of build/psweep-waves, which this hands on
#
# Environment: STAGE (default psweep: all stages), CFG (tiny), PLANE, CELL=column,row (the middle ones).
set -euo pipefail
cd "$(dirname "$0")/.."
case ${1:-} in
  -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
esac
[ -x build/psweep-waves ] || { echo 'waves: build/psweep-waves is missing; make waves builds it' >&2; exit 1; }
mkdir -p build/waves
options=(--out build/waves)
if [ -n "${CFG:-}" ]; then options+=(--config "$CFG"); fi
if [ -n "${STAGE:-}" ]; then options+=(--stage "$STAGE"); fi
if [ -n "${PLANE:-}" ]; then options+=(--plane "$PLANE"); fi
if [ -n "${CELL:-}" ]; then options+=(--cell "$CELL"); fi
exec build/psweep-waves "${options[@]}" "$@"
