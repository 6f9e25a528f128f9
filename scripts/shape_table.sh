#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Clocks of the paper's pair against the engine's memory, for tiles of every shape: prints the tables of docs/tiles.md
# and draws docs/images/tiles.svg (half a minute).
#
#   scripts/shape_table.sh [--program FILE]     default build/shape_table
set -euo pipefail
cd "$(dirname "$0")/.."
program=build/shape_table
while [ $# -gt 0 ]; do
  case $1 in
    --program) program=$2; shift ;;
    -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
    *) echo "shape_table.sh: unknown option '$1'" >&2; exit 2 ;;
  esac
  shift
done
points=$(mktemp)
trap 'rm -f "$points"' EXIT
"$program"
"$program" --curve > "$points"
[ "$(grep -c . "$points")" -gt 20 ] || { echo "shape_table.sh: no curve" >&2; exit 1; }
gnuplot << PLOT
set terminal svg size 900,480 font 'sans-serif,14' background rgb 'white'
set output 'docs/images/tiles.svg'
set title '1120 x 1120 x 301 planes, window 13: clocks against the memory of the engine'
set xlabel 'memory of the engine with one lane, Mbit'
set ylabel 'million clocks'
set xrange [0:12]
set yrange [0:820]
set grid
set key top right
set label 'NG-MEDIUM' at 2.8,780
set arrow from 2.7,0 to 2.7,820 nohead dt 2 lc rgb '#999999'
set label 'Virtex-5QV' at 10.6,560 right
set arrow from 10.7,0 to 10.7,820 nohead dt 2 lc rgb '#999999'
plot '$points' index 1 using 2:3 with lines lw 2 lc rgb '#b35900' title 'bands (figure 7), 1 lane', \
     '$points' index 0 using 2:3 with lines lw 2 lc rgb '#1f5fa8' title 'tiles, 1 lane', \
     '$points' index 0 using 2:4 with lines lw 2 lc rgb '#2c8f4e' title 'tiles, 2 lanes', \
     '$points' index 0 using 2:5 with lines lw 2 lc rgb '#7a3fa0' title 'tiles, 4 lanes', \
     '-' using 1:2:3 with labels point pt 7 offset 4.5,0.8 notitle
2.59 498 "30 rows"
1.91 409.1 "175 x 139"
0.98 439.3 "117 x 93"
e
PLOT
perl -0pi -e 's{\t}{  }g; s{ +$}{}mg; s{\n+\z}{\n}' docs/images/tiles.svg  # as scripts/lint.sh wants it
