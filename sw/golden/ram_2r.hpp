// SPDX-License-Identifier: Apache-2.0
// Model of entity ram_2r: a memory with two readers, one of which writes instead now and then. What a port shows for a
// clock in which its word was written is undefined.
#pragma once
#include <cstddef>
#include <cstdint>

#include "golden/ram_sdp.hpp"

namespace psweep::golden {

class Ram2r {
 public:
  static constexpr size_t kLatency = 2;

  explicit Ram2r(size_t depth) : a(depth, kLatency), b(depth, kLatency) {}
  void clock(bool we, uint32_t a_addr, uint64_t a_wdata, uint32_t b_addr) {
    a.clock(we, a_addr, a_wdata, a_addr);
    b.clock(we, a_addr, a_wdata, b_addr);
  }
  RamSdp a, b;  // as each port sees it
};

}  // namespace psweep::golden
