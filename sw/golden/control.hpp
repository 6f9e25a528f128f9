// SPDX-License-Identifier: Apache-2.0
// Model of entity control: the engine's timing, i.e. the latencies of its stages and the clocks of a tile. Constants
// mirror rtl/psweep_pkg.vhd and rtl/control.vhd; the bench compares measured clocks with them. Registers, states and
// error bits: contract/registers.hpp.
#pragma once
#include <algorithm>
#include <cstdint>

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

}  // namespace psweep::golden
