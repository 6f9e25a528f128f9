// SPDX-License-Identifier: Apache-2.0
// one_tile CONFIGURATION PLANES [COLS ROWS] [SEED]: one tile of a built configuration, its largest unless told
// otherwise, with a stereo texture: every cell and the clocks are compared with the bit-true model. Exit code 1 if
// anything differs. For sizes that are too long for the regression (scripts/large.sh).
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "contract/registers.hpp"
#include "fast/fast.hpp"
#include "golden/control.hpp"
#include "scene/stimulus.hpp"
#include "support/scoreboard.hpp"
#include "verilated/rtl_engine.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

const rtl::Configuration& configuration(const std::string& name) {
  std::string all;
  for (const auto& c : rtl::configurations()) {
    if (c.name == name) return c;
    all += " " + c.name;
  }
  throw std::runtime_error("configuration " + name + " was not built, but these:" + all);
}

int run(int argc, char** argv) {
  const rtl::Configuration& c = configuration(argv[1]);
  auto argument = [&](int at, int fallback, int lo, int hi, const char* name) {
    const int value = argc > at ? std::atoi(argv[at]) : fallback;
    if (value < lo || value > hi)
      throw std::runtime_error(std::string(name) + " = " + std::to_string(value) + ", must be " + std::to_string(lo) +
                               " .. " + std::to_string(hi));
    return value;
  };
  const int planes = argument(2, c.config.planes, 1, c.config.planes, "PLANES");
  const int cols = argument(3, c.config.plane_cols, 1, c.config.plane_cols, "COLS");
  const int rows = argument(4, c.config.plane_rows, 1, c.config.plane_rows, "ROWS");
  scene::StimulusMaker maker(c.config, static_cast<uint32_t>(argument(5, 1, 0, 1 << 30, "SEED")));
  const scene::Stimulus s = maker.make(scene::Texture::kStereo, scene::Geometry::kInside, cols, rows, planes);
  const uint64_t clocks = golden::engine_clocks(c.config, s.job);
  std::printf("%s: %dx%d cells, %d planes, window %d, images %dx%d: %.3f M clocks\n", c.name.c_str(), cols, rows,
              planes, c.config.window, s.job.win_cols, s.job.win_rows, static_cast<double>(clocks) / 1e6);
  std::fflush(stdout);
  const auto model = run_tile_fast(c.config, s.job, s.table, s.left, s.right);
  rtl::RtlEngine engine(c);
  engine.set_table(s.table);
  const auto start = std::chrono::steady_clock::now();
  const auto out = engine.run(s.job, s.left, s.right);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  Scoreboard cells("cell");
  size_t winners = 0;
  for (size_t at = 0; at < out.cells.size() && at < model.cells.size(); ++at) {
    cells.compare(golden::pack_cell(c.config, out.cells[at]), golden::pack_cell(c.config, model.cells[at]),
                  {0, -1, static_cast<int>(at) % cols, static_cast<int>(at) / cols}, out.clocks);
    winners += model.cells[at].v > 0;
  }
  const bool ok = cells.ok() && out.cells.size() == model.cells.size() && out.clocks == clocks && winners > 0;
  std::printf("%s\n%zu cells with a winner, %llu clocks (formula: %llu), %.2f M clocks/s: %s\n", cells.report().c_str(),
              winners, static_cast<unsigned long long>(out.clocks), static_cast<unsigned long long>(clocks),
              static_cast<double>(out.clocks) / seconds / 1e6, ok ? "equal" : "DIFFERENT");
  return ok ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: one_tile CONFIGURATION [PLANES [COLS ROWS [SEED]]]\n");
    return 2;
  }
  try {
    return run(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "one_tile: %s\n", e.what());
    return 2;
  }
}
