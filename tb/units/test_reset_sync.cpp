// SPDX-License-Identifier: Apache-2.0
// reset_sync: rst rises with arst at any time, also without clock; it falls with the third edge after arst has fallen.
#include <random>

#include "Vreset_sync.h"
#include "golden/reset_sync.hpp"
#include "support/catch.hpp"
#include "support/clocks.hpp"

using namespace psweep;
using namespace psweep::tb;

TEST_CASE("reset_sync: rises at once, falls with the third edge") {
  std::mt19937 random(test_seed());
  Clocks<Vreset_sync> clocks(1e9, test_seed());
  auto& dut = clocks.dut();
  CData ticker = 0;  // moves arst at times that have nothing to do with clk
  auto& clk = clocks.add({"clk", &dut.clk, 1000, 100});
  auto& fine = clocks.add({"fine", &ticker, 37.77});
  golden::ResetSync model;
  auto set = [&](bool arst) {
    dut.arst = arst;
    model.set(arst);
  };
  set(true);
  clocks.step();
  REQUIRE(dut.rst == 1);
  int late = 0, restarted = 0;
  for (int round = 0; round < 500; ++round) {
    clocks.run(fine, 1 + random() % 100);
    REQUIRE(dut.rst == 1);
    set(false);
    // Sometimes the next reset comes before this one is over.
    const int edges = random() % 4 == 0 ? static_cast<int>(random() % 3) : 3;
    for (int i = 1; i <= edges; ++i) {
      clocks.run(clk, 1);
      INFO("seed " << test_seed() << " round " << round << " edge " << i << " at " << clocks.now());
      model.edge();
      REQUIRE(dut.rst == (i < 3 ? 1 : 0));
      REQUIRE(dut.rst == model.rst());
    }
    if (edges == 3) {
      clocks.run(fine, random() % 100);
      REQUIRE(dut.rst == 0);
      ++late;
    } else {
      ++restarted;
    }
    const double before = clocks.now();
    set(true);
    dut.eval();
    REQUIRE(dut.rst == 1);
    REQUIRE(model.rst());
    REQUIRE(clocks.now() == before);
  }
  CHECK(late > 100);
  CHECK(restarted > 50);
}

TEST_CASE("reset_sync: rises without a clock and stays until the clock runs") {
  Clocks<Vreset_sync> clocks(1e9, test_seed());
  auto& dut = clocks.dut();
  CData ticker = 0;
  auto& clk = clocks.add({"clk", &dut.clk, 1000, 100});
  auto& fine = clocks.add({"fine", &ticker, 37.77});
  dut.arst = 0;
  clocks.run(clk, 4);
  CHECK(dut.rst == 0);
  clk.set_running(false);
  clocks.run(fine, 100);
  dut.arst = 1;
  clocks.run(fine, 1);
  CHECK(dut.rst == 1);
  dut.arst = 0;
  clocks.run(fine, 1000);
  CHECK(dut.rst == 1);
  clk.set_running(true);
  clocks.run(clk, 2);
  CHECK(dut.rst == 1);
  clocks.run(clk, 1);
  CHECK(dut.rst == 0);
}
