#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The simulated chip behind the kernel's own network stack. scripts/sim_net.sh --help says more.
exec "$(dirname "$0")/tools.py" sim-net "$@"
