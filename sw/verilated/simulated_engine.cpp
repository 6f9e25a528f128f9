// SPDX-License-Identifier: Apache-2.0
#include "verilated/simulated_engine.hpp"

#include <atomic>
#include <chrono>
#include <limits>
#include <thread>
#include <vector>

#include "core/error.hpp"

namespace psweep {
namespace {

std::string names_of_all() {
  std::string names;
  for (const auto& c : rtl::configurations()) names += (names.empty() ? "" : ", ") + c.name;
  return names;
}

// The setup with the sizes of a configuration.
SweepSetup sized_as(SweepSetup setup, const golden::Config& built) {
  golden::Config& f = setup.format;
  f.img_cols = built.img_cols;
  f.img_rows = built.img_rows;
  f.plane_cols = built.plane_cols;
  f.plane_rows = built.plane_rows;
  f.planes = setup.spacing.planes;
  f.lanes = built.lanes;
  f.rectified = built.rectified;
  return setup;
}

// Shows the clocks as they are simulated: tiles take minutes.
class ClockWatch {
 public:
  ClockWatch(const std::atomic<uint64_t>& clocks, uint64_t total, const ProgressCall& progress)
      : thread_([this, &clocks, total, &progress] {
          while (!over_) {
            std::this_thread::sleep_for(std::chrono::milliseconds(100));
            progress(clocks, total);
          }
        }) {}
  ~ClockWatch() {
    over_ = true;
    thread_.join();
  }
  ClockWatch(const ClockWatch&) = delete;
  ClockWatch& operator=(const ClockWatch&) = delete;

 private:
  std::atomic<bool> over_{false};
  std::thread thread_;
};

}  // namespace

golden::Config configuration_named(const std::string& name) {
  if (rtl::configurations().empty())
    throw InputError("--config: found '" + name + "', but this psweep was built without RTL (cmake -DPSWEEP_RTL=ON)");
  for (const auto& c : rtl::configurations())
    if (c.name == name) return c.config;
  throw InputError("--config: found '" + name + "', expected one of the built configurations: " + names_of_all());
}

SimulatedEngine::SimulatedEngine(const std::string& configuration, int threads)
    : wanted_(configuration), threads_(threads) {
  if (rtl::configurations().empty())
    throw InputError("--engine: found 'rtl', but this psweep was built without RTL (cmake -DPSWEEP_RTL=ON)");
  if (!wanted_.empty()) configuration_named(wanted_);
}

SweepPlan SimulatedEngine::plan(const SweepSetup& setup, std::optional<TileSize> tile) {
  SweepPlan best;
  chosen_ = nullptr;
  uint64_t best_clocks = std::numeric_limits<uint64_t>::max();
  std::string why;
  for (const auto& c : rtl::configurations()) {
    if (!wanted_.empty() && c.name != wanted_) continue;
    SweepSetup trial = sized_as(setup, c.config);
    if (!rtl::serves(c.config, trial.format)) {
      why =
          "its window or number formats differ, or it has room for " + std::to_string(c.config.planes) + " planes only";
      continue;
    }
    trial.format.planes = c.config.planes;
    PlanAttempt attempt = attempt_plan(trial, tile);
    if (!attempt.plan) {
      why = attempt.why;  // too small for this tile or disparity range
      continue;
    }
    const uint64_t clocks = plan_clocks(trial.format, *attempt.plan);
    if (clocks >= best_clocks) continue;
    best_clocks = clocks;
    chosen_ = &c;
    best.tiles = std::move(*attempt.plan);
    best.setup = trial;
  }
  if (chosen_) return best;
  SweepSetup need = setup;
  fit_format(need, tile);
  throw InputError("--engine rtl: " +
                   (wanted_.empty() ? "none of the built configurations (" + names_of_all() +
                                          ") serves this window, format, number of planes and tile"
                                    : "configuration '" + wanted_ + "' cannot serve this request: " + why) +
                   ".\nBuild one that does, in the root of the repository, and repeat:\n  " +
                   rtl::build_command(need.format));
}

DepthResult SimulatedEngine::sweep(const SweepPlan& plan, const StereoPair& input, const ProgressCall& progress) {
  figures_ = {};
  figures_.configuration = chosen_->name;
  figures_.generics = chosen_->config;
  figures_.clocks_expected = plan_clocks(plan.setup.format, plan.tiles);
  const std::vector<PlacedTile>& tiles = plan.tiles.tiles;
  std::vector<std::vector<golden::MapCell>> cells(tiles.size());
  {
    std::atomic<uint64_t> clocks{0};
    const ClockWatch watch(clocks, figures_.clocks_expected, progress);
    rtl::run_tiles(
        *chosen_, plan.tiles.table, static_cast<int>(tiles.size()), threads_,
        [&](int i) { return tile_input(tiles[static_cast<size_t>(i)], input); },
        [&](int i, rtl::TileOutput out) {
          if (out.window_errors != 0) {
            throw rtl::EngineError("rtl engine: tile " + std::to_string(i) + ": " + std::to_string(out.window_errors) +
                                   " samples lie outside the loaded window");
          }
          figures_.clocks += out.clocks;
          figures_.clocks_in_all += out.all_clocks;
          cells[static_cast<size_t>(i)] = std::move(out.cells);
        },
        &clocks);
  }
  return to_result(plan.setup, assemble(plan.setup.rig, plan.tiles, cells));
}

}  // namespace psweep
