// SPDX-License-Identifier: Apache-2.0
// info_rom: every byte, with the generics as by default and with others.
#include <verilated.h>

#include <random>

#include "Vinfo_rom.h"
#include "Vinfo_rom_odd.h"
#include "golden/info_rom.hpp"
#include "simulator/coverage.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

template <class Dut>
void run(const net::ArbiterConfig& config, int depth) {
  INFO("seed " << test_seed());
  std::mt19937_64 random(test_seed());
  VerilatedContext context;
  Dut dut{&context};
  Scoreboard board{"info"};
  for (int i = 0; i < 20; ++i) {
    const uint64_t mac = random() >> 16;
    const auto words = golden::info_words(config, depth, mac);
    for (unsigned n = 0; n < 4 * net::kInfoWords; ++n) {
      dut.own_mac = mac;
      dut.index = static_cast<CData>(n);
      dut.eval();
      board.compare(dut.data, words[n / 4] >> (24 - 8 * (n % 4)) & 0xff, {-1, -1, static_cast<int>(n), 0}, n);
    }
  }
  INFO(board.report());
  CHECK(board.ok());
  simulator::save_coverage(context);
  dut.final();
}

}  // namespace

TEST_CASE("info_rom: generics as by default") {
  net::ArbiterConfig config;
  config.row_slots = 70;
  run<Vinfo_rom>(config, 33280);
}

TEST_CASE("info_rom: other generics") {
  net::ArbiterConfig config;
  config.engine.img_cols = 62;
  config.engine.img_rows = 38;
  config.engine.plane_cols = 29;
  config.engine.plane_rows = 17;
  config.engine.planes = 37;
  config.engine.window = 5;
  config.engine.pix_bits = 9;
  config.engine.weight_bits = 6;
  config.engine.interp_frac = 3;
  config.engine.mncc_bits = 11;
  config.engine.frac_bits = 5;
  config.engine.lanes = 4;
  config.engine.rectified = 1;
  config.clk_khz = 60000;
  config.chunk_bytes = 502;
  config.row_slots = 5;
  config.rx_slots = 4;
  config.session_ms = 50;
  run<Vinfo_rom_odd>(config, 332);
}
