// SPDX-License-Identifier: Apache-2.0
#include "app/engines.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <memory>
#include <thread>

#include "core/error.hpp"
#include "fast/fixed_engine.hpp"
#include "reference/float_engine.hpp"

namespace psweep {
namespace {

std::optional<TileSize> parse_tile(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const size_t at = text.find('x');  // the parser has checked the form
  return TileSize{std::atoi(text.c_str()), std::atoi(text.c_str() + at + 1)};
}

struct Made {
  std::unique_ptr<Engine> engine;
  std::function<void(EngineRun&)> add_figures = [](EngineRun&) {};
};

Made make_engine(const EngineRequest& r) {
  const int threads = r.threads > 0 ? r.threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  if (r.engine == "float") return {std::make_unique<FloatEngine>(r.threshold, r.rounding, threads)};
  if (r.engine == "fixed") return {std::make_unique<FixedEngine>(threads)};
  if (r.engine == "rtl") {
    auto engine = std::make_unique<SimulatedEngine>(r.configuration, threads);
    const SimulatedEngine* const made = engine.get();
    return {std::move(engine), [made](EngineRun& run) { run.rtl = made->figures(); }};
  }
  if (r.engine.compare(0, 6, "udp://") == 0) {
    auto engine = std::make_unique<net::UdpEngine>(r.engine, r.link_timeout, r.in_flight);
    const net::UdpEngine* const made = engine.get();
    return {std::move(engine), [made](EngineRun& run) { run.link = made->figures(); }};
  }
  throw InputError("--engine: found '" + r.engine + "', expected float, fixed, rtl or udp://HOST[:PORT]");
}

}  // namespace

EngineRun run_engine(const EngineRequest& r, const StereoPair& input, const ProgressCall& progress) {
  const Made made = make_engine(r);
  const SweepPlan plan = made.engine->plan(r.setup, parse_tile(r.tile));
  EngineRun run;
  run.tiles = static_cast<int>(plan.tiles.tiles.size());
  for (const auto& tile : plan.tiles.tiles) {
    run.largest_cols = std::max(run.largest_cols, tile.job.tile_cols);
    run.largest_rows = std::max(run.largest_rows, tile.job.tile_rows);
  }
  const auto start = std::chrono::steady_clock::now();
  run.result = made.engine->sweep(plan, input, progress);
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  made.add_figures(run);
  return run;
}

}  // namespace psweep
