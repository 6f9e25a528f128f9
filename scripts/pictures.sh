#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Makes the README's pictures anew (docs/images/): four rendered scenes, and input, depth and error of one of them.
# Needs build/psweep (make build). The pictures are committed, so that the README shows them without a build.
set -eu

case ${1:-} in
  '') ;;
  *) echo "usage: scripts/pictures.sh" >&2; exit 2 ;;
esac
cd "$(dirname "$0")/.."
[ -x build/psweep ] || { echo "pictures.sh: build/psweep is missing; run make build first" >&2; exit 2; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Small renderings, for the eye.
for kind in rocky flat; do
  for seed in 1 2; do
    build/psweep render --kind $kind --seed $seed --size 400 -o "$work/$kind$seed"
    cp "$work/$kind$seed/left.png" "docs/images/${kind}_$seed.png"
  done
done

# The paper's size and planes; its pictures are half as large on the page.
build/psweep render --kind rocky --seed 2 --size 1120 -o "$work/full"
build/psweep depth "$work/full/left.png" "$work/full/right.png" --calib "$work/full/calib.yaml" -o "$work/fixed" \
  --cleanup
build/psweep eval "$work/fixed" "$work/full/truth.pfm"
cp "$work/full/left.png" docs/images/left.png
cp "$work/fixed/depth.png" docs/images/depth.png
ls -l docs/images
