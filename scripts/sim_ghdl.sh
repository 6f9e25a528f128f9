#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# More replays on the original VHDL in GHDL than `make sim` has time for (make sim-ghdl): every configuration that was
# built, several seeds, random tiles besides the session of good, refused, cut and aborted ones. Each is recorded on the
# Verilated engine, whose every stage is compared with the model meanwhile, and replayed clock by clock, every output
# port compared, memories unknown at the start (docs/replay.md).
#
#   scripts/sim_ghdl.sh [--build DIR] [--out DIR] [--tiles N] [--clocks N] [CONFIGURATION ...]    default: all
#     --build   folder with tb/replay (default: build)
#     --out     where to write (default: build/sim-ghdl)
#     --tiles   random tiles of each recording (default: 3)
#     --clocks  the longest of them, in clocks (default: 3000)
#
# Environment: SEEDS (default '2 3'; make sim has 1), JOBS (replays at once; default: all cores), GHDL (the program).
# Exit code 1 if anything differs, if a recording fails or if nothing was replayed.
set -euo pipefail
cd "$(dirname "$0")/.."
build=build out='' tiles=3 clocks=3000 names=()
while [ $# -gt 0 ]; do
  case $1 in
    --build) build=$2; shift ;;
    --out) out=$2; shift ;;
    --tiles) tiles=$2; shift ;;
    --clocks) clocks=$2; shift ;;
    -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
    -*) echo "sim_ghdl.sh: unknown option '$1'; see --help" >&2; exit 2 ;;
    *) names+=("$1") ;;
  esac
  shift
done
out=${out:-$build/sim-ghdl}
read -r -a seeds <<< "${SEEDS:-2 3}"
for file in record_engine psweep_replay.vhd; do
  [ -e "$build/tb/replay/$file" ] || { echo "sim_ghdl.sh: no $build/tb/replay/$file; make build first" >&2; exit 2; }
done
if [ ${#names[@]} -eq 0 ]; then
  for file in "$build"/tb/replay/widths_*.inc; do
    name=${file##*/widths_}
    names+=("${name%.inc}")
  done
fi
sources=$(sed 's/#.*//; s/[[:space:]]*$//; /^$/d; s|^|'"$PWD"'/rtl/|; /\/psweep.vhd$/q' rtl/files.f | paste -sd '|')
rm -rf "$out"
mkdir -p "$out"
out=$(realpath "$out") build=$(realpath "$build")

# What make sim replays as well is not repeated: another seed, and tiles of any size.
replay() { # replay CONFIGURATION SEED
  local log=$out/$1.$2.log recording=$out/$1.$2.txt begun=$SECONDS
  if ! PSWEEP_CONFIG=$1 PSWEEP_SEED=$2 PSWEEP_TILES=$tiles PSWEEP_CLOCKS=$clocks PSWEEP_RECORD=$recording \
    "$build/tb/replay/record_engine" > "$log" 2>&1; then
    cat "$log"
    echo "sim-ghdl: $1, seed $2: FAILED: the Verilated engine and the model differ"
  elif ! cmake -D GHDL="${GHDL:-ghdl}" -D STANDARD=--std=93 -D SOURCES="$sources" \
    -D BENCH="$build/tb/replay/psweep_replay.vhd" -D FILE="$recording" -D DIR="$out/$1.$2" \
    -P tb/replay/Replay.cmake > "$log" 2>&1; then
    grep -v '^ *\(in\|from\|call\)' "$log"
    echo "sim-ghdl: $1, seed $2: FAILED"
  else
    echo "sim-ghdl: $1, seed $2: $(sed -nE 's/.*replay: ([0-9]+ steps.*)/\1/p' "$log"), $((SECONDS - begun)) s"
    touch "$out/$1.$2.good"
    rm -rf "$recording" "${out:?}/$1.$2"
  fi
}

wanted=0
for seed in "${seeds[@]}"; do
  for name in "${names[@]}"; do
    while [ "$(jobs -rp | wc -l)" -ge "${JOBS:-$(nproc)}" ]; do sleep 0.2; done
    replay "$name" "$seed" &
    wanted=$((wanted + 1))
  done
done
wait
good=$(find "$out" -name '*.good' | wc -l)
echo "sim-ghdl: $good of $wanted replays without a difference, $SECONDS s"
[ "$wanted" -gt 0 ] && [ "$good" -eq "$wanted" ]
