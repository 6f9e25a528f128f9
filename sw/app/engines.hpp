// SPDX-License-Identifier: Apache-2.0
// The engines by name, behind plan/engine.hpp, and what a run of one has to report.
#pragma once
#include <optional>
#include <string>

#include "core/result.hpp"
#include "net/udp_engine.hpp"
#include "plan/engine.hpp"
#include "plan/planner.hpp"
#include "reference/reference.hpp"
#include "verilated/simulated_engine.hpp"

namespace psweep {

struct EngineRun {
  DepthResult result;
  double seconds = 0;                                 // of the engine alone
  int tiles = 0, largest_cols = 0, largest_rows = 0;  // 0: the engine knows no tiles (float)
  std::optional<RtlFigures> rtl;
  std::optional<net::LinkRun> link;
};

struct EngineRequest {
  std::string engine;         // float, fixed, rtl, udp://HOST[:PORT]
  SweepSetup setup;           // float uses rig, planes and window only
  double threshold = 0;       // float: 0 .. 1
  FloatOptions rounding;      // float
  std::string tile;           // "WxH" or empty
  std::string configuration;  // rtl: name of a configuration or empty
  int threads = 0;            // 0: one per core
  int in_flight = 2;          // udp: tiles in work at once, 1 or 2
  double link_timeout = 10;   // udp: seconds without any answer
};

// Errors: those of the engines, and InputError if there is none of this name.
EngineRun run_engine(const EngineRequest& request, const StereoPair& input, const ProgressCall& progress);

}  // namespace psweep
