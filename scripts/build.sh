#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Configures build/ if need be and builds TARGETs (default: all) in it.
#
#   scripts/build.sh [TARGET ...]
#
# Environment: JOBS (default: all cores), VERBOSE=1 (show the commands).
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in
  -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
esac

if [ ! -e build/build.ninja ]; then cmake --preset release; fi
options=(--parallel "${JOBS:-$(nproc)}")
if [ -n "${VERBOSE:-}" ]; then options+=(--verbose); fi
if [ $# -gt 0 ]; then options+=(--target "$@"); fi
# CMake takes a VERBOSE of any value, even an empty one, as a wish.
exec env -u VERBOSE cmake --build build "${options[@]}"
