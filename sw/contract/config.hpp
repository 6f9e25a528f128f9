// SPDX-License-Identifier: Apache-2.0
// The numeric contract's parameters (psweep_pkg.vhd has the same constants, psweep.vhd the same generics) and
// the run-time description of one tile. Prose: docs/numeric_contract.md.
#pragma once
#include <algorithm>
#include <cstdint>

#include "contract/fields.hpp"

namespace psweep::golden {

// Positions are sfix(13,19): 32 bits, -4096 .. 4096 px, 19 fraction bits. Steps are ufix(2,19) in a 32-bit word.
constexpr int kPosFrac = 19;
constexpr int kStepBits = 21;
// A row of samples takes at least this many clocks (short rows are padded with idle clocks), so that the feedback
// loops of column sums and map close in time. Only tiles with width + window - 1 < 8 feel it.
constexpr int kRowMin = 8;

// Generics of entity psweep: fixed when the hardware is built. The members: contract/fields.hpp.
struct Config : EngineFields {
  int sample_bits() const { return pix_bits + interp_frac; }  // interpolated pixel, ufix(pix_bits, interp_frac)
  int norm_bits() const { return mncc_bits + 3; }             // operands of the MNCC divider
  int plane_bits() const {                                    // plane index in a cell
    int b = 1;
    while ((1 << b) < planes) ++b;
    return b;
  }
};

// One line of the plane table: 8 words of 32 bits, in this order.
// Position of sample (i,j), i = 0 .. cols-1, j = 0 .. rows-1 (see TileJob): x = x0 + tx + i*dx, y = y0 + ty + j*dy,
// computed modulo 2^32 on the integer representation.
struct PlaneEntry {
  int32_t x0_left = 0, y0_left = 0, x0_right = 0, y0_right = 0;   // sfix(13,19)
  uint32_t dx_left = 0, dy_left = 0, dx_right = 0, dy_right = 0;  // ufix(2,19)
};

// Integer bounds of the real image, in coordinates of the loaded window (first column/row, last column/row).
struct Bounds {
  int x_lo = 0, x_hi = 0, y_lo = 0, y_hi = 0;  // each -4096 .. 4095
};

// Run-time description of one tile: configuration registers of entity psweep.
struct TileJob {
  int tile_cols = 0, tile_rows = 0;                              // cells of the map, 1 .. plane_cols / plane_rows
  int win_cols = 0, win_rows = 0;                                // pixels loaded per image, 1 .. img_cols / img_rows
  int planes = 0;                                                // planes to sweep, 1 .. Config::planes
  int threshold = 0;                                             // V at least this is accepted, 0 .. 2^mncc_bits - 1
  int32_t tx_left = 0, ty_left = 0, tx_right = 0, ty_right = 0;  // sfix(13,19), added to the plane's start
  Bounds left, right;
};

// Samples swept per row / rows of samples per plane: the tile and its skirt of M-1.
inline int sweep_cols(const Config& c, const TileJob& t) { return t.tile_cols + c.window - 1; }
inline int sweep_rows(const Config& c, const TileJob& t) { return t.tile_rows + c.window - 1; }

// What the engine sends per cell, raster order of the tile.
struct MapCell {
  uint16_t plane = 0;  // index of the best plane
  uint16_t frac = 0;   // position = plane - 1/2 + (frac + 1/2) / 2^frac_bits; meaningful where mask == 0
  uint16_t v = 0;      // best MNCC, ufix(0,mncc_bits)
  uint8_t mask = 0;    // bits 0-3: outside, no variance, below threshold, not a local maximum

  bool operator==(const MapCell& o) const { return plane == o.plane && frac == o.frac && v == o.v && mask == o.mask; }
  bool operator!=(const MapCell& o) const { return !(*this == o); }
};

}  // namespace psweep::golden
