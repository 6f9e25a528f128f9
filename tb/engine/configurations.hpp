// SPDX-License-Identifier: Apache-2.0
// The configurations under test: Verilated class and formats, for TEMPLATE_TEST_CASE.
#pragma once
#include <stdexcept>
#include <string>

#include "Vpsweep_odd.h"
#include "Vpsweep_odd_2.h"
#include "Vpsweep_odd_4.h"
#include "Vpsweep_rectified.h"
#include "Vpsweep_rectified_2.h"
#include "Vpsweep_tiny.h"
#include "verilated/rtl_engine.hpp"

namespace psweep::tb {

inline const rtl::Configuration& configuration(const char* name) {
  for (const auto& c : rtl::configurations())
    if (c.name == name) return c;
  throw std::runtime_error("configuration " + std::string(name) + " was not built");
}

struct Tiny {
  using Dut = Vpsweep_tiny;
  static golden::Config config() { return configuration("tiny").config; }
};
struct Odd {
  using Dut = Vpsweep_odd;
  static golden::Config config() { return configuration("odd").config; }
};

struct Odd2 {
  using Dut = Vpsweep_odd_2;
  static golden::Config config() { return configuration("odd_2").config; }
};
struct Odd4 {
  using Dut = Vpsweep_odd_4;
  static golden::Config config() { return configuration("odd_4").config; }
};
struct Rectified {
  using Dut = Vpsweep_rectified;
  static golden::Config config() { return configuration("rectified").config; }
};
struct Rectified2 {
  using Dut = Vpsweep_rectified_2;
  static golden::Config config() { return configuration("rectified_2").config; }
};

}  // namespace psweep::tb
