#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The simulated chip behind the kernel's own network stack (make sim-net): in a network namespace of its own, on a TAP
# device, psweep-sim is pinged (so the kernel's ARP works first), described, and sweeps a rendered pair in tiles through
# `psweep depth --engine udp://ADDRESS`; the files equal those of `--engine fixed` byte for byte. Then with an MTU that
# is too small, after a host that was killed, and on a bad wire. Nothing outside the namespace is touched, and it goes
# with this script, however that ends.
#
#   scripts/sim_net.sh [--psweep FILE] [--sim FILE] [--out DIR] [--config NAME] [--size N] [--planes N] [--window N]
#                      [--seed N] [--small]
#     --psweep, --sim    the programs (default: build/psweep, build/psweep-sim)
#     --out              where to write (default: build/sim-net)
#     --config           the chip (default: tiny), with the planes and window it serves (default: 12, 5)
#     --size             side of the images (default: 96; with --small: 64)
#
# Needs /dev/net/tun and the right to make namespaces: root, or user namespaces and a /dev/net/tun open to users.
# Without them it prints 'SKIPPED: <reason>', tests the chip over the in-process link instead, and ends with 0 if that
# is good. Exit code 1 if anything differs or does not answer.
set -euo pipefail
cd "$(dirname "$0")/.."
script=scripts/sim_net.sh
arguments=("$@")

psweep=build/psweep sim=build/psweep-sim out=build/sim-net config=tiny size='' planes=12 window=5 seed=1 small=0
while [ $# -gt 0 ]; do
  case $1 in
    --psweep) psweep=$2; shift ;;
    --sim) sim=$2; shift ;;
    --out) out=$2; shift ;;
    --config) config=$2; shift ;;
    --size) size=$2; shift ;;
    --planes) planes=$2; shift ;;
    --window) window=$2; shift ;;
    --seed) seed=$2; shift ;;
    --small) small=1 ;;
    -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
    *) echo "sim_net.sh: unknown option '$1'; see --help" >&2; exit 2 ;;
  esac
  shift
done
if [ -z "$size" ]; then if [ $small = 1 ]; then size=64; else size=96; fi; fi
for program in "$psweep" "$sim"; do
  [ -x "$program" ] || { echo "sim_net.sh: $program is missing; run make build first" >&2; exit 2; }
done
mkdir -p "$out"

if [ -z "${PSWEEP_IN_NAMESPACE:-}" ]; then
  skip() {
    echo "SKIPPED: $1"
    echo "== the chip over the in-process link instead"
    exec "$sim" --config "$config"
  }
  for tool in unshare ip ping; do
    command -v $tool > /dev/null || skip "$tool is not installed"
  done
  [ -e /dev/net/tun ] || skip "there is no /dev/net/tun (modprobe tun)"
  enter=(unshare -n)
  if [ "$(id -u)" -ne 0 ]; then enter=(unshare -Urn); fi
  "${enter[@]}" true 2> /dev/null || skip "no right to make a network namespace (${enter[*]})"
  problem=$("${enter[@]}" ip tuntap add dev psweep0 mode tap 2>&1) ||
    skip "no TAP device in a network namespace: $problem"
  export PSWEEP_IN_NAMESPACE=1
  exec "${enter[@]}" "$script" "${arguments[@]}"
fi

sim_pid=
stop_chip() {
  [ -n "$sim_pid" ] || return 0
  kill -TERM "$sim_pid" 2> /dev/null || true
  local code=0
  wait "$sim_pid" || code=$?
  sim_pid=
  return $code
}
trap 'stop_chip || true' EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

device=psweep0 host=10.5.0.1 chip=10.5.0.2
ip link set lo up
ip tuntap add dev $device mode tap
# Without it the kernel looks for IPv6 neighbours, and the chip counts its packets.
echo 1 2> /dev/null > /proc/sys/net/ipv6/conf/$device/disable_ipv6 || true
ip addr add $host/24 dev $device
ip link set $device up

# Log of the chip, then its options.
start_chip() {
  local log=$1
  shift
  "$sim" --config "$config" --tap $device --seed "$seed" "$@" > "$log" 2>&1 &
  sim_pid=$!
  # It prints its address when it is there.
  for _ in $(seq 100); do
    if grep -q Ctrl-C "$log"; then return; fi
    kill -0 "$sim_pid" 2> /dev/null || break
    sleep 0.1
  done
  echo "sim_net.sh: the chip did not start:" >&2
  cat "$log" >&2
  exit 1
}
# Output directory, then the options of the engine.
depth() {
  local to=$1
  shift
  "$psweep" depth "$out/scene/left.png" "$out/scene/right.png" --calib "$out/scene/calib.yaml" --planes "$planes" \
    --window "$window" -o "$to" "$@"
}

echo "== scene, and its map by the bit-true model"
rm -rf "$out/scene" "$out/fixed" "$out/chip" "$out/chip_faults" "$out/chip_next" "$out"/chip_lost*
"$psweep" render --kind rocky --seed "$seed" --size "$size" -o "$out/scene"
depth "$out/fixed" --engine fixed

echo "== chip '$config' at $chip"
start_chip "$out/chip.log" --pcap "$out/wire.pcap"
for bytes in 0 1 18 56 100 1000 1471 1472; do
  ping -n -c 1 -W 20 -s $bytes $chip > "$out/ping.log" || { cat "$out/ping.log"; echo "no answer to a ping"; exit 1; }
  grep 'bytes from' "$out/ping.log"
done
ip neigh show dev $device
"$psweep" info "udp://$chip" > "$out/info.txt"
depth "$out/chip" --engine "udp://$chip"
stop_chip
cat "$out/chip.log"
scripts/same_output.sh "$out/fixed" "$out/chip"

if command -v tshark > /dev/null; then
  dissector=()
  if [ -e sw/wireshark/psweep.lua ]; then dissector=(-X lua_script:sw/wireshark/psweep.lua); fi
  read_wire() {
    # XDG_CONFIG_HOME: without the preferences and plugins of whoever runs this.
    XDG_CONFIG_HOME=$out tshark -r "$out/wire.pcap" "${dissector[@]}" -o ip.check_checksum:TRUE \
      -o udp.check_checksum:TRUE "$@" 2> "$out/tshark.log" || { cat "$out/tshark.log"; return 1; }
  }
  frames=$(read_wire | wc -l)
  wrong='_ws.malformed || ip.checksum.status == 0 || udp.checksum.status == 0 || icmp.checksum.status == 0'
  bad=$(read_wire -Y "$wrong" |
    tee "$out/bad.txt" | wc -l)
  echo "== tshark: $frames frames, $bad of them malformed or with a wrong checksum"
  if [ "$frames" -lt 20 ] || [ "$bad" -ne 0 ]; then head "$out/bad.txt"; exit 1; fi
else
  echo "== tshark is not installed: $out/wire.pcap is not looked at"
fi

echo "== an interface whose MTU is too small, and a host that is killed"
start_chip "$out/chip_killed.log" --session-wall 2
ip link set dev $device mtu 1400
if depth "$out/chip_mtu" --engine "udp://$chip" > "$out/mtu.log" 2>&1; then
  echo "a chip behind an MTU of 1400 gave a map"; exit 1
fi
grep "interface $device has an MTU of 1400" "$out/mtu.log" || { cat "$out/mtu.log"; exit 1; }
ip link set dev $device mtu 1500
# Not by depth(), which would be the process that is killed.
"$psweep" depth "$out/scene/left.png" "$out/scene/right.png" --calib "$out/scene/calib.yaml" --planes "$planes" \
  --window "$window" -q -o "$out/chip_lost" --engine "udp://$chip" &
host_pid=$!
for _ in $(seq 100); do
  if "$psweep" info --json "udp://$chip" | grep -q '"session": true'; then break; fi
done
kill -KILL $host_pid
wait $host_pid || true
depth "$out/chip_next" --engine "udp://$chip"
stop_chip
cat "$out/chip_killed.log"
grep -q "sessions ended for 2 s of silence: 1" "$out/chip_killed.log"
scripts/same_output.sh "$out/fixed" "$out/chip_next"

echo "== again, with 1 % of the frames lost, doubled, reordered, corrupted"
start_chip "$out/chip_faults.log" --loss 0.01 --duplicate 0.01 --reorder 0.01 --corrupt 0.01 --corrupt-fcs 0.01
depth "$out/chip_faults" --engine "udp://$chip"
stop_chip
cat "$out/chip_faults.log"
scripts/same_output.sh "$out/fixed" "$out/chip_faults"
echo "sim-net: chip and model agree in every file; recorded wire: $out/wire.pcap"
