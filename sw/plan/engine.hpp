// SPDX-License-Identifier: Apache-2.0
// Engine: whatever sweeps a pair of images: floating point, the bit-true model, simulated hardware, a chip on a link.
// Those that work in the integer contract share planner and reconstruction, so that only the map cells themselves can
// differ between them.
//
//   const SweepPlan plan = engine.plan(setup, tile);
//   const DepthResult cells = engine.sweep(plan, {left, right}, progress);
//
// Errors: InputError if the engine cannot serve the request, and those of its own: net::LinkError, rtl::EngineError.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "contract/tile.hpp"
#include "core/result.hpp"
#include "plan/planner.hpp"

namespace psweep {

struct StereoPair {
  const Gray& left;
  const Gray& right;
};

// What an engine makes of a request: the format as it has it, and its tiles (none if it knows no tiles).
struct SweepPlan {
  SweepSetup setup;
  Plan tiles;
};

using ProgressCall = std::function<void(uint64_t done, uint64_t total)>;

class Engine {
 public:
  Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;
  virtual ~Engine() = default;

  // tile: the size of tiles if the user wants a certain one.
  virtual SweepPlan plan(const SweepSetup& setup, std::optional<TileSize> tile) = 0;
  // A plan of this engine. The cells of the whole map, as depths.
  virtual DepthResult sweep(const SweepPlan& plan, const StereoPair& input, const ProgressCall& progress) = 0;
};

// Sizes of the format such that tiles of this size fit, for engines whose memories have no fixed size.
void fit_format(SweepSetup& setup, std::optional<TileSize> tile);

// plan_tiles() for whoever tries several engines: the plan, or why there is none. Without a tile: the largest.
struct PlanAttempt {
  std::optional<Plan> plan;
  std::string why;
};
PlanAttempt attempt_plan(const SweepSetup& setup, std::optional<TileSize> tile);

golden::TileInput tile_input(const PlacedTile& tile, const StereoPair& input);

}  // namespace psweep
