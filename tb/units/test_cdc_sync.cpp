// SPDX-License-Identifier: Apache-2.0
// cdc_sync: every bit comes out as it was sampled, exactly G_STAGES clocks later, whatever clock it comes from.
#include <random>

#include "Vcdc_sync_1_2.h"
#include "Vcdc_sync_3_4.h"
#include "Vcdc_sync_5_3.h"
#include "golden/cdc_sync.hpp"
#include "support/catch.hpp"
#include "support/clocks.hpp"
#include "support/scoreboard.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

struct Shape1x2 {
  using Dut = Vcdc_sync_1_2;
  static constexpr unsigned kWidth = 1, kStages = 2;
};
struct Shape5x3 {
  using Dut = Vcdc_sync_5_3;
  static constexpr unsigned kWidth = 5, kStages = 3;
};
struct Shape3x4 {
  using Dut = Vcdc_sync_3_4;
  static constexpr unsigned kWidth = 3, kStages = 4;
};

template <class Dut>
struct Source : Agent {
  Source(Dut& dut, unsigned width, uint32_t seed) : dut_(dut), width_(width), random_(seed) { dut_.d = 0; }
  void drive() override { dut_.d = static_cast<CData>(random_() & ((1u << width_) - 1)); }

 private:
  Dut& dut_;
  unsigned width_;
  std::mt19937 random_;
};

template <class Dut>
struct Watcher : Agent {
  Watcher(Dut& dut, const CycleCounter& clock, unsigned stages, Scoreboard& board)
      : dut_(dut), clock_(clock), board_(board), model_(stages) {}
  void sample() override {
    if (model_.out()) board_.compare(dut_.q, *model_.out(), {}, clock_.cycle());
    model_.clock(dut_.d);
  }

 private:
  Dut& dut_;
  const CycleCounter& clock_;
  Scoreboard& board_;
  golden::CdcSync model_;
};

}  // namespace

TEMPLATE_TEST_CASE("cdc_sync: what was sampled comes out G_STAGES clocks later", "", Shape1x2, Shape5x3, Shape3x4) {
  using Dut = typename TestType::Dut;
  const double from_period = GENERATE(100.0, 997.3, 1000.0, 40321.7);
  Clocks<Dut> clocks(1e9, test_seed());
  CData from_clk = 0;  // the source's clock is not a port
  auto& to = clocks.add({"clk", &clocks.dut().clk, 1000, 0, 100});
  auto& from = clocks.add({"from", &from_clk, from_period, 333});
  Scoreboard board("cdc_sync");
  Source<Dut> source(clocks.dut(), TestType::kWidth, test_seed());
  Watcher<Dut> watcher(clocks.dut(), to, TestType::kStages, board);
  from.add(source);
  to.add(watcher);
  clocks.run(to, 3000);
  INFO("seed " << test_seed() << " period " << from_period << '\n' << board.report());
  CHECK(board.ok());
  CHECK(board.compared() == 3000 - TestType::kStages);
}

TEST_CASE("clocks: edges fall where period, phase and jitter say, and together when they meet") {
  Clocks<Vcdc_sync_1_2> clocks(1e6, test_seed());
  CData other = 0;
  auto& a = clocks.add({"a", &clocks.dut().clk, 100.25, 7});
  auto& b = clocks.add({"b", &other, 300.75, 7, 0});
  struct Note : Agent {
    explicit Note(Clocks<Vcdc_sync_1_2>& c) : clocks(c) {}
    void sample() override { at.push_back(clocks.now()); }
    Clocks<Vcdc_sync_1_2>& clocks;
    std::vector<double> at;
  } on_a(clocks), on_b(clocks);
  a.add(on_a);
  b.add(on_b);
  clocks.run(b, 1000);
  REQUIRE(on_b.at.size() == 1000);
  for (size_t i = 0; i < on_b.at.size(); ++i) CHECK(on_b.at[i] == approx(7 + static_cast<double>(i) * 300.75));
  REQUIRE(on_a.at.size() == 999 * 3 + 1);  // every third edge together with one of b
  CHECK(on_a.at.back() == on_b.at.back());
  CHECK(a.cycle() == 999 * 3 + 1);
  b.set_running(false);
  clocks.run(a, 300);
  CHECK(b.cycle() == 1000);
  CHECK_THROWS_AS(clocks.run(a, 10000), Timeout);

  Clocks<Vcdc_sync_1_2> jittered(1e9, test_seed());
  CHECK_THROWS_AS(jittered.add({"clk", &jittered.dut().clk, 100, 0, 50}), std::invalid_argument);
  auto& c = jittered.add({"clk", &jittered.dut().clk, 100, 1000, 40});
  double lowest = 1e9, highest = -1e9;
  for (int i = 0; i < 500; ++i) {
    jittered.run(c, 1);
    const double off = jittered.now() - (1000 + i * 100.0);
    lowest = std::min(lowest, off);
    highest = std::max(highest, off);
  }
  CHECK(lowest >= -20);
  CHECK(highest <= 20);
  CHECK(highest - lowest > 30);
}
