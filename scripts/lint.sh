#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Quick checks of everything that is text; scripts/lint.sh --help lists them.
exec "$(dirname "$0")/tools.py" lint "$@"
