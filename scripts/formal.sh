#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Proofs of small circuits: what tb/formal/<name>.sv asserts holds for ever, whatever comes in. Ends with
# 'N passed, N failed'; exit code 1 if anything failed.
#
#   scripts/formal.sh [NAME ...]      default: all
#
# GHDL makes Verilog of the entity, Yosys joins it with the assertions, ABC's pdr looks for a proof by induction (it
# finds the invariants itself) or a counterexample. Each clock edge becomes a step in which the clock's input is '1', so
# that several clocks tick in any order. Start: all registers zero (tb/formal/*.sv say what they assume beyond).
# Each proof is followed by faults put into the VHDL one by one: the prover has to find every one of them.
# Environment: VERBOSE=1 shows the tools' messages. Work files in build/formal.
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in
  -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
esac

for program in ghdl yosys; do
  command -v $program > /dev/null || { echo "formal: $program is not installed; see scripts/setup.sh formal"; exit 1; }
done
# Yosys brings ABC along, as a program of its own or as Debian's.
abc=$(command -v yosys-abc || command -v berkeley-abc) || { echo "formal: no ABC (yosys-abc, berkeley-abc)"; exit 1; }

root=$PWD/build/formal
limit=100  # seconds a run
passed=0
failed=0
wanted=("$@")
used=0

# build_and_prove DIR TOP GENERICS EXPOSED FILE..: prints 'proved', 'found' (a counterexample) or what went wrong.
# TOP check_crossings: the rules of tb/formal/crossings.ys instead of assertions.
build_and_prove() {
  if [ "$2" = check_crossings ]; then
    local folder=$1
    shift 4
    check_crossings "$folder" "$@"
    return
  fi
  local dir=$1 top=$2 generics=$3 exposed=$4 name synchroniser='' signals='' signal defines
  shift 4
  name=${dir##*/}
  name=${name%%[.-]*} # behind a '-': the same properties with other generics
  # shellcheck disable=SC2086
  {
    ghdl -a --std=93 --workdir="$dir" "$@" &&
      ghdl --synth --std=93 --no-formal --workdir="$dir" --out=verilog $generics "$top" > "$dir/raw.v"
  } > "$dir/ghdl.log" 2>&1 || { echo "GHDL failed: $dir/ghdl.log"; return; }
  sed -E 's/always @\(posedge (\w+)\)/always @($global_clock) if (\1)/' "$dir/raw.v" > "$dir/steps.v"
  if grep -qE 'posedge|negedge' "$dir/steps.v"; then echo "an edge in $dir/raw.v was not understood"; return; fi
  # A synchroniser of ideal flip-flops would prove too much.
  synchroniser=$(sed -nE 's/^module (cdc_sync_\w+).*/\1/p' "$dir/steps.v")
  defines=${generics//-gG_/-D}
  for signal in $exposed; do signals+=" $top/w:$signal"; done
  {
    echo "read_verilog -formal -sv $dir/steps.v"
    if [ -n "$synchroniser" ]; then
      echo "delete $synchroniser"
      echo "read_verilog -formal -sv tb/formal/cdc_sync_model.sv"
      echo "rename cdc_sync_model $synchroniser"
    fi
    if [ -n "$signals" ]; then echo "expose$signals"; fi
    echo "read_verilog -formal -sv $defines tb/formal/$name.sv"
    echo "prep -top proof -flatten"
    echo "opt -full"
    echo "setundef -init -zero"
    echo "setundef -undriven -anyseq"
    # No assertion may get lost on the way.
    echo "select -assert-min 1 t:\$assert"
    echo "techmap"
    echo "opt -fast"
    echo "abc -g AND -fast"
    echo "opt_clean"
    echo "write_aiger -zinit $dir/proof.aig"
  } > "$dir/proof.ys"
  yosys -q -l "$dir/yosys.log" "$dir/proof.ys" > /dev/null 2>&1 || { echo "Yosys failed: $dir/yosys.log"; return; }
  timeout $limit "$abc" -c "read_aiger $dir/proof.aig; fold; pdr" > "$dir/abc.log" 2>&1 || true
  if [ -n "${VERBOSE:-}" ]; then cat "$dir/abc.log" >&2; fi
  if grep -q 'Property proved' "$dir/abc.log"; then
    echo proved
  elif grep -q 'was asserted in frame' "$dir/abc.log"; then
    echo found
  else
    echo "no answer: $dir/abc.log"
  fi
}

report() { # report WANTED ANSWER BEGUN TEXT
  local words=$2
  if [ "$2" = "$1" ]; then
    passed=$((passed + 1))
    if [ "$1" = found ]; then words='fault found'; fi
  else
    failed=$((failed + 1))
    if [ "$2" = proved ]; then words='FAILED: fault not found'; fi
    if [ "$2" = found ]; then words='FAILED: counterexample'; fi
    if [ "$words" = "$2" ]; then words="FAILED: $2"; fi
  fi
  printf 'formal: %s: %s (%d ms)\n' "$4" "$words" $((($(date +%s%N) - $3) / 1000000))
}

# proof NAME TOP GENERICS EXPOSED 'FILE ..' [FILE DESCRIPTION SED]..: the proof, and faults as edits of one file each.
proof() {
  local name=$1 top=$2 generics=$3 exposed=$4 files=() file dir begun number=0
  read -r -a files <<< "$5"
  shift 5
  if [ ${#wanted[@]} -gt 0 ] && ! printf '%s\n' "${wanted[@]}" | grep -qxF "$name"; then return; fi
  used=$((used + 1))
  dir=$root/$name
  rm -rf "$dir" "$dir".*
  mkdir -p "$dir"
  begun=$(date +%s%N)
  report proved "$(build_and_prove "$dir" "$top" "$generics" "$exposed" "${files[@]}")" "$begun" "$name"
  while [ $# -ge 3 ]; do
    number=$((number + 1))
    dir=$root/$name.$number
    mkdir -p "$dir"
    begun=$(date +%s%N)
    sed -E "$3" "$1" > "$dir/$(basename "$1")"
    if cmp -s "$1" "$dir/$(basename "$1")"; then
      report found "the fault does not fit $1" "$begun" "$name, $2"
    else
      local mutated=()
      for file in "${files[@]}"; do
        if [ "$file" = "$1" ]; then mutated+=("$dir/$(basename "$1")"); else mutated+=("$file"); fi
      done
      report found "$(build_and_prove "$dir" "$top" "$generics" "$exposed" "${mutated[@]}")" "$begun" "$name, $2"
    fi
    shift 3
  done
}

proof async_fifo async_fifo '-gG_DATA_W=1 -gG_DEPTH_LOG2=2' \
  'w_take r_take w_hold r_hold w_gray r_gray w_gray_at_r r_gray_at_w' \
  'rtl/psweep_pkg.vhd rtl/cdc_sync.vhd rtl/async_fifo.vhd' \
  rtl/async_fifo.vhd 'pointers in binary' 's/v_count xor .*downto 1\)\)/v_count/' \
  rtl/async_fifo.vhd 'written when full' 's/w_take +<= w_valid and not w_full and/w_take <= w_valid and/' \
  rtl/async_fifo.vhd 'pointer cleared by its own reset' 's/w_clear <= w_answer or/w_clear <= w_rst or w_answer or/' \
  rtl/async_fifo.vhd 'request ends before the jump' "s/w_answer = '1' and w_zero = '1'/w_answer = '1'/" \
  rtl/async_fifo.vhd 'request during the last answer' "s/and r_answer \/= '1' then/then/" \
  rtl/async_fifo.vhd 'reader works during the answer' 's/(r_hold +<= r_rst or r_request) or r_answer/\1/' \
  rtl/async_fifo.vhd 'address without the fold' 's/gray\(C_TOP\) xor gray\(C_TOP - 1\)/gray(C_TOP - 1)/'

proof stream_fifo stream_fifo '-gG_DATA_W=3 -gG_DEPTH_LOG2=2' '' \
  'rtl/psweep_pkg.vhd rtl/ram_sdp.vhd rtl/stream_fifo.vhd' \
  rtl/stream_fifo.vhd 'one place too many' 's/write_place \+ 1 \/= read_place/write_place + 2 \/= read_place/' \
  rtl/stream_fifo.vhd 'shown while it is written' 's/to_sl\(next_place \/= write_place\);/s_fire or &/' \
  rtl/stream_fifo.vhd 'beats behind are forgotten' 's/more +<= s_fire or/more <=/'

proof crc_step crc_step '' '' 'rtl/eth_pkg.vhd tb/formal/crc_step.vhd' \
  rtl/eth_pkg.vhd 'one coefficient missing' 's/EDB88320/EDB88300/' \
  rtl/eth_pkg.vhd 'residue of the other bit order' 's/DEBB20E3/C704DD7B/'

for lanes in 1 2; do
  name=control
  if [ $lanes -gt 1 ]; then name=control-$lanes; fi
  proof $name control "-gG_IMG_COLS=6 -gG_IMG_ROWS=4 -gG_PLANE_COLS=2 -gG_PLANE_ROWS=2 -gG_PLANES=3 -gG_WINDOW=3 \
-gG_MNCC_W=4 -gG_LANES=$lanes -gG_LATENCY=5" \
    'tile_done tile_drop' 'rtl/psweep_pkg.vhd rtl/control.vhd' \
    rtl/control.vhd 'start with a table too short' \
    "s/if config_bad = '1' or table_bad = '1' then/if config_bad = '1' then/" \
    rtl/control.vhd 'a tile too wide allowed' 's/to_unsigned\(G_PLANE_COLS, 16\)/to_unsigned(G_PLANE_COLS + 1, 16)/' \
    rtl/control.vhd 'a set too many' 's/plane_set >= last_set or/plane_set > last_set or/' \
    rtl/control.vhd 'a short row' 's/to_unsigned\(C_ROW_MIN - 1, C_COL_W\)/to_unsigned(C_ROW_MIN - 2, C_COL_W)/' \
    rtl/control.vhd 'long packet not drained' '/state_q <= C_SWEEP;/{n;n;s/C_DRAIN/C_IDLE/}' \
    rtl/control.vhd 'map unloaded too early' 's/(C_FLUSH +: integer := G_LATENCY) \+ 2/\1/' \
    rtl/control.vhd 'done and dropped' 's/ and not tile_done and not event_short$/ and not event_short/' \
    rtl/control.vhd 'samples after an abort' "s/active +<= '0';\$/active <= active;/"
done

# check_crossings DIR FILE..: 'proved' or 'found' (a rule of tb/formal/crossings.ys is broken) or what went wrong.
check_crossings() {
  local dir=$1
  shift
  {
    ghdl -a --std=93 --workdir="$dir" "$@" &&
      ghdl --synth --std=93 --no-formal --workdir="$dir" --out=verilog -gG_PLANE_COLS=16 -gG_PLANE_ROWS=16 \
        -gG_IMG_COLS=40 -gG_IMG_ROWS=40 -gG_PLANES=5 arbiter > "$dir/raw.v"
  } > "$dir/ghdl.log" 2>&1 || { echo "GHDL failed: $dir/ghdl.log"; return; }
  { echo "read_verilog $dir/raw.v"; cat tb/formal/crossings.ys; } > "$dir/proof.ys"
  if yosys -q -l "$dir/yosys.log" "$dir/proof.ys" > "$dir/messages.log" 2>&1; then
    echo proved
  elif grep -q 'ERROR: Assertion failed' "$dir/messages.log"; then
    if [ -n "${VERBOSE:-}" ]; then cat "$dir/messages.log" >&2; fi
    echo found
  else
    echo "Yosys failed: $dir/messages.log"
  fi
}

# All crossings of the arbiter pass through synchronisers, memories or the list of tb/formal/crossings.ys.
mapfile -t arbiter_files < <(sed 's/#.*//; s/[[:space:]]*$//; /^$/d; s|^|rtl/|; /arbiter/q' rtl/files.f)
proof crossings check_crossings '' '' "${arbiter_files[*]}" \
  rtl/arbiter.vhd 'collisions past the synchroniser' \
  's/flips_last <= flips_seen/flips_last <= flips/' \
  rtl/arbiter.vhd 'ticks past the synchroniser' 's/ticks_last <= ticks_q/ticks_last <= ticks/' \
  rtl/mac_rx.vhd 'sending past the synchroniser' 's/own +<= synchronised\(0\)/own <= sending/' \
  rtl/packet_tx.vhd 'reset of mac_tx past the synchroniser' 's/down +<= levels_q\(2\)/down <= tx_rst/' \
  rtl/mac_tx.vhd 'requests past the synchroniser' 's/synchronised\(4 downto 3\)/f_request/' \
  rtl/arbiter.vhd 'a gate before a synchroniser' 's/full_duplex => duplex_q/full_duplex => full_duplex/' \
  rtl/arbiter.vhd 'reset of another clock' 's/rst +=> tx_rst/rst => rst/'

if [ $used -ne ${#wanted[@]} ] && [ ${#wanted[@]} -gt 0 ]; then
  echo "formal: unknown name among: ${wanted[*]}"
  failed=$((failed + 1))
fi
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
