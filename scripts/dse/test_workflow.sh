#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Does the workflow of 'make dse' do what it is for? A small grid is killed in the middle and resumed; nothing changes,
# and nothing may run; a VHDL file has a fault, which must be told; it changes, and only what depends on it may run.
#
#   scripts/dse/test_workflow.sh [--slurm] [--programs DIR]     default build; a minute, with --slurm some
#     --slurm  as jobs of a Slurm cluster, which must be there: scripts/dse/one_node.sh starts one
set -euo pipefail
start=$PWD
cd "$(dirname "$0")/../.."
programs=build
slurm=()
more=()
while [ $# -gt 0 ]; do
  case $1 in
    --programs) programs=$(cd "$start" && realpath "$2"); shift ;;
    --slurm) slurm=(--slurm); more=(-- --slurm-init-seconds-before-status-checks 3) ;;
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
cost: [[16, 12, 5, 13, 1], [16, 12, 7, 13, 1]]
tiles: [[1092, 20], [1092, 30], [256, 130]]
windows: [7, 13]
scenes: [rocky-1-560, flat-1-128]
accuracy_windows: [7, 13]
formats: ["float:13:2:8:8", "mncc:13:2:8:8", "fixed:13:2:8:8"]
GRID
run() {
  scripts/dse/dse.sh --grid "$work/grid.yaml" --out "$work/out" --programs "$programs" --rtl "$work/rtl" \
    "${slurm[@]}" "${more[@]}" > "$work/log" 2>&1
}
jobs_of() { grep -cE "^(local)?rule $1:" "$work/log" || true; }
# Results that take some time: six of them.
products() { find "$work/out/accuracy" "$work/out/cost" -type f 2> /dev/null | wc -l || true; }
seconds() { echo "$((SECONDS - begun)) s"; }
waiting() { squeue --noheader 2> /dev/null | wc -l; }

# Killed as soon as there are some of the results, with all of its jobs; those of a cluster go on.
begun=$SECONDS
set -m
run & pid=$!
set +m
disown "$pid"
for ((i = 0; i < 3000; ++i)); do
  if [ "$(products)" -ge 2 ] || ! kill -0 "$pid" 2> /dev/null; then break; fi
  sleep 0.1
done
kill -KILL -- "-$pid" 2> /dev/null || fail "the run ended before it could be killed"
while kill -0 -- "-$pid" 2> /dev/null; do sleep 0.1; done
[ ! -e "$work/out/index.html" ] || fail "the run was killed too late"
before=$(products)
[ "$before" -ge 2 ] || fail "nothing was finished when the run was killed"
left=
if [ ${#slurm[@]} -gt 0 ]; then
  [ "$(waiting)" -gt 0 ] || fail "no job outlived the run"
  left=", $(waiting) jobs left in the queue"
fi
echo "killed after $(seconds) with files of $before of 6 results$left"

begun=$SECONDS
run || fail "the run does not resume"
[ -s "$work/out/index.html" ] || fail "no page"
resumed=$(($(jobs_of cost) + $(jobs_of scene) + $(jobs_of accuracy)))
[ "$(products)" -eq 6 ] || fail "$(products) results, not 6"
if [ "$resumed" -eq 0 ] || [ "$resumed" -ge 8 ]; then fail "resumed with $resumed of 8 points"; fi
cancelled=$(sed -n 's/^dse.sh: cancelling \([0-9]*\) jobs.*/, after \1 old ones were cancelled/p' "$work/log")
if [ ${#slurm[@]} -gt 0 ]; then
  [ -n "$cancelled" ] || fail "the jobs of the killed run were not cancelled"
  ! grep -q 'Unable to get the status' "$work/log" || fail "jobs were lost from sight"
  submitted=$(grep -c 'has been submitted with SLURM jobid' "$work/log" || true)
  [ "$submitted" -eq "$resumed" ] || fail "$submitted jobs were submitted, not $resumed"
  [ "$(waiting)" -eq 0 ] || fail "jobs are left in the queue"
  cancelled=", all submitted and seen finished$cancelled"
fi
echo "resumed with $resumed of 8 jobs$cancelled: $(seconds)"

run || fail "a run with nothing to do"
[ "$(jobs_of '.*')" -eq 0 ] || fail "something ran again though nothing had changed"
echo "nothing changed: nothing ran"

cp "$work/rtl/updating.vhd" "$work/good.vhd"
echo 'fault' >> "$work/rtl/updating.vhd"
! run || fail "a fault in the VHDL, and the run succeeds"
grep -q 'updating.vhd:[0-9]*:[0-9]*' "$work/log" || fail "the fault in the VHDL is not shown"
echo "a fault in the VHDL: told, exit code not 0"

begun=$SECONDS
cp "$work/good.vhd" "$work/rtl/updating.vhd"
echo '-- one more line' >> "$work/rtl/updating.vhd"
run || fail "a run with changed VHDL"
ran="cost $(jobs_of cost), shape $(jobs_of shape), scene $(jobs_of scene), accuracy $(jobs_of accuracy)"
[ "$ran" = "cost 2, shape 0, scene 0, accuracy 0" ] || fail "VHDL changed: $ran"
[ "$(jobs_of page)" -eq 1 ] || fail "the page was not made once"
echo "VHDL changed: $ran, page 1: $(seconds)"
