// SPDX-License-Identifier: Apache-2.0
// FloatEngine: run_float() as an Engine. Its plan has no tiles.
#pragma once
#include "plan/engine.hpp"
#include "reference/reference.hpp"

namespace psweep {

class FloatEngine : public Engine {
 public:
  // threshold: 0 .. 1; that of the setup is in units of V.
  FloatEngine(double threshold, const FloatOptions& rounding, int threads)
      : threshold_(threshold), rounding_(rounding), threads_(threads) {}
  SweepPlan plan(const SweepSetup& setup, std::optional<TileSize>) override { return {setup, {}}; }
  DepthResult sweep(const SweepPlan& plan, const StereoPair& input, const ProgressCall& progress) override {
    return run_float(input.left, input.right, plan.setup.rig, plan.setup.spacing, plan.setup.format.window, threshold_,
                     rounding_, threads_, [&](double share) { progress(static_cast<uint64_t>(share * 1000), 1000); });
  }

 private:
  double threshold_;
  FloatOptions rounding_;
  int threads_;
};

}  // namespace psweep
