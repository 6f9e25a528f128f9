#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs the tests of build/ and ends with one line 'N passed, N failed, N skipped' (scripts/summary.sh).
#
#   scripts/sim.sh
#
# Environment: T (regular expression: only tests of these names), SEED (seed of the random stimuli, default 1), JOBS,
# VERBOSE=1 (all output of all tests). Exit code 1 if a test failed or none ran.
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in
  -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
esac

result=$PWD/build/tests.xml
rm -f "$result"
# Outputs are kept in full: the summary looks into those of skipped tests.
options=(--parallel "${JOBS:-$(nproc)}" --timeout 600 --no-tests=error --output-junit "$result"
  --test-output-size-passed 1000000 --test-output-size-failed 1000000)
if [ -n "${T:-}" ]; then options+=(--tests-regex "$T"); fi
if [ -n "${VERBOSE:-}" ]; then options+=(--verbose); else options+=(--output-on-failure); fi
if [ -n "${SEED:-}" ]; then export PSWEEP_SEED=$SEED; fi
cd build
ctest "${options[@]}" || true  # the summary judges, by the same results
exec ../scripts/summary.sh "$result"
