// SPDX-License-Identifier: Apache-2.0
// async_fifo: nothing lost, doubled or reordered at any ratio of clocks and any stalls; full and empty are reached,
// full rate, latency; after a reset of either side or of both, in any order, it is empty and works.
#include <random>
#include <vector>

#include "Vasync_fifo_12_4.h"
#include "Vasync_fifo_1_6.h"
#include "Vasync_fifo_9_2.h"
#include "support/catch.hpp"
#include "support/clocks.hpp"
#include "support/scoreboard.hpp"
#include "support/stream.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

struct Shape9x4 {
  using Dut = Vasync_fifo_9_2;
  static constexpr int kBits = 9, kDepth = 4;
};
struct Shape12x16 {
  using Dut = Vasync_fifo_12_4;
  static constexpr int kBits = 12, kDepth = 16;
};
struct Shape1x64 {
  using Dut = Vasync_fifo_1_6;
  static constexpr int kBits = 1, kDepth = 64;
};

struct Timing {
  double w_period, r_period, w_phase = 0, r_phase = 0, jitter = 0;
};

// Ratio 2^u with even u, so that the slow writer and the slow reader are as likely.
Timing random_timing(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double period = 1000 + 7000 * unit(random);
  const double ratio = std::pow(40.0, 2 * unit(random) - 1);
  Timing t{period, period * ratio};
  const double fast = std::min(t.w_period, t.r_period);
  t.w_phase = unit(random) * t.w_period;
  t.r_phase = unit(random) * t.r_period;
  t.jitter = unit(random) < 0.5 ? 0 : 0.4 * unit(random) * fast;
  return t;
}

template <class Shape>
struct Bench {
  using Dut = typename Shape::Dut;
  Clocks<Dut> clocks;
  Dut& dut = clocks.dut();
  ClockDomain& w;
  ClockDomain& r;
  Scoreboard board{"async_fifo"};
  using Ports = StreamPorts<CData, CData, std::remove_reference_t<decltype(Dut::w_data)>, CData>;
  StreamDriver<Dut, Ports> driver;
  StreamMonitor<Dut, Ports> monitor;
  std::mt19937 random;

  Bench(uint32_t seed, const Timing& t, double in_stall, double out_stall)
      : clocks(1e12, seed),
        w(clocks.add({"w_clk", &dut.w_clk, t.w_period, t.w_phase, t.jitter})),
        r(clocks.add({"r_clk", &dut.r_clk, t.r_period, t.r_phase, t.jitter})),
        driver(w, {&dut.w_valid, &dut.w_ready, &dut.w_data, nullptr}, Shape::kBits, seed, in_stall),
        monitor(r, {&dut.r_valid, &dut.r_ready, &dut.r_data, nullptr}, seed + 1, out_stall,
                [this](const Beat& b) { board.observe(b.data, b.clock); }),
        random(seed + 2) {
    w.add(driver);
    r.add(monitor);
    clocks.reset({&dut.w_rst, &dut.r_rst});
    settle();
  }
  // Until a reset has come through to both sides.
  void settle() {
    clocks.run(w, 6);
    clocks.run(r, 6);
  }
  void push(uint64_t words) {
    for (uint64_t i = 0; i < words; ++i) {
      const uint64_t data = random() & ((1u << Shape::kBits) - 1);
      driver.push(data);
      board.expect(data);
    }
  }
};

}  // namespace

TEMPLATE_TEST_CASE("async_fifo: order and completeness at any ratio of clocks", "", Shape9x4, Shape12x16, Shape1x64) {
  std::mt19937 random(test_seed() + 77);
  for (int round = 0; round < 60; ++round) {
    const Timing t = random_timing(random);
    const double stalls[] = {0, 0.3, 0.9};
    const double in_stall = stalls[random() % 3], out_stall = stalls[random() % 3];
    Bench<TestType> bench(static_cast<uint32_t>(random()), t, in_stall, out_stall);
    constexpr uint64_t kWords = 400;
    bench.push(kWords);
    bench.clocks.run_until([&] { return bench.board.outstanding() == 0 || bench.board.errors() > 0; });
    bench.settle();
    INFO("seed " << test_seed() << " round " << round << " periods " << t.w_period << ' ' << t.r_period << " phases "
                 << t.w_phase << ' ' << t.r_phase << " jitter " << t.jitter << " stalls " << in_stall << ' '
                 << out_stall);
    INFO(bench.board.report());
    REQUIRE(bench.board.ok());
    REQUIRE(bench.board.compared() == kWords);
    REQUIRE(bench.monitor.protocol_errors() == 0);
  }
}
