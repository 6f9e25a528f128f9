// SPDX-License-Identifier: Apache-2.0
// session_timer: every clock against the model: with and without a session, silence of all lengths, the watchdog after
// G_SESSION_MS and after 1,024 ms, waits divided by 256.
#include <random>

#include "Vsession_timer_2.h"
#include "Vsession_timer_2000.h"
#include "golden/session_timer.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

template <class Dut>
struct Bench : Agent {
  Bench(uint32_t seed, int session_ms) : sim(40000000, seed), dut(sim.dut()), model(1000, session_ms), random(seed) {
    dut.alive = 1;  // the silence has no reset
    dut.session = dut.no_rows = dut.no_room = 0;
    for (int i = 0; i < 2; ++i) sim.reset();
    sim.add(*this);
  }
  void drive() override {
    dut.alive = quiet == 0;
    if (quiet-- == 0) {
      quiet = static_cast<int64_t>(random() % longest);
      dut.session = random() % 2;
    }
    // Long waits and short ones: some end in the very clock that makes 256.
    const uint32_t change = sim.cycle() >> 12 & 1 ? 300 : 3;
    if (random() % change == 0) dut.no_rows = random() % 2;
    if (random() % change == 0) dut.no_room = random() % 2;
  }
  void sample() override {
    const uint64_t now = sim.cycle();
    board.compare(dut.tick_ms, model.tick(), {}, now);
    board.compare(dut.expired, model.expired(), {}, now);
    board.compare(dut.stuck, model.stuck(dut.session), {}, now);
    board.compare(dut.wait_rows, model.wait_rows(), {}, now);
    board.compare(dut.wait_map, model.wait_map(), {}, now);
    expired += model.expired();
    stuck[dut.session] += model.stuck(dut.session);
    waits += model.wait_rows() + model.wait_map();
    model.clock(dut.alive, dut.no_rows, dut.no_room);
  }

  Sim<Dut> sim;
  Dut& dut;
  golden::SessionTimer model;
  Scoreboard board{"timer"};
  std::mt19937 random;
  int64_t quiet = 0, expired = 0, stuck[2] = {}, waits = 0;
  uint32_t longest = 5000;
};

}  // namespace

TEST_CASE("session_timer: a session of 2 ms") {
  INFO("seed " << test_seed());
  Bench<Vsession_timer_2> bench(test_seed(), 2);
  bench.sim.run(300000);
  INFO(bench.board.report());
  CHECK(bench.board.ok());
  CHECK(bench.expired > 0);
  CHECK(bench.stuck[0] > 0);
  CHECK(bench.stuck[1] > 0);
  CHECK(bench.waits > 100);
}

TEST_CASE("session_timer: without a session 1,024 ms are enough") {
  INFO("seed " << test_seed());
  Bench<Vsession_timer_2000> bench(test_seed(), 2000);
  bench.quiet = 1100000;
  bench.dut.alive = 0;
  bench.sim.run(1099000);
  INFO(bench.board.report());
  CHECK(bench.board.ok());
  CHECK(bench.expired == 0);
  CHECK(bench.stuck[0] > 0);
}
