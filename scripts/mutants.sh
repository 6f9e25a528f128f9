#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Tests the tests: puts one small fault at a time into a copy of the RTL (an operator, a constant, a condition, an
# assignment), and the tests of `make sim` have to notice it. docs/mutants.md says how and with what result.
#
#   scripts/mutants.sh [options] [ENTITY ...]      default: all entities of rtl/files.f
#     --count N    so many mutants over all entities, more for the larger ones, at least two each (default 120)
#     --seed N     draws others (default 1)
#     --only ID    that mutant alone (ENTITY.NUMBER, as in the list), drawn or not
#     --list       shows what would be tested and what the candidates are, tests nothing
#     --strict     no mercy for those in the list of equivalents: for tests of this script
#
# Works in build/mutants, one copy of the tree and one build per job; the checkout is not touched. The unit's own test
# comes first, then those of the whole engine or chip; the first that fails ends it. A mutant that cannot be built is
# 'invalid' and another is drawn. A mutant that survives has to be in scripts/mutants_equivalent.txt, with a reason.
# Results in build/mutants/results.txt. Environment: JOBS (default: all cores), VERBOSE=1 (names the log of each).
# Exit code 1 if a mutant survived that is not in that list, if one in the list was killed, if an entry of the list fits
# no mutant, or if nothing was tested.
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in
  -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
esac
export LC_ALL=C
exec perl scripts/mutants.pl "$@"
