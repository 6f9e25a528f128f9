// SPDX-License-Identifier: Apache-2.0
// FixedEngine: the bit-true model as an Engine. It sweeps whole frames; the tiles of its plan are what the hardware
// would do, with the same result.
#pragma once
#include "fast/fast.hpp"
#include "plan/engine.hpp"

namespace psweep {

class FixedEngine : public Engine {
 public:
  explicit FixedEngine(int threads) : threads_(threads) {}
  SweepPlan plan(const SweepSetup& setup, std::optional<TileSize> tile) override {
    SweepPlan out{setup, {}};
    fit_format(out.setup, tile);
    out.tiles = plan_tiles(out.setup, out.setup.format.plane_cols, out.setup.format.plane_rows);
    return out;
  }
  DepthResult sweep(const SweepPlan& plan, const StereoPair& input, const ProgressCall& progress) override {
    FastOptions options;
    options.threads = threads_;
    options.progress = [&](double share) { progress(static_cast<uint64_t>(share * 1000), 1000); };
    return to_result(plan.setup, run_fixed(input.left, input.right, plan.setup, options));
  }

 private:
  int threads_;
};

}  // namespace psweep
