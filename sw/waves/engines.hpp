// SPDX-License-Identifier: Apache-2.0
// The engines that were built with waves ("waves": true in their configuration), to run one tile on each.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "contract/config.hpp"
#include "scene/stimulus.hpp"

namespace psweep::waves {

// Where the debug ports show what a stage hands on; the map is its write port.
enum Tap { kSample, kQuad, kInterp, kSim, kMap, kTaps };

struct Run {
  const scene::Stimulus* stimulus = nullptr;
  int lane = 0;                                     // whose valid counts
  std::array<std::vector<uint64_t>, kTaps> wanted;  // numbers of beats, ascending from 0: when do they come?
  std::string fst;                                  // empty: no waves
  uint64_t first = 0, last = 0;                     // clocks in the waves
};
struct RunLog {
  std::array<std::vector<uint64_t>, kTaps> clocks;  // of the wanted beats
  std::array<uint64_t, kTaps> before{};             // beats before clock `first`
  std::vector<golden::MapCell> cells;               // what came out
  uint64_t last_clock = 0;
};

struct Engine {
  std::string name, description;
  golden::Config config;
  std::map<std::string, int> keys;  // all numbers of the configuration file, by name
  RunLog (*run)(const golden::Config& config, const Run& run);
};
// Sorted by name.
const std::vector<Engine>& engines();

}  // namespace psweep::waves
