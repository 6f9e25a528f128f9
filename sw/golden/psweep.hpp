// SPDX-License-Identifier: Apache-2.0
// Bit-true model of entity psweep, written for clarity: one function per hardware module, in the hardware's order.
// The fast model (sw/fast) is proved equal to this one; this one is proved equal to the RTL, stage by stage.
#pragma once
#include <vector>

#include "golden/address_generator.hpp"
#include "golden/interpolation.hpp"
#include "golden/storage.hpp"
#include "golden/updating.hpp"

namespace psweep::golden {

// Every intermediate result of one plane, in the order in which the hardware produces it.
struct PlaneTrace {
  std::vector<Sample> left, right;     // sweep_cols * sweep_rows, raster
  std::vector<SampleFlags> flags;      // likewise
  std::vector<int> l, r;               // interpolated pixels, 0 where not usable
  std::vector<Similarity> similarity;  // tile_cols * tile_rows, raster
};

// Samples and MNCC of one plane over a tile.
inline PlaneTrace sweep_plane(const Config& c, const TileJob& t, const PlaneEntry& p, const Pixels& left,
                              const Pixels& right) {
  const int cols = sweep_cols(c, t), rows = sweep_rows(c, t), m = c.window;
  PlaneTrace out;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < cols; ++i) {
      const Sample sl = left_sample(c, t, p, i, j);
      const Sample sr = right_sample(c, t, p, i, j);
      const SampleFlags flags = sample_flags(sl, sr);
      out.left.push_back(sl);
      out.right.push_back(sr);
      out.flags.push_back(flags);
      out.l.push_back(flags.usable ? interpolate(c, fetch(c, left, sl), sl.fx, sl.fy) : 0);
      out.r.push_back(flags.usable ? interpolate(c, fetch(c, right, sr), sr.fx, sr.fy) : 0);
    }
  }
  // Vertical sums of M rows per column, then a horizontal running sum: O(1) a cell, as in the hardware.
  std::vector<Sums> column(cols);
  std::vector<int> column_usable(cols, 0);
  for (int j = 0; j < rows; ++j) {
    Sums window;
    int window_usable = 0;
    for (int i = 0; i < cols; ++i) {
      const size_t at = static_cast<size_t>(j) * cols + i;
      auto accumulate = [](Sums& s, int l, int r, int sign) {
        Sums d;
        d.add(l, r);
        s.add(d, sign);
      };
      accumulate(column[i], out.l[at], out.r[at], 1);
      column_usable[i] += out.flags[at].usable;
      if (j >= m) {
        const size_t old = at - static_cast<size_t>(m) * cols;
        accumulate(column[i], out.l[old], out.r[old], -1);
        column_usable[i] -= out.flags[old].usable;
      }
      auto add_column = [&](int k, int sign) {
        window.add(column[k], sign);
        window_usable += sign * column_usable[k];
      };
      add_column(i, 1);
      if (i >= m) add_column(i - m, -1);
      if (j >= m - 1 && i >= m - 1) out.similarity.push_back(mncc(c, window, window_usable == m * m));
    }
  }
  return out;
}

struct TileResult {
  std::vector<MapCell> cells;  // tile_cols * tile_rows, raster
  uint64_t window_errors = 0;  // samples inside both images but outside the loaded window, over all planes
};

// A whole tile. `observe(k, trace, cells)` is called after every plane with that plane's trace and the map words.
template <class Observer>
TileResult run_tile(const Config& c, const TileJob& t, const std::vector<PlaneEntry>& table, const Pixels& left,
                    const Pixels& right, Observer&& observe) {
  TileResult result;
  std::vector<Cell> map(static_cast<size_t>(t.tile_cols) * t.tile_rows);
  for (int k = 0; k < t.planes; ++k) {
    const PlaneTrace trace = sweep_plane(c, t, table[k], left, right);
    for (const auto& f : trace.flags) result.window_errors += f.window_error;
    for (size_t i = 0; i < map.size(); ++i) map[i] = update(c, map[i], k, trace.similarity[i]);
    observe(k, trace, map);
  }
  for (const auto& cell : map) result.cells.push_back(unload(cell, t.threshold));
  return result;
}
inline TileResult run_tile(const Config& c, const TileJob& t, const std::vector<PlaneEntry>& table, const Pixels& left,
                           const Pixels& right) {
  return run_tile(c, t, table, left, right, [](int, const PlaneTrace&, const std::vector<Cell>&) {});
}

}  // namespace psweep::golden
