// SPDX-License-Identifier: Apache-2.0
// Model of entity ram_dc: a memory that is written at the edges of one clock and read at those of another; the word
// comes an edge later. Edges of both at once are undefined.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace psweep::golden {

class RamDc {
 public:
  explicit RamDc(size_t depth) : memory_(depth) {}
  void write_edge(bool we, uint32_t waddr, uint32_t wdata) {
    if (we) memory_[waddr] = wdata;
  }
  void read_edge(uint32_t raddr) {
    address_ = raddr;
    shown_ = memory_[raddr];
  }
  // Nothing: undefined, never written.
  std::optional<uint32_t> rdata() const { return shown_; }
  uint32_t address() const { return address_; }  // of that word

 private:
  std::vector<std::optional<uint32_t>> memory_;
  std::optional<uint32_t> shown_;
  uint32_t address_ = 0;
};

}  // namespace psweep::golden
