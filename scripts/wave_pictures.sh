#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The pictures of docs/waves.md: GTKWave, without a screen (Xvfb), on what `make waves` writes for a cell of
# configuration tiny. Needs a built build/psweep-waves and the packages of group `waves` (scripts/packages.txt).
#
#   scripts/wave_pictures.sh [STAGE ...]      default: all; docs/images/waves_<stage>.png; half a minute
set -euo pipefail
cd "$(dirname "$0")/.."
case ${1:-} in
  -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
esac
die() { printf 'wave_pictures: %s\n' "$*" >&2; exit 1; }
[ -x build/psweep-waves ] || die 'build/psweep-waves is missing; make wave-pictures builds it'
for tool in gtkwave Xvfb xdotool import convert; do
  command -v "$tool" > /dev/null || die "$tool is missing; scripts/setup.sh waves installs it"
done
readonly most=80000 # bytes a picture may have
readonly width=1400
# Enough for all signals of a stage, or for those of its first groups where all of them are too many for a picture.
declare -A height=([psweep]=1720 [control]=1110 [address_generator]=1370 [storage]=1500 [interpolation]=1400
                   [similarity]=1400 [updating]=1400)
stages=("$@")
[ $# -gt 0 ] || stages=(psweep control address_generator storage interpolation similarity updating)

work=$(mktemp -d)
x_server='' viewer=''
finish() {
  if [ -n "$viewer" ]; then kill "$viewer" 2> /dev/null || true; fi
  if [ -n "$x_server" ]; then kill "$x_server" 2> /dev/null || true; fi
  rm -rf "$work"
}
trap finish EXIT

# The server tells the first display number that is free.
Xvfb -displayfd 3 -screen 0 "${width}x2000x24" 3> "$work/display" > "$work/xvfb.log" 2>&1 &
x_server=$!
for _ in $(seq 100); do [ -s "$work/display" ] && break; sleep 0.1; done
[ -s "$work/display" ] || die "Xvfb does not start: $(tail -n 1 "$work/xvfb.log")"
DISPLAY=:$(< "$work/display")
export DISPLAY

for stage in "${stages[@]}"; do
  [ -n "${height[$stage]:-}" ] || die "unknown stage '$stage'; there are: ${!height[*]}"
  build/psweep-waves --stage "$stage" --config tiny --out "$work" --no-table > /dev/null
  save=$(echo "$work/tiny_${stage}"_*.gtkw)
  sed -i "s/^\[size\].*/[size] $width ${height[$stage]}/; s/^\[pos\].*/[pos] 0 0/" "$save"
  gtkwave --rcvar 'hide_sst on' --rcvar 'splash_disable on' --rcvar 'fontname_waves DejaVu Sans Mono 9' \
    --rcvar 'fontname_signals DejaVu Sans Mono 9' -S /dev/null "$save" > "$work/gtkwave.log" 2>&1 &
  viewer=$!
  window=$(timeout 30 xdotool search --sync --onlyvisible --name "^GTKWave - .*tiny_$stage" | tail -n 1) ||
    die "GTKWave shows no window: $(tail -n 1 "$work/gtkwave.log")"
  sleep 2 # it draws when it has shown its window
  import -window "$window" "$work/$stage.png"
  kill "$viewer"
  wait "$viewer" 2> /dev/null || true
  viewer=''
  picture=docs/images/waves_$stage.png
  # Without title and tool bar; few colours are enough.
  convert "$work/$stage.png" -gravity north -chop 0x110 +repage +dither -colors 32 -depth 8 -strip \
    -define png:compression-level=9 "PNG8:$picture"
  size=$(stat -c %s "$picture")
  printf 'wave_pictures: %s, %s, %d bytes\n' "$picture" "$(identify -format '%wx%h' "$picture")" "$size"
  [ "$size" -le $most ] || die "$picture is larger than $most bytes"
done
