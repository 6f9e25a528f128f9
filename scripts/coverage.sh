#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# How much of the circuit the tests reach (docs/coverage.md). scripts/coverage.sh --help says more.
exec "$(dirname "$0")/tools.py" coverage "$@"
