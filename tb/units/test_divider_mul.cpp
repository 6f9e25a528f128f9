// SPDX-License-Identifier: Apache-2.0
// divider_mul: all operands of a format of 8 quotient bits; of wider ones every denominator, and the numerators around
// those where the quotient changes, for some denominators all of them. Below 8 bits the entity is a divider.
#include <verilated.h>

#include <algorithm>
#include <deque>
#include <random>

#include "Vdivider_mul_11.h"
#include "Vdivider_mul_13.h"
#include "Vdivider_mul_14.h"
#include "Vdivider_mul_16.h"
#include "Vdivider_mul_5.h"
#include "Vdivider_mul_7.h"
#include "Vdivider_mul_8.h"
#include "golden/divider.hpp"
#include "golden/divider_mul.hpp"
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
  int bits;
  int64_t lowest, end;  // denominators
  uint64_t clock = 0;
  std::deque<int64_t> way;
  Scoreboard board{"quotient"};
  std::mt19937 random{test_seed()};

  explicit Bench(int quot_bits) : bits(quot_bits), lowest(int64_t{4} << quot_bits), end(2 * lowest) { dut.clk = 0; }
  ~Bench() {
    simulator::save_coverage(context);
    dut.final();
  }

  void put(int64_t num, int64_t den) {
    if (num < 0 || num > den) return;
    way.push_back(golden::divide_fraction(num, den, bits));
    dut.s_num = static_cast<std::remove_reference_t<decltype(dut.s_num)>>(num);
    dut.s_nden = static_cast<std::remove_reference_t<decltype(dut.s_nden)>>(end - 1 - den);
    tick();
  }
  void tick() {
    dut.clk = 0;
    dut.eval();
    dut.clk = 1;
    dut.eval();
    if (++clock < static_cast<uint64_t>(bits)) return;
    board.compare(dut.m_quot, static_cast<uint64_t>(way.front()), {}, clock);
    way.pop_front();
  }
  // Numerators on both sides of where the quotient becomes k.
  void around(int64_t k, int64_t den) {
    const int64_t num = ((k * den - 1) >> bits) + 1;
    put(num - 1, den);
    put(num, den);
  }
  void all_quotients(int64_t den) {
    for (int64_t k = 0; k <= int64_t{1} << bits; ++k) around(k, den);
  }
  // Every denominator (but the last ones if step > 1), with the quotients at both ends and some others.
  void denominators(int step) {
    const int64_t top = int64_t{1} << bits;
    for (int64_t den = lowest; den < end; den += step) {
      for (int64_t k : {int64_t{0}, int64_t{1}, top / 2, top - 2, top - 1, top}) around(k, den);
      for (int i = 0; i < 6; ++i) around(static_cast<int64_t>(random()) % top, den);
    }
    for (int64_t den : {lowest, lowest + 1, lowest + top / 2, 2 * lowest - 2, 2 * lowest - 1}) all_quotients(den);
    for (int i = 0; i < 20; ++i) all_quotients(lowest + static_cast<int64_t>(random()) % lowest);
  }
  void check() {
    for (int i = 1; i < bits; ++i) tick();
    INFO("seed " << test_seed() << '\n' << board.report());
    CHECK(board.ok());
    CHECK(way.empty());
  }
};

template <class Dut>
void run_all(int bits) {
  Bench<Dut> bench(bits);
  for (int64_t den = bench.lowest; den < bench.end; ++den)
    for (int64_t num = 0; num <= den; ++num) bench.put(num, den);
  bench.check();
}

template <class Dut>
void run(int bits, int step = 1) {
  Bench<Dut> bench(bits);
  bench.denominators(step);
  bench.check();
}

}  // namespace

TEST_CASE("divider_mul: all operands of 5, 7 and 8 quotient bits") {
  run_all<Vdivider_mul_5>(5);
  run_all<Vdivider_mul_7>(7);
  run_all<Vdivider_mul_8>(8);
}
TEST_CASE("divider_mul: 11 quotient bits") { run<Vdivider_mul_11>(11); }
TEST_CASE("divider_mul: 13 quotient bits, every denominator") { run<Vdivider_mul_13>(13); }
TEST_CASE("divider_mul: 14 quotient bits") { run<Vdivider_mul_14>(14, 3); }
TEST_CASE("divider_mul: 16 quotient bits") { run<Vdivider_mul_16>(16, 13); }

// What the entity rests on, for all formats that it has: num * reciprocal / 2^.. is the quotient or one more.
TEST_CASE("divider_mul: the reciprocal is near enough") {
  for (int bits = 8; bits <= 16; ++bits) {
    const golden::DividerMul model(bits);
    const int64_t one = int64_t{1} << model.power();
    for (int64_t line = 0; line < model.lines(); ++line) {
      const int64_t first = model.first(line);
      int64_t least = one, most = 0;
      for (int64_t den = first; den < first + model.count(); ++den) {
        const int64_t error = model.reciprocal(den) * den - one;
        least = std::min(least, error);
        most = std::max(most, error);
      }
      INFO("bits " << bits << " line " << line);
      REQUIRE(least >= 0);
      REQUIRE(most < one >> bits);
    }
  }
}

TEST_CASE("divider_mul: the model by multiplication is the one by division") {
  std::mt19937 random(test_seed());
  for (int bits = 8; bits <= 16; ++bits) {
    const golden::DividerMul model(bits);
    const int64_t lowest = int64_t{4} << bits;
    for (int i = 0; i < 20000; ++i) {
      const int64_t den = lowest + static_cast<int64_t>(random()) % lowest;
      const int64_t num = i % 16 == 0 ? den : static_cast<int64_t>(random()) % den;
      INFO("bits " << bits << ": " << num << " / " << den);
      REQUIRE(model.quotient(num, den) == golden::divide_fraction(num, den, bits));
    }
  }
}
