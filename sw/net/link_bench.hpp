// SPDX-License-Identifier: Apache-2.0
// Goodput and latency of a link (psweep bench-link). One tile is swept over a single plane and its map read again and
// again; a second tile is opened and its rows are sent again and again, all but one, so that it never starts.
//   Up   : chunks of rows that arrived, by the chip's own count (STATUS and COUNTERS, before and after), so that
//   neither
//          a lost answer nor one that is late behind this side's queue makes a difference
//   Down : cells of the map packets that came
//   Time : from the first packet to the last answer of that direction
// On any transport, in its time. Errors: LinkError.
#pragma once
#include <cstdint>
#include <vector>

#include "net/link_engine.hpp"

namespace psweep::net {

struct LinkRates {
  double up = 0, down = 0;                  // Mbit/s of pixels and cells
  uint64_t chunks_sent = 0, chunks_up = 0;  // those of the chunks sent that arrived
  uint64_t chunks_down = 0;
};

class LinkBench {
 public:
  // Opens a session, which the caller closes.
  LinkBench(Client& client, const Capabilities& chip);

  LinkRates measure(bool up, bool down, double seconds);
  // Of STATUS, in seconds, sorted.
  std::vector<double> latencies(double seconds);

 private:
  Reply repeat(Type type, uint16_t tile, uint16_t index, const Bytes& payload, uint8_t flags = 0);
  Status status();
  uint64_t chunks_arrived();

  Client& client_;
  const ArbiterConfig c_;
  golden::TileJob job_;
  Bytes chunk_;          // of rows
  uint32_t usable_ = 0;  // chunks of the second tile that may be sent
  uint32_t map_chunks_ = 0;
  size_t map_wire_ = 0;  // bytes of wire that the map takes, at least two chunks of rows
  bool half_duplex_ = false;
};

}  // namespace psweep::net
