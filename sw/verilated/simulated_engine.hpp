// SPDX-License-Identifier: Apache-2.0
// SimulatedEngine: the Verilated engines of this binary as an Engine. Its plan takes the configuration and the tile
// size that finish in the fewest clocks; both may be fixed by the user.
#pragma once
#include <cstdint>
#include <string>

#include "contract/config.hpp"
#include "plan/engine.hpp"
#include "verilated/rtl_engine.hpp"

namespace psweep {

struct RtlFigures {
  std::string configuration;
  golden::Config generics;
  uint64_t clocks = 0;           // sum over tiles, start command to last map beat
  uint64_t clocks_in_all = 0;    // and register and plane table writes
  uint64_t clocks_expected = 0;  // planner's formula
};

class SimulatedEngine : public Engine {
 public:
  // configuration: a name, or empty. InputError if there is none of this name, or no RTL in this binary; from plan(),
  // if no configuration serves the request (with the command that builds one).
  SimulatedEngine(const std::string& configuration, int threads);
  SweepPlan plan(const SweepSetup& setup, std::optional<TileSize> tile) override;
  DepthResult sweep(const SweepPlan& plan, const StereoPair& input, const ProgressCall& progress) override;
  const RtlFigures& figures() const { return figures_; }  // of the latest sweep

 private:
  std::string wanted_;
  int threads_;
  const rtl::Configuration* chosen_ = nullptr;  // by plan()
  RtlFigures figures_;
};

// Generics of a built configuration. InputError if there is none of this name, or no RTL in this binary.
golden::Config configuration_named(const std::string& name);

}  // namespace psweep
