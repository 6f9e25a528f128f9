// SPDX-License-Identifier: Apache-2.0
// Model of entity ram_sdp: a read returns what was written last, after exactly so many clocks. A word that is read in
// the clock in which it is written is undefined, as is one that was never written.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

namespace psweep::golden {

class RamSdp {
 public:
  struct Read {
    uint32_t address = 0;
    bool defined = false;
    uint64_t word = 0;      // if defined; else, of a word that collides, the old one
    bool collides = false;  // with a write of the same clock
  };

  RamSdp(size_t depth, size_t latency) : memory_(depth), latency_(latency) {}

  // What rdata shows before the coming edge; nothing in the first clocks.
  std::optional<Read> due() const {
    if (way_.size() < latency_) return std::nullopt;
    return way_.front();
  }
  // One rising edge.
  void clock(bool we, uint32_t waddr, uint64_t wdata, uint32_t raddr) {
    if (way_.size() == latency_) way_.pop_front();
    const std::optional<uint64_t>& old = memory_[raddr];
    const bool collides = we && waddr == raddr;
    way_.push_back({raddr, old && !collides, old.value_or(0), old && collides});
    if (we) memory_[waddr] = wdata;
  }

 private:
  std::vector<std::optional<uint64_t>> memory_;
  size_t latency_;
  std::deque<Read> way_;
};

}  // namespace psweep::golden
