#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The netlist for Virtex-6 at gate level, bit-exact with recorded streams. scripts/sim_gates.sh --help says more.
exec "$(dirname "$0")/tools.py" sim-gates "$@"
