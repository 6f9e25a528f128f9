// SPDX-License-Identifier: Apache-2.0
// message_rules: decisions about headers and arguments equal the model's, for messages of every type, right ones and
// such with any of their parts wrong, in every situation of the chip; what they leave behind, too.
#include <array>
#include <random>

#include "Vmessage_rules.h"
#include "golden/message_rules.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"

using namespace psweep;
using namespace psweep::tb;
using golden::Step;

namespace {

struct Bench {
  explicit Bench(uint32_t seed) : sim(40000000, seed), dut(sim.dut()), random(seed) {
    step(Step::kIdle);
    dut.checked = dut.word_full = dut.at_last = 0;
    sim.reset();
  }
  bool chance(unsigned n) { return random() % n == 0; }
  void step(Step s) { dut.state = static_cast<CData>(s); }
  void compare(uint64_t value, uint64_t want, int what) {
    board.compare(value, want, {-1, m.type, what, 0}, sim.cycle());
  }

  void draw() {
    m = {};
    m.type = static_cast<uint8_t>(chance(20) ? random() & 0xff : 1 + random() % 11);
    for (bool* part :
         {&m.magic, &m.version, &m.peer, &m.token, &m.nonce, &m.header, &m.word, &m.whole, &m.start, &m.write, &m.list})
      *part = !chance(12);
    if (chance(3)) c.session = !chance(4);
    for (bool* part : {&c.rows, &c.staged, &c.running, &c.map, &c.map_complete}) *part = chance(3);
    c.engine_idle = !chance(6);
    c.map_tile = static_cast<uint16_t>(model.tile() - random() % 3);
    const uint16_t known = m.type == net::kTable ? model.table() : m.type == net::kRelease ? c.map_tile : model.tile();
    m.number = static_cast<uint16_t>(known + (chance(4) ? random() % 4 - 1 : random() % 2));
    m.index = static_cast<uint16_t>(chance(3) ? 0 : chance(8) ? random() : model.table_words() + random() % 3 - 1);
    if (m.type == net::kSet && !chance(4)) m.index = 0;
    dut.msg_type = m.type;
    dut.magic_ok = m.magic;
    dut.version_ok = m.version;
    dut.peer_ok = m.peer;
    dut.token_ok = m.token;
    dut.nonce_ok = m.nonce;
    dut.long_header = m.header;
    dut.long_word = m.word;
    dut.whole_words = m.whole;
    dut.long_start = m.start;
    dut.long_write = m.write;
    dut.long_list = m.list;
    dut.word = uint32_t{m.number} << 16 | m.index;
    dut.session = c.session;
    dut.row_busy = c.rows;
    dut.staged = c.staged;
    dut.running = c.running;
    dut.engine_idle = c.engine_idle;
    dut.map_busy = c.map;
    dut.map_complete = c.map_complete;
    dut.map_tile = c.map_tile;
  }

  // After the edge: what is registered.
  void settled(bool bad, bool foreign, bool answer, bool release) {
    dut.eval();
    compare(dut.result, model.code(), 10);
    compare(dut.last_tile, model.tile(), 11);
    compare(dut.table_id, model.table(), 12);
    compare(dut.table_words, model.table_words(), 13);
    compare(dut.index, model.index(), 14);
    compare(dut.duplex_mode, model.duplex(), 15);
    compare(dut.ev_bad, bad, 16);
    compare(dut.ev_foreign, foreign, 17);
    compare(dut.ev_answer, answer, 18);
    compare(dut.map_release, release, 19);
  }

  void message() {
    step(Step::kIdle);
    sim.tick();
    model.idle();
    draw();
    step(Step::kDecide);
    dut.eval();
    const auto d = model.header(m, c);
    compare(dut.head_state, static_cast<uint64_t>(d.next), 0);
    compare(dut.head_alive, d.alive, 1);
    compare(dut.admitted, d.admitted, 2);
    compare(dut.only_header, d.only_header, 3);
    compare(dut.of_list, d.list, 4);
    sim.tick();
    model.decided(m, d);
    ++steps[static_cast<size_t>(d.next)];
    ++codes[d.code];
    settled(d.bad, d.foreign, d.answer, d.release);
    Step next = d.next;
    if (next == Step::kLimit && m.type == net::kOpen && d.code == net::kOk) next = Step::kWords;
    if (next == Step::kWords) words();
    if (next == Step::kCheck) check();
    if (next == Step::kAbort) abort();
  }
  void abort() {
    step(Step::kAbort);
    sim.tick();
    model.abort();
    settled(false, false, false, false);
  }
  uint32_t value(int count) {
    if (m.type == net::kSet) return static_cast<uint32_t>(chance(4) ? random() : random() % 4);
    if (m.type != net::kStart || chance(40)) return static_cast<uint32_t>(random() >> random() % 32);
    if (count == 0) return uint32_t{model.table()} << 16 | (random() & 0xffff);
    if (count == 1) return 1 + static_cast<uint32_t>(random() % 0xffffff);
    if (count == 2) return 1 + static_cast<uint32_t>(random() % 0xffff);
    return static_cast<uint32_t>(random() % (model.table_words() / 8u + (chance(4) ? 2 : 1)));
  }
  void words() {
    const int length = m.type == net::kTable ? 1 + static_cast<int>(random() % (chance(10) ? 300 : 20)) : 99;
    for (int count = 0;; ++count) {
      step(Step::kWords);
      dut.word_count = static_cast<CData>(std::min(count, 31));
      dut.word_full = 0;
      sim.tick();
      settled(false, false, false, false);
      const uint32_t v = value(count);
      dut.word_next = v;
      dut.word_full = 1;
      dut.at_last = m.type == net::kTable ? count + 1 == length : chance(2);
      dut.eval();
      const auto w = model.argument(m, c, count, v, count + 1 == length);
      compare(dut.word_state, static_cast<uint64_t>(w.next), 5);
      compare(dut.words_end, w.next != Step::kWords, 6);
      compare(dut.open_new, m.type == net::kOpen && !c.session, 7);
      compare(dut.open_again, w.open_again, 8);
      sim.tick();
      model.taken(m, w, count, v);
      dut.word_full = 0;
      settled(w.bad, w.foreign, false, false);
      if (m.type == net::kStart && count == 1) compare(dut.pixels, model.pixels(), 20);
      if (m.type == net::kStart && count == 2) compare(dut.chunks, model.chunks(), 21);
      ++codes[w.code];
      ++steps[static_cast<size_t>(w.next)];
      if (w.next == Step::kAbort) abort();
      if (w.next == Step::kDivide) divide();
      if (w.next != Step::kWords) return;
    }
  }
  void divide() {
    step(Step::kDivide);
    sim.tick();
    settled(false, false, false, false);
    dut.checked = 1;
    dut.chunks_fit = !chance(4);
    sim.tick();
    dut.checked = 0;
    model.divided(dut.chunks_fit);
    settled(!dut.chunks_fit, false, false, false);
    compare(dut.row_open, dut.chunks_fit, 22);
    compare(dut.pixels, model.pixels(), 20);
    compare(dut.chunks, model.chunks(), 21);
  }
  void check() {
    step(Step::kCheck);
    sim.tick();
    settled(false, false, false, false);
    dut.checked = 1;
    dut.w_new = chance(2);
    dut.w_repeated = !dut.w_new && chance(2);
    sim.tick();
    dut.checked = 0;
    model.checked(dut.w_new, dut.w_repeated);
    settled(false, false, false, false);
    compare(dut.ev_repeated, dut.w_repeated, 23);
    compare(dut.ev_refused, !dut.w_new && !dut.w_repeated, 24);
  }

  Sim<Vmessage_rules> sim;
  Vmessage_rules& dut;
  golden::MessageRules model;
  golden::MessageRules::Message m;
  golden::MessageRules::Chip c;
  Scoreboard board{"rules"};
  std::mt19937 random;
  std::array<int, 32> steps{};
  std::array<int, 8> codes{};
};

}  // namespace

TEST_CASE("message_rules: every decision as the model says") {
  INFO("seed " << test_seed());
  Bench bench(test_seed());
  for (int i = 0; i < 150000; ++i) bench.message();
  INFO(bench.board.report());
  CHECK(bench.board.ok());
  for (const Step s :
       {Step::kLimit, Step::kWords, Step::kDivide, Step::kCheck, Step::kWait, Step::kDone, Step::kAbort}) {
    INFO("step " << static_cast<int>(s));
    CHECK(bench.steps[static_cast<size_t>(s)] > 100);
  }
  for (int code = net::kOk; code <= net::kNotReady; ++code) {
    INFO("code " << code);
    CHECK(bench.codes[static_cast<size_t>(code)] > 100);
  }
}
