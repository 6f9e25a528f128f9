// SPDX-License-Identifier: Apache-2.0
// reply_limiter: every clock against the model: bursts that empty each bucket, refusals, refills, an answer in the
// clock of a refill, buckets that stay full.
#include <random>

#include "Vreply_limiter.h"
#include "golden/reply_limiter.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

using Outcome = golden::ReplyLimiter::Outcome;

struct Bench : Agent {
  explicit Bench(uint32_t seed) : sim(4000000, seed), dut(sim.dut()), random(seed) {
    dut.tick_ms = dut.request = dut.bucket = 0;
    sim.add(*this);
    sim.reset();
  }
  void drive() override {
    dut.tick_ms = sim.cycle() >= next_tick;
    if (dut.tick_ms) next_tick = sim.cycle() + 3 + random() % spacing;
    if (!dut.request && random() % idle == 0) {
      dut.request = 1;
      dut.bucket = static_cast<CData>(random() % 3);
    }
  }
  void sample() override {
    const Outcome want = model.ask(dut.request, dut.bucket);
    board.compare(dut.grant, want == Outcome::kGranted, {-1, dut.bucket, 0, 0}, sim.cycle());
    board.compare(dut.refuse, want == Outcome::kRefused, {-1, dut.bucket, 0, 0}, sim.cycle());
    granted += want == Outcome::kGranted;
    refused += want == Outcome::kRefused;
    at_refill += want == Outcome::kGranted && dut.tick_ms;
    for (int i = 0; i < 3; ++i) full += model.left(i) == net::kBucketAnswers;
    model.clock(dut.request, dut.bucket, dut.tick_ms);
    done = want != Outcome::kWaits;
  }
  void run(int clocks) {
    for (int i = 0; i < clocks; ++i) {
      sim.tick();
      if (done) dut.request = 0;
    }
  }

  Sim<Vreply_limiter> sim;
  Vreply_limiter& dut;
  golden::ReplyLimiter model;
  Scoreboard board{"limiter"};
  std::mt19937 random;
  uint64_t next_tick = 100;
  uint32_t spacing = 50, idle = 2;
  bool done = false;
  int granted = 0, refused = 0, at_refill = 0;
  int64_t full = 0;
};

}  // namespace

TEST_CASE("reply_limiter: every clock as the model says") {
  INFO("seed " << test_seed());
  Bench bench(test_seed());
  for (const uint32_t spacing : {50u, 400u, 4u, 2000u, 20u})
    for (const uint32_t idle : {1u, 8u, 60u}) {
      bench.spacing = spacing;
      bench.idle = idle;
      bench.run(20000);
    }
  INFO(bench.board.report());
  CHECK(bench.board.ok());
  CHECK(bench.granted > 1000);
  CHECK(bench.refused > 1000);
  CHECK(bench.at_refill > 100);
  CHECK(bench.full > 1000);
}
