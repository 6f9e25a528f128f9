// SPDX-License-Identifier: Apache-2.0
// reply_builder: every byte and every clock against the model: replies of a header, status blocks with bitmaps of one
// word and of more, INFO, COUNTERS that keep it waiting, ICMP, port unreachable, map packets.
#include <verilated.h>

#include <random>

#include "Vreply_builder.h"
#include "Vreply_builder_5.h"
#include "golden/reply_builder.hpp"
#include "simulator/coverage.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"

using namespace psweep;
using namespace psweep::tb;
using golden::Step;

namespace {

template <class Dut>
struct Bench {
  Bench(uint32_t seed, int row_slots) : model(row_slots), random(seed) { dut.clk = 0; }
  ~Bench() {
    simulator::save_coverage(context);
    dut.final();
  }
  bool chance(unsigned n) { return random() % n == 0; }
  uint8_t byte() { return static_cast<uint8_t>(random()); }
  void draw() {
    for (uint8_t* b : {&in.frame, &in.memory, &in.bits, &in.info, &in.cell}) *b = byte();
    for (uint32_t& w : in.status) w = static_cast<uint32_t>(random());
    in.counter = static_cast<uint32_t>(random());
    in.chunk = static_cast<uint16_t>(random());
    in.counter_valid = chance(2);
    in.cell_valid = chance(2);
    in.ready = chance(2);
  }
  void apply() {
    dut.state = static_cast<CData>(in.step);
    dut.step = static_cast<CData>(in.clocks);
    dut.is_map = in.is_map;
    dut.is_icmp = in.is_icmp;
    dut.session_io = in.session_io;
    dut.peer_end = in.peer_end;
    dut.only_header = in.only_header;
    dut.of_list = in.of_list;
    dut.long_list = in.long_list;
    dut.result = static_cast<CData>(in.result);
    dut.m_kind = static_cast<CData>(in.kind);
    dut.msg_type = in.type;
    dut.reply_last = in.reply_last;
    dut.reply_zeros = in.reply_zeros;
    dut.r_data = in.frame;
    dut.memory_byte = in.memory;
    dut.bits = in.bits;
    for (size_t i = 0; i < in.status.size(); ++i) dut.status_words[in.status.size() - 1 - i] = in.status[i];
    dut.map_chunk = in.chunk;
    dut.info_byte = in.info;
    dut.c_valid = in.counter_valid;
    dut.c_data = in.counter;
    dut.f_valid = in.cell_valid;
    dut.f_data = in.cell;
    dut.f_last = in.cell_last;
    dut.p_ready = in.ready;
  }
  void compare(uint64_t value, uint64_t want, int what) {
    board.compare(value, want, {model.place(), model.word(), what, 0}, clocks);
  }
  void clock() {
    draw();
    apply();
    dut.eval();
    compare(dut.p_valid, model.valid(in), 0);
    if (model.valid(in)) {
      compare(dut.p_data, model.data(in), 1);
      compare(dut.p_last, model.last(in), 2);
    }
    if (started) {
      compare(dut.body_cells, model.body_cells(in), 3);
      compare(dut.reply_end, model.reply_end(in), 4);
      compare(dut.f_take, in.ready && in.step == Step::kCells, 5);
      compare(dut.b_hold, model.in_status(in), 6);
      if (in.step == Step::kFetch) compare(dut.fetched, model.fetched(in), 7);
      if (model.in_list(in)) {
        const int n = model.word() - 4;
        compare(dut.c_index, static_cast<uint64_t>(n), 8);
        compare(dut.info_index, static_cast<uint64_t>((4 * n + model.place()) & 127), 9);
      }
      if (model.in_bitmap(in)) {
        const int bit = 32 * (model.word() - 13) + 8 * model.place() + in.clocks % 8;
        compare(dut.b_index, static_cast<uint64_t>(bit & 1023), 10);
      }
    }
    model.clock(in);
    dut.clk = 1;
    dut.eval();
    dut.clk = 0;
    dut.eval();
    ++clocks;
  }
  // A byte of the reply: whether it was the last one.
  bool show() {
    in.step = Step::kFetch;
    in.clocks = -1;
    do {
      ++in.clocks;
      clock();
    } while (!model.fetched(in));
    in.step = Step::kShow;
    for (;;) {
      const bool cells = model.body_cells(in), end = model.reply_end(in);
      clock();
      if (!in.ready) continue;
      ++bytes;
      if (!cells) return end;
      in.step = Step::kCells;
      for (int i = 0; i < 20; ++i) {
        in.cell_last = i == 19;
        clock();
      }
      in.cell_last = false;
      return true;
    }
  }
  void reply(uint8_t type, int kind) {
    in.type = type;
    in.kind = kind;
    in.step = Step::kIdle;
    in.is_map = type == net::kMap;
    in.is_icmp = kind % 2 == 1;
    in.session_io = in.is_map || chance(4);
    in.result = static_cast<int>(random() % 6);
    clock();
    started = true;
    if (kind == 2 && !in.is_map) {
      in.step = Step::kDecide;
      in.of_list = type == net::kInfo || type == net::kCounters;
      in.long_list = !chance(4);
      in.only_header = in.of_list ? !in.long_list : chance(2);
      clock();
      in.of_list = in.only_header = false;
    }
    if (!in.is_map) {
      in.step = Step::kPeer;
      in.peer_end = true;
      clock();
      in.peer_end = false;
    }
    const int length = 2 + static_cast<int>(random() % 40);
    for (int n = 0;; ++n) {
      in.reply_zeros = kind == 3 && n < 3;
      in.reply_last = in.is_icmp && n + 2 == length;
      if (in.is_icmp && n > length) FAIL("ICMP does not end");
      if (show()) break;
    }
    ++replies;
  }

  VerilatedContext context;
  Dut dut{&context};
  golden::ReplyBuilder model;
  golden::ReplyBuilder::Inputs in;
  Scoreboard board{"reply"};
  std::mt19937 random;
  uint64_t clocks = 0;
  int bytes = 0, replies = 0;
  bool started = false;
};

template <class Dut>
void run(int row_slots) {
  INFO("seed " << test_seed());
  Bench<Dut> bench(test_seed(), row_slots);
  for (int i = 0; i < 400; ++i) {
    for (const uint8_t type : {net::kOpen, net::kInfo, net::kCounters, net::kStatus, net::kWrite, net::kMap})
      bench.reply(type, 2);
    bench.reply(0, 1);
    bench.reply(0, 3);
  }
  INFO(bench.board.report());
  CHECK(bench.board.ok());
  CHECK(bench.replies == 3200);
}

}  // namespace

TEST_CASE("reply_builder: a bitmap of three words") { run<Vreply_builder>(70); }
TEST_CASE("reply_builder: a bitmap of one word") { run<Vreply_builder_5>(5); }
