// SPDX-License-Identifier: Apache-2.0
// Catch2 2 (Debian 12, one header) and Catch2 3 (Debian 13, library) under one name; tests include this file only.
// PSWEEP_CATCH2_V3 comes from scripts/cmake/PsweepTargets.cmake.
//   psweep::contains("text")  matcher: the string contains "text"
//   psweep::approx(value)     floating-point comparison with .epsilon() and .margin()
//   psweep::test_seed()       seed of all random stimuli: environment PSWEEP_SEED, else 1. Put it into INFO().
#pragma once
#ifdef PSWEEP_CATCH2_V3
#include <catch2/catch_approx.hpp>
#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/generators/catch_generators_adapters.hpp>
#include <catch2/generators/catch_generators_range.hpp>
#include <catch2/matchers/catch_matchers.hpp>
#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>
#else
#include <catch2/catch.hpp>
#endif
#include <cstdint>
#include <cstdlib>
#include <string>

namespace psweep {

inline auto contains(const std::string& text) {
#ifdef PSWEEP_CATCH2_V3
  return Catch::Matchers::ContainsSubstring(text);
#else
  return Catch::Matchers::Contains(text);
#endif
}

#ifdef PSWEEP_CATCH2_V3
inline Catch::Approx approx(double value) { return Catch::Approx(value); }
#else
inline Catch::Detail::Approx approx(double value) { return Catch::Detail::Approx(value); }
#endif

// Not Catch's own seed: version 3 draws a fresh one for every run, and a regression must be repeatable.
inline uint32_t test_seed() {
  const char* text = std::getenv("PSWEEP_SEED");
  return text ? static_cast<uint32_t>(std::strtoul(text, nullptr, 0)) : 1;
}

}  // namespace psweep
