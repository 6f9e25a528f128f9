// SPDX-License-Identifier: Apache-2.0
// From rig and planes to what the engine wants: plane table, tiles, windows; and back from map cells to depths.
// Every engine that works in the integer contract (fixed, rtl, networked) uses exactly this code on both sides, so
// their output files are the same to the byte. Paper, sections 3.1 and 4.2; docs/planner.md.
//
// Coordinates: map cells (u,v) and pixels are integers at their centres. `Absolute` positions count from pixel (0,0) of
// the image, `window` positions from the first loaded pixel. sfix(13,19) throughout.
// Errors: InputError with the name of the field (rig.left.fx, planes, tile width, ...).
#pragma once
#include <vector>

#include "contract/config.hpp"
#include "contract/tile.hpp"
#include "core/planes.hpp"
#include "core/result.hpp"
#include "core/rig.hpp"

namespace psweep {

// Everything that decides the content of the map. The format's sizes (img_*, plane_*) decide only how it is tiled.
struct SweepSetup {
  Rig rig;
  PlaneSpacing spacing;
  golden::Config format;
  int threshold = 0;  // units of V: 0 .. 2^mncc_bits - 1
};

// Threshold register for a correlation 0 .. 1: the smallest V that is at least `correlation`, at most all ones.
int threshold_for(const golden::Config& format, double correlation);

// Throws InputError if a field of the setup is out of its range. plane_table() and plan_tiles() call it.
void check_setup(const SweepSetup& setup);

// Position of map cell (0,0) in absolute image coordinates and the step per cell, for every plane; rounded to nearest.
// All planes have the same steps and the same y (parallel cameras). Throws InputError naming plane and field if a
// sample that some cell needs leaves sfix(13,19), or a step leaves ufix(2,19).
std::vector<golden::PlaneEntry> plane_table(const SweepSetup& setup);

// Cells whose window lies inside both images at one plane: u_lo <= u < u_hi, v_lo <= v < v_hi. Empty if lo >= hi.
struct CellRange {
  int u_lo = 0, u_hi = 0, v_lo = 0, v_hi = 0;
  bool empty() const { return u_lo >= u_hi || v_lo >= v_hi; }
};
CellRange valid_cells(const SweepSetup& setup, const golden::PlaneEntry& plane);

struct PlacedTile {
  int u0 = 0, v0 = 0;                                    // map cell of the tile's first cell
  int left_x = 0, left_y = 0, right_x = 0, right_y = 0;  // absolute position of the windows' first pixels
  golden::TileJob job;
};

struct Plan {
  std::vector<golden::PlaneEntry> table;
  int u_lo = 0, u_hi = 0, v_lo = 0, v_hi = 0;  // cells that can be valid at some plane, half open; all others: outside
  int max_win_cols = 0, max_win_rows = 0;      // largest window of a tile
  std::vector<PlacedTile> tiles;               // raster order, no two overlap
};

// Cuts the cells that can be valid into tiles of at most tile_cols x tile_rows. As few tiles per axis as possible;
// either all full but the last, or all as equal as possible: what fits format.img_cols/rows, then what takes fewer
// clocks. Throws InputError if a tile exceeds format.plane_cols/rows or a window exceeds format.img_cols/rows.
Plan plan_tiles(const SweepSetup& setup, int tile_cols, int tile_rows);

// Image buffer for the cheapest way to cut tiles of this size, whatever the format offers. A smaller buffer may do
// when equal tiles fit where full ones do not: plan_tiles() finds out.
struct BufferSize {
  int img_cols = 0, img_rows = 0;      // even, as the generics want them
  int plane_cols = 0, plane_rows = 0;  // largest tile of the plan
};
BufferSize required_buffer(const SweepSetup& setup, int tile_cols, int tile_rows);

// Widest and highest tile that setup.format can serve (a tile of this size always passes plan_tiles). Throws
// InputError if not even one cell fits.
struct TileSize {
  int cols = 0, rows = 0;
};
TileSize largest_tile(const SweepSetup& setup);

// Window of an image; pixels beyond the border repeat it.
golden::Pixels cut_window(const Gray& image, int x, int y, int cols, int rows);

// Clocks of all tiles one after the other: every pixel loaded, sample swept and cell sent takes one. Filling of
// pipelines (golden/control.hpp) and stalls of the streams come on top.
uint64_t plan_clocks(const golden::Config& format, const Plan& plan);

// Puts the cells of one tile (raster order) into the map. blank_map(): every cell outside.
Image<golden::MapCell> blank_map(const Rig& rig);
void place_cells(const PlacedTile& tile, const std::vector<golden::MapCell>& cells, Image<golden::MapCell>& map);
// The whole map from the cells of all tiles, in the order of plan.tiles.
Image<golden::MapCell> assemble(const Rig& rig, const Plan& plan,
                                const std::vector<std::vector<golden::MapCell>>& cells);

// Map words to metres: position = plane - 1/2 + (frac + 1/2) / 2^frac_bits (without the fraction where the winner is
// no local maximum: it means nothing there), mncc = v / 2^mncc_bits, depth only where mask == 0.
DepthResult to_result(const SweepSetup& setup, const Image<golden::MapCell>& map);

}  // namespace psweep
