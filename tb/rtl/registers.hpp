// SPDX-License-Identifier: Apache-2.0
// Register map, map-word format and error bits of entity psweep (docs/interfaces.md), for whoever talks to its streams.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "golden/config.hpp"

namespace psweep::rtl {

enum Register : uint16_t {
  kCommand = 0x0000,
  kTileCols = 0x0001,
  kTileRows = 0x0002,
  kWinCols = 0x0003,
  kWinRows = 0x0004,
  kPlanes = 0x0005,
  kThreshold = 0x0006,
  kTxLeft = 0x0008,
  kTyLeft = 0x0009,
  kTxRight = 0x000A,
  kTyRight = 0x000B,
  kLeftBounds = 0x0010,   // x_lo, x_hi, y_lo, y_hi
  kRightBounds = 0x0014,  // likewise
  kTable = 0x8000,        // + 8 * plane + field
};
enum Command : uint32_t { kStart = 1, kAbort = 2, kClear = 4 };
enum State { kIdle = 0, kLoad = 1, kSweep = 2, kFlush = 3, kUnload = 4, kDrain = 5 };
enum ErrorBit : uint8_t {
  kErrorConfig = 1 << 0,
  kErrorTable = 1 << 1,
  kErrorShort = 1 << 2,
  kErrorLong = 1 << 3,
  kErrorWindow = 1 << 4,
  kErrorAddress = 1 << 5,
  kErrorBusy = 1 << 6,
};

struct RegisterWrite {
  uint16_t address;
  uint32_t value;
  uint64_t word() const { return uint64_t{address} << 32 | value; }  // s_cfg_tdata
};

inline std::vector<RegisterWrite> job_writes(const golden::TileJob& t) {
  auto u = [](int v) { return static_cast<uint32_t>(v); };
  std::vector<RegisterWrite> w = {
      {kTileCols, u(t.tile_cols)}, {kTileRows, u(t.tile_rows)},  {kWinCols, u(t.win_cols)}, {kWinRows, u(t.win_rows)},
      {kPlanes, u(t.planes)},      {kThreshold, u(t.threshold)}, {kTxLeft, u(t.tx_left)},   {kTyLeft, u(t.ty_left)},
      {kTxRight, u(t.tx_right)},   {kTyRight, u(t.ty_right)},
  };
  auto bounds = [&](uint16_t base, const golden::Bounds& b) {
    const int values[] = {b.x_lo, b.x_hi, b.y_lo, b.y_hi};
    for (int i = 0; i < 4; ++i) w.push_back({static_cast<uint16_t>(base + i), u(values[i])});
  };
  bounds(kLeftBounds, t.left);
  bounds(kRightBounds, t.right);
  return w;
}

inline std::vector<RegisterWrite> table_writes(const std::vector<golden::PlaneEntry>& table) {
  std::vector<RegisterWrite> w;
  for (size_t k = 0; k < table.size(); ++k) {
    const golden::PlaneEntry& p = table[k];
    const uint32_t fields[8] = {static_cast<uint32_t>(p.x0_left),
                                static_cast<uint32_t>(p.y0_left),
                                static_cast<uint32_t>(p.x0_right),
                                static_cast<uint32_t>(p.y0_right),
                                p.dx_left,
                                p.dy_left,
                                p.dx_right,
                                p.dy_right};
    for (size_t f = 0; f < 8; ++f) w.push_back({static_cast<uint16_t>(kTable + 8 * k + f), fields[f]});
  }
  return w;
}

// m_map_tdata = {mask(3:0), plane, frac, v}
inline golden::MapCell unpack_cell(const golden::Config& c, uint64_t word) {
  auto take = [&word](int bits) {
    const uint64_t value = word & ((uint64_t{1} << bits) - 1);
    word >>= bits;
    return static_cast<uint16_t>(value);
  };
  golden::MapCell cell;
  cell.v = take(c.mncc_bits);
  cell.frac = take(c.frac_bits);
  cell.plane = take(c.plane_bits());
  cell.mask = static_cast<uint8_t>(take(4));
  return cell;
}
inline uint64_t pack_cell(const golden::Config& c, const golden::MapCell& cell) {
  uint64_t word = cell.mask;
  word = word << c.plane_bits() | cell.plane;
  word = word << c.frac_bits | cell.frac;
  return word << c.mncc_bits | cell.v;
}

// "config, short" and so on; "none" for 0.
inline std::string error_names(unsigned bits) {
  static const char* const names[] = {"config", "table", "short", "long", "window", "address", "busy"};
  std::string text;
  for (unsigned i = 0; i < 7; ++i)
    if (bits >> i & 1) text += (text.empty() ? "" : ", ") + std::string(names[i]);
  return text.empty() ? "none" : text;
}

}  // namespace psweep::rtl
