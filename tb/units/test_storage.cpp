// SPDX-License-Identifier: Apache-2.0
// storage: any 2x2 neighbourhood of any loaded window comes out of both images at once, one sample per clock, with its
// sidebands, after the promised latency; windows of every size, one loaded over the other.
#include <deque>
#include <random>

#include "Vstorage_mid.h"
#include "golden/control.hpp"
#include "golden/storage.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

constexpr uint64_t kLatency = golden::kStorageLatency;

golden::Config mid_config() {
  golden::Config c;
  c.img_cols = 26, c.img_rows = 18, c.pix_bits = 8, c.weight_bits = 6;
  return c;
}

struct Bench : Agent {
  golden::Config config = mid_config();
  Sim<Vstorage_mid> sim{1000000, test_seed()};
  Vstorage_mid& dut = sim.dut();
  Scoreboard pixels{"quad"}, sideband{"sideband"}, latency{"latency"};
  std::mt19937 random{test_seed()};

  struct Expected {
    bool usable;
    golden::Quad left, right;
    uint64_t sideband, clock;
    Place place;
  };
  std::deque<Expected> expected;
  uint64_t surplus = 0;

  Bench() {
    dut.load_valid = 0;
    dut.load_clear = 0;
    dut.s_valid = 0;
    dut.s_row_first = 0;
    sim.add(*this);
    sim.reset();
  }

  static uint64_t pack(uint64_t strobes, int fx_left, int fy_left, int fx_right, int fy_right) {
    uint64_t word = strobes;
    for (int f : {fx_left, fy_left, fx_right, fy_right}) word = word << 8 | static_cast<uint64_t>(f);
    return word;
  }

  void sample() override {
    if (!dut.m_valid) return;
    if (expected.empty()) {
      ++surplus;
      return;
    }
    const Expected e = expected.front();
    expected.pop_front();
    const uint64_t now = sim.cycle();
    latency.compare(now, e.clock + kLatency, e.place, now);
    const uint64_t strobes = static_cast<uint64_t>(dut.m_row_first << 4 | dut.m_plane_first << 3 |
                                                   dut.m_plane_last << 2 | dut.m_usable_x << 1 | dut.m_usable_y);
    sideband.compare(pack(strobes, dut.m_fx_left, dut.m_fy_left, dut.m_fx_right, dut.m_fy_right), e.sideband, e.place,
                     now);
    if (!e.usable) return;
    auto word = [](int p00, int p10, int p01, int p11) {
      return static_cast<uint64_t>(p00) << 48 | static_cast<uint64_t>(p10) << 32 | static_cast<uint64_t>(p01) << 16 |
             static_cast<uint64_t>(p11);
    };
    pixels.compare(word(dut.m_p00_left, dut.m_p10_left, dut.m_p01_left, dut.m_p11_left),
                   word(e.left.p00, e.left.p10, e.left.p01, e.left.p11), e.place, now);
    pixels.compare(word(dut.m_p00_right, dut.m_p10_right, dut.m_p01_right, dut.m_p11_right),
                   word(e.right.p00, e.right.p10, e.right.p01, e.right.p11), e.place, now);
  }

  int below(int n) { return static_cast<int>(static_cast<uint32_t>(random()) % static_cast<uint32_t>(n)); }

  void load(const golden::Pixels& left, const golden::Pixels& right, double stall) {
    std::bernoulli_distribution idle(stall);
    dut.load_clear = 1;
    sim.tick();
    dut.load_clear = 0;
    for (int y = 0; y < left.height; ++y) {
      for (int x = 0; x < left.width; ++x) {
        while (idle(random)) sim.tick();
        dut.load_valid = 1;
        dut.load_col = static_cast<CData>(x);
        dut.load_row_odd = y & 1;
        dut.load_row_end = x == left.width - 1;
        dut.load_data = static_cast<SData>(right.at(x, y) << 8 | left.at(x, y));
        sim.tick();
        dut.load_valid = 0;
        dut.load_data = static_cast<SData>(random());
      }
    }
    sim.run(2);
  }

  // Rows of samples at random places; some of them not usable, then with addresses beyond everything.
  void read(const golden::Pixels& left, const golden::Pixels& right, int rows, int cols) {
    auto row_address = [&](int yi, int parity) {
      return static_cast<CData>(golden::bank_address(config, 0, (yi & 1) == parity ? yi : yi + 1));
    };
    for (int j = 0; j < rows; ++j) {
      const bool usable_y = below(5) != 0;
      const int yl = below(left.height - 1), yr = below(left.height - 1), fyl = below(64), fyr = below(64);
      for (int i = 0; i < cols; ++i) {
        const bool usable_x = below(5) != 0;
        golden::Sample l, r;
        l.xi = below(left.width - 1), r.xi = below(left.width - 1);
        l.yi = yl, r.yi = yr;
        const int fxl = below(64), fxr = below(64);
        dut.s_valid = 1;
        dut.s_row_first = i == 0;
        dut.s_plane_first = j == 0;
        dut.s_plane_last = i == cols - 1 && j == rows - 1;
        dut.s_usable_x = usable_x;
        dut.s_usable_y = usable_y;
        dut.s_xi_left = static_cast<CData>(usable_x ? l.xi : below(32));
        dut.s_xi_right = static_cast<CData>(usable_x ? r.xi : below(32));
        dut.s_fx_left = static_cast<CData>(fxl), dut.s_fx_right = static_cast<CData>(fxr);
        if (i == 0) {
          dut.s_yi_odd_left = yl & 1, dut.s_yi_odd_right = yr & 1;
          dut.s_fy_left = static_cast<CData>(fyl), dut.s_fy_right = static_cast<CData>(fyr);
          dut.s_row_even_left = usable_y ? row_address(yl, 0) : static_cast<CData>(below(128));
          dut.s_row_odd_left = usable_y ? row_address(yl, 1) : static_cast<CData>(below(128));
          dut.s_row_even_right = usable_y ? row_address(yr, 0) : static_cast<CData>(below(128));
          dut.s_row_odd_right = usable_y ? row_address(yr, 1) : static_cast<CData>(below(128));
        }
        Expected e;
        e.usable = usable_x && usable_y;
        if (e.usable) e.left = golden::fetch(left, l), e.right = golden::fetch(right, r);
        e.sideband = pack(static_cast<uint64_t>(dut.s_row_first << 4 | dut.s_plane_first << 3 | dut.s_plane_last << 2 |
                                                usable_x << 1 | usable_y),
                          fxl, fyl, fxr, fyr);
        e.clock = sim.cycle();
        e.place = {-1, -1, i, j};
        expected.push_back(e);
        sim.tick();
      }
    }
    dut.s_valid = 0;
    dut.s_row_first = 0;
    sim.run(10);
  }
};

}  // namespace

TEST_CASE("storage: every neighbourhood of windows of many sizes") {
  Bench bench;
  INFO("seed " << test_seed());
  for (int round = 0; round < 25; ++round) {
    // The first rounds are the full buffer and the smallest window, then any.
    const int cols = round == 0 ? 26 : round == 1 ? 2 : 2 + bench.below(25);
    const int rows = round == 0 ? 18 : round == 1 ? 2 : 2 + bench.below(17);
    golden::Pixels left(cols, rows), right(cols, rows);
    for (auto* image : {&left, &right})
      for (auto& p : image->data) p = static_cast<uint16_t>(bench.below(256));
    bench.load(left, right, round % 3 * 0.3);
    bench.read(left, right, 20, 8 + bench.below(30));
  }
  for (const Scoreboard* board : {&bench.pixels, &bench.sideband, &bench.latency}) {
    INFO(board->report());
    CHECK(board->ok());
  }
  CHECK(bench.expected.empty());
  CHECK(bench.surplus == 0);
}
