#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs the tests of build/ and sums them up. scripts/sim.sh --help says more.
exec "$(dirname "$0")/tools.py" sim "$@"
