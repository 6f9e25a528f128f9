// SPDX-License-Identifier: Apache-2.0
// map_sender: every clock against the model: READs for the map that is there, for another one and for one that comes
// later, of no chunk and of many, replaced while they are in force; maps and sessions that end meanwhile; whose turn it
// is.
#include <random>

#include "Vmap_sender.h"
#include "golden/map_sender.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

struct Bench : Agent {
  explicit Bench(uint32_t seed) : sim(4000000, seed), dut(sim.dut()), random(seed) {
    apply();
    sim.add(*this);
    sim.reset();
  }
  bool chance(unsigned n) { return random() % n == 0; }
  void apply() {
    dut.clear = in.clear;
    dut.decide = in.decide;
    dut.read_head = in.read_head;
    dut.read_tail = in.read_tail;
    dut.word = in.word;
    dut.word_next = in.word_next;
    dut.number_ok = static_cast<uint16_t>(in.word >> 16) == model.map_tile();
    dut.answered = in.answered;
    dut.started = in.started;
    dut.sent = in.sent;
    dut.map_started = in.map_started;
    dut.map_busy = in.map_busy;
    dut.run_tile = in.run_tile;
    dut.f_ready = in.ready;
  }
  // As the sequencer: a message and its argument, a reply, a chunk; one at a time.
  void drive() override {
    golden::MapSender::Inputs next;
    next.map_busy = chance(50) ? !in.map_busy : in.map_busy;
    next.ready = !chance(4);
    next.run_tile = static_cast<uint16_t>(random() % 3);
    next.map_started = chance(60);
    next.clear = chance(400);
    const uint16_t tile = static_cast<uint16_t>(random() % 3);
    next.word = uint32_t{tile} << 16 | (random() & 0xffff);
    next.word_next = static_cast<uint32_t>((random() % (chance(8) ? 0x10000 : 6)) << 16 | (random() & 0xffff));
    if (step == 0 && chance(12)) {
      next.decide = true;
      next.read_head = chance(2);
      if (next.read_head) step = 3;
    } else if (step == 3) {
      next.read_tail = chance(3);
      if (next.read_tail) step = 0;
    } else if (step == 4) {
      next.sent = chance(8);
      if (next.sent) step = 0;
    } else if (chance(6)) {
      next.answered = true;
    } else if (model.due(next)) {
      next.started = true;
      step = 4;
    }
    if (next.clear) next.sent = next.read_tail = next.read_head = false;
    if (next.clear) step = 0;
    in = next;
    apply();
  }
  void sample() override {
    const uint64_t now = sim.cycle();
    board.compare(dut.due, model.due(in), {}, now);
    board.compare(dut.first, model.first(), {}, now);
    board.compare(dut.map_tile, model.map_tile(), {}, now);
    if (known) board.compare(dut.f_chunk, model.chunk(), {}, now);
    if (kept) board.compare(dut.map_keep, model.keep(), {}, now);
    known = known || in.read_head;  // no reset
    kept = kept || in.map_started;
    chunks += in.sent;
    due += model.due(in);
    model.clock(in);
  }

  Sim<Vmap_sender> sim;
  Vmap_sender& dut;
  golden::MapSender model;
  golden::MapSender::Inputs in;
  Scoreboard board{"map"};
  std::mt19937 random;
  int step = 0, chunks = 0, due = 0;
  bool known = false, kept = false;
};

}  // namespace

TEST_CASE("map_sender: every clock as the model says") {
  INFO("seed " << test_seed());
  Bench bench(test_seed());
  bench.sim.run(300000);
  INFO(bench.board.report());
  CHECK(bench.board.ok());
  CHECK(bench.chunks > 1000);
  CHECK(bench.due > 1000);
}
