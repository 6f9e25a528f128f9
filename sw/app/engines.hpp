// SPDX-License-Identifier: Apache-2.0
// The three engines behind one call. fixed and rtl share planner and reconstruction, so only the map cells themselves
// can differ between them.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "core/result.hpp"
#include "plan/planner.hpp"

namespace psweep {

struct RtlFigures {
  std::string configuration;
  golden::Config generics;
  uint64_t clocks = 0;           // sum over tiles, start command to last map beat
  uint64_t clocks_in_all = 0;    // and register and plane table writes
  uint64_t clocks_expected = 0;  // planner's formula
};

struct EngineRun {
  DepthResult result;
  double seconds = 0;                                 // of the engine alone
  int tiles = 0, largest_cols = 0, largest_rows = 0;  // 0: the engine knows no tiles (float)
  std::optional<RtlFigures> rtl;
};

using ProgressCall = std::function<void(size_t done, size_t total)>;

// `tile`: "WxH" or empty. `configuration`: name of an RTL configuration or empty.
// Errors: InputError, also if no built configuration serves the request (with the command that builds one).
EngineRun run_engine(const std::string& engine, const Gray& left, const Gray& right, SweepSetup setup,
                     const std::string& tile, const std::string& configuration, int threads,
                     const ProgressCall& progress);

// Generics of a built configuration. InputError if there is none of this name, or no RTL in this binary.
golden::Config configuration_named(const std::string& name);

}  // namespace psweep
