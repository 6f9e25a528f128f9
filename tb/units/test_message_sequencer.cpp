// SPDX-License-Identifier: Apache-2.0
// message_sequencer: every clock against the model, from random inputs of each step; every step is left in every way.
// After an upset of its state, whatever it becomes, it is in C_ST_ABORT or goes on from a state that is one.
#include <array>
#include <bitset>
#include <random>
#include <set>

#include "Vmessage_sequencer.h"
#include "Vmessage_sequencer_upset.h"
#include "golden/message_sequencer.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"

using namespace psweep;
using namespace psweep::tb;
using golden::Step;

namespace {

struct Site {
  const char* name;
  int bits;
};
constexpr Site kSites[] = {
#include "message_sequencer_upset.inc"
};

constexpr Step kSteps[] = {Step::kIdle,   Step::kHeader, Step::kDecide, Step::kLimit, Step::kWords,
                           Step::kDivide, Step::kCheck,  Step::kRows,   Step::kWait,  Step::kPeer,
                           Step::kFetch,  Step::kShow,   Step::kCells,  Step::kDone,  Step::kAbort};
constexpr Step kAfterHeader[] = {Step::kWait, Step::kLimit, Step::kWords, Step::kCheck, Step::kDone, Step::kAbort};
constexpr Step kAfterWord[] = {Step::kWords, Step::kWords, Step::kWait, Step::kDivide, Step::kAbort};

template <class Dut>
struct Bench {
  explicit Bench(uint32_t seed) : sim(40000000, seed), dut(sim.dut()), random(seed) {
    apply();
    sim.reset();
    sim.tick();  // the alive of no session
    model.clock(in);
  }
  bool chance(unsigned n) { return random() % n == 0; }
  void draw() {
    const Step s = model.step();
    in.expired = chance(8);
    in.stuck = chance(300);
    in.due = chance(3);
    in.first = chance(2);
    in.grant = s == Step::kLimit && chance(3);
    in.refuse = s == Step::kLimit && !in.grant && chance(8);
    in.word_full = chance(4);
    in.header_end = s == Step::kHeader && chance(6);
    in.rows_end = s == Step::kRows && chance(6);
    in.peer_end = s == Step::kPeer && chance(6);
    in.head = kAfterHeader[random() % 6];
    in.word = kAfterWord[random() % 5];
    in.head_alive = chance(2);
    in.admitted = chance(2);
    in.long_word = chance(2);
    in.open_new = chance(6);
    in.open_again = !in.open_new && chance(6);
    in.result = chance(2) ? 0 : static_cast<int>(random() % 6);
    in.fetched = chance(4);
    in.body_cells = chance(12);
    in.reply_end = chance(12);
    in.cells_end = s == Step::kCells && chance(12);
    in.message = chance(2);
    in.sender_ready = chance(2);
    in.byte_ready = chance(2);
    in.chunk_new = chance(2);
    in.ask_answer = chance(2);
    if (s == Step::kIdle) {
      in.kind = chance(2) ? 2 : static_cast<int>(random() % 4);
      in.type = static_cast<uint8_t>(random() % 12);
    }
  }
  void apply() {
    dut.expired = in.expired;
    dut.stuck = in.stuck;
    dut.due = in.due;
    dut.first = in.first;
    dut.grant = in.grant;
    dut.refuse = in.refuse;
    dut.msg_type = in.type;
    dut.ask_answer = in.ask_answer;
    dut.word_full = in.word_full;
    dut.header_end = in.header_end;
    dut.rows_end = in.rows_end;
    dut.peer_end = in.peer_end;
    dut.head_state = static_cast<CData>(in.head);
    dut.word_state = static_cast<CData>(in.word);
    dut.head_alive = in.head_alive;
    dut.admitted = in.admitted;
    dut.long_word = in.long_word;
    dut.open_new = in.open_new;
    dut.open_again = in.open_again;
    dut.result = static_cast<CData>(in.result);
    dut.fetched = in.fetched;
    dut.body_cells = in.body_cells;
    dut.reply_end = in.reply_end;
    dut.cells_end = in.cells_end;
    dut.m_valid = in.message;
    dut.m_kind = static_cast<CData>(in.kind);
    dut.s_ready = in.sender_ready;
    dut.p_ready = in.byte_ready;
    dut.w_new = in.chunk_new;
  }
  void compare(uint64_t value, uint64_t want, int what) {
    board.compare(value, want, {-1, static_cast<int>(model.step()), what, 0}, sim.cycle());
  }
  void check() {
    compare(dut.state, static_cast<uint64_t>(model.step()), 0);
    compare(dut.step, static_cast<uint64_t>(model.clocks()), 1);
    compare(dut.session, model.session(), 2);
    compare(dut.alive, model.alive(), 3);
    compare(dut.is_map, model.is_map(), 4);
    compare(dut.is_icmp, model.is_icmp(), 5);
    compare(dut.session_io, model.session_io(), 6);
    compare(dut.renewed, model.renewed(), 7);
    compare(dut.idle_chunk, model.map_packet(in), 8);
    compare(dut.recover, model.recover(in), 9);
    compare(dut.checked, model.checked(), 10);
    compare(dut.request, model.step() == Step::kLimit, 11);
    compare(dut.bucket, static_cast<uint64_t>(model.bucket(in)), 12);
    compare(dut.read_head, model.read_head(in), 13);
    compare(dut.read_tail, model.read_tail(in), 14);
    const auto& p = model.pulses();
    compare(dut.m_done, p.done, 20);
    compare(dut.s_start, p.start, 21);
    compare(dut.tx_abort, p.abort_frame, 22);
    compare(dut.row_clear, p.abort, 23);
    compare(dut.map_clear, p.abort, 24);
    compare(dut.stop, p.abort, 25);
    compare(dut.w_check, p.check, 26);
    compare(dut.w_commit, p.commit, 27);
    compare(dut.f_start, p.packet, 28);
    compare(dut.ev_session, p.session, 29);
    compare(dut.ev_timeout, p.timeout, 30);
    compare(dut.ev_map_packet, p.packet, 31);
    compare(dut.ev_limited, p.limited, 32);
    compare(dut.ev_unreachable, p.unreachable, 33);
    compare(dut.ev_recovered, p.abort_frame, 34);
  }
  void clock() {
    draw();
    apply();
    dut.eval();
    check();
    const Step before = model.step();
    model.clock(in);
    ways.insert({before, model.step()});
    sim.tick();
  }

  Sim<Dut> sim;
  Dut& dut;
  golden::MessageSequencer model;
  golden::MessageSequencer::Inputs in;
  Scoreboard board{"sequence"};
  std::mt19937 random;
  std::set<std::pair<Step, Step>> ways;
};

}  // namespace

TEST_CASE("message_sequencer: every clock as the model says") {
  INFO("seed " << test_seed());
  Bench<Vmessage_sequencer> bench(test_seed());
  for (int i = 0; i < 400000; ++i) bench.clock();
  INFO(bench.board.report());
  CHECK(bench.board.ok());
  for (const Step s : kSteps) {
    INFO("step " << static_cast<int>(s));
    CHECK(bench.ways.count({s, Step::kAbort}) == 1);
  }
  CHECK(bench.ways.size() > 40);
}

TEST_CASE("message_sequencer: a state that is none ends the session, as one upset bit always makes it") {
  INFO("seed " << test_seed());
  int site = 0;
  for (const Site& s : kSites)
    if (std::string(s.name) == "state_q") site = 1 + static_cast<int>(&s - kSites);
  REQUIRE(site > 0);
  Bench<Vmessage_sequencer_upset> bench(test_seed());
  bench.dut.flip_site = 0;
  constexpr int kUnused = 0b11110;  // the even code that is no state
  int unused = 0;
  for (int i = 0; i < 20000; ++i) {
    for (int k = 0; k < static_cast<int>(bench.random() % 60); ++k) bench.clock();
    bench.draw();
    bench.apply();
    bench.dut.flip_site = static_cast<SData>(site);
    const bool one = i % 2 == 0;
    bench.dut.flip_mask = one ? uint64_t{1} << bench.random() % 5 : 1 + bench.random() % 31;
    bench.sim.tick();
    bench.dut.flip_site = 0;
    bench.dut.eval();
    const bool odd = std::bitset<5>(bench.dut.state).count() % 2 == 1;
    if (one) REQUIRE(odd);
    if (odd || bench.dut.state == kUnused) {
      unused += !odd;
      REQUIRE(bench.dut.recover);
      bench.sim.tick();
      REQUIRE(bench.dut.state == static_cast<CData>(Step::kAbort));
      REQUIRE(bench.dut.ev_recovered);
    }
    // From here on again with the model.
    bench.sim.reset(1);
    bench.model = {};
    bench.in = {};
    bench.apply();
    bench.sim.tick();
    bench.model.clock(bench.in);
  }
  CHECK(unused > 100);
}
