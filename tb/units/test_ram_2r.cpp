// SPDX-License-Identifier: Apache-2.0
// ram_2r, depth no power of two, of one part and of three: both ports return what was written last, two clocks after
// the address, while the first one writes now and then. Words read in the clock in which they are written are undefined
// and not compared.
#include <random>
#include <type_traits>
#include <vector>

#include "Vram_2r_a.h"
#include "Vram_2r_deep.h"
#include "Vram_2r_synthesized.h"
#include "golden/ram_2r.hpp"
#include "simulator/coverage.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

// Addresses: `around` words on both sides of each of these places.
template <class Dut>
void run(uint32_t depth, const std::vector<uint32_t>& places, uint32_t around) {
  const uint32_t seed = test_seed();
  INFO("seed " << seed);
  // The entity has no reset, so it cannot live in Sim.
  VerilatedContext context;
  context.randReset(2);
  context.randSeed(static_cast<int>(seed | 1));
  Dut dut(&context);
  std::mt19937 random(seed);
  Scoreboard a("a_rdata"), b("b_rdata");

  golden::Ram2r model(depth);
  auto address = [&] {
    const uint32_t place = places[static_cast<uint32_t>(random()) % places.size()];
    return (place + depth - around + static_cast<uint32_t>(random()) % (2 * around)) % depth;
  };
  for (uint64_t clock = 0; clock < 20000; ++clock) {
    const bool we = random() % 3 == 0;
    const uint32_t a_addr = address(), b_addr = address();
    dut.a_we = we;
    dut.a_addr = static_cast<std::remove_reference_t<decltype(dut.a_addr)>>(a_addr);
    dut.b_addr = static_cast<std::remove_reference_t<decltype(dut.b_addr)>>(b_addr);
    dut.a_wdata = static_cast<SData>(random() & 0x1fff);
    dut.clk = 0;
    dut.eval();
    if (const auto due = model.a.due(); due && due->defined) a.compare(dut.a_rdata, due->word, {}, clock);
    if (const auto due = model.b.due(); due && due->defined) b.compare(dut.b_rdata, due->word, {}, clock);
    model.clock(we, a_addr, dut.a_wdata, b_addr);
    dut.clk = 1;
    dut.eval();
  }
  simulator::save_coverage(context);
  dut.final();
  INFO(a.report() << b.report());
  CHECK((a.ok() && b.ok()));
  CHECK(a.compared() > 10000);
  CHECK(b.compared() > 15000);
}

}  // namespace

TEST_CASE("ram_2r: two readers, one of which writes") { run<Vram_2r_a>(37, {0, 18}, 10); }
TEST_CASE("ram_2r: 8192 + 4096 + 512 words") { run<Vram_2r_deep>(12320, {0, 8192, 12288}, 12); }
// GHDL 2.0 translates some RAM templates wrongly only if the words of a collision are left out, as synthesis does.
TEST_CASE("ram_2r: as synthesis sees it") { run<Vram_2r_synthesized>(12320, {0, 8192, 12288}, 12); }
