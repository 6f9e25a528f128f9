#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Tests the tests: small faults in a copy of the RTL have to be noticed. scripts/mutants.sh --help says more.
LC_ALL=C exec "$(dirname "$0")/tools.py" mutants "$@"
