#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Engines of random sizes and formats, degenerate ones among them: each is built, and takes random tiles, good and bad,
# every stage compared with the bit-true model (tb/soak/soak.cpp).
#
#   scripts/sweep.sh [--count N] [--seed N] [--tiles N] [--only K]
#     --count  configurations (default 10); the first four are the degenerate ones
#     --seed   draws others (default 1)
#     --tiles  tiles of each (default 60)
#     --only   configuration number K alone
#
# Works in build/sweep; results in build/sweep/results.txt. Exit code 1 if any fails. Environment: JOBS (default: all
# cores), VERBOSE=1.
set -euo pipefail
cd "$(dirname "$0")/.."
count=10 seed=1 tiles=60 only=''
while [ $# -gt 0 ]; do
  case $1 in
    --count) count=$2; shift ;;
    --seed) seed=$2; shift ;;
    --tiles) tiles=$2; shift ;;
    --only) only=$2; shift ;;
    -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
    *) echo "sweep.sh: unknown argument '$1'; see --help" >&2; exit 2 ;;
  esac
  shift
done
for number in "$count" "$seed" "$tiles" "${only:-0}"; do
  [[ $number =~ ^[0-9]+$ ]] || { echo "sweep.sh: '$number' is not a number" >&2; exit 2; }
done
[ "$count" -gt 0 ] || { echo "sweep.sh: --count 0" >&2; exit 2; }
jobs=${JOBS:-$(nproc)}
out=build/sweep
rm -rf "$out/configs" "$out"/*.log "$out/results.txt"
mkdir -p "$out/configs"

# No $( ): a subshell draws from a generator that bash seeds with time and process, so nothing could be repeated.
RANDOM=$((seed % 32768))
for ((k = 0; k < 8; k++)); do : "$RANDOM"; done # first values of seeds side by side are alike
pick() { # pick NAME VALUE ..: one of them
  local all=("${@:2}")
  printf -v "$1" %s "${all[$((RANDOM % ${#all[@]}))]}"
}
between() { # between NAME LOW HIGH
  printf -v "$1" %d "$(($2 + (RANDOM * 32768 + RANDOM) % ($3 - $2 + 1)))"
}
primes=(2 3 5 7 11 13 17 19 23 29 31 37)
names=() wanted=()
window=0 cols=0 rows=0 planes=0 lanes=0 pix=0 weight=0 interp=0 mncc=0 frac=0 rectified=0 divider=0 disparity=0 prime=0
# Drawn in this shell, one after the other, so that --only finds the same.
for ((k = 1; k <= count; k++)); do
  pick window 3 5 7 9 11 13 15 17 19 21
  between cols 1 40
  between rows 1 24
  between planes 1 12
  pick lanes 1 1 2 4
  between pix 1 12
  between weight 1 12
  between interp 0 8
  between mncc 4 16
  between frac 2 12
  pick rectified 0 0 1
  between disparity 0 12
  pick prime 0 1
  if [ "$prime" -eq 1 ]; then
    pick cols "${primes[@]}"
    pick rows "${primes[@]}"
  fi
  pick divider 0 1
  pick split 0 1
  case $k in
    1) window=21 cols=1 rows=1 planes=1 lanes=1 ;;      # one cell, one plane, the largest window
    2) window=3 cols=1 rows=17 planes=2 lanes=4 ;;      # one column, fewer planes than lanes, the smallest window
    3) cols=37 rows=1 planes=7 lanes=2 ;;               # one row, a last set that is not full
    4) pix=1 weight=1 interp=0 mncc=4 frac=2 rows=5 ;;  # the smallest formats
  esac
  # The bench's ports are words of 64 bits: samples of four lanes in one.
  if [ $((lanes * (pix + interp))) -gt 64 ]; then interp=$((64 / lanes - pix)); fi
  if [ "$interp" -gt 8 ]; then interp=8; fi
  name=s${seed}_$k
  args="PLANE_COLS=$cols PLANE_ROWS=$rows PLANES=$planes WINDOW=$window PIX_BITS=$pix WEIGHT_BITS=$weight"
  args+=" INTERP_FRAC=$interp MNCC_BITS=$mncc FRAC_BITS=$frac LANES=$lanes RECTIFIED=$rectified DIVIDER=$divider SPLIT=$split"
  args+=" DISPARITY=$disparity"
  if [ -n "$only" ] && [ "$only" -ne "$k" ]; then continue; fi
  # shellcheck disable=SC2086
  scripts/configurations.py new --build "$out" NAME="$name" WAVES=1 $args > "$out/$name.log" 2>&1 || { cat "$out/$name.log"; exit 1; }
  names+=("$name")
  wanted+=("$args")
done
[ ${#names[@]} -gt 0 ] || { echo "sweep.sh: no configuration $only among $count" >&2; exit 2; }

echo "sweep: seed $seed, building ${#names[@]} engines"
cmake -S . -B "$out/build" -G Ninja -DPSWEEP_SWEEP=ON > "$out/cmake.log" 2>&1 ||
  { tail -n 20 "$out/cmake.log"; exit 1; }
rm -rf "$out/build/configs"
cp -r "$out/configs" "$out/build/configs"
cmake "$out/build" > "$out/cmake.log" 2>&1 || { tail -n 20 "$out/cmake.log"; exit 1; }
ninja -C "$out/build" -j "$jobs" soak > "$out/build.log" 2>&1 ||
  { grep -v '^\[' "$out/build.log" | tail -n 30; exit 1; }
failed=0
for i in "${!names[@]}"; do
  name=${names[$i]}
  if PSWEEP_CONFIG=$name PSWEEP_TILES=$tiles PSWEEP_SEED=$seed "$out/build/tb/soak/soak" > "$out/$name.log" 2>&1 &&
    grep -q "^soak: $name: " "$out/$name.log"; then
    verdict="good: $(sed -nE "s/^soak: $name: [^:]*: (.*)/\1/p" "$out/$name.log")"
  else
    verdict="FAILED, see $out/$name.log; again: scripts/sweep.sh --seed $seed --tiles $tiles --only ${name#*_}"
    failed=$((failed + 1))
    [ -z "${VERBOSE:-}" ] || cat "$out/$name.log"
  fi
  echo "sweep: $name: ${wanted[$i]}: $verdict" | tee -a "$out/results.txt"
done
echo "sweep: $((${#names[@]} - failed)) passed, $failed failed, seed $seed, $SECONDS s"
[ $failed -eq 0 ]
