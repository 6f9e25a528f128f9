// SPDX-License-Identifier: Apache-2.0
// interpolation: every sample equals the model bit for bit in formats with few and many fraction bits (rounding among
// the rows' bits, below them, and none at all); corners first (all 0, all max, checkers, extreme fractions), then
// random; 0 where not usable; sidebands and latency.
#include <deque>
#include <random>

#include "Vinterpolation_12_12_0.h"
#include "Vinterpolation_3_1_8.h"
#include "Vinterpolation_8_4_6.h"
#include "Vinterpolation_8_8_2.h"
#include "Vinterpolation_rectified_12_12_0.h"
#include "Vinterpolation_rectified_8_4_6.h"
#include "Vinterpolation_rectified_8_8_2.h"
#include "golden/control.hpp"
#include "golden/interpolation.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

template <class Dut>
struct Bench : Agent {
  golden::Config config;
  Sim<Dut> sim{1000000, test_seed()};
  Dut& dut = sim.dut();
  Scoreboard value{"l, r"}, sideband{"sideband"}, latency{"latency"};
  std::mt19937 random{test_seed()};

  struct Expected {
    int l, r;
    uint64_t sideband, clock;
    Place place;
  };
  std::deque<Expected> expected;
  uint64_t surplus = 0;

  Bench(int pix_bits, int weight_bits, int interp_frac, int rectified) {
    config.pix_bits = pix_bits, config.weight_bits = weight_bits, config.interp_frac = interp_frac;
    config.rectified = rectified;
    dut.s_valid = 0;
    dut.s_row_first = 0;
    sim.add(*this);
    sim.reset();
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
    value.compare(dut.m_l, static_cast<uint64_t>(e.l), e.place, now);
    value.compare(dut.m_r, static_cast<uint64_t>(e.r), e.place, now);
    sideband.compare(static_cast<uint64_t>(dut.m_row_first << 4 | dut.m_plane_first << 3 | dut.m_plane_last << 2 |
                                           dut.m_usable_x << 1 | dut.m_usable_y),
                     e.sideband, e.place, now);
    latency.compare(now, e.clock + static_cast<uint64_t>(golden::interpolation_latency(config)), e.place, now);
  }
  int below(int n) { return static_cast<int>(static_cast<uint32_t>(random()) % static_cast<uint32_t>(n)); }

  golden::Quad quad(int kind) {
    const int top = (1 << config.pix_bits) - 1;
    auto any = [&] { return below(top + 1); };
    switch (kind) {
      case 0:
        return {0, 0, 0, 0};
      case 1:
        return {top, top, top, top};
      case 2:
        return {top, 0, 0, top};
      case 3:
        return {0, top, top, 0};
      case 4:
        return {top, 0, top, 0};
      case 5:
        return {0, 0, top, top};
      default:
        return {any(), any(), any(), any()};
    }
  }

  void run(int rows, int cols) {
    const int weights = 1 << config.weight_bits;
    auto fraction = [&](int kind) { return kind == 0 ? 0 : kind == 1 ? weights - 1 : below(weights); };
    auto put = [](auto& port, int v) { port = static_cast<std::remove_reference_t<decltype(port)>>(v); };
    for (int j = 0; j < rows; ++j) {
      const bool usable_y = j % 7 != 6;
      const int fyl = fraction(j % 4), fyr = fraction(j % 3);
      for (int i = 0; i < cols; ++i) {
        const bool usable_x = below(6) != 0;
        const golden::Quad l = quad(j < 12 ? i % 7 : 9), r = quad(j < 12 ? i % 6 : 9);
        const int fxl = fraction(below(4)), fxr = fraction(below(4));
        dut.s_valid = 1;
        dut.s_row_first = i == 0;
        dut.s_plane_first = j == 0;
        dut.s_plane_last = i == cols - 1 && j == rows - 1;
        dut.s_usable_x = usable_x, dut.s_usable_y = usable_y;
        put(dut.s_fx_left, fxl), put(dut.s_fx_right, fxr), put(dut.s_fy_left, fyl), put(dut.s_fy_right, fyr);
        put(dut.s_p00_left, l.p00), put(dut.s_p10_left, l.p10), put(dut.s_p01_left, l.p01), put(dut.s_p11_left, l.p11);
        put(dut.s_p00_right, r.p00), put(dut.s_p10_right, r.p10);
        put(dut.s_p01_right, r.p01), put(dut.s_p11_right, r.p11);
        Expected e;
        const bool usable = usable_x && usable_y;
        // Without interpolation between rows the inputs fy and p01, p11 mean nothing, whatever they show.
        auto model = [&](const golden::Quad& q, int fx, int fy) {
          return usable ? golden::interpolate(config, q, fx, config.rectified ? 0 : fy) : 0;
        };
        e.l = model(l, fxl, fyl), e.r = model(r, fxr, fyr);
        e.sideband = static_cast<uint64_t>(dut.s_row_first << 4 | dut.s_plane_first << 3 | dut.s_plane_last << 2 |
                                           usable_x << 1 | usable_y);
        e.clock = sim.cycle();
        e.place = {-1, -1, i, j};
        expected.push_back(e);
        sim.tick();
      }
    }
    dut.s_valid = 0;
    dut.s_row_first = 0;
    sim.run(12);
  }
  void check() {
    for (const Scoreboard* board : {&value, &sideband, &latency}) {
      INFO(board->report());
      CHECK(board->ok());
    }
    CHECK(expected.empty());
    CHECK(surplus == 0);
  }
};

template <class Dut>
void run_format(int pix_bits, int weight_bits, int interp_frac, int rectified = 0) {
  INFO("seed " << test_seed() << " format " << pix_bits << ' ' << weight_bits << ' ' << interp_frac);
  Bench<Dut> bench(pix_bits, weight_bits, interp_frac, rectified);
  bench.run(40, 8);
  bench.run(40, 200);
  bench.check();
}

}  // namespace

TEST_CASE("interpolation: 8-bit pixels, 8-bit weights, 2 fraction bits") { run_format<Vinterpolation_8_8_2>(8, 8, 2); }
TEST_CASE("interpolation: widest pixels and weights, integer result") { run_format<Vinterpolation_12_12_0>(12, 12, 0); }
TEST_CASE("interpolation: more fraction bits than weight bits") { run_format<Vinterpolation_8_4_6>(8, 4, 6); }
TEST_CASE("interpolation: exact results padded with zeros") { run_format<Vinterpolation_3_1_8>(3, 1, 8); }
TEST_CASE("interpolation: along the row only, for rectified pairs") {
  run_format<Vinterpolation_rectified_8_8_2>(8, 8, 2, 1);
  run_format<Vinterpolation_rectified_12_12_0>(12, 12, 0, 1);
  run_format<Vinterpolation_rectified_8_4_6>(8, 4, 6, 1);
}
