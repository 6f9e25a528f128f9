#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The demo (make demo, make demo-full): renders a rocky scene, computes its depth by float reference, bit-true model and
# simulated hardware, proves that the last two wrote the same bytes, evaluates against ground truth, and writes one page
# with everything.
set -eu

usage() {
  cat <<END
usage: scripts/demo.sh [--full] [--psweep FILE] [--out DIR] [--size N] [--planes N] [--seed N] [--threads N]
  --full     1120x1120 pixels and 301 planes (default: 400x400 and 109)
  --psweep   the command line (default: build/psweep)
  --out      where to write (default: build/demo, with --full build/demo-full)
Exit code 0 only if hardware and model agree in every file.
END
}

cd "$(dirname "$0")/.."
psweep=build/psweep out='' size='' planes='' seed=1 threads=0 full=0
while [ $# -gt 0 ]; do
  case $1 in
    --full) full=1 ;;
    --psweep) psweep=$2; shift ;;
    --out) out=$2; shift ;;
    --size) size=$2; shift ;;
    --planes) planes=$2; shift ;;
    --seed) seed=$2; shift ;;
    --threads) threads=$2; shift ;;
    -h | --help) usage; exit 0 ;;
    *) echo "demo.sh: unknown option '$1'" >&2; usage >&2; exit 2 ;;
  esac
  shift
done
if [ $full = 1 ]; then
  : "${out:=build/demo-full}" "${size:=1120}" "${planes:=301}"
else
  : "${out:=build/demo}" "${size:=400}" "${planes:=109}"
fi
[ -x "$psweep" ] || { echo "demo.sh: $psweep is missing; run make build first" >&2; exit 2; }

begin=$(date +%s)
mkdir -p "$out"
scene=$out/scene
echo "== scene: rocky terrain, ${size}x${size}, seed $seed"
"$psweep" render --kind rocky --seed "$seed" --size "$size" -o "$scene"

# Name of the run, then its options.
run() {
  name=$1
  shift
  echo "== $name"
  "$psweep" depth "$scene/left.png" "$scene/right.png" --calib "$scene/calib.yaml" --planes "$planes" \
    --threads "$threads" -o "$out/$name" "$@"
  "$psweep" eval "$out/$name" "$scene/truth.pfm"
}
run float --engine float
run fixed --engine fixed
run rtl --engine rtl
run fixed_cleaned --engine fixed --cleanup

echo "== fixed = rtl?"
scripts/same_output.sh "$out/fixed" "$out/rtl"

"$psweep" report "$out/float" "$out/fixed" "$out/rtl" "$out/fixed_cleaned" -o "$out/index.html" \
  --title "psweep: plane-sweep stereo in simulated hardware" --input "$scene/left.png" --truth "$scene/truth.pfm" \
  --note "A rendered rocky terrain (${size}x${size} pixels, seed $seed), swept over $planes planes."
end=$(date +%s)
echo "demo: hardware and model agree in every file; wall time $((end - begin)) s; open $out/index.html"
