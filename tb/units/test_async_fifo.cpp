// SPDX-License-Identifier: Apache-2.0
// async_fifo: nothing lost, doubled or reordered at any ratio of clocks and any stalls; full and empty are reached,
// full rate, latency; after a reset of either side or of both, in any order, it is empty and works.
#include <algorithm>
#include <random>
#include <vector>

#include "Vasync_fifo_12_4.h"
#include "Vasync_fifo_1_6.h"
#include "Vasync_fifo_9_2.h"
#include "golden/async_fifo.hpp"
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

// The model, fed at one clock and emptied at the other by what the handshakes say.
template <class Dut>
struct Writes : Agent {
  Writes(Dut& d, golden::AsyncFifo& m) : dut(d), model(m) {}
  void sample() override {
    if (dut.w_valid && dut.w_ready) model.put(dut.w_data);
  }
  Dut& dut;
  golden::AsyncFifo& model;
};
template <class Dut>
struct Reads : Agent {
  Reads(Dut& d, golden::AsyncFifo& m, Scoreboard& b, const CycleCounter& c) : dut(d), model(m), board(b), clock(c) {}
  void sample() override {
    if (dut.r_valid && dut.r_ready) board.compare(dut.r_data, model.take(), {}, clock.cycle());
  }
  Dut& dut;
  golden::AsyncFifo& model;
  Scoreboard& board;
  const CycleCounter& clock;
};

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
  // Until a reset has come through to both sides (async_fifo.vhd, Reset).
  void settle() { clocks.run_for(8 * w.period() + 8 * r.period()); }
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
    golden::AsyncFifo model(TestType::kDepth);
    Scoreboard mirror("model");
    Writes<typename TestType::Dut> writes(bench.dut, model);
    Reads<typename TestType::Dut> reads(bench.dut, model, mirror, bench.r);
    bench.w.add(writes);
    bench.r.add(reads);
    constexpr uint64_t kWords = 400;
    bench.push(kWords);
    bench.clocks.run_until([&] { return bench.board.outstanding() == 0 || bench.board.errors() > 0; });
    bench.settle();
    INFO("seed " << test_seed() << " round " << round << " periods " << t.w_period << ' ' << t.r_period << " phases "
                 << t.w_phase << ' ' << t.r_phase << " jitter " << t.jitter << " stalls " << in_stall << ' '
                 << out_stall);
    INFO(bench.board.report() << mirror.report());
    REQUIRE(bench.board.ok());
    REQUIRE(bench.board.compared() == kWords);
    REQUIRE(mirror.ok());
    REQUIRE(mirror.compared() == kWords);
    REQUIRE(bench.monitor.protocol_errors() == 0);
  }
}

TEMPLATE_TEST_CASE("async_fifo: full after exactly its depth, then empty", "", Shape9x4, Shape12x16, Shape1x64) {
  std::mt19937 random(test_seed());
  for (int round = 0; round < 20; ++round) {
    Bench<TestType> bench(static_cast<uint32_t>(random()), random_timing(random), 0, 1.0);  // the reader takes nothing
    CHECK(bench.dut.w_ready == 1);
    CHECK(bench.dut.r_valid == 0);
    bench.push(TestType::kDepth + 3);
    bench.clocks.run(bench.w, TestType::kDepth + 20);
    REQUIRE(bench.driver.sent() == TestType::kDepth);
    CHECK(bench.dut.w_ready == 0);
    bench.monitor.set_stall(0);
    bench.clocks.run_until([&] { return bench.board.outstanding() == 0; });
    bench.settle();
    CHECK(bench.dut.w_ready == 1);
    CHECK(bench.dut.r_valid == 0);
    INFO(bench.board.report());
    REQUIRE(bench.board.ok());
  }
}

TEMPLATE_TEST_CASE("async_fifo: a word each clock at equal clocks", "", Shape9x4, Shape12x16, Shape1x64) {
  Bench<TestType> bench(test_seed(), {8000, 8000, 0, 3000, 0}, 0, 0);
  const uint64_t begin = bench.w.cycle();
  constexpr uint64_t kWords = 600;
  bench.push(kWords);
  bench.clocks.run_until([&] { return bench.board.outstanding() == 0; });
  const uint64_t clocks = bench.w.cycle() - begin;
  INFO(clocks << " clocks");
  if (TestType::kDepth >= 8)
    CHECK(clocks <= kWords + 4);
  else
    CHECK(clocks <= kWords * 6 / TestType::kDepth + 4);  // a place is busy for 6 clocks
  CHECK(bench.board.ok());
}

TEST_CASE("async_fifo: a word shows with the second edge of the reader") {
  std::mt19937 random(test_seed() + 5);
  for (int round = 0; round < 40; ++round) {
    Bench<Shape9x4> bench(static_cast<uint32_t>(random()), random_timing(random), 0, 0);
    bench.monitor.set_stall(1.0);
    bench.push(1);
    bench.clocks.run_until([&] { return bench.driver.sent() == 1; });
    CHECK(bench.dut.r_valid == 0);
    bench.clocks.run(bench.r, 1);
    CHECK(bench.dut.r_valid == 0);
    bench.clocks.run(bench.r, 1);
    REQUIRE(bench.dut.r_valid == 1);
  }
}

// Words are numbered. Whatever the resets do, none may come twice, late or out of thin air; each reset loses at most
// what the FIFO held; and from the end of a reset on nothing is lost.
TEMPLATE_TEST_CASE("async_fifo: resets of one side or both, in any order, while both work", "", Shape9x4, Shape12x16) {
  std::mt19937 random(test_seed() + 9);
  uint64_t total_lost = 0;
  constexpr uint64_t kModulus = uint64_t{1} << TestType::kBits;
  for (int round = 0; round < 150; ++round) {
    const Timing t = random_timing(random);
    const double stalls[] = {0, 0.5, 0.95};
    Bench<TestType> bench(static_cast<uint32_t>(random()), t, stalls[random() % 3], stalls[random() % 3]);
    std::vector<uint64_t> received;
    StreamMonitor<typename TestType::Dut, typename Bench<TestType>::Ports> numbers(
        bench.r, {&bench.dut.r_valid, &bench.dut.r_ready, &bench.dut.r_data, nullptr}, 1, stalls[random() % 3],
        [&](const Beat& b) { received.push_back(b.data); });
    numbers.set_watching(false);
    bench.monitor.set_watching(false);
    Clocks<typename TestType::Dut>& clocks = bench.clocks;
    INFO("seed " << test_seed() << " round " << round << " periods " << t.w_period << ' ' << t.r_period << " phases "
                 << t.w_phase << ' ' << t.r_phase << " jitter " << t.jitter);
    // The bench's own monitor decides r_ready; this one only listens.
    struct Listener : Agent {
      std::function<void()> call;
      void sample() override { call(); }
    } listener;
    listener.call = [&] { numbers.sample(); };
    bench.r.add(listener);
    uint64_t pushed = 0;
    auto push = [&](uint64_t words) {
      for (uint64_t i = 0; i < words; ++i) bench.driver.push(pushed++ % kModulus);
    };
    push(random() % (2 * TestType::kDepth));
    clocks.run_for(static_cast<double>(random() % 30) * std::max(t.w_period, t.r_period));
    // One or two pulses, which may overlap.
    const int which = static_cast<int>(random() % 3);  // 0 writer, 1 reader, 2 both
    CData* first = random() % 2 ? &bench.dut.w_rst : &bench.dut.r_rst;
    if (which == 0) first = &bench.dut.w_rst;
    if (which == 1) first = &bench.dut.r_rst;
    CData* second = first == &bench.dut.w_rst ? &bench.dut.r_rst : &bench.dut.w_rst;
    auto clock_of = [&](const CData* pin) -> ClockDomain& { return pin == &bench.dut.w_rst ? bench.w : bench.r; };
    const bool overlap = random() % 2 != 0;
    *first = 1;
    clocks.run(clock_of(first), 1 + random() % 3);
    if (which == 2 && overlap) *second = 1, clocks.run(clock_of(second), 1 + random() % 3);
    *first = 0;
    if (which == 2 && !overlap) {
      clocks.run_for(static_cast<double>(random() % 20) / 4 * std::max(t.w_period, t.r_period));
      *second = 1;
      clocks.run(clock_of(second), 1 + random() % 3);
    }
    *second = 0;
    bench.settle();
    // What a reset leaves in the driver, and new words, must all arrive.
    const uint64_t mark = bench.driver.sent();
    push(3 * TestType::kDepth);
    clocks.run_until([&] { return bench.driver.done(); });
    bench.monitor.set_stall(0);
    clocks.run_for(static_cast<double>(TestType::kDepth + 8) * 4 * std::max(t.w_period, t.r_period));
    REQUIRE(bench.dut.r_valid == 0);
    REQUIRE(bench.dut.w_ready == 1);
    REQUIRE(pushed < kModulus);
    REQUIRE(bench.driver.sent() == pushed);
    for (size_t i = 1; i < received.size(); ++i) REQUIRE(received[i] > received[i - 1]);
    REQUIRE(received.back() == pushed - 1);
    const uint64_t lost = pushed - received.size();
    total_lost += lost;
    REQUIRE(lost <= (which == 2 ? 2 : 1) * uint64_t{TestType::kDepth});
    REQUIRE(std::count_if(received.begin(), received.end(), [&](uint64_t n) { return n >= mark; }) ==
            static_cast<int64_t>(pushed - mark));
  }
  CHECK(total_lost > 0);  // else no reset ever found a word
}

TEMPLATE_TEST_CASE("async_fifo: a reset of one side alone empties it", "", Shape9x4, Shape12x16, Shape1x64) {
  std::mt19937 random(test_seed() + 3);
  for (int round = 0; round < 20; ++round) {
    Bench<TestType> bench(static_cast<uint32_t>(random()), random_timing(random), 0, 1.0);
    bench.push(TestType::kDepth);
    bench.clocks.run_until([&] { return bench.driver.done(); });
    bench.settle();
    REQUIRE(bench.dut.r_valid == 1);
    const bool writer = round % 2 != 0;
    CData& pin = writer ? bench.dut.w_rst : bench.dut.r_rst;
    bench.monitor.set_watching(false);
    pin = 1;
    bench.clocks.run(writer ? bench.w : bench.r, 1);
    pin = 0;
    bench.settle();
    CHECK(bench.dut.r_valid == 0);
    CHECK(bench.dut.w_ready == 1);
    bench.board.forget_expectations();
    bench.push(TestType::kDepth);
    bench.monitor.set_stall(0);
    bench.clocks.run_until([&] { return bench.board.outstanding() == 0; });
    bench.settle();
    INFO(bench.board.report());
    REQUIRE(bench.board.ok());
  }
}

TEST_CASE("async_fifo: a reset waits for a clock that stands still") {
  Bench<Shape9x4> bench(test_seed(), {40000, 8000, 0, 300, 0}, 0, 0);
  bench.w.set_running(false);
  bench.dut.r_rst = 1;
  bench.clocks.run(bench.r, 3);
  bench.dut.r_rst = 0;
  bench.clocks.run(bench.r, 100);
  CHECK(bench.dut.r_valid == 0);
  bench.w.set_running(true);
  bench.settle();
  CHECK(bench.dut.w_ready == 1);
  bench.push(50);
  bench.clocks.run_until([&] { return bench.board.outstanding() == 0; });
  INFO(bench.board.report());
  CHECK(bench.board.ok());
}
