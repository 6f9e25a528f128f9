#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Does the workflow of 'make dse' do what it is for? A small grid is killed in the middle and resumed; then one VHDL
# file changes, and only what depends on the VHDL may run; then nothing changes, and nothing may run. A minute.
#
#   scripts/dse/test_workflow.sh [--programs DIR]     default build
set -euo pipefail
start=$PWD
cd "$(dirname "$0")/../.."
programs=build
while [ $# -gt 0 ]; do
  case $1 in
    --programs) programs=$(cd "$start" && realpath "$2"); shift ;;
    -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
    *) echo "test_workflow.sh: unknown option '$1'" >&2; exit 2 ;;
  esac
  shift
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "test_workflow.sh: FAILED: $*" >&2; tail -n 20 "$work/log" >&2; exit 1; }
cp -r rtl "$work/rtl"
cat > "$work/grid.yaml" << 'GRID'
cost: [[16, 12, 5, 13, 1]]
tiles: [[1092, 20], [1092, 30], [256, 130]]
windows: [7, 13]
scenes: [rocky-1-560, flat-1-128]
accuracy_windows: [7, 13]
formats: ["float:13:2:8:8", "mncc:13:2:8:8", "fixed:13:2:8:8"]
GRID
run() {
  scripts/dse/dse.sh --grid "$work/grid.yaml" --out "$work/out" --programs "$programs" --rtl "$work/rtl" \
    > "$work/log" 2>&1
}
jobs_of() { grep -cE "^(local)?rule $1:" "$work/log" || true; }
products() { find "$work/out/shape" "$work/out/accuracy" "$work/out/cost" -type f 2> /dev/null | wc -l || true; }

# Killed as soon as something is finished, with all of its jobs.
set -m
run & pid=$!
set +m
for ((i = 0; i < 600; ++i)); do
  [ "$(products)" -lt 3 ] || break
  sleep 0.1
done
kill -KILL -- "-$pid" 2> /dev/null || fail "the run ended before it could be killed"
wait "$pid" 2> /dev/null || true
[ ! -e "$work/out/index.html" ] || fail "the run was killed too late"
before=$(products)
[ "$before" -ge 3 ] || fail "nothing was finished when the run was killed"

run || fail "the run does not resume"
[ -s "$work/out/index.html" ] || fail "no page"
resumed=$(($(jobs_of shape) + $(jobs_of cost) + $(jobs_of accuracy)))
all=$(products)
if [ "$resumed" -eq 0 ] || [ "$resumed" -ge "$all" ]; then fail "resumed with $resumed of $all points"; fi
echo "killed with $before of $all points, resumed with $resumed"

run || fail "a run with nothing to do"
[ "$(jobs_of '.*')" -eq 0 ] || fail "something ran again though nothing had changed"
echo "nothing changed: nothing ran"

echo '-- one more line' >> "$work/rtl/updating.vhd"
run || fail "a run with changed VHDL"
ran="cost $(jobs_of cost), shape $(jobs_of shape), scene $(jobs_of scene), accuracy $(jobs_of accuracy)"
[ "$ran" = "cost 1, shape 0, scene 0, accuracy 0" ] || fail "VHDL changed: $ran"
[ "$(jobs_of page)" -le 1 ] || fail "more than one page"
echo "VHDL changed: $ran"
