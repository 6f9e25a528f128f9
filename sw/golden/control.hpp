// SPDX-License-Identifier: Apache-2.0
// Model of entity control: its errors and counters, what it takes for a job and a plane table, and the engine's timing,
// i.e. the latencies of its stages and the clocks of a tile. Constants mirror psweep_pkg.vhd and control.vhd;
// the bench compares measured clocks with them. Registers, states and error bits: contract/registers.hpp.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "contract/protocol.hpp"
#include "contract/registers.hpp"

namespace psweep::golden {

// Clocks from the first input to the first output of an entity.
constexpr int kAddressLatency = 9;
constexpr int kStorageLatency = 4;

inline int interpolation_latency(const Config& c) { return c.rectified ? 3 : 6; }
inline int similarity_latency(const Config& c) { return 16 + c.mncc_bits; }
inline int updating_latency(const Config& c) { return 4 + c.lanes + c.frac_bits; }
// The start command on s_cfg and in its register, the strobes' register, the last plane noticed in the map, the unload
// command, and four to the first word out of the map.
constexpr int kControlClocks = 9;

// Clocks of a whole tile if neither stream stalls: every pixel, sample and cell takes one clock, one thing after the
// other, and the pipeline is filled once. engine_clocks() is what port tile_clocks shows: from the start command to the
// last map beat. The padding of the last row does not count, since nobody waits for it.
inline uint64_t load_clocks(const TileJob& t) { return static_cast<uint64_t>(t.win_cols) * t.win_rows; }
// Lanes sweep a set of planes at once; in the last one some may rest.
inline int plane_sets(const Config& c, const TileJob& t) { return (t.planes + c.lanes - 1) / c.lanes; }
inline uint64_t sweep_clocks(const Config& c, const TileJob& t) {
  const int row = std::max(sweep_cols(c, t), kRowMin);
  return static_cast<uint64_t>(plane_sets(c, t)) * sweep_rows(c, t) * row - (row - sweep_cols(c, t));
}
inline uint64_t unload_clocks(const TileJob& t) { return static_cast<uint64_t>(t.tile_cols) * t.tile_rows; }
inline uint64_t fill_clocks(const Config& c) {
  return static_cast<uint64_t>(kAddressLatency + kStorageLatency + interpolation_latency(c) + similarity_latency(c) +
                               updating_latency(c) + kControlClocks);
}
inline uint64_t engine_clocks(const Config& c, const TileJob& t) {
  return load_clocks(t) + sweep_clocks(c, t) + unload_clocks(t) + fill_clocks(c);
}

// Inverse of job_writes(): values of the registers net::kJobRegisters, in their order. Of a bound the engine keeps 13
// bits, of a step along a row 21 (table_entry()); sizes and threshold must fit.
inline TileJob job_from_words(const std::array<uint32_t, net::kJobWords>& w) {
  auto s = [&w](size_t i) { return static_cast<int32_t>(w[i]); };
  TileJob t;
  t.tile_cols = s(0), t.tile_rows = s(1), t.win_cols = s(2), t.win_rows = s(3), t.planes = s(4), t.threshold = s(5);
  t.tx_left = s(6), t.ty_left = s(7), t.tx_right = s(8), t.ty_right = s(9);
  auto bound = [&w](size_t i) { return static_cast<int32_t>(w[i] << 19) >> 19; };
  t.left = {bound(10), bound(11), bound(12), bound(13)};
  t.right = {bound(14), bound(15), bound(16), bound(17)};
  return t;
}
inline PlaneEntry table_entry(const uint32_t* w) {
  auto s = [w](int i) { return static_cast<int32_t>(w[i]); };
  const uint32_t step = (1u << 21) - 1;
  return {s(0), s(1), s(2), s(3), w[4] & step, w[5], w[6] & step, w[7]};
}

// Between two tiles; what happens while one is in work is a matter of clocks (tile_run.hpp).
class Control {
 public:
  explicit Control(const Config& config) : config_(config), table_(size_t{8} * config.planes, 0) {}

  // Word `at` of the plane table. Words beyond the table are errors, one each.
  void write_table(size_t at, uint32_t value) {
    if (at < table_.size())
      table_[at] = value;
    else
      error(kErrorAddress);
  }
  std::vector<PlaneEntry> table(int planes) const {
    std::vector<PlaneEntry> entries(static_cast<size_t>(planes));
    for (size_t k = 0; k < entries.size(); ++k) entries[k] = table_entry(&table_[8 * k]);
    return entries;
  }
  // Every register in its range.
  bool takes(const TileJob& t) const {
    auto in = [](int v, int hi) { return v >= 1 && v <= hi; };
    const Config& c = config_;
    return in(t.tile_cols, c.plane_cols) && in(t.tile_rows, c.plane_rows) && in(t.win_cols, c.img_cols) &&
           in(t.win_rows, c.img_rows) && in(t.planes, c.planes) && t.threshold >= 0 && t.threshold < 1 << c.mncc_bits;
  }

  void error(ErrorBit bit) {
    errors_ |= bit;
    error_count_ = std::min(error_count_ + 1, 0xffffu);
  }
  void drop(ErrorBit bit) {
    error(bit);
    tiles_dropped_ = std::min(tiles_dropped_ + 1, 0xffffu);
  }
  // Samples inside both images, but not loaded, of a whole tile.
  void lost_samples(uint64_t count) {
    if (count == 0) return;
    window_errors_ = static_cast<unsigned>(std::min<uint64_t>(window_errors_ + count, 0xffff));
    error(kErrorWindow);
  }
  void done(uint32_t clocks) {
    tile_clocks_ = clocks;
    tiles_done_ = std::min(tiles_done_ + 1, 0xffffu);
  }
  // Abort and clear in one command: the tile in work is dropped, and counts. The clocks of the latest tile stay.
  void stop(bool dropped) {
    errors_ = error_count_ = tiles_done_ = window_errors_ = 0;
    tiles_dropped_ = dropped ? 1 : 0;
  }

  unsigned errors() const { return errors_; }
  unsigned error_count() const { return error_count_; }
  unsigned tiles_done() const { return tiles_done_; }
  unsigned tiles_dropped() const { return tiles_dropped_; }
  unsigned window_errors() const { return window_errors_; }
  uint32_t tile_clocks() const { return tile_clocks_; }

 private:
  Config config_;
  std::vector<uint32_t> table_;
  unsigned errors_ = 0, error_count_ = 0, tiles_done_ = 0, tiles_dropped_ = 0, window_errors_ = 0;
  uint32_t tile_clocks_ = 0;
};

}  // namespace psweep::golden
