#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Real stereo pairs (make real DATA=DIR): each pair present goes through float reference, bit-true model and simulated
# hardware; the last two must write the same bytes; matched share and bad pixels against ground truth are tabled.
#
# Layout of DIR (Middlebury's own file names; what is absent is skipped by name):
#   tsukuba/  im3.png im4.png   groundtruth.png (scale 16)  nonocc.png
#   teddy/    im2.png im6.png   groundtruth.png (scale 4)   nonocc.png
#   rocks1/   view1.png view5.png  disp1.png (scale 2; half size; the truth can sit 0.5 px low; no mask)
#   navcam/   left_rows.png right_rows.png  (no truth)
# The pairs come without calibration, so depths are relative; disparities are what is evaluated.
set -eu

usage() {
  cat <<END
usage: scripts/real.sh DATA [--psweep FILE] [--out DIR] [--engines "float fixed rtl"] [--threads N]
  DATA       directory with tsukuba/, teddy/, rocks1/, navcam/
  --psweep   the command line (default: build/psweep)
  --out      where to write (default: build/real)
Exit code 0 only if at least one pair was there and hardware and model agree on every pair.
END
}

psweep='' out='' engines='float fixed rtl' threads=0 data=''
here=$(cd "$(dirname "$0")/.." && pwd)
while [ $# -gt 0 ]; do
  case $1 in
    --psweep) psweep=$2; shift ;;
    --out) out=$2; shift ;;
    --engines) engines=$2; shift ;;
    --threads) threads=$2; shift ;;
    -h | --help) usage; exit 0 ;;
    -*) echo "real.sh: unknown option '$1'" >&2; usage >&2; exit 2 ;;
    *) data=$1 ;;
  esac
  shift
done
: "${psweep:=$here/build/psweep}" "${out:=$here/build/real}"
[ -n "$data" ] && [ -d "$data" ] || { echo "real.sh: DATA='$data' is no directory" >&2; usage >&2; exit 2; }
[ -x "$psweep" ] || { echo "real.sh: $psweep is missing; run make build first" >&2; exit 2; }
mkdir -p "$out"
table=$out/table.md
pages=''
pairs=0 skipped='' wrong=''

# number NAME FILE: the value that `psweep eval` printed.
number() { awk -v name="$1" '$1 == name { printf "%.2f", $2; found = 1 } END { if (!found) printf "-" }' "$2"; }

# pair NAME LEFT RIGHT RANGE [TRUTH SCALE [MASK]]
pair() {
  name=$1 left=$data/$1/$2 right=$data/$1/$3 range=$4 truth=${5:-} scale=${6:-} mask=${7:-}
  for file in "$left" "$right" ${truth:+"$data/$name/$truth"} ${mask:+"$data/$name/$mask"}; do
    if [ ! -e "$file" ]; then
      echo "== $name: skipped, $file is missing"
      skipped="$skipped $name"
      return 0
    fi
  done
  pairs=$((pairs + 1))
  runs=''
  for engine in $engines; do
    echo "== $name: $engine"
    dir=$out/$name/$engine
    mkdir -p "$out/$name"
    "$psweep" depth "$left" "$right" --disparity-range "$range" --engine "$engine" --threads "$threads" -o "$dir"
    : > "$out/$name/$engine.txt"
    if [ -n "$truth" ]; then
      "$psweep" eval "$dir" "$data/$name/$truth" --scale "$scale" ${mask:+--mask "$data/$name/$mask"} \
        > "$out/$name/$engine.txt"
    fi
    same='-'
    if [ "$engine" = rtl ]; then
      same=yes
      "$here/scripts/same_output.sh" "$out/$name/fixed" "$dir" || { same=NO; wrong="$wrong $name"; }
    fi
    planes=$(sed -n 's/^  "planes": \([0-9]*\).*/\1/p' "$dir/report.json")
    clocks=$(awk '/"clocks_in_all"/ { gsub(/[^0-9]/, "", $2); printf "%.1f", $2 / 1e6; f = 1 }
                  END { if (!f) printf "-" }' "$dir/report.json")
    results=$out/$name/$engine.txt
    echo "| $name | $engine | $range | $planes | $(number matched_percent "$results") |" \
      "$(number bad1_percent "$results") | $(number bad1_all_percent "$results") |" \
      "$(number mean_px "$results") | $clocks | $same |" >> "$table.new"
    runs="$runs $dir"
  done
  # shellcheck disable=SC2086  # a list of directories
  "$psweep" report $runs -o "$out/$name/index.html" --title "psweep: $name" --input "$left" \
    --note "Real stereo pair without calibration: depths are relative, disparities $range px were searched."
  pages="$pages $name"
}

cat > "$table.new" <<END
# Real pairs

Window 13, threshold 0.85, no clean-up. Evaluated: pixels of the left image with truth, outside occlusions where the
data set has that mask (rocks1 has none, so its occluded pixels count; its truth can sit 0.5 px low, which shows in the
mean error). Matched: share of these with a disparity. Bad: share of the matched
that is more than 1 px off; bad all: of the evaluated, unmatched ones counted. Mean px: error of the good ones.
= fixed: every file but report.json has the bytes of the bit-true model's. navcam has no truth.

| pair | engine | disparities | planes | matched % | bad % | bad all % | mean px | M clocks | = fixed |
|---|---|---|---|---|---|---|---|---|---|
END
pair tsukuba im3.png im4.png 3:16 groundtruth.png 16 nonocc.png
pair teddy im2.png im6.png 10:60 groundtruth.png 4 nonocc.png
pair rocks1 view1.png view5.png 18:115 disp1.png 2
pair navcam left_rows.png right_rows.png 10:50

for name in $pages; do
  last=${engines##* }
  {
    printf '\n## %s\n\n![%s](%s/%s/depth.png)\n' "$name" "$name" "$name" "$last"
    [ ! -e "$out/$name/$last/error.png" ] || printf '![error](%s/%s/error.png)\n' "$name" "$last"
    printf '\n[page](%s/index.html)\n' "$name"
  } >> "$table.new"
done
[ -z "$skipped" ] || printf '\nSkipped, files missing:%s\n' "$skipped" >> "$table.new"
mv "$table.new" "$table"

echo
sed -n '/^|/p' "$table"
echo "real: $pairs pairs done; skipped:${skipped:- none}; fixed and rtl differ on:${wrong:- none}; see $table"
[ "$pairs" -gt 0 ] && [ -z "$wrong" ]
