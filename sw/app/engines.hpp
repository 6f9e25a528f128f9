// SPDX-License-Identifier: Apache-2.0
// The engines behind one call. fixed, rtl and the chip at the end of a link share planner and reconstruction, so only
// the map cells themselves can differ between them.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "core/result.hpp"
#include "net/link_engine.hpp"
#include "plan/planner.hpp"
#include "reference/reference.hpp"

namespace psweep {

struct RtlFigures {
  std::string configuration;
  golden::Config generics;
  uint64_t clocks = 0;           // sum over tiles, start command to last map beat
  uint64_t clocks_in_all = 0;    // and register and plane table writes
  uint64_t clocks_expected = 0;  // planner's formula
};

struct LinkRun {
  std::string peer;
  net::Capabilities chip;
  net::LinkFigures figures;
  net::LinkStatistics statistics;
  uint64_t clocks_expected = 0;  // planner's formula
};

struct EngineRun {
  DepthResult result;
  double seconds = 0;                                 // of the engine alone
  int tiles = 0, largest_cols = 0, largest_rows = 0;  // 0: the engine knows no tiles (float)
  std::optional<RtlFigures> rtl;
  std::optional<LinkRun> link;
};

using ProgressCall = std::function<void(size_t done, size_t total)>;

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

// Errors: net::LinkError; InputError, also if no built configuration serves the request (with the command that builds
// one).
EngineRun run_engine(const EngineRequest& request, const Gray& left, const Gray& right, const ProgressCall& progress);

// Generics of a built configuration. InputError if there is none of this name, or no RTL in this binary.
golden::Config configuration_named(const std::string& name);

}  // namespace psweep
