#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The pictures of the page about waves. scripts/wave_pictures.sh --help says more.
exec "$(dirname "$0")/tools.py" wave-pictures "$@"
