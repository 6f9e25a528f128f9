// SPDX-License-Identifier: Apache-2.0
#include "app/engines.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <limits>
#include <thread>

#include "core/error.hpp"
#include "fast/fast.hpp"
#include "golden/control.hpp"
#include "net/udp_transport.hpp"
#include "verilated/rtl_engine.hpp"

namespace psweep {
namespace {

using Clock = std::chrono::steady_clock;

constexpr TileSize kUsualTile{256, 130};

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

TileSize parse_tile(const std::string& text) {
  const size_t at = text.find('x');  // the parser has checked the form
  return {std::atoi(text.c_str()), std::atoi(text.c_str() + at + 1)};
}

// Sizes of the format such that this tile fits: the models have no memory of fixed size. For the fixed engine tiles are
// only what the hardware would do: the fast model sweeps whole frames, with the same result.
void fit_format(SweepSetup& setup, TileSize tile) {
  const BufferSize need = required_buffer(setup, tile.cols, tile.rows);
  setup.format.img_cols = need.img_cols;
  setup.format.img_rows = need.img_rows;
  setup.format.plane_cols = need.plane_cols;
  setup.format.plane_rows = need.plane_rows;
  setup.format.planes = setup.spacing.planes;
}

void describe_tiles(const Plan& plan, EngineRun& run) {
  run.tiles = static_cast<int>(plan.tiles.size());
  for (const auto& tile : plan.tiles) {
    run.largest_cols = std::max(run.largest_cols, tile.job.tile_cols);
    run.largest_rows = std::max(run.largest_rows, tile.job.tile_rows);
  }
}

EngineRun run_fixed_engine(const Gray& left, const Gray& right, SweepSetup setup, const std::string& tile, int threads,
                           const ProgressCall& progress) {
  fit_format(setup, tile.empty() ? kUsualTile : parse_tile(tile));
  const Plan plan = plan_tiles(setup, setup.format.plane_cols, setup.format.plane_rows);
  EngineRun run;
  describe_tiles(plan, run);
  const auto start = Clock::now();
  FastOptions options;
  options.threads = threads;
  options.progress = [&](double share) { progress(static_cast<size_t>(share * 1000), 1000); };
  const Image<golden::MapCell> map = run_fixed(left, right, setup, options);
  run.result = to_result(setup, map);
  run.seconds = since(start);
  return run;
}

// Formats decide every bit of the map, so they must be the same; the message names the field and both values.
void check_chip(const std::string& where, const golden::Config& chip, const SweepSetup& setup) {
  const golden::Config& f = setup.format;
  struct Field {
    const char* option;
    int chip, request;
  };
  for (const Field& x :
       {Field{"--window", chip.window, f.window}, Field{"pixel bits", chip.pix_bits, f.pix_bits},
        Field{"--weight-bits", chip.weight_bits, f.weight_bits},
        Field{"--interp-bits", chip.interp_frac, f.interp_frac}, Field{"--mncc-bits", chip.mncc_bits, f.mncc_bits},
        Field{"--frac-bits", chip.frac_bits, f.frac_bits}}) {
    if (x.chip != x.request) {
      throw InputError(std::string(x.option) + ": found " + std::to_string(x.request) + ", but the chip at " + where +
                       " has " + std::to_string(x.chip));
    }
  }
  if (setup.spacing.planes > chip.planes) {
    throw InputError("--planes: found " + std::to_string(setup.spacing.planes) + ", but the chip at " + where +
                     " has room for " + std::to_string(chip.planes));
  }
}

EngineRun run_link_engine(const EngineRequest& r, const Gray& left, const Gray& right, const ProgressCall& progress) {
  const auto start = Clock::now();
  const auto transport = net::connect_udp(net::parse_endpoint("--engine", r.engine));
  net::Client client(*transport, r.link_timeout, net::fresh_seed());
  EngineRun run;
  LinkRun link;
  link.peer = transport->peer();
  link.chip = client.info();
  check_chip(client.where(), link.chip.config.engine, r.setup);
  SweepSetup setup = r.setup;
  setup.format = link.chip.config.engine;
  const TileSize size = r.tile.empty() ? largest_tile(setup) : parse_tile(r.tile);
  const Plan plan = plan_tiles(setup, size.cols, size.rows);
  describe_tiles(plan, run);
  uint64_t all = 0;
  for (const auto& t : plan.tiles) all += golden::unload_clocks(t.job);
  std::vector<std::vector<golden::MapCell>> cells(plan.tiles.size());
  net::LinkOptions options;
  options.in_flight = r.in_flight;
  link.figures = net::run_link_tiles(
      client, link.chip, plan.table, static_cast<int>(plan.tiles.size()), options,
      [&](int i) {
        const PlacedTile& t = plan.tiles[i];
        return golden::TileInput{t.job, cut_window(left, t.left_x, t.left_y, t.job.win_cols, t.job.win_rows),
                                 cut_window(right, t.right_x, t.right_y, t.job.win_cols, t.job.win_rows)};
      },
      [&](int i, std::vector<golden::MapCell> out) { cells[i] = std::move(out); },
      [&](uint64_t done) { progress(done, all); });
  for (const auto& t : plan.tiles)
    link.clocks_expected += golden::engine_clocks(setup.format, t.job) + net::kFirstPairClocks;
  link.statistics = client.statistics();
  run.link = link;
  run.result = to_result(setup, assemble(setup.rig, plan, cells));
  run.seconds = since(start);
  return run;
}

// The configuration and tile size that finish in the fewest clocks; both may be fixed by the user.
const rtl::Configuration* choose(SweepSetup& setup, const std::string& tile, const std::string& name, Plan& plan) {
  const rtl::Configuration* best = nullptr;
  uint64_t best_clocks = std::numeric_limits<uint64_t>::max();
  std::string why;
  for (const auto& c : rtl::configurations()) {
    if (!name.empty() && c.name != name) continue;
    SweepSetup trial = setup;
    trial.format.img_cols = c.config.img_cols;
    trial.format.img_rows = c.config.img_rows;
    trial.format.plane_cols = c.config.plane_cols;
    trial.format.plane_rows = c.config.plane_rows;
    trial.format.planes = setup.spacing.planes;
    trial.format.lanes = c.config.lanes;
    trial.format.rectified = c.config.rectified;
    if (!rtl::serves(c.config, trial.format)) {
      why =
          "its window or number formats differ, or it has room for " + std::to_string(c.config.planes) + " planes only";
      continue;
    }
    trial.format.planes = c.config.planes;
    try {
      const TileSize size = tile.empty() ? largest_tile(trial) : parse_tile(tile);
      const Plan candidate = plan_tiles(trial, size.cols, size.rows);
      const uint64_t clocks = plan_clocks(trial.format, candidate);
      if (clocks < best_clocks) {
        best_clocks = clocks;
        best = &c;
        plan = candidate;
        setup.format = trial.format;
      }
    } catch (const InputError& e) {
      why = e.what();  // too small for this tile or disparity range
    }
  }
  if (best) return best;
  fit_format(setup, tile.empty() ? kUsualTile : parse_tile(tile));
  std::string built;
  for (const auto& c : rtl::configurations()) built += (built.empty() ? "" : ", ") + c.name;
  throw InputError("--engine rtl: " +
                   (name.empty() ? "none of the built configurations (" + built + ") serves this window, format, " +
                                       "number of planes and tile"
                                 : "configuration '" + name + "' cannot serve this request: " + why) +
                   ".\nBuild one that does, in the root of the repository, and repeat:\n  " +
                   rtl::build_command(setup.format));
}

EngineRun run_rtl_engine(const Gray& left, const Gray& right, SweepSetup setup, const std::string& tile,
                         const std::string& configuration, int threads, const ProgressCall& progress) {
  if (!configuration.empty()) configuration_named(configuration);
  Plan plan;
  const rtl::Configuration* chosen = choose(setup, tile, configuration, plan);
  EngineRun run;
  describe_tiles(plan, run);
  RtlFigures figures;
  figures.configuration = chosen->name;
  figures.generics = chosen->config;
  figures.clocks_expected = plan_clocks(setup.format, plan);
  const auto start = Clock::now();
  std::vector<std::vector<golden::MapCell>> cells(plan.tiles.size());
  std::atomic<uint64_t> clock_counter{0};
  std::atomic<bool> finished{false};
  // Tiles take minutes, so progress counts clocks.
  std::thread watcher([&] {
    while (!finished) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      progress(clock_counter, figures.clocks_expected);
    }
  });
  std::string failure;
  try {
    rtl::run_tiles(
        *chosen, plan.table, static_cast<int>(plan.tiles.size()), threads,
        [&](int i) {
          const PlacedTile& t = plan.tiles[i];
          return golden::TileInput{t.job, cut_window(left, t.left_x, t.left_y, t.job.win_cols, t.job.win_rows),
                                   cut_window(right, t.right_x, t.right_y, t.job.win_cols, t.job.win_rows)};
        },
        [&](int i, rtl::TileOutput out) {
          if (out.window_errors != 0) {
            throw rtl::EngineError("rtl engine: tile " + std::to_string(i) + ": " + std::to_string(out.window_errors) +
                                   " samples lie outside the loaded window");
          }
          figures.clocks += out.clocks;
          figures.clocks_in_all += out.all_clocks;
          cells[i] = std::move(out.cells);
        },
        &clock_counter);
  } catch (...) {
    finished = true;
    watcher.join();
    throw;
  }
  finished = true;
  watcher.join();
  run.result = to_result(setup, assemble(setup.rig, plan, cells));
  run.rtl = figures;
  run.seconds = since(start);
  return run;
}

}  // namespace

golden::Config configuration_named(const std::string& name) {
  if (rtl::configurations().empty())
    throw InputError("--config: found '" + name + "', but this psweep was built without RTL (cmake -DPSWEEP_RTL=ON)");
  std::string built;
  for (const auto& c : rtl::configurations()) {
    if (c.name == name) return c.config;
    built += (built.empty() ? "" : ", ") + c.name;
  }
  throw InputError("--config: found '" + name + "', expected one of the built configurations: " + built);
}

EngineRun run_engine(const EngineRequest& r, const Gray& left, const Gray& right, const ProgressCall& progress) {
  const int threads = r.threads > 0 ? r.threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  if (r.engine == "fixed") return run_fixed_engine(left, right, r.setup, r.tile, threads, progress);
  if (r.engine == "float") {
    EngineRun run;
    const auto start = Clock::now();
    run.result = run_float(left, right, r.setup.rig, r.setup.spacing, r.setup.format.window, r.threshold, r.rounding,
                           threads, [&](double share) { progress(static_cast<size_t>(share * 1000), 1000); });
    run.seconds = since(start);
    return run;
  }
  if (r.engine == "rtl") {
    if (rtl::configurations().empty())
      throw InputError("--engine: found 'rtl', but this psweep was built without RTL (cmake -DPSWEEP_RTL=ON)");
    return run_rtl_engine(left, right, r.setup, r.tile, r.configuration, threads, progress);
  }
  if (r.engine.compare(0, 6, "udp://") == 0) return run_link_engine(r, left, right, progress);
  throw InputError("--engine: found '" + r.engine + "', expected float, fixed, rtl or udp://HOST[:PORT]");
}

}  // namespace psweep
