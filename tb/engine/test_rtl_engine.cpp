// SPDX-License-Identifier: Apache-2.0
// The library behind --engine rtl: rendered pairs through the large configurations in tiles and in full-width bands,
// equal to the model cell by cell and to each other; choice of a configuration; errors; threads.
#include <mutex>

#include "contract/registers.hpp"
#include "core/error.hpp"
#include "engine/configurations.hpp"
#include "golden/control.hpp"
#include "golden/psweep.hpp"
#include "plan/planner.hpp"
#include "reference/reference.hpp"
#include "scene/scene.hpp"
#include "scene/stimulus.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

constexpr int kSize = 128, kPlanes = 24;

// Whole map through the RTL in tiles of the given size; every tile is compared with the model.
Image<golden::MapCell> through_rtl(const char* name, const Scene& scene, int tile_cols, int tile_rows, int threads,
                                   Scoreboard& board) {
  const rtl::Configuration& c = configuration(name);
  SweepSetup setup{scene.rig, {kPlanes, 1.0, 4.0}, c.config, threshold_for(c.config, 0.85)};
  const Plan plan = plan_tiles(setup, tile_cols, tile_rows);
  Image<golden::MapCell> map = blank_map(scene.rig);
  auto input = [&](int i) {
    const PlacedTile& t = plan.tiles[static_cast<size_t>(i)];
    return golden::TileInput{t.job, cut_window(scene.left, t.left_x, t.left_y, t.job.win_cols, t.job.win_rows),
                             cut_window(scene.right, t.right_x, t.right_y, t.job.win_cols, t.job.win_rows)};
  };
  int done = 0;
  rtl::run_tiles(
      c, plan.table, static_cast<int>(plan.tiles.size()), threads, input, [&](int i, const rtl::TileOutput& out) {
        ++done;
        const PlacedTile& t = plan.tiles[static_cast<size_t>(i)];
        const golden::TileInput in = input(i);
        const auto model = golden::run_tile(c.config, t.job, plan.table, in.left, in.right);
        CHECK(out.window_errors == 0);
        REQUIRE(out.cells.size() == model.cells.size());
        for (size_t at = 0; at < out.cells.size(); ++at)
          board.compare(golden::pack_cell(c.config, out.cells[at]), golden::pack_cell(c.config, model.cells[at]),
                        {i, -1, static_cast<int>(at) % t.job.tile_cols, static_cast<int>(at) / t.job.tile_cols},
                        out.clocks);
        place_cells(t, out.cells, map);
      });
  CHECK(done == static_cast<int>(plan.tiles.size()));
  return map;
}

// Value of an image between its pixels; the border repeats.
template <class T>
double between(const Image<T>& image, double x, double y) {
  const double cx = std::clamp(x, 0.0, image.width - 1.001), cy = std::clamp(y, 0.0, image.height - 1.001);
  const int xi = static_cast<int>(cx), yi = static_cast<int>(cy);
  const double fx = cx - xi, fy = cy - yi;
  return (image.at(xi, yi) * (1 - fx) + image.at(xi + 1, yi) * fx) * (1 - fy) +
         (image.at(xi, yi + 1) * (1 - fx) + image.at(xi + 1, yi + 1) * fx) * fy;
}

// What the cameras of `rig`, of the size kSize x kSize, see of a scene rendered at twice that size.
Scene seen_by(const Scene& scene, const Rig& rig) {
  Scene out;
  out.rig = rig;
  auto project = [](const Camera& from, const Camera& to, int u, int v) {
    return std::pair<double, double>{(u - from.cx) * to.fx / from.fx + to.cx, (v - from.cy) * to.fy / from.fy + to.cy};
  };
  auto warp = [&](const Gray& image, const Camera& from, const Camera& to) {
    Gray result(kSize, kSize);
    for (int v = 0; v < kSize; ++v) {
      for (int u = 0; u < kSize; ++u) {
        const auto [x, y] = project(to, from, u, v);
        result.at(u, v) = static_cast<uint8_t>(std::lround(between(image, x, y)));
      }
    }
    return result;
  };
  out.left = warp(scene.left, scene.rig.left, rig.left);
  out.right = warp(scene.right, scene.rig.right, rig.right);
  out.truth = FloatImage(kSize, kSize);
  const Camera eye = rig.cyclopean(), base = scene.rig.cyclopean();
  for (int v = 0; v < kSize; ++v) {
    for (int u = 0; u < kSize; ++u) {
      const auto [x, y] = project(eye, base, u, v);
      out.truth.at(u, v) = static_cast<float>(between(scene.truth, x, y));
    }
  }
  return out;
}

}  // namespace

// A pair of any two cameras, without rectification: the map is the model's bit for bit, its planes are those that the
// float engine finds by its own projection, and the depths are about as often right as with equal cameras.
TEST_CASE("rtl engine: cameras with unequal focal lengths, principal points and row offsets") {
  const Scene large = render(SceneKind::kRocky, test_seed(), 2 * kSize, 1);
  Rig equal = large.rig;
  equal.width = equal.height = kSize;
  for (Camera* c : {&equal.left, &equal.right}) {
    c->fx /= 2, c->fy /= 2;
    c->cx = c->cy = (kSize - 1) / 2.0;
  }
  Rig focal = equal, offset = equal, all = equal;
  focal.left.fx *= 1.06, focal.left.fy *= 1.06;
  offset.left.cy += 2.37, offset.right.cx -= 3.61;
  all.left = {equal.left.fx * 1.04, equal.left.fy * 1.03, equal.left.cx + 1.83, equal.left.cy - 1.29};
  all.right = {equal.right.fx * 0.97, equal.right.fy * 0.98, equal.right.cx - 2.41, equal.right.cy + 0.77};
  struct Case {
    const char* name;
    const Rig& rig;
  };
  double right_if_equal = 0;
  for (const Case& c : {Case{"equal cameras", equal}, Case{"focal lengths", focal}, Case{"offsets", offset},
                        Case{"all unequal", all}}) {
    const Scene scene = seen_by(large, c.rig);
    Scoreboard board("cell");
    const auto map = through_rtl("tile", scene, 60, 47, 1, board);
    INFO(c.name << " seed " << test_seed() << "\n" << board.report());
    CHECK(board.ok());
    const golden::Config& format = configuration("tile").config;
    const PlaneSpacing spacing{kPlanes, 1.0, 4.0};
    const SweepSetup setup{scene.rig, spacing, format, threshold_for(format, 0.85)};
    const DepthResult rtl = to_result(setup, map);
    const DepthResult exact = run_float(scene.left, scene.right, scene.rig, spacing, format.window, 0.85);
    int both = 0, close = 0, right = 0;
    for (size_t i = 0; i < rtl.mask.data.size(); ++i) {
      if (rtl.mask.data[i] || exact.mask.data[i]) continue;
      ++both;
      close += std::abs(rtl.position.data[i] - exact.position.data[i]) < 0.1;
      right += std::abs(rtl.position.data[i] - spacing.position(scene.truth.data[i])) < 0.5;
    }
    INFO("accepted by both engines " << both << ", closer than 0.1 planes " << close << ", right to 0.5 planes "
                                     << right);
    CHECK(both > 3500);
    CHECK(close > 0.995 * both);
    const double right_share = static_cast<double>(right) / both;
    if (&c.rig == &equal) right_if_equal = right_share;
    // Pictures of 128 x 128 pixels, resampled once more: the truth itself is blurred.
    CHECK(right_share > 0.7);
    CHECK(right_share > right_if_equal - 0.15);
  }
}

TEST_CASE("rtl engine: a rendered pair in tiles and in full-width bands is the model's map") {
  const SceneKind kind = GENERATE(SceneKind::kRocky, SceneKind::kFlat);
  const Scene scene = render(kind, test_seed(), kSize, 1);
  Scoreboard tiles("cell, tiles"), bands("cell, bands");
  const auto from_tiles = through_rtl("tile", scene, 50, 41, 2, tiles);
  const auto from_bands = through_rtl("bands", scene, kSize, 30, 1, bands);
  INFO(tiles.report() << bands.report());
  CHECK(tiles.ok());
  CHECK(bands.ok());
  CHECK(from_tiles.data == from_bands.data);
  size_t accepted = 0;
  for (const auto& cell : from_tiles.data) accepted += cell.mask == 0;
  CHECK(accepted > from_tiles.data.size() / 4);
}

TEST_CASE("rtl engine: extreme formats, random tiles") {
  const char* name = GENERATE("wide", "narrow", "odd");
  INFO("configuration " << name << " seed " << test_seed());
  const rtl::Configuration& c = configuration(name);
  scene::StimulusMaker maker(c.config, test_seed());
  rtl::RtlEngine engine(c);
  Scoreboard cells("cell");
  for (int tile = 0; tile < 40; ++tile) {
    const int planes = tile == 0 ? c.config.planes : 1 + maker.below(std::min(c.config.planes, 40));
    const scene::Stimulus s =
        maker.make(static_cast<scene::Texture>(tile % 5), static_cast<scene::Geometry>(maker.below(4)),
                   1 + maker.below(c.config.plane_cols), 1 + maker.below(c.config.plane_rows), planes);
    engine.set_table(s.table);
    const auto out = engine.run(s.job, s.left, s.right);
    const auto model = golden::run_tile(c.config, s.job, s.table, s.left, s.right);
    REQUIRE(out.cells.size() == model.cells.size());
    for (size_t at = 0; at < out.cells.size(); ++at)
      cells.compare(golden::pack_cell(c.config, out.cells[at]), golden::pack_cell(c.config, model.cells[at]),
                    {tile, -1, static_cast<int>(at) % s.job.tile_cols, static_cast<int>(at) / s.job.tile_cols},
                    out.clocks);
    CHECK(out.clocks == golden::engine_clocks(c.config, s.job));
  }
  INFO(cells.report());
  CHECK(cells.ok());
}

TEST_CASE("rtl engine: clocks and errors of a tile, table kept from tile to tile") {
  const rtl::Configuration& c = configuration("tiny");
  scene::StimulusMaker maker(c.config, test_seed());
  rtl::RtlEngine engine(c);
  const scene::Stimulus s = maker.make(scene::Texture::kStereo, scene::Geometry::kInside, 16, 12, 12);
  engine.set_table(s.table);
  const auto model = golden::run_tile(c.config, s.job, s.table, s.left, s.right);
  const auto first = engine.run(s.job, s.left, s.right);
  const auto second = engine.run(s.job, s.left, s.right);
  CHECK(first.cells == model.cells);
  CHECK(second.cells == model.cells);
  CHECK(first.clocks == second.clocks);
  CHECK(first.all_clocks > second.all_clocks + 8 * 12 - 1);  // the table is written once
  CHECK(first.errors == 0);

  const scene::Stimulus lost = maker.make(scene::Texture::kStereo, scene::Geometry::kLost, 16, 12, 12);
  engine.set_table(lost.table);
  const auto out = engine.run(lost.job, lost.left, lost.right);
  const auto lost_model = golden::run_tile(c.config, lost.job, lost.table, lost.left, lost.right);
  CHECK(out.cells == lost_model.cells);
  CHECK(out.errors == golden::kErrorWindow);
  CHECK(out.window_errors == lost_model.window_errors);
}

TEST_CASE("rtl engine: a refused tile throws with the reason, the engine works on") {
  const rtl::Configuration& c = configuration("tiny");
  scene::StimulusMaker maker(c.config, test_seed());
  rtl::RtlEngine engine(c);
  const scene::Stimulus s = maker.make(scene::Texture::kStereo, scene::Geometry::kInside, 8, 8, 5);
  const auto model = golden::run_tile(c.config, s.job, s.table, s.left, s.right);
  CHECK_THROWS_WITH(engine.run(s.job, s.left, s.right), contains("errors: table"));
  engine.set_table(s.table);
  CHECK(engine.run(s.job, s.left, s.right).cells == model.cells);
  golden::TileJob bad = s.job;
  bad.tile_cols = c.config.plane_cols + 1;
  CHECK_THROWS_WITH(engine.run(bad, s.left, s.right), contains("errors: config"));
  bad = s.job;
  ++bad.win_cols;
  CHECK_THROWS_WITH(engine.run(bad, s.left, s.right), contains("the tile's window is"));
  CHECK_THROWS_WITH(engine.set_table(std::vector<golden::PlaneEntry>(static_cast<size_t>(c.config.planes) + 1)),
                    contains("the hardware has room for"));
  CHECK(engine.run(s.job, s.left, s.right).cells == model.cells);
}

TEST_CASE("rtl engine: threads change nothing, an exception in a worker comes out") {
  const rtl::Configuration& c = configuration("tiny");
  scene::StimulusMaker maker(c.config, test_seed());
  const scene::Stimulus s = maker.make(scene::Texture::kStereo, scene::Geometry::kInside, 16, 12, 6);
  const auto model = golden::run_tile(c.config, s.job, s.table, s.left, s.right);
  for (int threads : {1, 3, 0}) {
    std::vector<int> seen(7, 0);
    std::atomic<uint64_t> clocks{0};
    uint64_t sum = 0;
    rtl::run_tiles(
        c, s.table, 7, threads,
        [&](int) {
          return golden::TileInput{s.job, s.left, s.right};
        },
        [&](int i, const rtl::TileOutput& out) {
          ++seen[static_cast<size_t>(i)];
          sum += out.all_clocks;
          CHECK(out.cells == model.cells);
        },
        &clocks);
    CHECK(seen == std::vector<int>(7, 1));
    CHECK(clocks == sum);
  }
  auto fail = [&](int i) -> golden::TileInput {
    if (i == 2) throw InputError("tile 2 cannot be read");
    return {s.job, s.left, s.right};
  };
  CHECK_THROWS_WITH(rtl::run_tiles(c, s.table, 7, 2, fail, [](int, const rtl::TileOutput&) {}),
                    contains("tile 2 cannot be read"));
}

TEST_CASE("rtl engine: the smallest configuration that serves is chosen, and the command builds one that would") {
  golden::Config need = configuration("tiny").config;
  need.plane_cols = 9, need.plane_rows = 9, need.img_cols = 20, need.img_rows = 20, need.planes = 3;
  REQUIRE(rtl::find_configuration(need) != nullptr);
  CHECK(rtl::find_configuration(need)->name == "tiny");
  need = configuration("tile").config;
  CHECK(rtl::find_configuration(need)->name == "tile");
  for (int golden::Config::*field :
       {&golden::Config::window, &golden::Config::pix_bits, &golden::Config::weight_bits, &golden::Config::interp_frac,
        &golden::Config::mncc_bits, &golden::Config::frac_bits}) {
    golden::Config other = need;
    other.*field = 5;
    CHECK(rtl::find_configuration(other) == nullptr);
  }
  for (int golden::Config::*field : {&golden::Config::plane_rows, &golden::Config::img_rows, &golden::Config::planes}) {
    golden::Config other = need;
    ++(other.*field);
    CHECK(rtl::find_configuration(other) == nullptr);
  }
  need.window = 9, need.img_cols = 101;
  CHECK_THAT(rtl::build_command(need), contains("make config NAME=w9_256x130_p301_8_8_2_13_8 IMG_COLS=102 IMG_ROWS=144 "
                                                "PLANE_COLS=256 PLANE_ROWS=130 PLANES=301 WINDOW=9 PIX_BITS=8"));
}
