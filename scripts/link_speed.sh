#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# How busy the link keeps the engine, and how long a whole pair takes end to end, in simulated time, with one and two
# tiles in flight (docs/arbiter.md); then the tests of goodput and latency, which print what they measure.
#
#   scripts/link_speed.sh [tiles] [in flight]      default: the first 3 tiles, 1 and 2 in flight; some minutes
set -euo pipefail
cd "$(dirname "$0")/.."
case ${1:-} in
  -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
esac
build/tb/chip/link_speed "${@:-3}"
build/tb/chip/test_goodput 'goodput: *' | grep Mbit
build/tb/chip/test_goodput 'goodput: STATUS*' | grep STATUS
