#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs a command in a Slurm cluster of this one machine. scripts/dse/one_node.sh --help says more.
exec "$(dirname "$0")/../tools.py" dse-node "$@"
