// SPDX-License-Identifier: Apache-2.0
// Planner: the map does not depend on the tiling, planned windows always suffice, wrong rigs are named.
#include <cmath>
#include <functional>
#include <random>
#include <string>

#include "core/error.hpp"
#include "golden/psweep.hpp"
#include "plan/planner.hpp"
#include "support/catch.hpp"

using namespace psweep;

namespace {

SweepSetup small_setup(int width = 40, int height = 30, int planes = 9) {
  SweepSetup s;
  s.rig.width = width;
  s.rig.height = height;
  s.rig.left = s.rig.right = {1.07 * width, 1.07 * width, (width - 1) / 2.0, (height - 1) / 2.0};
  s.rig.baseline = 0.2;
  s.spacing = {planes, 1.0, 4.0};
  s.format.window = 5;
  s.format.planes = 16;
  s.format.plane_cols = s.format.plane_rows = 64;
  s.format.img_cols = s.format.img_rows = 80;
  s.threshold = threshold_for(s.format, 0.6);
  return s;
}

// Noise with some correlation between the images, and flat patches, so that every kind of cell occurs.
struct Pair {
  Gray left, right;
};
Pair noise_pair(const SweepSetup& s, unsigned seed) {
  std::mt19937 random(seed);
  Pair p{Gray(s.rig.width, s.rig.height), Gray(s.rig.width, s.rig.height)};
  const int shift = s.rig.width / 10;
  for (auto& v : p.left.data) v = static_cast<uint8_t>(random() % 256);
  for (int y = 0; y < s.rig.height; ++y) {
    for (int x = 0; x < s.rig.width; ++x) {
      const int source = std::min(x + shift, s.rig.width - 1);
      p.right.at(x, y) = static_cast<uint8_t>((p.left.at(source, y) * 7 + random() % 256) / 8);
      if (x > s.rig.width / 2 && y > s.rig.height / 2) p.left.at(x, y) = p.right.at(x, y) = 77;
    }
  }
  return p;
}

// The contract said in one breath: one "tile" with the whole image as window and every cell swept, no planner.
Image<golden::MapCell> whole_map(const SweepSetup& s, const Pair& p) {
  const int half = s.format.window / 2;
  const auto table = plane_table(s);
  golden::TileJob job;
  job.tile_cols = s.rig.width;
  job.tile_rows = s.rig.height;
  job.win_cols = s.rig.width + 1;
  job.win_rows = s.rig.height + 1;
  job.planes = s.spacing.planes;
  job.threshold = s.threshold;
  const int round = 1 << (golden::kPosFrac - s.format.weight_bits - 1);
  job.tx_left = -half * static_cast<int>(table[0].dx_left) + round;
  job.ty_left = -half * static_cast<int>(table[0].dy_left) + round;
  job.tx_right = -half * static_cast<int>(table[0].dx_right) + round;
  job.ty_right = -half * static_cast<int>(table[0].dy_right) + round;
  job.left = job.right = {0, s.rig.width - 1, 0, s.rig.height - 1};
  const auto result = golden::run_tile(s.format, job, table, cut_window(p.left, 0, 0, job.win_cols, job.win_rows),
                                       cut_window(p.right, 0, 0, job.win_cols, job.win_rows));
  REQUIRE(result.window_errors == 0);
  Image<golden::MapCell> map(s.rig.width, s.rig.height);
  map.data = result.cells;
  return map;
}

// The same through the planner. Every tile is checked against the format on the way.
Image<golden::MapCell> tiled_map(const SweepSetup& s, const Pair& p, int cols, int rows) {
  const Plan plan = plan_tiles(s, cols, rows);
  std::vector<std::vector<golden::MapCell>> cells;
  for (const auto& t : plan.tiles) {
    REQUIRE(t.job.tile_cols >= 1);
    REQUIRE(t.job.tile_cols <= cols);
    REQUIRE(t.job.tile_rows >= 1);
    REQUIRE(t.job.tile_rows <= rows);
    REQUIRE(t.job.win_cols <= s.format.img_cols);
    REQUIRE(t.job.win_rows <= s.format.img_rows);
    const auto result = golden::run_tile(s.format, t.job, plan.table,
                                         cut_window(p.left, t.left_x, t.left_y, t.job.win_cols, t.job.win_rows),
                                         cut_window(p.right, t.right_x, t.right_y, t.job.win_cols, t.job.win_rows));
    REQUIRE(result.window_errors == 0);
    cells.push_back(result.cells);
  }
  return assemble(s.rig, plan, cells);
}

size_t differing(const Image<golden::MapCell>& a, const Image<golden::MapCell>& b) {
  REQUIRE(a.data.size() == b.data.size());
  REQUIRE(!a.data.empty());
  size_t count = 0;
  for (size_t i = 0; i < a.data.size(); ++i) count += a.data[i] != b.data[i];
  return count;
}

std::string error_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& e) {
    return e.what();
  }
  return "no error";
}

bool mentions(const std::string& message, const std::vector<std::string>& words) {
  UNSCOPED_INFO("message: " << message);
  for (const auto& word : words) {
    if (message.find(word) == std::string::npos) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("the map is the same for every tiling") {
  SweepSetup s = small_setup();
  SECTION("rectified") {}
  SECTION("principal points apart, row offset") {
    s.rig.left.cx += 1.3;
    s.rig.right.cx -= 0.45;
    s.rig.left.cy += 0.77;
  }
  SECTION("unequal focal lengths") {
    s.rig.left.fx *= 1.21;
    s.rig.left.fy *= 1.19;
    s.rig.right.cy -= 2.3;
  }
  SECTION("large steps") {
    s.rig.left.fx *= 0.4;
    s.rig.right.fx *= 1.7;
  }
  SECTION("coarse weights, large window, one plane") {
    s.format.weight_bits = 1;
    s.format.window = 11;
    s.spacing = {1, 2.0, 2.0};
  }
  const Pair p = noise_pair(s, 3);
  const auto whole = whole_map(s, p);
  size_t kinds[5] = {};
  for (const auto& cell : whole.data) {
    ++kinds[cell.mask == 0 ? 4 : cell.mask & 1 ? 0 : cell.mask & 2 ? 1 : cell.mask & 4 ? 2 : 3];
  }
  CHECK(kinds[0] > 0);
  CHECK(kinds[0] < whole.data.size());
  const int sizes[][2] = {{64, 64}, {40, 3}, {3, 30}, {40, 1}, {1, 30}, {7, 5}, {5, 5}, {1, 1}, {13, 8}, {31, 17}};
  for (const auto& size : sizes) {
    CAPTURE(size[0], size[1]);
    CHECK(differing(tiled_map(s, p, size[0], size[1]), whole) == 0);
  }
}

TEST_CASE("tiles cover the cells that can be valid exactly once") {
  SweepSetup s = small_setup(53, 37);
  const Plan plan = plan_tiles(s, 11, 6);
  Image<int> covered(s.rig.width, s.rig.height);
  for (const auto& t : plan.tiles) {
    for (int j = 0; j < t.job.tile_rows; ++j) {
      for (int i = 0; i < t.job.tile_cols; ++i) ++covered.at(t.u0 + i, t.v0 + j);
    }
  }
  REQUIRE(!plan.tiles.empty());
  for (int v = 0; v < s.rig.height; ++v) {
    for (int u = 0; u < s.rig.width; ++u) {
      const bool inside = u >= plan.u_lo && u < plan.u_hi && v >= plan.v_lo && v < plan.v_hi;
      CHECK(covered.at(u, v) == (inside ? 1 : 0));
    }
  }
}

TEST_CASE("every range of valid cells is what the bit-true model says") {
  SweepSetup s = small_setup();
  s.rig.left.cx += 0.37;
  s.rig.right.cy -= 1.61;
  s.rig.right.fx *= 1.08;
  const Pair p = noise_pair(s, 5);
  const auto table = plane_table(s);
  golden::TileJob job = plan_tiles(s, 64, 64).tiles.at(0).job;
  const PlacedTile tile = plan_tiles(s, 64, 64).tiles.at(0);
  int compared = 0;
  golden::run_tile(s.format, job, table, cut_window(p.left, tile.left_x, tile.left_y, job.win_cols, job.win_rows),
                   cut_window(p.right, tile.right_x, tile.right_y, job.win_cols, job.win_rows),
                   [&](int k, const golden::PlaneTrace& trace, const std::vector<golden::Cell>&) {
                     const CellRange r = valid_cells(s, table[k]);
                     for (int j = 0; j < job.tile_rows; ++j) {
                       for (int i = 0; i < job.tile_cols; ++i) {
                         const int u = tile.u0 + i, v = tile.v0 + j;
                         const bool expected = u >= r.u_lo && u < r.u_hi && v >= r.v_lo && v < r.v_hi;
                         compared += 1;
                         if (trace.similarity[static_cast<size_t>(j) * job.tile_cols + i].valid != expected) {
                           FAIL("plane " << k << " cell " << u << "," << v);
                         }
                       }
                     }
                   });
  CHECK(compared == job.tile_cols * job.tile_rows * job.planes);
}

TEST_CASE("table entries are the projection of the paper's section 3.1") {
  SweepSetup s = small_setup();
  s.rig.left.fx *= 1.1;
  s.rig.right.cy += 2.5;
  const auto table = plane_table(s);
  const Camera eye = s.rig.cyclopean();
  REQUIRE(table.size() == static_cast<size_t>(s.spacing.planes));
  for (int k = 0; k < s.spacing.planes; ++k) {
    const double z = s.spacing.depth(k);
    for (const int u : {0, 7, s.rig.width - 1}) {
      for (const int v : {0, 11, s.rig.height - 1}) {
        const double x = (u - eye.cx) * z / eye.fx, y = (v - eye.cy) * z / eye.fy;
        const double unit = std::ldexp(1.0, -golden::kPosFrac);
        const double tolerance = unit * (1 + std::max(u, v)) / 2;
        auto at = [&](int32_t start, uint32_t step, int n) { return unit * (start + static_cast<double>(step) * n); };
        const Camera &l = s.rig.left, &r = s.rig.right;
        const double half = s.rig.baseline / 2;
        CHECK(std::abs(at(table[k].x0_left, table[k].dx_left, u) - (l.fx * (x + half) / z + l.cx)) <= tolerance);
        CHECK(std::abs(at(table[k].x0_right, table[k].dx_right, u) - (r.fx * (x - half) / z + r.cx)) <= tolerance);
        CHECK(std::abs(at(table[k].y0_left, table[k].dy_left, v) - (l.fy * y / z + l.cy)) <= tolerance);
        CHECK(std::abs(at(table[k].y0_right, table[k].dy_right, v) - (r.fy * y / z + r.cy)) <= tolerance);
      }
    }
  }
}

TEST_CASE("the largest tile of a format fits, the next one does not") {
  SweepSetup s = small_setup(60, 44);
  s.format.img_cols = 40;
  s.format.img_rows = 20;
  const TileSize most = largest_tile(s);
  REQUIRE(most.cols > 1);
  REQUIRE(most.rows > 1);
  CHECK_NOTHROW(plan_tiles(s, most.cols, most.rows));
  const BufferSize fits = required_buffer(s, most.cols, most.rows);
  CHECK(fits.img_cols <= 40);
  CHECK(fits.img_rows <= 20);
  const std::string wide = error_of([&] { plan_tiles(s, 64, most.rows); });
  CHECK(mentions(wide, {"tile width", "img_cols"}));
  const std::string high = error_of([&] { plan_tiles(s, most.cols, 64); });
  CHECK(mentions(high, {"tile height", "img_rows"}));
  s.format.plane_cols = 10;
  s.format.plane_rows = 9;
  CHECK(largest_tile(s).cols == 10);
  CHECK(mentions(error_of([&] { plan_tiles(s, 11, 5); }), {"tile width", "plane_cols"}));
  CHECK(mentions(error_of([&] { plan_tiles(s, 5, 10); }), {"tile height", "plane_rows"}));
  CHECK(mentions(error_of([&] { plan_tiles(s, 0, 5); }), {"tile width"}));
  s.format.img_cols = 6;
  CHECK(mentions(error_of([&] { largest_tile(s); }), {"img_cols"}));
}

TEST_CASE("wrong setups name their field") {
  auto error_after = [](auto change) {
    SweepSetup s = small_setup();
    change(s);
    return error_of([&] { plan_tiles(s, 8, 8); });
  };
  CHECK(error_after([](SweepSetup&) {}) == "no error");
  CHECK(mentions(error_after([](SweepSetup& s) { s.rig.left.fx = 0; }), {"left.fx"}));
  CHECK(mentions(error_after([](SweepSetup& s) { s.rig.right.fy = std::nan(""); }), {"right.fy"}));
  CHECK(mentions(error_after([](SweepSetup& s) { s.rig.right.cx = INFINITY; }), {"right.cx"}));
  CHECK(mentions(error_after([](SweepSetup& s) { s.rig.baseline = 0; }), {"baseline"}));
  CHECK(mentions(error_after([](SweepSetup& s) { s.rig.width = 5000; }), {"image width"}));
  CHECK(mentions(error_after([](SweepSetup& s) { s.rig.height = 0; }), {"image height"}));
  CHECK(mentions(error_after([](SweepSetup& s) { s.spacing.planes = 17; }), {"planes"}));
  CHECK(mentions(error_after([](SweepSetup& s) { s.spacing.zmin = -1; }), {"zmin"}));
  CHECK(mentions(error_after([](SweepSetup& s) { s.spacing.zmax = 0.5; }), {"zmax"}));
  CHECK(mentions(error_after([](SweepSetup& s) { s.threshold = 1 << 13; }), {"threshold"}));
  CHECK(mentions(error_after([](SweepSetup& s) { s.format.window = 4; }), {"window"}));
  CHECK(mentions(error_after([](SweepSetup& s) { s.format.rectified = 2; }), {"rectified"}));
  CHECK(error_after([](SweepSetup& s) { s.format.rectified = 1; }) == "no error");
  CHECK(mentions(error_after([](SweepSetup& s) { s.format.rectified = 1, s.rig.left.cy += 0.25; }), {"rows", "cy"}));
  CHECK(mentions(error_after([](SweepSetup& s) { s.format.rectified = 1, s.rig.right.fy *= 1.01; }), {"rows", "fy"}));
  CHECK(mentions(error_after([](SweepSetup& s) { s.format.interp_frac = 9; }), {"interp_frac"}));
  // A metre of baseline seen from a centimetre: the shift leaves sfix(13,19).
  CHECK(mentions(error_after([](SweepSetup& s) { s.spacing.zmin = 0.0005; }), {"plane 0", "x0_left"}));
  CHECK(mentions(error_after([](SweepSetup& s) { s.rig.right.cy = -20000; }), {"plane 0", "y0_left"}));
  // One focal length so much longer that a cell's step passes 4 pixels cannot happen with the mean as reference
  // (the step stays below 2); a vanishing one can.
  CHECK(mentions(error_after([](SweepSetup& s) { s.rig.left.fx = 1e-6; }), {"dx_left"}));
}

TEST_CASE("images without any valid cell need no tile") {
  SweepSetup s = small_setup(4, 30);  // narrower than the window
  const Plan plan = plan_tiles(s, 8, 8);
  CHECK(plan.tiles.empty());
  for (const auto& cell : assemble(s.rig, plan, {}).data) CHECK(cell.mask == kMaskOutside);
}

TEST_CASE("a window repeats the border of its image") {
  Gray image(3, 2);
  image.data = {1, 2, 3, 4, 5, 6};
  const auto window = cut_window(image, -1, 1, 6, 3);
  CHECK(window.data == std::vector<uint16_t>{4, 4, 5, 6, 6, 6, 4, 4, 5, 6, 6, 6, 4, 4, 5, 6, 6, 6});
}

TEST_CASE("map words become metres") {
  SweepSetup s = small_setup();
  Image<golden::MapCell> map(4, 1);
  map.data[0] = {3, 128, 4096, 0};
  map.data[1] = {8, 0, 8191, kMaskNotLocal};
  map.data[2] = {0, 1, 0, kMaskNoVariance};
  map.data[3] = {2, 0, 2048, kMaskBelow};
  const DepthResult r = to_result(s, map);
  const double position = 3 - 0.5 + 128.5 / 256;
  CHECK(r.position.data[0] == static_cast<float>(position));
  CHECK(r.depth.data[0] == static_cast<float>(s.spacing.depth(position)));
  CHECK(r.mncc.data[0] == 0.5f);
  CHECK(r.position.data[1] == 8.0f);
  CHECK(std::isinf(r.depth.data[1]));
  CHECK(std::isnan(r.position.data[2]));
  CHECK(r.mncc.data[2] == 0.0f);
  CHECK(r.position.data[3] == static_cast<float>(2 - 0.5 + 0.5 / 256));
  CHECK(std::isinf(r.depth.data[3]));
  CHECK(r.mask.data == std::vector<uint8_t>{0, kMaskNotLocal, kMaskNoVariance, kMaskBelow});
}

TEST_CASE("threshold register") {
  golden::Config c;
  CHECK(threshold_for(c, 0.85) == 6964);  // 6963.2 rounded up
  CHECK(threshold_for(c, 0.5) == 4096);
  CHECK(threshold_for(c, 0) == 0);
  CHECK(threshold_for(c, 1) == 8191);
}

TEST_CASE("clocks of the paper's rig stay within their budget", "[clocks]") {
  SweepSetup s;
  s.rig.width = s.rig.height = 1120;
  s.rig.left = s.rig.right = {1200, 1200, 559.5, 559.5};
  s.rig.baseline = 0.20;
  s.spacing = {301, 1.0, 4.0};
  s.threshold = threshold_for(s.format, 0.85);
  s.format.plane_cols = 1092;
  s.format.plane_rows = 30;
  s.format.img_cols = 1122;
  s.format.img_rows = 44;
  const Plan bands = plan_tiles(s, 1092, 30);
  const uint64_t band_clocks = plan_clocks(s.format, bands);
  WARN("bands 1092x30: " << bands.tiles.size() << " tiles, window " << bands.max_win_cols << "x" << bands.max_win_rows
                         << ", " << band_clocks << " clocks");
  CHECK(band_clocks <= 530000000u);
  s.format = golden::Config{};
  s.format.img_cols = required_buffer(s, 256, 130).img_cols;
  s.format.img_rows = required_buffer(s, 256, 130).img_rows;
  const Plan tiles = plan_tiles(s, 256, 130);
  const uint64_t clocks = plan_clocks(s.format, tiles);
  WARN("tiles 256x130: " << tiles.tiles.size() << " tiles, window " << tiles.max_win_cols << "x" << tiles.max_win_rows
                         << ", " << clocks << " clocks");
  CHECK(clocks <= 440000000u);
}
