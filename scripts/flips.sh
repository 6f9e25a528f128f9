#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Upsets: bits of registers and memories of the simulated engine are changed while it works (docs/robustness.md).
#
#   scripts/flips.sh [--all] [--seed N]     --all: registers of all entities, not only those of control
#
# Table in build/flips.txt. Exit code 1 if an upset hangs the engine, or if the tile behind the next one is wrong.
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in
  -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
esac
build/tb/upsets/flips "$@" | tee build/flips.txt
