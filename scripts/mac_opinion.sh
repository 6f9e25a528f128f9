#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The MAC against the MII models of cocotbext-eth. scripts/mac_opinion.sh --help says more.
exec "$(dirname "$0")/tools.py" mac-opinion "$@"
