// SPDX-License-Identifier: Apache-2.0
// session_memory: every clock against the model, while frames pass: OPEN, repeated OPEN, READ, ARP and messages that
// differ from what is kept in a byte or in none.
#include <array>
#include <random>

#include "Vsession_memory.h"
#include "golden/session_memory.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"

using namespace psweep;
using namespace psweep::tb;
using golden::Step;

namespace {

struct Bench {
  explicit Bench(uint32_t seed) : sim(40000000, seed), dut(sim.dut()), random(seed) {
    apply();
    sim.reset(1);
  }
  bool chance(unsigned n) { return random() % n == 0; }
  void apply() {
    dut.state = static_cast<CData>(in.step);
    dut.m_kind = static_cast<CData>(in.kind);
    dut.of_read = in.read;
    dut.session_io = in.session_io;
    dut.renewed = in.renewed;
    dut.tick_ms = in.tick;
    dut.r_addr = in.address;
    dut.r_data = in.data;
    dut.byte_valid = in.valid;
    dut.byte_place = static_cast<CData>(in.place);
  }
  void clock() {
    in.tick = chance(40);
    apply();
    dut.eval();
    const uint64_t now = sim.cycle();
    board.compare(dut.peer_we, golden::SessionMemory::peer_write(in), {-1, in.place, 0, 0}, now);
    if (dut.peer_we) board.compare(dut.peer_index, golden::SessionMemory::peer_index(in), {-1, in.place, 1, 0}, now);
    if (filled) {
      board.compare(dut.memory_byte, model.byte(), {-1, in.place, 2, 0}, now);
      board.compare(dut.nonce_ok, model.nonce_ok(in), {-1, in.place, 3, 0}, now);
    }
    if (filled) {
      board.compare(dut.peer_ok, model.peer_ok(), {-1, in.place, 4, 0}, now);
      board.compare(dut.token_ok, model.token_ok(), {-1, in.place, 5, 0}, now);
    }
    good += in.step == Step::kWords && model.peer_ok() && model.token_ok() && model.nonce_ok(in);
    foreign += in.step == Step::kWords && !model.peer_ok();
    model.clock(in);
    sim.tick();
  }
  // Bytes first .. last of the frame, as message_reader has them. What the frame says of the session is right but for
  // one byte at times.
  void scan(Step step, int first, int last) {
    in.step = step;
    for (int place = first; place <= last + 1; ++place) {
      in.address = static_cast<uint16_t>(place);
      in.valid = place > first;
      in.place = place > first ? place - 1 : 63;
      in.data = static_cast<uint8_t>(random());
      if (in.valid && same) in.data = model.byte();
      if (in.valid && place - 1 == odd) in.data = static_cast<uint8_t>(in.data ^ 1 << random() % 8);
      clock();
    }
    in.valid = false;
  }
  void wait(Step step, int clocks) {
    in.step = step;
    for (int i = 0; i < clocks; ++i) clock();
  }
  void message() {
    same = !chance(3);
    odd = chance(2) ? -1 : 6 + static_cast<int>(random() % 56);
    in.session_io = false;
    in.renewed = true;
    in.kind = chance(8) ? static_cast<int>(random() % 4) : 2;
    in.read = chance(2);
    wait(Step::kIdle, 1 + static_cast<int>(random() % 5));
    scan(Step::kHeader, 6, 57);
    wait(Step::kDecide, 1);
    scan(Step::kWords, 58, 61);
    in.session_io = in.kind == 2 && !chance(3);
    in.renewed = !chance(3);
    wait(Step::kWait, 1 + static_cast<int>(random() % 5));
    scan(Step::kPeer, 6, in.session_io && !in.read ? 61 : 57);
    wait(Step::kFetch, 1 + static_cast<int>(random() % 20));
  }

  Sim<Vsession_memory> sim;
  Vsession_memory& dut;
  golden::SessionMemory model;
  golden::SessionMemory::Inputs in;
  Scoreboard board{"session"};
  std::mt19937 random;
  bool same = false, filled = false;
  int odd = -1, good = 0, foreign = 0;
};

}  // namespace

TEST_CASE("session_memory: every clock as the model says") {
  INFO("seed " << test_seed());
  Bench bench(test_seed());
  // The memory has no reset: an OPEN fills what the others read.
  bench.wait(Step::kIdle, 2);
  bench.in.session_io = true;
  bench.in.renewed = false;
  bench.scan(Step::kPeer, 0, 63);
  bench.wait(Step::kIdle, 2);
  bench.filled = true;
  for (int i = 0; i < 4000; ++i) bench.message();
  INFO(bench.board.report());
  CHECK(bench.board.ok());
  CHECK(bench.good > 1000);
  CHECK(bench.foreign > 1000);
}
