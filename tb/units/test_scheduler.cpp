// SPDX-License-Identifier: Apache-2.0
// scheduler: every write to the engine, in order; launches only when they may happen, and then at once; tiles that end
// well, are refused or dropped; stops in every state. The engine is a few lines here: busy after the start, idle after
// the last map beat, a failure or an abort.
#include <algorithm>
#include <random>

#include "Vscheduler.h"
#include "golden/scheduler.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

class Bench : public Agent {
 public:
  Bench(uint32_t seed, double stop_rate, double fail_rate, double table_rate)
      : sim(4000000, seed),
        dut(sim.dut()),
        random_(seed),
        stop_rate_(stop_rate),
        fail_rate_(fail_rate),
        table_rate_(table_rate) {
    dut.job_we = dut.t_valid = dut.staged = dut.complete = dut.stop = dut.engine_busy = dut.map_last = 0;
    sim.add(*this);
    sim.reset();
  }

  Sim<Vscheduler> sim;
  Vscheduler& dut;
  golden::Scheduler model;
  Scoreboard writes{"cfg"}, status{"status"};
  int good = 0, bad = 0, stops = 0, tables = 0, stops_loading = 0;

  bool ok() const { return writes.ok() && status.ok(); }
  std::string report() const { return writes.report() + status.report(); }

  void drive() override {
    dut.job_we = dut.t_valid = dut.stop = dut.map_last = 0;
    dut.job_addr = static_cast<CData>(random_() & 31);
    dut.job_data = draw32();
    dut.t_address = static_cast<SData>(random_());
    dut.t_data = draw32();
    drive_engine();
    if (chance(stop_rate_)) {
      dut.stop = 1;
      dut.staged = dut.complete = 0;
      filled_ = 0;
      return;
    }
    if (launched_) {  // the arbiter's flag falls one clock after go
      dut.staged = dut.complete = 0;
      launched_ = false;
      dut.tile = static_cast<SData>(random_());
    }
    if (!dut.staged) {
      dut.complete = chance(0.5);  // means nothing
      if (!model.running() && !engine_busy_ && !stop_due_ && chance(table_rate_)) {
        dut.t_valid = 1;
        return;
      }
      // The next tile: its words in order, then it is staged, then complete.
      if (filled_ < net::kJobWords) {
        if (chance(0.5)) return;
        dut.job_we = 1;
        dut.job_addr = static_cast<CData>(filled_++);
      } else if (chance(0.2)) {
        dut.staged = 1;
        dut.tile = static_cast<SData>(random_());
        dut.complete = chance(0.3);
      }
    } else if (chance(0.05)) {
      dut.complete = 1;
    }
  }

  void sample() override {
    const uint64_t now = sim.cycle();
    status.compare(dut.running, model.running() || dut.go, {}, now);
    if (model.running()) status.compare(dut.run_tile, model.run_tile(), {}, now);
    status.compare(dut.failed, model.failed(), {}, now);
    if (model.failed()) status.compare(dut.failed_tile, model.failed_tile(), {}, now);

    // What may be seen on cfg in this clock.
    uint64_t start = 0;
    if (stop_due_) {
      check(golden::Scheduler::kStop, now);
    } else if (dut.t_valid) {
      check({dut.t_address, dut.t_data}, now);
      ++tables;
    } else if (dut.cfg_tvalid) {
      if (position_ == 0) {
        expected_ = model.launch();
        // The condition held when the RTL saw it: two clocks before the first word.
        status.compare(able_[1], 1, {}, now);
      }
      check(expected_[position_], now);
      start = ++position_ == expected_.size();
    } else if (position_ > 0) {
      writes.compare(0, expected_[position_].word(), {}, now);  // a word is missing
    }
    status.compare(dut.go, start, {}, now);
    if (start) {
      position_ = 0;
      filled_ = 0;
      launched_ = true;
      model.started(dut.tile);
      delay_ = 1 + static_cast<int>(random_() % 4);
    }
    const bool able = dut.staged && dut.complete && !dut.engine_busy && !model.running() && !dut.go && !dut.stop;
    waited_ = able && position_ == 0 ? waited_ + 1 : 0;
    if (waited_ > 3) status.compare(0, 1, {}, now);  // it should have been launched
    able_[1] = able_[0];
    able_[0] = able;

    if (!start) model.clock(dut.engine_busy, dut.map_last);
    if (dut.job_we) model.job(dut.job_addr, dut.job_data);
    stop_due_ = dut.stop;
    if (dut.stop) {
      ++stops;
      if (position_ > 0) ++stops_loading;
      position_ = 0;
      model.stop();
      launched_ = false;
      // A start that is out in this clock is aborted by the command of the next.
      ending_ = 1 + static_cast<int>(random_() % 3);
    }
  }

 private:
  bool chance(double p) { return std::bernoulli_distribution(p)(random_); }
  uint32_t draw32() { return static_cast<uint32_t>(random_()); }
  void check(const golden::RegisterWrite& want, uint64_t now) {
    writes.compare(dut.cfg_tvalid, 1, {}, now);
    writes.compare(dut.cfg_tdata, want.word(), {}, now);
  }

  void drive_engine() {
    if (delay_ > 0 && --delay_ == 0 && ending_ == 0) {
      engine_busy_ = true;
      fails_ = chance(fail_rate_);
      work_ = 1 + static_cast<int>(random_() % 60);
      tail_ = static_cast<int>(random_() % 3);
    }
    if (ending_ > 0 && --ending_ == 0) engine_busy_ = false, delay_ = 0;
    if (engine_busy_ && dut.stop == 0) {
      if (work_ > 0) {
        --work_;
      } else if (fails_) {
        engine_busy_ = false;
        ++bad;
      } else if (work_ == 0) {
        dut.map_last = 1;
        ++good;
        work_ = -1;
        if (tail_ == 0) engine_busy_ = false;  // falls with it, or later
      } else if (--tail_ <= 0) {
        engine_busy_ = false;
      }
    }
    dut.engine_busy = engine_busy_;
  }

  std::mt19937 random_;
  double stop_rate_, fail_rate_, table_rate_;
  bool engine_busy_ = false, fails_ = false, launched_ = false, stop_due_ = false;
  int filled_ = 0, delay_ = 0, ending_ = 0, work_ = 0, tail_ = 0, waited_ = 0;
  bool able_[2] = {};
  size_t position_ = 0;
  std::vector<golden::RegisterWrite> expected_;
};

}  // namespace

TEST_CASE("scheduler: tiles that end well, are refused or dropped") {
  const uint32_t seed = test_seed();
  INFO("seed " << seed);
  Bench bench(seed, 0, 0.3, 0.1);
  bench.sim.run_until([&] { return bench.good > 300; });
  INFO(bench.report());
  CHECK(bench.ok());
  CHECK(bench.bad > 50);
  CHECK(bench.tables > 100);
}

TEST_CASE("scheduler: stops in every state") {
  const uint32_t seed = test_seed();
  INFO("seed " << seed);
  Bench bench(seed, 0.005, 0.3, 0.05);
  bench.sim.run_until([&] { return bench.good > 300; });
  INFO(bench.report());
  CHECK(bench.ok());
  CHECK(bench.bad > 50);
  CHECK(bench.stops > 100);
  CHECK(bench.stops_loading > 10);
}
