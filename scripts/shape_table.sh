#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Clocks of the paper's pair against memory, for tiles of every shape. scripts/shape_table.sh --help says more.
exec "$(dirname "$0")/tools.py" shapes "$@"
