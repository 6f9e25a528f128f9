#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Random tiles, good and bad, one after the other, in several engines (tb/soak/soak.cpp): nothing hangs, every error is
# counted, the next good tile is right in every stage.
#
#   scripts/soak.sh [--build DIR] [--tiles N] [--seed N] [CONFIGURATION ...]
#
# N tiles in all (default 10000), shared by the configurations (default: the small named ones). Environment: JOBS.
# Exit code 1 if any fails, or if nothing was run.
set -euo pipefail
cd "$(dirname "$0")/.."
build=build tiles=10000 seed=1 names=()
while [ $# -gt 0 ]; do
  case $1 in
    --build) build=$2; shift ;;
    --tiles) tiles=$2; shift ;;
    --seed) seed=$2; shift ;;
    -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
    -*) echo "soak.sh: unknown option '$1'; see --help" >&2; exit 2 ;;
    *) names+=("$1") ;;
  esac
  shift
done
[ ${#names[@]} -gt 0 ] || names=(tiny narrow odd odd_2 odd_4 rectified rectified_2)
if ! [[ $tiles =~ ^[1-9][0-9]*$ && $seed =~ ^[0-9]+$ ]]; then
  echo "soak.sh: --tiles and --seed are numbers" >&2
  exit 2
fi
each=$(((tiles + ${#names[@]} - 1) / ${#names[@]}))
out=$build/soak
rm -rf "$out"
mkdir -p "$out"
for name in "${names[@]}"; do
  while [ "$(jobs -rp | wc -l)" -ge "${JOBS:-$(nproc)}" ]; do sleep 0.1; done
  {
    if PSWEEP_CONFIG=$name PSWEEP_TILES=$each PSWEEP_SEED=$seed "$build/tb/soak/soak" > "$out/$name.log"; then
      grep '^soak: ' "$out/$name.log"
      touch "$out/$name.good"
    else
      cat "$out/$name.log"
      echo "soak: $name: FAILED"
    fi
  } &
done
wait
good=$(find "$out" -name '*.good' | wc -l)
echo "soak: $good of ${#names[@]} configurations, $((each * good)) tiles, seed $seed, $SECONDS s"
[ "$good" -eq ${#names[@]} ]
