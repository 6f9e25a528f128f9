// SPDX-License-Identifier: Apache-2.0
// Model of entity map_buffer: which cells it takes, which chunks it has, their bytes.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace psweep::golden {

class MapBuffer {
 public:
  // depth >= cells: whole tile, else a ring of depth / chunk_cells chunks.
  MapBuffer(int cell_bits, int chunk_cells, int cells, int depth)
      : cell_bits_(cell_bits), chunk_cells_(chunk_cells), ring_(depth >= cells ? 0 : depth / chunk_cells) {}

  int cell_bytes() const { return (cell_bits_ + 7) / 8; }
  bool whole() const { return ring_ == 0; }
  bool busy() const { return !cells_.empty(); }
  bool complete() const { return complete_; }
  int count() const { return static_cast<int>(cells_.size()); }
  // Chunks that are there to the end, the short last one included.
  int finished() const { return complete_ ? (count() + chunk_cells_ - 1) / chunk_cells_ : count() / chunk_cells_; }

  bool takes() const { return !complete_ && (whole() || count() / chunk_cells_ - kept_ < ring_); }
  void put(uint64_t cell, bool last) {
    cells_.push_back(cell);
    complete_ = last;
  }
  // Never back within a map; nothing before the first cell.
  void keep(int chunk) {
    if (busy() && !whole()) kept_ = std::max(kept_, chunk);
  }
  // The launched tile has failed.
  void fail() {
    if (!complete_) forget();
  }
  void forget() {
    cells_.clear();
    complete_ = false;
    kept_ = 0;
  }

  bool ready(int chunk) const { return chunk < finished() && chunk >= kept_; }
  std::vector<uint8_t> bytes(int chunk) const {
    std::vector<uint8_t> out;
    const int first = chunk * chunk_cells_;
    for (int i = first; i < std::min(first + chunk_cells_, count()); ++i)
      for (int k = cell_bytes() - 1; k >= 0; --k)
        out.push_back(static_cast<uint8_t>(cells_[static_cast<size_t>(i)] >> 8 * k));
    return out;
  }

 private:
  int cell_bits_, chunk_cells_, ring_;
  std::vector<uint64_t> cells_;
  bool complete_ = false;
  int kept_ = 0;
};

}  // namespace psweep::golden
