// SPDX-License-Identifier: Apache-2.0
// Goodput: what psweep bench-link measures, and the same counted at the chip's pins, frame by frame and in simulated
// time: pixels of the WRITEs and cells of the map packets between the first of them and the last.
#pragma once
#include "desk/chip_transport.hpp"
#include "net/link_bench.hpp"

namespace psweep::chip {

struct Goodput {
  net::LinkRates bench;
  double wire_up = 0, wire_down = 0;  // Mbit/s
  // Apart by a share of the wire's figure.
  static double apart(double bench, double wire) { return wire > 0 ? bench / wire - 1 : bench; }
  double worst() const { return std::max(std::abs(apart(bench.up, wire_up)), std::abs(apart(bench.down, wire_down))); }
};

// slow: so many times faster goes the clock that the bench sees.
inline Goodput goodput(Desk& desk, uint16_t chip_port, net::LinkBench& bench, bool up, bool down, double seconds,
                       double slow = 1) {
  struct Flow {
    Time first = -1, last = 0;
    uint64_t bytes = 0;
    void add(Time now, size_t payload) {
      // A frame's time is its end, so the first one has had its time already.
      if (first >= 0) bytes += payload - net::kHeaderBytes;
      if (first < 0) first = now;
      last = now;
    }
    double rate() const {
      return last > first ? 8e-6 * static_cast<double>(bytes) * kSecond / static_cast<double>(last - first) : 0;
    }
  } writes, maps;
  const Time end = desk.now() + static_cast<Time>(seconds * kSecond);
  desk.on_wire = [&](bool from_chip, const net::Bytes& frame) {
    const auto p = net::parse_udp(frame);
    const auto h = p ? net::decode(p->payload) : std::nullopt;
    if (!h || (from_chip ? p->from : p->to).port != chip_port) return;
    if (!from_chip && h->type == net::kWrite) writes.add(desk.now(), p->payload.size());
    if (from_chip && h->type == net::kMap && desk.now() <= end) maps.add(desk.now(), p->payload.size());
  };
  Goodput g;
  g.bench = bench.measure(up, down, seconds * slow);
  desk.on_wire = nullptr;
  g.wire_up = writes.rate();
  g.wire_down = maps.rate();
  return g;
}

}  // namespace psweep::chip
