#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Random tiles, good and bad, in several engines. scripts/soak.sh --help says more.
exec "$(dirname "$0")/tools.py" soak "$@"
