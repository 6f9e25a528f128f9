#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# More recorded streams on the original VHDL in GHDL. scripts/sim_ghdl.sh --help says more.
exec "$(dirname "$0")/tools.py" sim-ghdl "$@"
