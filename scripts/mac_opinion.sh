#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# An independent opinion on the MAC: mac_rx and mac_tx (as the Verilog that GHDL makes of them) in Icarus, against the
# MII source and sink of cocotbext-eth. Ends with 'N passed, N failed'; exit code 1 if any failed, or none ran.
#
#   scripts/mac_opinion.sh
#
# cocotb and cocotbext-eth are installed by pip into build/opinion/venv (PYTHON_VENV names a ready one instead); this
# needs the network once. Everything else is of the package group 'opinion'.
set -euo pipefail
cd "$(dirname "$0")/.."

out=build/opinion
venv=${PYTHON_VENV:-$out/venv}
versions=(cocotb==2.1.0 cocotbext-eth==0.1.28)
say() { printf 'mac-opinion: %s\n' "$*"; }
mkdir -p "$out"

if ! "$venv/bin/python3" -c 'import cocotb, cocotbext.eth' 2> /dev/null; then
  say "installing ${versions[*]} into $venv"
  python3 -m venv "$venv"
  "$venv/bin/pip" install -q --disable-pip-version-check "${versions[@]}" > "$out/pip.log" 2>&1 || {
    tail -n 15 "$out/pip.log" >&2
    say "pip could not install ${versions[*]}" >&2
    exit 1
  }
fi

sources=()
while read -r file _; do
  case "$file" in '' | '#'*) continue ;; esac
  sources+=("rtl/$file")
  [ "$file" != mac_tx.vhd ] || break
done < rtl/files.f
rm -rf "$out/work"
mkdir -p "$out/work"
ghdl -a --std=93 --workdir="$out/work" "${sources[@]}"
for unit in mac_rx mac_tx; do
  ghdl --synth --std=93 --workdir="$out/work" --out=verilog "$unit" > "$out/$unit.v" 2> "$out/$unit.log" || {
    cat "$out/$unit.log" >&2
    exit 1
  }
done
iverilog -g2012 -s mac_wrapper -o "$out/mac.vvp" tb/flows/mac_wrapper.v "$out/mac_rx.v" "$out/mac_tx.v"

config="$venv/bin/cocotb-config"
GPI_USERS="$("$config" --libpython);$("$config" --pygpi-entry-point)"
export GPI_USERS
export PYGPI_PYTHON_BIN="$PWD/$venv/bin/python3" COCOTB_TEST_MODULES=mac_opinion COCOTB_TOPLEVEL=mac_wrapper
case "$venv" in /*) PYGPI_PYTHON_BIN="$venv/bin/python3" ;; esac
export COCOTB_RESULTS_FILE="$PWD/$out/results.xml" PYTHONPATH="$PWD/tb/flows" PYTHONDONTWRITEBYTECODE=1
export COCOTB_LOG_LEVEL=WARNING
rm -f "$COCOTB_RESULTS_FILE"
# vvp 11 knows modules by the ending .vpi only.
library=$("$config" --lib-name-path vpi icarus)
ln -sf "$(realpath "$library")" "$out/cocotb.vpi"
LD_LIBRARY_PATH="$(dirname "$library")${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}" \
  vvp -M "$out" -m cocotb "$out/mac.vvp" > "$out/run.log" 2>&1 || true

[ -s "$COCOTB_RESULTS_FILE" ] || {
  tail -n 30 "$out/run.log" >&2
  say "the simulation did not end" >&2
  exit 1
}
total=$({ grep -o '<testcase' "$COCOTB_RESULTS_FILE" || true; } | wc -l)  # all in one line
failed=$({ grep -oE '<(failure|error)' "$COCOTB_RESULTS_FILE" || true; } | wc -l)
[ "$failed" -eq 0 ] || tail -n 40 "$out/run.log" >&2
say "log: $out/run.log"
echo "$((total - failed)) passed, $failed failed"
[ "$failed" -eq 0 ] && [ "$total" -gt 0 ]
