#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Random and mutated frames into the simulated chips tiny, tiny_min and odd (tb/chip/test_fuzz.cpp), then random,
# mutated and forged packets into the host's receive path (tb/model/test_net_fuzz.cpp).
#
#   scripts/fuzz.sh [frames]      default: 100000 over the three chips; ten times as many packets into the host
#
# Environment: SEED (default 1). Progress on stderr. Half an hour of one core.
set -euo pipefail
cd "$(dirname "$0")/.."
case ${1:-} in
  -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
esac
frames=${1:-100000}
if [ -n "${SEED:-}" ]; then export PSWEEP_SEED=$SEED; fi
PSWEEP_FUZZ_PROGRESS=1 PSWEEP_FUZZ_FRAMES=$(((frames + 2) / 3)) build/tb/chip/test_fuzz
PSWEEP_FUZZ_PACKETS=$((10 * frames)) build/tb/model/test_net_fuzz
