#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Speed on this machine: the bit-true model at 1120x1120 with 301 planes on one core, by instruction set
# (psweep_bench); clocks a second of the simulated engine on one core, a tile of 256x130 cells (one_tile, three times,
# as other work on the machine shows); then all three engines on one rendered scene (seconds and clocks: report.json).
#
#   scripts/bench.sh [--size N] [--planes N]      scene of the last part, default 400 and 109
set -euo pipefail
cd "$(dirname "$0")/.."
size=400 planes=109
while [ $# -gt 0 ]; do
  case $1 in
    --size) size=$2; shift ;;
    --planes) planes=$2; shift ;;
    -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
    *) echo "bench.sh: unknown option '$1'" >&2; exit 2 ;;
  esac
  shift
done

echo "bit-true model, 1120x1120, 301 planes, window 13, one thread"
build/sw/fast/psweep_bench threads=1

echo "simulated RTL, one tile of 256x130 cells, 101 planes, one thread"
for _ in 1 2 3; do build/tb/engine/one_tile tile 101 | grep -E 'clocks/s'; done

out=build/bench
rm -rf "$out"
build/psweep render --kind rocky --seed 1 --size "$size" -o "$out/scene"
for engine in float fixed rtl; do
  echo "$engine, ${size}x$size, $planes planes, all cores"
  build/psweep depth "$out/scene/left.png" "$out/scene/right.png" --calib "$out/scene/calib.yaml" -o "$out/$engine" \
    --engine "$engine" --planes "$planes"
  grep -E '"(seconds|clocks|threads)"' "$out/$engine/report.json"
done
