#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Do the assertions in the VHDL find what they are for (docs/verification.md)? One fault at a time is put into a copy of
# the RTL, a recorded session is replayed on it in GHDL (docs/replay.md), and the rule named has to stop it.
#
#   scripts/rules.sh [--build DIR] [TEXT]      only the faults with TEXT in their line; default: all
#
# Ends with 'N passed, N failed'; exit code 1 if a rule did not speak, or if nothing was tried.
# Environment: JOBS (default: all cores), GHDL (the program).
set -euo pipefail
cd "$(dirname "$0")/.."
build=build text=''
while [ $# -gt 0 ]; do
  case $1 in
    --build) build=$2; shift ;;
    -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
    -*) echo "rules.sh: unknown option '$1'; see --help" >&2; exit 2 ;;
    *) text=$1 ;;
  esac
  shift
done
for file in record_engine psweep_replay.vhd; do
  [ -e "$build/tb/replay/$file" ] || { echo "rules.sh: no $build/tb/replay/$file; make build first" >&2; exit 2; }
done
mapfile -t files < <(sed 's/#.*//; s/[[:space:]]*$//; /^$/d; s|^|rtl/|; /\/psweep.vhd$/q' rtl/files.f)
out=$(realpath "$build")/rules
rm -rf "$out"
mkdir -p "$out"
PSWEEP_CONFIG=tiny PSWEEP_RECORD=$out/tiny.txt "$build/tb/replay/record_engine" > "$out/record.log" 2>&1 ||
  { echo "rules.sh: no recording: $out/record.log" >&2; exit 1; }

# fault ENTITY SED RULE: the rule is the beginning of its message.
fault() {
  local dir=$out/$$.$RANDOM.$BASHPID sources='' file log code=0
  mkdir -p "$dir"
  sed -E "$2" "rtl/$1.vhd" > "$dir/$1.vhd"
  if cmp -s "rtl/$1.vhd" "$dir/$1.vhd"; then
    echo "rules: FAILED: the fault does not fit rtl/$1.vhd: $2"
    return
  fi
  for file in "${files[@]}"; do
    if [ "$file" = "rtl/$1.vhd" ]; then file=$dir/$1.vhd; else file=$PWD/$file; fi
    sources+="|$file"
  done
  log=$dir/log
  timeout 100 cmake -D GHDL="${GHDL:-ghdl}" -D STANDARD=--std=93 -D SOURCES="${sources#|}" \
    -D BENCH="$build/tb/replay/psweep_replay.vhd" -D FILE="$out/tiny.txt" -D DIR="$dir/work" \
    -P tb/replay/Replay.cmake > "$log" 2>&1 || code=$?
  if [ $code -ne 0 ] && grep -qF "$3" "$log"; then
    echo "rules: $3: told"
    touch "$out/$BASHPID.told"
    rm -rf "$dir"
  else
    echo "rules: FAILED: not told: $3 (code $code, $log)"
  fi
}

wanted=0
try() {
  if [ -n "$text" ] && [[ "$*" != *"$text"* ]]; then return; fi
  while [ "$(jobs -rp | wc -l)" -ge "${JOBS:-$(nproc)}" ]; do sleep 0.1; done
  wanted=$((wanted + 1))
  fault "$@" &
}

try stream_fifo "s/m_valid = '1' and m_tready = '1'/m_valid = '1'/" 'stream_fifo: a beat that waited at m_*'
try updating 's/G_DEPTH_LOG2 => 4/G_DEPTH_LOG2 => 2/' 'updating: a cell that leaves finds no place'
try address_generator "s/and s_plane_first = '0'$/and s_plane_first = '1'/" 'address_generator: a position is unknown'
try control "s/if is_sweep = '1' and at_last = '1' then\$/if is_sweep = '1' then/" \
  'address_generator: the plane changed within a row'
try control 's/to_unsigned\(C_ROW_MIN - 1, C_COL_W\)/to_unsigned(C_ROW_MIN - 2, C_COL_W)/' \
  'address_generator: a row without a sample, or too close'
try address_generator "s/return to_sl\(position\(31 downto C_POS_FRAC\) < .*/return '1';/" \
  'address_generator: a usable sample lies outside'
try storage 's/write_row <= write_row \+ C_PITCH;/write_row <= write_row + C_PITCH + 1;/' 'storage: a pixel of a usable'
try control 's/load_valid +<= pix_fire;/load_valid <= pix_fire or is_sweep;/' 'storage: a pixel is written while'
try interpolation "s/(s1_upper_start.*)'0' & p00/\1'0' \& p10/" "interpolation: the upper row's sum"
try interpolation "s/(s1_lower_start.*)'0' & p01/\1'0' \& p11/" "interpolation: the lower row's sum"
try interpolation 's/s4_start <= shift_left\(resize\(s3_upper/s4_start <= shift_left(resize(s3_lower/' \
  'interpolation: the sum between the rows'
try similarity 's/raddr => std_logic_vector\(next_line\)/raddr => s2_line/' 'similarity: the sample M rows above'
try similarity 's/s8_l <= v_l \+/s8_l <= v_l + v_l +/' 'similarity: the sum of l'
try similarity 's/s12_half  <= s11_x \+ /s12_half <= s11_x - /' 'similarity: the covariance is larger'
try similarity 's/v_s15_den := s14_den\(C_NORM downto 1\)/v_s15_den := s14_den(C_NORM - 1 downto 0)/' \
  "similarity: the quotient's operands"
try similarity 's/raddr => s2_col/raddr => s7_col/' 'similarity: the sums of a column'
try psweep 's/\+ updating_latency\(G_FRAC_W, G_LANES\);/;/' 'updating: unloading begins while'
try updating "s/(s1_first <=) first;/\1 '0';/" 'updating: a cell of the map is unknown'
try updating 's/old_best - lower;/lower - old_best;/' "updating: the parabola's quotient"
try control 's/state_q <= C_FLUSHING;/state_q <= "0001";/' 'control: a state that cannot be'
wait
told=$(find "$out" -name '*.told' | wc -l)
echo "$told passed, $((wanted - told)) failed"
[ "$wanted" -gt 0 ] && [ "$told" -eq "$wanted" ]
