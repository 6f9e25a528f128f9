#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Compares two output folders of psweep depth byte for byte. scripts/same_output.sh --help says more.
exec "$(dirname "$0")/tools.py" same-output "$@"
