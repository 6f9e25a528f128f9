// SPDX-License-Identifier: Apache-2.0
// What entity psweep says and understands (docs/interfaces.md, docs/registers.md): addresses of its registers, states,
// error bits, and the words on its streams: register writes of a tile and of the plane table, pixels, map cells.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "contract/config.hpp"
#include "contract/tile.hpp"

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
  kRegRight = 0x14,  // x_lo, x_hi, y_lo, y_hi
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

struct RegisterWrite {
  uint16_t address = 0;
  uint32_t value = 0;
  uint64_t word() const { return uint64_t{address} << 32 | value; }  // s_cfg_tdata
};

inline std::vector<RegisterWrite> job_writes(const TileJob& t) {
  auto u = [](int v) { return static_cast<uint32_t>(v); };
  auto offset = [](int i) { return static_cast<uint16_t>(kRegTx + i); };
  std::vector<RegisterWrite> w = {
      {kRegTileCols, u(t.tile_cols)}, {kRegTileRows, u(t.tile_rows)}, {kRegWinCols, u(t.win_cols)},
      {kRegWinRows, u(t.win_rows)},   {kRegPlanes, u(t.planes)},      {kRegThreshold, u(t.threshold)},
      {offset(0), u(t.tx_left)},      {offset(1), u(t.ty_left)},      {offset(2), u(t.tx_right)},
      {offset(3), u(t.ty_right)},
  };
  auto bounds = [&](uint16_t base, const Bounds& b) {
    const int values[] = {b.x_lo, b.x_hi, b.y_lo, b.y_hi};
    for (int i = 0; i < 4; ++i) w.push_back({static_cast<uint16_t>(base + i), u(values[i])});
  };
  bounds(kRegLeft, t.left);
  bounds(kRegRight, t.right);
  return w;
}

// The words of one plane, in the order of their addresses.
inline std::array<uint32_t, 8> table_words(const PlaneEntry& p) {
  return {static_cast<uint32_t>(p.x0_left),
          static_cast<uint32_t>(p.y0_left),
          static_cast<uint32_t>(p.x0_right),
          static_cast<uint32_t>(p.y0_right),
          p.dx_left,
          p.dy_left,
          p.dx_right,
          p.dy_right};
}
inline std::vector<RegisterWrite> table_writes(const std::vector<PlaneEntry>& table) {
  std::vector<RegisterWrite> w;
  for (size_t k = 0; k < table.size(); ++k) {
    const auto fields = table_words(table[k]);
    for (size_t f = 0; f < 8; ++f) w.push_back({static_cast<uint16_t>(kRegTable + 8 * k + f), fields[f]});
  }
  return w;
}

// s_pix_tdata = {right, left}
inline uint32_t pixel_beat(const Config& c, unsigned left, unsigned right) { return right << c.pix_bits | left; }
// Pixel i of both windows, raster order.
inline uint32_t pixel_beat(const Config& c, const Pixels& left, const Pixels& right, size_t i) {
  return pixel_beat(c, left.data[i], right.data[i]);
}

inline void unpack_beat(const Config& c, uint32_t beat, uint16_t& left, uint16_t& right) {
  left = static_cast<uint16_t>(beat & ((1u << c.pix_bits) - 1));
  right = static_cast<uint16_t>(beat >> c.pix_bits);
}

// m_map_tdata = {mask(3:0), plane, frac, v}
inline MapCell unpack_cell(const Config& c, uint64_t word) {
  auto take = [&word](int bits) {
    const uint64_t value = word & ((uint64_t{1} << bits) - 1);
    word >>= bits;
    return static_cast<uint16_t>(value);
  };
  MapCell cell;
  cell.v = take(c.mncc_bits);
  cell.frac = take(c.frac_bits);
  cell.plane = take(c.plane_bits());
  cell.mask = static_cast<uint8_t>(take(4));
  return cell;
}
inline uint64_t pack_cell(const Config& c, const MapCell& cell) {
  uint64_t word = cell.mask;
  word = word << c.plane_bits() | cell.plane;
  word = word << c.frac_bits | cell.frac;
  return word << c.mncc_bits | cell.v;
}

// "config, short" and so on; "none" for 0.
inline std::string error_names(unsigned bits) {
  static const char* const names[] = {"config", "table", "short", "long", "window", "address", "busy", "upset"};
  std::string text;
  for (unsigned i = 0; i < 8; ++i)
    if (bits >> i & 1) text += (text.empty() ? "" : ", ") + std::string(names[i]);
  return text.empty() ? "none" : text;
}

}  // namespace psweep::golden
