// SPDX-License-Identifier: Apache-2.0
// message_reader: every clock against the model, step by step as the responder goes through messages of all types and
// lengths, through ARP, ICMP and map packets, with the watchdog between.
#include <random>

#include "Vmessage_reader.h"
#include "Vmessage_reader_9.h"
#include "golden/message_reader.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"

using namespace psweep;
using namespace psweep::tb;
using golden::Step;

namespace {

template <class Dut>
struct Bench {
  Bench(uint32_t seed, int bytes)
      : sim(40000000, seed), dut(sim.dut()), model(bytes), random(seed), write_bytes(bytes) {
    apply();
    sim.reset();
  }
  bool chance(unsigned n) { return random() % n == 0; }
  void apply() {
    dut.state = static_cast<CData>(in.step);
    dut.idle_chunk = in.map_packet;
    dut.session_io = in.session_io;
    dut.words_end = in.words_end;
    dut.reply_step = in.reply_step;
    dut.recover = in.recover;
    dut.m_kind = static_cast<CData>(in.kind);
    dut.m_length = static_cast<SData>(in.length);
    dut.r_data = in.data;
    dut.b_bit = in.bit;
  }
  void compare(uint64_t value, uint64_t want, int what) {
    if (known) board.compare(value, want, {-1, static_cast<int>(in.step), what, 0}, sim.cycle());
  }
  void check() {
    compare(dut.byte_valid, model.valid(), 0);
    compare(dut.r_addr, static_cast<uint64_t>(model.address()), 1);
    compare(dut.byte_place, static_cast<uint64_t>(model.place()), 2);
    compare(dut.word_full, model.word_full(), 3);
    compare(dut.header_end, model.header_end(in), 4);
    compare(dut.rows_end, model.rows_end(in), 5);
    compare(dut.peer_end, model.peer_end(in), 6);
    compare(dut.at_last, model.at_last(), 7);
    compare(dut.word_count, static_cast<uint64_t>(model.words()), 8);
    compare(dut.word, model.word(), 9);
    compare(dut.word_next, model.word_next(in), 10);
    compare(dut.msg_type, model.type(), 11);
    compare(dut.magic_ok, model.magic(), 12);
    compare(dut.version_ok, model.version(), 13);
    compare(dut.ask_answer, model.ask_answer(), 14);
    compare(dut.reply_last, model.reply_last(), 15);
    compare(dut.reply_zeros, model.reply_zeros(in), 16);
    compare(dut.long_header, model.long_header(), 17);
    compare(dut.long_word, model.long_word(), 18);
    compare(dut.long_start, model.long_start(), 19);
    compare(dut.long_write, model.long_write(), 20);
    compare(dut.long_list, model.long_list(), 21);
    compare(dut.whole_words, model.whole_words(), 22);
  }
  // A clock. The frame's byte is that of the address before; a header is a right one at times.
  void clock() {
    in.data = static_cast<uint8_t>(random());
    const int at = model.place();
    if (right && at == 42) in.data = 0x50;
    if (right && at == 43) in.data = 0x53;
    if (right && at == 44) in.data = net::kVersion;
    if (at == 45 && !chance(4)) in.data = type;
    in.bit = chance(2);
    in.recover = chance(20000);
    in.words_end = in.step == Step::kWords && model.word_full() && (chance(12) || model.at_last());
    in.reply_step = in.step == Step::kShow;
    apply();
    dut.eval();
    check();
    lost = lost || in.recover;
    rows += model.rows_end(in);
    writes += model.long_write();
    model.clock(in);
    sim.tick();
    in.map_packet = false;
  }
  void wait(Step step, int clocks) {
    in.step = step;
    for (int i = 0; i < clocks && !lost; ++i) clock();
  }
  template <class Done>
  void until(Step step, Done&& done) {
    in.step = step;
    for (bool over = false; !over && !lost;) {
      over = done();
      clock();
    }
  }
  void reply() {
    for (int i = 0; i < 30 && !lost; ++i) {
      wait(Step::kFetch, 1 + static_cast<int>(random() % 9));
      wait(Step::kShow, 1);
    }
  }
  void message() {
    static constexpr int kLengths[] = {0, 15, 16, 19, 20, 99, 100, 143, 144, 175, 176, 1472};
    lost = false;
    right = !chance(4);
    type = static_cast<uint8_t>(chance(9) ? random() : 1 + random() % 11);
    in.kind = chance(3) ? static_cast<int>(random() % 4) : 2;
    in.length = chance(3)   ? write_bytes + 15 + static_cast<int>(random() % 3)
                : chance(2) ? kLengths[random() % 12]
                            : static_cast<int>(random() % 1473);
    in.session_io = false;
    wait(Step::kIdle, 1 + static_cast<int>(random() % 3));
    if (chance(8)) {
      in.map_packet = true;
      wait(Step::kIdle, 1);
      reply();
      wait(Step::kCells, 20);
      return;
    }
    if (in.kind == 2) {
      until(Step::kHeader, [&] { return model.header_end(in); });
      wait(Step::kDecide, 1);
      if (model.long_write() && !lost) {
        wait(Step::kCheck, 4);
        until(Step::kRows, [&] { return model.rows_end(in); });
      } else if (model.long_word()) {
        in.step = Step::kWords;
        do clock();
        while (!in.words_end && !lost);
      }
    } else {
      wait(Step::kLimit, 2);
    }
    in.session_io = chance(2);
    wait(Step::kWait, 1 + static_cast<int>(random() % 5));
    until(Step::kPeer, [&] { return model.peer_end(in); });
    reply();
    wait(Step::kDone, 4);
  }

  Sim<Dut> sim;
  Dut& dut;
  golden::MessageReader model;
  golden::MessageReader::Inputs in;
  Scoreboard board{"reader"};
  std::mt19937 random;
  int write_bytes, rows = 0, writes = 0;
  uint8_t type = 0;
  bool right = false, lost = false, known = false;
};

template <class Dut>
void run(int write_bytes) {
  INFO("seed " << test_seed());
  Bench<Dut> bench(test_seed(), write_bytes);
  // Words and header have no reset.
  bench.right = true;
  bench.wait(Step::kIdle, 2);
  bench.until(Step::kHeader, [&] { return bench.model.header_end(bench.in); });
  bench.known = true;
  for (int i = 0; i < 3000; ++i) bench.message();
  INFO(bench.board.report());
  CHECK(bench.board.ok());
  CHECK(bench.rows > 50);
}

}  // namespace

TEST_CASE("message_reader: every clock as the model says") { run<Vmessage_reader>(1408); }
TEST_CASE("message_reader: pixels of 9 bits in chunks of 502 bytes") { run<Vmessage_reader_9>(501); }
