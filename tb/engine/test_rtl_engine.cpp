// SPDX-License-Identifier: Apache-2.0
// The library behind --engine rtl: rendered pairs through the large configurations in tiles and in full-width bands,
// equal to the model cell by cell and to each other; choice of a configuration; errors; threads.
#include <mutex>

#include "core/error.hpp"
#include "engine/configurations.hpp"
#include "engine/stimulus.hpp"
#include "golden/control.hpp"
#include "golden/psweep.hpp"
#include "plan/planner.hpp"
#include "rtl/registers.hpp"
#include "scene/scene.hpp"
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
    return rtl::TileInput{t.job, cut_window(scene.left, t.left_x, t.left_y, t.job.win_cols, t.job.win_rows),
                          cut_window(scene.right, t.right_x, t.right_y, t.job.win_cols, t.job.win_rows)};
  };
  int done = 0;
  rtl::run_tiles(
      c, plan.table, static_cast<int>(plan.tiles.size()), threads, input, [&](int i, const rtl::TileOutput& out) {
        ++done;
        const PlacedTile& t = plan.tiles[static_cast<size_t>(i)];
        const rtl::TileInput in = input(i);
        const auto model = golden::run_tile(c.config, t.job, plan.table, in.left, in.right);
        CHECK(out.window_errors == 0);
        REQUIRE(out.cells.size() == model.cells.size());
        for (size_t at = 0; at < out.cells.size(); ++at)
          board.compare(rtl::pack_cell(c.config, out.cells[at]), rtl::pack_cell(c.config, model.cells[at]),
                        {i, -1, static_cast<int>(at) % t.job.tile_cols, static_cast<int>(at) / t.job.tile_cols},
                        out.clocks);
        place_cells(t, out.cells, map);
      });
  CHECK(done == static_cast<int>(plan.tiles.size()));
  return map;
}

}  // namespace

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
  StimulusMaker maker(c.config, test_seed());
  rtl::RtlEngine engine(c);
  Scoreboard cells("cell");
  for (int tile = 0; tile < 40; ++tile) {
    const int planes = tile == 0 ? c.config.planes : 1 + maker.below(std::min(c.config.planes, 40));
    const Stimulus s = maker.make(static_cast<Texture>(tile % 4), static_cast<Geometry>(maker.below(4)),
                                  1 + maker.below(c.config.plane_cols), 1 + maker.below(c.config.plane_rows), planes);
    engine.set_table(s.table);
    const auto out = engine.run(s.job, s.left, s.right);
    const auto model = golden::run_tile(c.config, s.job, s.table, s.left, s.right);
    REQUIRE(out.cells.size() == model.cells.size());
    for (size_t at = 0; at < out.cells.size(); ++at)
      cells.compare(rtl::pack_cell(c.config, out.cells[at]), rtl::pack_cell(c.config, model.cells[at]),
                    {tile, -1, static_cast<int>(at) % s.job.tile_cols, static_cast<int>(at) / s.job.tile_cols},
                    out.clocks);
    CHECK(out.clocks == golden::engine_clocks(c.config, s.job));
  }
  INFO(cells.report());
  CHECK(cells.ok());
}

TEST_CASE("rtl engine: clocks and errors of a tile, table kept from tile to tile") {
  const rtl::Configuration& c = configuration("tiny");
  StimulusMaker maker(c.config, test_seed());
  rtl::RtlEngine engine(c);
  const Stimulus s = maker.make(Texture::kStereo, Geometry::kInside, 16, 12, 12);
  engine.set_table(s.table);
  const auto model = golden::run_tile(c.config, s.job, s.table, s.left, s.right);
  const auto first = engine.run(s.job, s.left, s.right);
  const auto second = engine.run(s.job, s.left, s.right);
  CHECK(first.cells == model.cells);
  CHECK(second.cells == model.cells);
  CHECK(first.clocks == second.clocks);
  CHECK(first.all_clocks > second.all_clocks + 8 * 12 - 1);  // the table is written once
  CHECK(first.errors == 0);

  const Stimulus lost = maker.make(Texture::kStereo, Geometry::kLost, 16, 12, 12);
  engine.set_table(lost.table);
  const auto out = engine.run(lost.job, lost.left, lost.right);
  const auto lost_model = golden::run_tile(c.config, lost.job, lost.table, lost.left, lost.right);
  CHECK(out.cells == lost_model.cells);
  CHECK(out.errors == golden::kErrorWindow);
  CHECK(out.window_errors == lost_model.window_errors);
}

TEST_CASE("rtl engine: a refused tile throws with the reason, the engine works on") {
  const rtl::Configuration& c = configuration("tiny");
  StimulusMaker maker(c.config, test_seed());
  rtl::RtlEngine engine(c);
  const Stimulus s = maker.make(Texture::kStereo, Geometry::kInside, 8, 8, 5);
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
  StimulusMaker maker(c.config, test_seed());
  const Stimulus s = maker.make(Texture::kStereo, Geometry::kInside, 16, 12, 6);
  const auto model = golden::run_tile(c.config, s.job, s.table, s.left, s.right);
  for (int threads : {1, 3, 0}) {
    std::vector<int> seen(7, 0);
    std::atomic<uint64_t> clocks{0};
    uint64_t sum = 0;
    rtl::run_tiles(
        c, s.table, 7, threads,
        [&](int) {
          return rtl::TileInput{s.job, s.left, s.right};
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
  auto fail = [&](int i) -> rtl::TileInput {
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
  CHECK_THAT(rtl::build_command(need), contains("make config NAME=w9_256x130_p301_8_8_2_13_8 "
                                                "WINDOW=9 PLANE_COLS=256 PLANE_ROWS=130 IMG_COLS=102"));
}
