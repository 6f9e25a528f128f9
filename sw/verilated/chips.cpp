// SPDX-License-Identifier: Apache-2.0
#include "verilated/chips.hpp"

#include "core/error.hpp"

namespace psweep::chip {

const Chip& chip_named(std::string_view name) {
  std::string names;
  for (const auto& c : chips()) {
    if (c.name == name) return c;
    names += (names.empty() ? "" : ", ") + c.name;
  }
  throw InputError("--config: found '" + std::string(name) + "', expected one of " + names);
}

}  // namespace psweep::chip
