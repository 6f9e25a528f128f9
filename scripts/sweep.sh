#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Engines of random sizes and formats, each built and tried. scripts/sweep.sh --help says more.
exec "$(dirname "$0")/tools.py" sweep "$@"
