// SPDX-License-Identifier: Apache-2.0
// A small chip and a small pair for tests of the link: 40x30 pixels, whose map by the bit-true model is `expected`.
#pragma once
#include <algorithm>
#include <random>
#include <vector>

#include "golden/psweep.hpp"
#include "net/link_engine.hpp"
#include "plan/planner.hpp"

namespace psweep {

// 40x30 cells in several tiles; small chunks, so that a tile has many.
inline net::ArbiterConfig small_chip() {
  net::ArbiterConfig c;
  c.engine.img_cols = 36;
  c.engine.img_rows = 24;
  c.engine.plane_cols = 17;
  c.engine.plane_rows = 11;
  c.engine.planes = 16;
  c.engine.window = 5;
  c.clk_khz = 60000;
  c.chunk_bytes = 90;
  c.session_ms = 5000;
  return c;
}

struct Scene {
  SweepSetup setup;
  Gray left, right;
  Plan plan;
  Image<golden::MapCell> expected;

  explicit Scene(const net::ArbiterConfig& chip, uint32_t seed = 1) {
    setup.rig.width = 40;
    setup.rig.height = 30;
    setup.rig.left = setup.rig.right = {43, 43, 19.5, 14.5};
    setup.rig.baseline = 0.2;
    setup.spacing = {9, 1.0, 4.0};
    setup.format = chip.engine;
    setup.threshold = threshold_for(setup.format, 0.6);
    std::mt19937 random(seed);
    left = right = Gray(40, 30);
    for (auto& v : left.data) v = static_cast<uint8_t>(random() % 256);
    for (int y = 0; y < 30; ++y) {
      for (int x = 0; x < 40; ++x) {
        right.at(x, y) = static_cast<uint8_t>((left.at(std::min(x + 4, 39), y) * 7 + random() % 256) / 8);
        if (x > 20 && y > 15) left.at(x, y) = right.at(x, y) = 77;
      }
    }
    const TileSize size = largest_tile(setup);
    plan = plan_tiles(setup, size.cols, size.rows);
    std::vector<std::vector<golden::MapCell>> cells;
    for (size_t i = 0; i < plan.tiles.size(); ++i) {
      const golden::TileInput t = tile(static_cast<int>(i));
      cells.push_back(golden::run_tile(setup.format, t.job, plan.table, t.left, t.right).cells);
    }
    expected = assemble(setup.rig, plan, cells);
  }
  golden::TileInput tile(int i) const {
    const PlacedTile& t = plan.tiles[i];
    return {t.job, cut_window(left, t.left_x, t.left_y, t.job.win_cols, t.job.win_rows),
            cut_window(right, t.right_x, t.right_y, t.job.win_cols, t.job.win_rows)};
  }
};

}  // namespace psweep
