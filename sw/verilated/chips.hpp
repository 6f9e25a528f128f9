// SPDX-License-Identifier: Apache-2.0
// The chips in this binary: entity psweep_top, converted and Verilated, one per rtl/configs/chip/*.json (and, added by
// the user, <build>/chips/*.json). This header needs no Verilator.
#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "contract/frames.hpp"
#include "desk/chip_model.hpp"

namespace psweep::chip {

struct Chip {
  std::string name;
  std::string description;
  std::string engine;  // name of the engine's configuration
  net::ArbiterConfig config;
  net::Address address;  // with straps 0
  bool waves;
  std::unique_ptr<ChipModel> (*make)();
};

// Sorted by name.
const std::vector<Chip>& chips();
// Throws InputError, which names those there are.
const Chip& chip_named(std::string_view name);

}  // namespace psweep::chip
