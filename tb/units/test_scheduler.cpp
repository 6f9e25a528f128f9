// SPDX-License-Identifier: Apache-2.0
// scheduler: every write to the engine, in order; launches only when they may happen, and then at once; tiles that end
// well, are refused or dropped, never begin, wait for pixels that nobody has, or lose what a buffer held; an engine
// that begins by itself; stops in every state. The engine is a few lines here: busy after the start, idle after the
// last map beat, a failure or an abort.
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
    dut.starved = dut.lost = 0;
    sim.add(*this);
    sim.reset();
  }

  Sim<Vscheduler> sim;
  Vscheduler& dut;
  golden::Scheduler model;
  Scoreboard writes{"cfg"}, status{"status"};
  int good = 0, bad = 0, stops = 0, tables = 0, stops_loading = 0;
  int never = 0, starved = 0, spurious = 0, lost = 0;  // starts that had no effect, ...

  bool ok() const { return writes.ok() && status.ok(); }
  std::string report() const { return writes.report() + status.report(); }

  void drive() override {
    dut.job_we = dut.t_valid = dut.stop = dut.map_last = dut.lost = 0;
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
      if (!model.running() && !engine_busy_ && !stop_due_ && !abort_due_ && chance(table_rate_)) {
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
    status.compare(dut.tile_failed, model.tile_failed(), {}, now);
    status.compare(dut.recovered, model.recovered(), {}, now);
    if (model.failed()) status.compare(dut.failed_tile, model.failed_tile(), {}, now);

    // What may be seen on cfg in this clock.
    uint64_t start = 0;
    if (stop_due_) {
      check(golden::Scheduler::kStop, now);
    } else if (abort_due_) {
      check(golden::Scheduler::kAbort, now);
      engine_busy_ = false;
      work_ = 0;
      quirk_ = kNone;
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

    abort_due_ = !start && model.clock(dut.engine_busy, dut.map_last, dut.starved, dut.lost);
    if (dut.job_we) model.job(dut.job_addr, dut.job_data);
    stop_due_ = dut.stop;
    if (dut.stop) {
      ++stops;
      if (position_ > 0) ++stops_loading;
      position_ = 0;
      model.stop();
      abort_due_ = false;
      launched_ = false;
      // A start that is out in this clock is aborted by the command of the next.
      ending_ = 1 + static_cast<int>(random_() % 3);
    }
  }

 private:
  // What goes wrong in or around the engine.
  enum Quirk { kNone, kNever, kStarves, kLost, kSpurious };

  bool chance(double p) { return std::bernoulli_distribution(p)(random_); }
  uint32_t draw32() { return static_cast<uint32_t>(random_()); }
  void check(const golden::RegisterWrite& want, uint64_t now) {
    writes.compare(dut.cfg_tvalid, 1, {}, now);
    writes.compare(dut.cfg_tdata, want.word(), {}, now);
  }

  void drive_engine() {
    dut.starved = 0;
    if (delay_ > 0 && --delay_ == 0 && ending_ == 0) {
      quirk_ = chance(fail_rate_ / 3) ? static_cast<Quirk>(1 + random_() % 3) : kNone;
      if (quirk_ == kNever) ++never;
      engine_busy_ = quirk_ != kNever;
      fails_ = chance(fail_rate_);
      work_ = 1 + static_cast<int>(random_() % 60);
      tail_ = static_cast<int>(random_() % 3);
    }
    if (ending_ > 0 && --ending_ == 0) engine_busy_ = false, delay_ = 0, quirk_ = kNone;
    // By itself: an upset of its own.
    if (!dut.staged && !model.running() && !engine_busy_ && delay_ == 0 && ending_ == 0 && chance(fail_rate_ / 100)) {
      engine_busy_ = true;
      quirk_ = kSpurious;
      ++spurious;
    }
    if (engine_busy_ && dut.stop == 0 && quirk_ != kSpurious) {
      if (work_ > 0) {
        --work_;
        // For a while only, as between two chunks: nothing happens.
        dut.starved = quirk_ == kNone && work_ % 32 < 8;
      } else if (quirk_ == kStarves) {
        dut.starved = 1;
        starved += model.recovered();
      } else if (quirk_ == kLost) {
        dut.lost = model.running();
        lost += dut.lost;
        quirk_ = kSpurious;
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
  bool engine_busy_ = false, fails_ = false, launched_ = false, stop_due_ = false, abort_due_ = false;
  Quirk quirk_ = kNone;
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
  CHECK(bench.never > 5);
  CHECK(bench.starved > 5);
  CHECK(bench.spurious > 5);
  CHECK(bench.lost > 5);
}

TEST_CASE("scheduler: what is lost before it runs has failed") {
  Sim<Vscheduler> sim(10000, test_seed());
  auto& dut = sim.dut();
  dut.job_we = dut.t_valid = dut.staged = dut.complete = dut.stop = dut.engine_busy = dut.map_last = 0;
  dut.starved = dut.lost = 0;
  sim.reset();
  dut.tile = 77;
  auto ends = [&](int within) {
    int pulses = 0, recovered = 0, starts = 0;
    bool aborted = false;
    for (int i = 0; i < within; ++i) {
      sim.tick();
      dut.lost = 0;
      dut.eval();
      pulses += dut.tile_failed;
      recovered += dut.recovered;
      starts += dut.go;
      aborted |= dut.cfg_tvalid && dut.cfg_tdata == golden::Scheduler::kAbort.word();
      if (aborted) dut.engine_busy = dut.starved = 0;
    }
    CHECK(pulses == 1);
    CHECK(recovered == 1);
    CHECK(starts == 0);
    CHECK(aborted);
    CHECK(dut.failed);
    CHECK(dut.failed_tile == 77);
    CHECK(!dut.running);
    dut.stop = 1;
    sim.tick();
    dut.stop = 0;
    sim.tick();
    CHECK(!dut.failed);
  };
  SECTION("a staged tile whose rows are lost") {
    dut.staged = 1;
    sim.tick();
    dut.lost = 1;
    dut.staged = 0;
    ends(24);
  }
  for (int clock = 1; clock < 17; clock += 4) {
    DYNAMIC_SECTION("rows lost in clock " << clock << " of the launch") {
      dut.staged = dut.complete = 1;
      sim.run(static_cast<uint64_t>(clock));
      dut.staged = dut.complete = 0;
      dut.lost = 1;
      ends(24);
    }
    DYNAMIC_SECTION("the engine begins by itself in clock " << clock << " of the launch") {
      dut.staged = dut.complete = 1;
      sim.run(static_cast<uint64_t>(clock) + 1);
      dut.engine_busy = dut.starved = 1;
      sim.run(2);  // from now on without the rows: tile_failed clears the row buffer only at the end
      dut.staged = dut.complete = 0;
      ends(24);
    }
  }
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
