#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Compares two output directories of psweep depth byte for byte, all files but report.json (times differ).
# usage: scripts/same_output.sh DIR_A DIR_B      exit code 0: same names, same bytes; 1: not, or nothing to compare
set -eu
case ${1:-} in
  -h | --help | '') sed -n '3,4s/^# //p' "$0"; exit 0 ;;
esac
a=$1 b=$2 compared=0 differ=0
for name in $(find "$a" "$b" -mindepth 1 -maxdepth 1 ! -name report.json -exec basename {} \; | sort -u); do
  compared=$((compared + 1))
  cmp "$a/$name" "$b/$name" || differ=$((differ + 1))
done
if [ $compared -eq 0 ] || [ ! -e "$a/depth.pfm" ]; then
  echo "same_output: no depth.pfm in $a" >&2
  exit 1
fi
echo "$a and $b: $((compared - differ)) of $compared files are the same"
[ $differ -eq 0 ]
