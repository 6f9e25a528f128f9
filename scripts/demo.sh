#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The demo: one scene through float, fixed and RTL, with a report. scripts/demo.sh --help says more.
exec "$(dirname "$0")/tools.py" demo "$@"
