#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# What the engine, or one entity, costs in a Virtex-6 by Yosys (synth_xilinx -family xc6v -flatten): LUT, FF, RAMB36
# (two RAMB18 are one), DSP48E1, in rows as those of docs/datasheet.md. No vendor's tool, no timing.
#
#   scripts/cost.sh                       the engines of the datasheet (some minutes)
#   scripts/cost.sh ENTITY [G_X=n ...]    one entity; generics that are not given as by default
#
# Debug outputs dbg_* are left open. Needs ghdl and yosys (scripts/setup.sh gates). Counts differ between versions: the
# datasheet's are of Yosys 0.70. Environment: YOSYS=<program>.
set -euo pipefail
cd "$(dirname "$0")/.."
yosys=${YOSYS:-yosys}
case "${1:-}" in
  -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
  -*) echo "cost.sh: unknown option '$1'" >&2; exit 2 ;;
esac
for program in ghdl "$yosys" perl; do
  command -v "$program" > /dev/null || { echo "cost.sh: no $program; see scripts/setup.sh build gates" >&2; exit 1; }
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# cost NAME ENTITY [GENERIC=VALUE ..]: one row
cost() {
  local name=$1 top=$2
  shift 2
  [ -f "rtl/$top.vhd" ] || { echo "cost.sh: no rtl/$top.vhd" >&2; return 1; }
  sed 's/#.*//; s/[[:space:]]*$//; /^$/d; s|^|rtl/|' rtl/files.f | sed "/^rtl\/$top\.vhd$/q" > "$work/files"
  rm -rf "$work/ghdl" && mkdir "$work/ghdl"
  { xargs ghdl -a --std=93c --workdir="$work/ghdl" < "$work/files" &&
    ghdl --synth --std=93c --no-formal --workdir="$work/ghdl" --out=verilog "${@/#/-g}" "$top" > "$work/top.v"; } \
    2> "$work/messages" || { cat "$work/messages" >&2; return 1; }
  printf '%s\n' "read_verilog $work/top.v" "delete -output $top/w:dbg_*" \
    "synth_xilinx -family xc6v -flatten -noiopad -top $top" "tee -q -o $work/cells stat" > "$work/run.ys"
  "$yosys" -q -l "$work/log" "$work/run.ys" > "$work/messages" 2>&1 || { tail -n 5 "$work/messages" >&2; return 1; }
  # A line a kind of cell: 'LUT6 17' or, since 0.50, '17 - LUT6'; what is counted twice belongs to a sum of modules.
  NAME=$name perl -ne '
    my ($kind, $count) = /^\s+([A-Z][A-Z0-9_]+)\s+(\d+)\s*$/ ? ($1, $2)
                       : /^\s+(\d+)\s+(?:[\d.-]+\s+)?([A-Z][A-Z0-9_]+)\s*$/ ? ($2, $1) : next;
    $seen{$kind} = $count;
    END {
      for (keys %seen) {
        my $n = $seen{$_};
        if (/^LUT\d$|^SRL/) { $lut += $n }
        elsif (/^RAM(32M|64M|128X1D)$/) { $lut += 4 * $n }
        elsif (/^RAM(64X1D|32X1D|128X1S)$/) { $lut += 2 * $n }
        elsif (/^RAM\d+X1S$/) { $lut += $n }
        elsif (/^FD/) { $ff += $n }
        elsif (/^RAMB36/) { $ram += $n }
        elsif (/^RAMB18/) { $ram += $n / 2 }
        elsif (/^DSP/) { $dsp += $n }
      }
      die "cost.sh: no cells in the netlist\n" unless $lut || $ff || $ram;
      printf "| %s | %d | %d | %s | %d |\n", $ENV{NAME}, $lut // 0, $ff // 0, $ram // 0, $dsp // 0;
    }' "$work/cells"
}

echo "$("$yosys" -V), $(ghdl --version | sed -n 1p)"
printf '%s\n' '| engine | LUT | FF | RAMB36 | DSP48E1 |' '|---|---|---|---|---|'
if [ $# -gt 0 ]; then
  cost "$*" "$@"
  exit
fi
tile=(G_IMG_COLS=362 G_IMG_ROWS=144)
cost 'bands 44-30-13-13' psweep G_IMG_COLS=1120 G_IMG_ROWS=44 G_PLANE_COLS=1092 G_PLANE_ROWS=30
cost 'tile' psweep "${tile[@]}"
cost 'tile, rectified' psweep "${tile[@]}" G_RECTIFIED=1
cost 'tile, two lanes' psweep "${tile[@]}" G_LANES=2
cost 'tile, four lanes' psweep "${tile[@]}" G_LANES=4
cost 'tile, pixels of 8.4' psweep "${tile[@]}" G_INTERP_F=4
cost '117 x 93 cells, buffer 220 x 106' psweep G_IMG_COLS=220 G_IMG_ROWS=106 G_PLANE_COLS=117 G_PLANE_ROWS=93
