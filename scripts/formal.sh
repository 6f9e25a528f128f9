#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Proofs of small circuits, and faults that have to be found. scripts/formal.sh --help says more.
exec "$(dirname "$0")/tools.py" formal "$@"
