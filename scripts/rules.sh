#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Do the assertions in the VHDL find what they are for? scripts/rules.sh --help says more.
exec "$(dirname "$0")/tools.py" rules "$@"
