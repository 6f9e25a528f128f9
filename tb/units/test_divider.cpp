// SPDX-License-Identifier: Apache-2.0
// divider: every pair num <= den of a small format, and corners and random pairs of the two formats in the engine.
#include <verilated.h>

#include <deque>
#include <random>

#include "Vdivider_16_13.h"
#include "Vdivider_2_1.h"
#include "Vdivider_6_9.h"
#include "golden/divider.hpp"
#include "simulator/coverage.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

// No reset and no valid: the quotient of a pair is seen exactly G_QUOT_W clocks behind it.
template <class Dut>
struct Bench {
  VerilatedContext context;
  Dut dut{&context};
  int num_bits, quot_bits;
  uint64_t clock = 0;
  std::deque<std::pair<uint64_t, int>> way;
  Scoreboard board{"quotient"};

  Bench(int num_width, int quot_width) : num_bits(num_width), quot_bits(quot_width) { dut.clk = 0; }
  ~Bench() {
    simulator::save_coverage(context);
    dut.final();
  }

  void put(uint64_t num, uint64_t den) {
    if (den != 0)
      way.emplace_back(clock + static_cast<uint64_t>(quot_bits),
                       golden::divide_fraction(static_cast<int64_t>(num), static_cast<int64_t>(den), quot_bits));
    dut.s_num = static_cast<std::remove_reference_t<decltype(dut.s_num)>>(num);
    dut.s_den = static_cast<std::remove_reference_t<decltype(dut.s_den)>>(den);
    dut.clk = 0;
    dut.eval();
    dut.clk = 1;
    dut.eval();
    ++clock;
    if (!way.empty() && way.front().first == clock) {
      board.compare(dut.m_quot, static_cast<uint64_t>(way.front().second), {}, clock);
      way.pop_front();
    }
  }
  void check() {
    for (int i = 0; i <= quot_bits; ++i) put(0, 0);
    INFO(board.report());
    CHECK(board.ok());
    CHECK(way.empty());
  }
};

template <class Dut>
void all_pairs(int num_bits, int quot_bits) {
  Bench<Dut> bench(num_bits, quot_bits);
  for (uint64_t den = 1; den < uint64_t{1} << num_bits; ++den)
    for (uint64_t num = 0; num <= den; ++num) bench.put(num, den);
  bench.check();
}

}  // namespace

TEST_CASE("divider: all pairs of 6 bits, 9 quotient bits") { all_pairs<Vdivider_6_9>(6, 9); }
TEST_CASE("divider: all pairs of 2 bits, 1 quotient bit") { all_pairs<Vdivider_2_1>(2, 1); }

TEST_CASE("divider: corners and random pairs of the MNCC division") {
  INFO("seed " << test_seed());
  std::mt19937 random(test_seed());
  Bench<Vdivider_16_13> bench(16, 13);
  for (uint64_t den : {1u, 2u, 3u, 0x7fffu, 0x8000u, 0x8001u, 0xfffeu, 0xffffu})
    for (uint64_t num : {uint64_t{0}, uint64_t{1}, den / 2, den - 1, den})
      if (num <= den) bench.put(num, den);
  for (int i = 0; i < 200000; ++i) {
    const uint64_t den = 1 + random() % 0xffff;
    bench.put(random() % (den + 1), den);
  }
  bench.check();
}
