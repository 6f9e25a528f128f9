#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Gate level (make sim-gates): the netlist that Yosys makes of the engine for Virtex-6 is driven with recorded streams,
# and every output port has to be as recorded before every clock (docs/gates.md). Then one cell of each kind is broken
# in turn, and the simulation has to see it.
#
#   scripts/sim_gates.sh [--build DIR] [--out DIR] [--no-faults] [CONFIGURATION[:counted] ...]
#                    default: tiny odd_2 tiny:counted odd_2:counted
#     :counted     the netlist whose cells 'make cost' counts: by the Yosys of scripts/cost/requirements.txt, debug
#                  ports left open; else by the installed Yosys, with the debug ports compared too
#     --build      folder with tb/replay/record_engine and sw/verilated/psweep_*/psweep.v (default: build)
#     --out        where to write (default: build/sim-gates)
#     --no-faults  without the broken cells (they are tried on the first configuration)
#
# Environment: SEED of the recorded session (default 1), JOBS (configurations at once; default: all cores), VERBOSE=1
# (Yosys' messages). Exit code 1 if anything differs, nothing was compared, or a broken cell is not noticed.
set -euo pipefail
cd "$(dirname "$0")/.."
build=build out='' faults=1 names=()
while [ $# -gt 0 ]; do
  case $1 in
    --build) build=$2; shift ;;
    --out) out=$2; shift ;;
    --no-faults) faults=0 ;;
    -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
    -*) echo "sim_gates.sh: unknown option '$1'; see --help" >&2; exit 2 ;;
    *) names+=("$1") ;;
  esac
  shift
done
[ ${#names[@]} -gt 0 ] || names=(tiny odd_2 tiny:counted odd_2:counted)
out=${out:-$build/sim-gates}
for program in yosys iverilog vvp perl; do
  command -v $program > /dev/null ||
    { echo "sim_gates.sh: $program is missing; see scripts/setup.sh gates" >&2; exit 2; }
done
[ -x "$build/tb/replay/record_engine" ] || { echo "sim_gates.sh: make build first ($build)" >&2; exit 2; }
# Debian's yosys comes without yosys-config; the cell models lie beside the program.
cells=$(dirname "$(dirname "$(readlink -f "$(command -v yosys)")")")/share/yosys/xilinx/cells_sim.v
[ -f "$cells" ] || { echo "sim_gates.sh: Yosys' cell models are not at $cells" >&2; exit 2; }
counted_cells=''
case " ${names[*]} " in
  *:counted\ *)
    scripts/setup.sh --check cost || exit 2
    counted_cells=$(echo "${COST_VENV:-build/cost/venv}"/lib/python3*/site-packages/pyosys/share/xilinx/cells_sim.v)
    [ -f "$counted_cells" ] || { echo "sim_gates.sh: Yosys' cell models are not at $counted_cells" >&2; exit 2; }
    ;;
esac

compile() { # compile PROGRAM NETLIST DIR: true if Icarus takes it without a word
  local log
  log=$(iverilog -g2005 -o "$1" -s replay "$3/bench.v" "$2" tb/gates/block_rams.v "$3/cells.v" 2>&1) &&
    [ -z "$log" ] && return
  echo "iverilog: $log"
  return 1
}

replay() { # replay PROGRAM RECORDING [+first]: prints what the bench says; true if all is equal
  local text
  text=$(vvp -n "$1" "+recording=$2" "${@:3}" 2>&1 | tee /dev/fd/3)
  grep -qE '^replay: [1-9][0-9]* steps, [1-9][0-9]* values compared, 0 differences$' <<< "$text"
} 3>&1

gates() { # one configuration
  local name=${1%:counted} dir=$out/${1/:/_} begun=$SECONDS models=$cells open=()
  local verilog=$build/sw/verilated/psweep_$name/psweep.v
  [ -f "$verilog" ] || { echo "there is no $verilog"; return 1; }
  rm -rf "$dir"
  mkdir -p "$dir"
  PSWEEP_CONFIG=$name PSWEEP_SEED=${SEED:-1} PSWEEP_RECORD=$dir/recording.txt "$build/tb/replay/record_engine" \
    > "$dir/record.log" || { cat "$dir/record.log"; return 1; }
  grep clocks "$dir/record.log"
  echo "Yosys at work"
  if [ "$1" != "$name" ]; then
    models=$counted_cells open=(--open dbg_)
    scripts/cost/measure.py --config "$name" --netlist "$dir/raw.v" || return 1
  else
    synthesise || return 1
  fi
  echo "netlist after $((SECONDS - begun)) s:"
  perl -ne '$n{$1}++ if /^  ([A-Z][A-Z0-9]+) (?:#\(|\S+ \($)/;
    END { printf "  %-9s %d\n", $_, $n{$_} for sort keys %n }' "$dir/raw.v"
  # Unknown start values are what the models of block_rams.v start with; others they do not have.
  perl -0pe 's/^\s*\.INITP?_[0-9A-F]{2}\(\d+.[hb]x+\),?\n//mg' "$dir/raw.v" > "$dir/netlist.v"
  # A register of the DSP that is left out is a copy of its input; Icarus would see no change of a constant input.
  perl -0pe 's/^module RAMB(?:18|36)E1\b.*?^endmodule\n//msg;
    s/always \@\* (\w+)\s*<?= (\w+);/always begin $1 = $2; \@($2); end/g' "$models" > "$dir/cells.v"
  scripts/tools.py ports --out "$dir/bench.v" gates "$verilog" psweep psweep tb/gates/replay.v.in clk "${open[@]}"
  compile "$dir/gates.vvp" "$dir/netlist.v" "$dir" || return 1
  replay "$dir/gates.vvp" "$dir/recording.txt" || { echo "FAILED: the netlist differs"; return 1; }
  echo "the netlist is bit-exact ($((SECONDS - begun)) s)"
}

synthesise() { # with the installed Yosys; name, dir, verilog of gates()
  {
    echo "read_verilog $verilog"
    echo "synth_xilinx -family xc6v -flatten -noiopad -top psweep"
    echo "write_verilog -noattr $dir/raw.v"
  } > "$dir/synth.ys"
  if [ -n "${VERBOSE:-}" ]; then
    yosys "$dir/synth.ys" || return 1
  else
    yosys -q -l "$dir/yosys.log" "$dir/synth.ys" > "$dir/messages.log" 2>&1 ||
      { tail -n 5 "$dir/messages.log"; return 1; }
  fi
}

# fault KIND SUBSTITUTION: breaks one cell of a kind, the middle one; if nobody ever sees what that one does, up to four
# others in turn.
fault() {
  local kind=$1 dir=$out/${names[0]/:/_} number
  for number in 5 3 7 2 8; do
    KIND=$kind NUMBER=$number perl -0pe '
      my $kind = $ENV{KIND};
      my @at;
      push @at, $-[0] while /^  \Q$kind\E (?:#\(.*?\) )?\S+ +\(.*?\);\n/msg;
      my $from = $at[@at * $ENV{NUMBER} / 10] // die "there is no $kind\n";
      my $cell = substr($_, $from);
      $cell =~ s/^(.*?\);\n)//s;
      my ($broken, $rest) = ($1, $cell);
      my $good = $broken;
      { local $_ = $broken; '"$2"'; $broken = $_; }
      die "$kind stays as it is\n" if $broken eq $good;
      $_ = substr($_, 0, $from) . $broken . $rest;
    ' "$dir/netlist.v" > "$dir/broken.v" 2> "$dir/fault.log" || { cat "$dir/fault.log"; return 1; }
    compile "$dir/broken.vvp" "$dir/broken.v" "$dir" || return 1
    if ! vvp -n "$dir/broken.vvp" "+recording=$dir/recording.txt" +first > "$dir/fault.log" 2>&1 ||
      grep -q '^mismatch' "$dir/fault.log"; then
      echo "$kind broken: found: $(grep -m1 '^mismatch' "$dir/fault.log" || tail -n 1 "$dir/fault.log")"
      return
    fi
  done
  echo "FAILED: five broken $kind are not noticed"
  return 1
}

begun=$SECONDS
jobs=${JOBS:-$(nproc)}
pids=() failed=0
for name in "${names[@]}"; do
  while [ "$(jobs -rp | wc -l)" -ge "$jobs" ]; do sleep 0.2; done
  gates "$name" 2>&1 | sed -u "s/^/sim-gates: $name: /" &
  pids+=($!)
done
for pid in "${pids[@]}"; do wait "$pid" || failed=$((failed + 1)); done
if [ $failed -eq 0 ] && [ $faults -eq 1 ]; then
  echo "sim-gates: broken cells in ${names[0]}"
  # shellcheck disable=SC2016  # $1 is Perl's
  {
    fault LUT6 's/INIT\(64.h([0-9a-f]+)\)/my $v = $1; $v =~ tr|0-9a-f|fedcba9876543210|; "INIT(64\x27h$v)"/e' ||
      failed=$((failed + 1))
    fault FDRE 's/\.D\((.*?)\),?\n/.D(~$1),\n/' || failed=$((failed + 1))
    fault CARRY4 's/\.S\((.*?)\)\n/.S(~$1)\n/' || failed=$((failed + 1))
    fault SRL16E 's/\.A0\(1.h([01])\)/".A0(1\x27h" . (1 - $1) . ")"/e' || failed=$((failed + 1))
    fault DSP48E1 's/\.ALUMODE\(4.h0\)/.ALUMODE(4\x27h3)/' || failed=$((failed + 1))
    fault RAMB36E1 's/\.WEBWE\(.*?\)(,?)\n/.WEBWE(8\x27h00)$1\n/' || failed=$((failed + 1))
  }
fi
echo "sim-gates: ${#names[@]} configurations, $failed failed, $((SECONDS - begun)) s"
[ $failed -eq 0 ]
