// SPDX-License-Identifier: Apache-2.0
// Words on the streams of entity psweep (docs/interfaces.md): register writes of a tile and of the plane table, map
// cells, names of the error bits. Addresses and bits themselves: golden/control.hpp.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "golden/control.hpp"

namespace psweep::golden {

struct RegisterWrite {
  uint16_t address;
  uint32_t value;
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
