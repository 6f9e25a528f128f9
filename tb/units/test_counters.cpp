// SPDX-License-Identifier: Apache-2.0
// counters: no pulse lost or doubled at the highest legal rate in any phase of the scanner, r_valid never stale, read
// latency, zero after reset, carries through all bits.
#include <algorithm>
#include <random>
#include <vector>

#include "Vcounters_1.h"
#include "Vcounters_13.h"
#include "Vcounters_2.h"
#include "Vcounters_40.h"
#include "Vcounters_64.h"
#include "golden/counters.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

template <class Dut>
class Bench : public Agent {
 public:
  Bench(int count, uint32_t seed) : sim(4000000, seed), dut(sim.dut()), model(count), count_(count), random_(seed) {
    dut.events = 0;
    dut.r_index = 0;
    next_.assign(static_cast<size_t>(count), 0);
    pulses_.assign(static_cast<size_t>(count), {});
    sim.add(*this);
    restart();
  }
  // Resets, and waits for the end of the first scan.
  void restart(int reset_clocks = 4) {
    quiet = true;
    sim.reset(reset_clocks);
    model = golden::Counters(count_);
    for (auto& p : pulses_) p.clear();
    for (auto& n : next_) n = 0;
    watching_ = false;
    sim.run(model.spacing() + 8);
    watching_ = true;
    longest_read = 0;
  }

  Sim<Dut> sim;
  Dut& dut;
  golden::Counters model;
  Scoreboard board{"counters"};
  bool quiet = false;  // no events
  bool hold_index = false;
  double activity = 1.0;  // share of the legal rate
  uint64_t longest_read = 0, reads = 0;

  void drive() override {
    uint64_t events = 0;
    for (int i = 0; i < count_; ++i) {
      auto& due = next_[static_cast<size_t>(i)];
      if (quiet || sim.cycle() < due || !std::bernoulli_distribution(activity)(random_)) continue;
      events |= uint64_t{1} << i;
      due = sim.cycle() + model.spacing() + (random_() % 3 == 0 ? random_() % 5 : 0);
    }
    set(dut.events, events);
    if (!hold_index && random_() % 9 == 0) index(static_cast<int>(random_() % static_cast<unsigned>(count_ + 1)) & 63);
  }
  void index(int n) {
    if (n != dut.r_index) steady_ = 0;
    dut.r_index = static_cast<CData>(n);
  }

  void sample() override {
    const uint64_t now = sim.cycle();
    const int n = dut.r_index;
    if (dut.r_valid && n < count_) {
      // Counted by then: everything older than that before the index came, and its reading; nothing that came after
      // this clock.
      const uint32_t all = model.value(n);
      const uint64_t old = now - std::min(now, steady_ + 7 + model.counted_after());
      uint32_t recent = 0;
      const auto& pulses = pulses_[static_cast<size_t>(n)];
      for (auto p = pulses.rbegin(); p != pulses.rend() && *p >= old; ++p) ++recent;
      const Place place{-1, n, 0, 0};
      const uint32_t value = dut.r_data;
      board.compare(value + recent >= all && value <= all ? all : value, all, place, now);
      if (quiet_for_ > model.counted_after() + steady_) board.compare(value, all, place, now);
      if (was_valid_ && steady_ > 0) board.compare(value, previous_, place, now);  // holds
      if (!was_valid_ || steady_ == 0) {
        longest_read = std::max(longest_read, steady_);
        ++reads;
      }
    } else if (!dut.r_valid && watching_ && steady_ > 7) {
      board.compare(0, 1, {-1, n, 0, 0}, now);  // r_valid is late
    }
    was_valid_ = dut.r_valid;
    previous_ = dut.r_data;
    ++steady_;
    quiet_for_ = dut.events ? 0 : quiet_for_ + 1;
    for (int i = 0; i < count_; ++i)
      if (uint64_t{dut.events} >> i & 1) {
        model.pulse(i, now);
        pulses_[static_cast<size_t>(i)].push_back(now);
      }
  }
  // Every counter, after all events have been counted.
  void read_all() {
    quiet = hold_index = true;
    sim.run(model.counted_after() + 1);
    for (int i = 0; i < count_; ++i) {
      index((i + 1) & 63);  // another one in between, so that it is read afresh
      sim.tick();
      index(i);
      do sim.tick();
      while (!dut.r_valid);
      board.compare(dut.r_data, model.value(i), {-1, i, 0, 0}, sim.cycle());
    }
    quiet = hold_index = false;
  }

 private:
  template <class T>
  static void set(T& port, uint64_t value) {
    port = static_cast<T>(value);
  }
  int count_;
  std::mt19937 random_;
  std::vector<uint64_t> next_;
  std::vector<std::vector<uint64_t>> pulses_;
  uint64_t steady_ = 0, quiet_for_ = 0;
  uint32_t previous_ = 0;
  bool was_valid_ = false, watching_ = false;
};

template <class Dut>
void run_all(int count) {
  const uint32_t seed = test_seed();
  INFO("seed " << seed << " counters " << count);
  Bench<Dut> bench(count, seed);
  bench.read_all();  // zeros
  for (const double activity : {1.0, 0.02, 1.0}) {
    bench.activity = activity;
    bench.sim.run(40 * bench.model.spacing() + 1000);
    bench.read_all();
  }
  for (int i = 0; i < 16; ++i) {  // in all phases of the scanner, by short resets
    bench.quiet = false;
    bench.sim.run(3 * bench.model.spacing() + static_cast<uint64_t>(i));
    bench.restart(1 + i / 4);
    bench.read_all();  // zeros again
  }
  bench.quiet = false;
  bench.sim.run(10 * bench.model.spacing());
  bench.read_all();
  INFO(bench.board.report());
  CHECK(bench.board.ok());
  CHECK(bench.reads > 10);
  CHECK(bench.longest_read <= 7);
}

}  // namespace

TEST_CASE("counters: 64") { run_all<Vcounters_64>(64); }
TEST_CASE("counters: 40") { run_all<Vcounters_40>(40); }
TEST_CASE("counters: 13") { run_all<Vcounters_13>(13); }
TEST_CASE("counters: 2") { run_all<Vcounters_2>(2); }
TEST_CASE("counters: 1, past many carries") {
  run_all<Vcounters_1>(1);
  Bench<Vcounters_1> bench(1, test_seed());
  bench.quiet = false;
  bench.sim.run(5 * 70000);
  bench.read_all();
  INFO(bench.board.report());
  CHECK(bench.board.ok());
  CHECK(bench.model.value(0) > 65536);
}
