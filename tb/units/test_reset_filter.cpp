// SPDX-License-Identifier: Apache-2.0
// reset_filter: pulses of every length, up to 15 edges they do nothing, from 16 edges on they reset; so do gaps in a
// long reset; bouncing; a defined state from any beginning.
#include <random>

#include "Vreset_filter.h"
#include "golden/reset_filter.hpp"
#include "support/catch.hpp"
#include "support/clocks.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

constexpr int kEdges = golden::ResetFilter::kEdges, kLatency = golden::ResetFilter::kLatency;

struct Bench {
  Clocks<Vreset_filter> clocks;
  Vreset_filter& dut = clocks.dut();
  ClockDomain& clk;
  explicit Bench(uint32_t seed) : clocks(1e12, seed), clk(clocks.add({"clk", &dut.clk, 6000, 3000})) { dut.arst_n = 1; }
  void edges(int n) { clocks.run(clk, static_cast<uint64_t>(n)); }
  // Out of reset, whatever was before.
  void begin() {
    dut.arst_n = 0;
    edges(40);
    REQUIRE(dut.rst == 1);
    dut.arst_n = 1;
    edges(40);
    REQUIRE(dut.rst == 0);
  }
};

}  // namespace

TEST_CASE("reset_filter: low pulses of every length, high pulses within a reset likewise") {
  Bench bench(test_seed());
  bench.begin();
  for (const int level : {1, 0}) {  // at rest
    for (int length = 1; length <= 60; ++length) {
      INFO("rest " << level << ", length " << length);
      bench.dut.arst_n = static_cast<uint8_t>(level);
      bench.edges(60);
      REQUIRE(bench.dut.rst == 1 - level);
      golden::ResetFilter model(level);
      int first = -1, count = 0;
      for (int i = 0; i < 120; ++i) {
        bench.dut.arst_n = static_cast<uint8_t>(i < length ? 1 - level : level);
        bench.edges(1);
        model.edge(bench.dut.arst_n);
        REQUIRE(bench.dut.rst == model.rst());
        if (bench.dut.rst != 1 - level) {
          if (first < 0) first = i + 1;
          ++count;
        }
      }
      if (length < kEdges) {
        CHECK(first == -1);
      } else {
        CHECK(first == kLatency);
        CHECK(count == length);
      }
    }
  }
}

TEST_CASE("reset_filter: an input that bounces does nothing, nor do pulses between two edges") {
  Bench bench(test_seed());
  std::mt19937 random(test_seed());
  bench.begin();
  int low = 0;
  for (int i = 0; i < 20000; ++i) {
    const bool level = low == kEdges - 1 || random() % 3 == 0;
    low = level ? 0 : low + 1;
    bench.dut.arst_n = level;
    bench.edges(1);
    REQUIRE(bench.dut.rst == 0);
  }
  for (int i = 0; i < 1000; ++i) {  // never low at an edge
    bench.dut.arst_n = 0;
    bench.dut.eval();
    REQUIRE(bench.dut.rst == 0);
    bench.dut.arst_n = 1;
    bench.dut.eval();
    bench.edges(1);
    REQUIRE(bench.dut.rst == 0);
  }
}

TEST_CASE("reset_filter: from any beginning 18 edges of low are a reset, and a reset lasts for 16 clocks") {
  for (uint32_t seed = 0; seed < 200; ++seed) {
    Bench bench(test_seed() * 1000 + seed);  // random registers
    bench.dut.arst_n = 0;
    bench.edges(kLatency);
    REQUIRE(bench.dut.rst == 1);
    bench.dut.arst_n = 1;
    int clocks = 0;
    for (; bench.dut.rst && clocks < 100; ++clocks) bench.edges(1);
    REQUIRE(clocks == kLatency);
  }
  int begun = 0;
  for (uint32_t seed = 0; seed < 200; ++seed) {  // what the registers began with may be a reset
    Bench bench(test_seed() * 1000 + seed);
    bench.dut.arst_n = 1;
    bench.edges(1);
    begun += bench.dut.rst;
    bench.edges(40);
    REQUIRE(bench.dut.rst == 0);
  }
  CHECK(begun > 20);
}

TEST_CASE("reset_filter: without a clock nothing changes") {
  Bench bench(test_seed());
  bench.begin();
  bench.clk.set_running(false);
  bench.dut.arst_n = 0;
  bench.dut.eval();
  CHECK(bench.dut.rst == 0);
  bench.clk.set_running(true);
  bench.edges(kLatency - 1);
  CHECK(bench.dut.rst == 0);
  bench.edges(1);
  CHECK(bench.dut.rst == 1);
}
