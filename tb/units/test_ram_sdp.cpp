// SPDX-License-Identifier: Apache-2.0
// ram_sdp with one and two clocks of read latency, depth no power of two: every read returns what was written last,
// after exactly the promised number of clocks. Words read in the clock in which they are
// written are undefined and not compared; but that the model does not return the old word, on which somebody might come
// to rely unseen, is.
#include <random>

#include "Vram_sdp_1.h"
#include "Vram_sdp_2.h"
#include "Vram_sdp_synthesized.h"
#include "golden/ram_sdp.hpp"
#include "simulator/coverage.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

constexpr int kDepth = 37;
constexpr uint32_t kDataMask = 0x1FFF;

// The entity has no reset, so it cannot live in Sim.
template <class Dut>
void random_traffic(unsigned latency, bool old_word_promised = false) {
  const uint32_t seed = test_seed();
  INFO("seed " << seed << " latency " << latency);
  VerilatedContext context;
  context.randReset(2);
  context.randSeed(static_cast<int>(seed | 1));
  Dut dut(&context);
  std::mt19937 random(seed);
  Scoreboard board("rdata");

  golden::RamSdp model(kDepth, latency);
  unsigned collisions = 0, old_words = 0;
  for (uint64_t clock = 0; clock < 20000; ++clock) {
    const bool we = random() & 1;
    const uint32_t waddr = static_cast<uint32_t>(random()) % kDepth, raddr = static_cast<uint32_t>(random()) % kDepth;
    const uint32_t wdata = static_cast<uint32_t>(random()) & kDataMask;
    dut.we = we;
    dut.waddr = static_cast<CData>(waddr);
    dut.wdata = static_cast<SData>(wdata);
    dut.raddr = static_cast<CData>(raddr);
    dut.clk = 0;
    dut.eval();
    if (const auto due = model.due()) {
      if (due->defined) board.compare(dut.rdata, due->word, {-1, -1, -1, -1}, clock);
      if (due->collides) {
        ++collisions;
        if (dut.rdata == due->word) ++old_words;
      }
    }
    model.clock(we, waddr, wdata, raddr);
    dut.clk = 1;
    dut.eval();
  }
  simulator::save_coverage(context);
  dut.final();
  INFO(board.report());
  CHECK(board.ok());
  CHECK(board.compared() > 15000);
  CHECK(collisions > 100);
  if (old_word_promised) {
    CHECK(old_words == collisions);
  } else {
    CHECK(old_words < collisions / 10);
  }
}

}  // namespace

TEST_CASE("ram_sdp: latency 1") { random_traffic<Vram_sdp_1>(1); }
TEST_CASE("ram_sdp: latency 2") { random_traffic<Vram_sdp_2>(2); }
TEST_CASE("ram_sdp: as synthesis sees it") { random_traffic<Vram_sdp_synthesized>(2, true); }
