// SPDX-License-Identifier: Apache-2.0
// delay_line: every word leaves unchanged after exactly G_DELAY enabled clocks, clocks without ce do not count; the
// shortest delay, a word of one bit, and a delay longer than one shift-register primitive.
#include <verilated.h>

#include <random>

#include "Vdelay_line_1_40.h"
#include "Vdelay_line_7_1.h"
#include "Vdelay_line_9_13.h"
#include "golden/delay_line.hpp"
#include "simulator/coverage.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

// The entity has no reset: the first G_DELAY words are whatever the registers held and are not compared.
template <class Dut>
void random_words(unsigned width, size_t delay, double enabled) {
  INFO("seed " << test_seed() << " width " << width << " delay " << delay << " enabled " << enabled);
  VerilatedContext context;
  context.randReset(2);
  context.randSeed(static_cast<int>(test_seed() | 1));
  Dut dut(&context);
  std::mt19937 random(test_seed());
  std::bernoulli_distribution enable(enabled);
  golden::DelayLine model(delay);
  Scoreboard board("word");
  dut.clk = 0;
  for (uint64_t clock = 0; clock < 5000; ++clock) {
    const auto word = static_cast<uint32_t>(random()) & ((1u << width) - 1);
    dut.ce = enable(random);
    dut.s_data = static_cast<std::remove_reference_t<decltype(dut.s_data)>>(word);
    dut.clk = 0;
    dut.eval();
    dut.clk = 1;
    dut.eval();
    model.clock(dut.ce, word);
    if (model.out()) board.compare(dut.m_data, *model.out(), {}, clock);
  }
  simulator::save_coverage(context);
  dut.final();
  INFO(board.report());
  CHECK(board.ok());
  CHECK(board.compared() > 1000);
}

}  // namespace

TEST_CASE("delay_line: 9 bits, 13 words") {
  random_words<Vdelay_line_9_13>(9, 13, 1.0);
  random_words<Vdelay_line_9_13>(9, 13, 0.4);
}
TEST_CASE("delay_line: 7 bits, 1 word") { random_words<Vdelay_line_7_1>(7, 1, 0.5); }
TEST_CASE("delay_line: 1 bit, 40 words") { random_words<Vdelay_line_1_40>(1, 40, 0.7); }
