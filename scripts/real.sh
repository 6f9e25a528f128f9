#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Real stereo pairs through float, fixed and RTL. scripts/real.sh --help says more.
exec "$(dirname "$0")/tools.py" real "$@"
