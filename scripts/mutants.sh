#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Tests the tests: puts one small fault at a time into a copy of the RTL (an operator, a constant, a condition, an
# assignment), and the tests of `make sim` have to notice it. docs/mutants.md says how and with what result.
#
#   scripts/mutants.sh [options] [ENTITY ...]      default: all entities of rtl/files.f, the chip's parts first
#     --count N    N mutants an entity (default: one for each 50 lines; at least ten of a file of more than 200 lines,
#                  two of a smaller one)
#     --seed N     draws others (default 1)
#     --minutes N  begins nothing new after that time; the next run goes on
#     --only ID    that mutant alone (ENTITY.NUMBER, as in the list), drawn or not
#     --list       shows what would be tested and by which tests, tests nothing
#     --report     only the table of what is known
#     --strict     no mercy for those in the list of equivalents: for tests of this script
#     --out DIR    where to work (default: build/mutants)
#
# Works in build/mutants, one copy of the tree and its builds per job; the checkout is not touched. The entity's own
# test comes first, then one small engine or chip, then the tests of the whole; the first that fails ends it. A mutant
# that cannot be built is 'invalid' and another is drawn. A mutant that survives has to be in
# scripts/mutants_equivalent.txt, with a reason. Results are kept in build/mutants/results.jsonl: an interrupted run
# goes on, and a mutant whose entity and tests are unchanged is not run again. Environment: JOBS (default: all cores),
# VERBOSE=1 (keeps all logs).
# Exit code 1 if a mutant survived that is not in that list, if one in the list was killed, if an entry of the list fits
# no mutant, if the run is not finished, or if nothing was tested.
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in
  -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
esac
export LC_ALL=C
exec python3 scripts/mutants/main.py "$@"
