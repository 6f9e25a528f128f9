// SPDX-License-Identifier: Apache-2.0
// Model of entity control and of the engine's timing: register addresses, states, error bits, latencies and the clocks
// of a tile. Constants mirror rtl/psweep_pkg.vhd and rtl/control.vhd; the bench compares measured clocks with them.
#pragma once
#include <algorithm>
#include <cstdint>

#include "golden/config.hpp"

namespace psweep::golden {

// Registers: address of a write on s_cfg. Plane table: kRegTable + 8 * plane + field.
enum Register : uint16_t {
  kRegCommand = 0x00,
  kRegTileCols = 0x01,
  kRegTileRows = 0x02,
  kRegWinCols = 0x03,
  kRegWinRows = 0x04,
  kRegPlanes = 0x05,
  kRegThreshold = 0x06,
  kRegTx = 0x08,     // left x, left y, right x, right y
  kRegLeft = 0x10,   // x_lo, x_hi, y_lo, y_hi
  kRegRight = 0x14,  // likewise
  kRegTable = 0x8000,
};
enum CommandBit : uint32_t { kCommandStart = 1 << 0, kCommandAbort = 1 << 1, kCommandClear = 1 << 2 };

enum class State { kIdle = 0, kLoad = 1, kSweep = 2, kFlush = 3, kUnload = 4, kDrain = 5 };

// Port errors.
enum ErrorBit : uint8_t {
  kErrorConfig = 1 << 0,   // a size register out of range (or never written) at start
  kErrorTable = 1 << 1,    // more planes than written to the table
  kErrorShort = 1 << 2,    // tlast before the last pixel
  kErrorLong = 1 << 3,     // no tlast on the last pixel
  kErrorWindow = 1 << 4,   // a sample inside both images is not loaded
  kErrorAddress = 1 << 5,  // unknown register, or a table word out of order or range
  kErrorBusy = 1 << 6,     // write or start while a tile is in work
  kErrorUpset = 1 << 7,    // RTL alone: a state or an end of the map that cannot be; the tile is dropped
};

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
