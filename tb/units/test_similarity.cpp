// SPDX-License-Identifier: Apache-2.0
// similarity: every cell of several planes equals the plain sums of the model, for the smallest and the largest window,
// short rows with idle clocks, runs of unusable columns and rows, and samples at both ends of their range.
#include <deque>
#include <random>

#include "Vsimilarity_13.h"
#include "Vsimilarity_13_mul.h"
#include "Vsimilarity_15.h"
#include "Vsimilarity_21.h"
#include "Vsimilarity_3.h"
#include "Vsimilarity_5.h"
#include "Vsimilarity_7.h"
#include "golden/control.hpp"
#include "golden/similarity.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

enum class Texture { kRandom, kEqual, kConstant, kMaximum, kChecker, kOpposite, kFaint, kLow, kColumns };

template <class Dut>
struct Bench : Agent {
  golden::Config config;
  int sample_bits;
  Sim<Dut> sim{10000000, test_seed()};
  Dut& dut = sim.dut();
  Scoreboard v{"v"}, flags{"inside, textured, last"}, latency{"latency"};
  std::mt19937 random{test_seed()};
  uint64_t surplus = 0;
  int plane = 0;

  struct Expected {
    int v;
    uint64_t flags, clock;
    Place place;
  };
  std::deque<Expected> expected;

  Bench(int window, int width, int mncc_bits) : sample_bits(width) {
    config.window = window, config.mncc_bits = mncc_bits;
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
    v.compare(dut.m_v, static_cast<uint64_t>(e.v), e.place, now);
    flags.compare(static_cast<uint64_t>(dut.m_inside << 2 | dut.m_textured << 1 | dut.m_last), e.flags, e.place, now);
    latency.compare(now, e.clock, e.place, now);
  }
  int below(int n) { return static_cast<int>(static_cast<uint32_t>(random()) % static_cast<uint32_t>(n)); }

  std::pair<int, int> texel(Texture kind, int i, int j) {
    const int top = (1 << sample_bits) - 1;
    switch (kind) {
      case Texture::kEqual: {
        const int a = below(top + 1);
        return {a, a};
      }
      case Texture::kConstant:
        return {top / 3, top / 2};
      case Texture::kMaximum:
        return {top, top};
      case Texture::kChecker:
        return {(i + j) % 2 ? top : 0, (i + j) % 2 ? top : 0};
      case Texture::kOpposite:
        return {(i + j) % 2 ? top : 0, (i + j) % 2 ? 0 : top};
      case Texture::kLow:
        return {0, top};
      case Texture::kColumns: {
        // The column decides how many samples lie at the ends of the range and in how many of them l and r are
        // opposite, so that its sums reach the corners of what they may be.
        const int a = i / 32 % 2 && below(2) ? top : 0, b = below(7) < i % 8 ? top - a : a;
        return below(4) <= i / 8 % 4 ? std::pair{a, b} : std::pair{top / 2, top / 2};
      }
      case Texture::kFaint: {
        const int a = top / 2 + (below(50) == 0 ? 1 : 0);
        return {a, below(3) == 0 ? top / 2 : a};
      }
      default:
        return {below(top + 1), below(top + 1)};
    }
  }

  // One plane of cols x rows samples; a share of columns and rows is not usable.
  void run_plane(Texture kind, int cols, int rows, double unusable) {
    const int m = config.window;
    std::vector<int> l, r, ok;
    std::vector<int> usable_x(cols), usable_y(rows);
    std::bernoulli_distribution bad(unusable);
    for (auto& u : usable_x) u = !bad(random);
    for (auto& u : usable_y) u = !bad(random);
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < cols; ++i) {
        const auto [a, b] = texel(kind, i, j);
        l.push_back(a), r.push_back(b), ok.push_back(usable_x[i] && usable_y[j]);
        dut.s_valid = 1;
        dut.s_row_first = i == 0;
        dut.s_plane_first = j == 0;
        dut.s_plane_last = i == cols - 1 && j == rows - 1;
        dut.s_usable_x = static_cast<uint8_t>(usable_x[i]);
        dut.s_usable_y = static_cast<uint8_t>(usable_y[j]);
        dut.s_l = static_cast<std::remove_reference_t<decltype(dut.s_l)>>(a);
        dut.s_r = static_cast<std::remove_reference_t<decltype(dut.s_r)>>(b);
        if (i >= m - 1 && j >= m - 1) {
          golden::Sums sums;
          bool inside = true;
          for (int dj = 0; dj < m; ++dj)
            for (int di = 0; di < m; ++di) {
              const size_t at = static_cast<size_t>(j - dj) * cols + static_cast<size_t>(i - di);
              sums.add(l[at], r[at]);
              inside = inside && ok[at];
            }
          const golden::Similarity s = golden::mncc(config, sums, inside);
          const int latency_clocks = golden::similarity_latency(config);
          expected.push_back({s.v,
                              static_cast<uint64_t>(s.valid << 2 | s.textured << 1 | dut.s_plane_last),
                              sim.cycle() + static_cast<uint64_t>(latency_clocks),
                              {-1, plane, i - m + 1, j - m + 1}});
        }
        sim.tick();
      }
      dut.s_valid = 0;
      dut.s_row_first = 0;
      for (int i = cols; i < golden::kRowMin; ++i) sim.tick();
      if (below(8) == 0) sim.run(static_cast<uint64_t>(below(5)));
    }
    ++plane;
  }
  void check() {
    sim.run(60);
    for (const Scoreboard* board : {&v, &flags, &latency}) {
      INFO(board->report());
      CHECK(board->ok());
    }
    CHECK(expected.empty());
    CHECK(surplus == 0);
  }
};

template <class Dut>
void run_window(int window, int sample_bits, int mncc_bits, int max_cols) {
  INFO("seed " << test_seed() << " window " << window);
  Bench<Dut> bench(window, sample_bits, mncc_bits);
  for (const Texture kind :
       {Texture::kRandom, Texture::kEqual, Texture::kConstant, Texture::kMaximum, Texture::kChecker, Texture::kOpposite,
        Texture::kFaint, Texture::kLow, Texture::kColumns}) {
    bench.run_plane(kind, window, window, 0);  // one cell
    bench.run_plane(kind, window + bench.below(max_cols - window + 1), window + bench.below(window), 0);
    bench.run_plane(kind, max_cols, 2 * window + 3, 0.02);
  }
  bench.run_plane(Texture::kRandom, max_cols, window, 0.5);
  bench.check();
}

}  // namespace

TEST_CASE("similarity: 3 x 3, 8-bit samples") { run_window<Vsimilarity_3>(3, 8, 16, 19); }
TEST_CASE("similarity: 5 x 5, samples 8.3, products split") { run_window<Vsimilarity_5>(5, 11, 9, 16); }
TEST_CASE("similarity: 7 x 7, samples of one bit, divided in products") { run_window<Vsimilarity_7>(7, 1, 8, 64); }
TEST_CASE("similarity: 13 x 13, samples 8.2") { run_window<Vsimilarity_13>(13, 10, 13, 37); }
TEST_CASE("similarity: 13 x 13, divided in products, products split") {
  run_window<Vsimilarity_13_mul>(13, 10, 13, 37);
}
TEST_CASE("similarity: 15 x 15, 4-bit samples, divided in products") { run_window<Vsimilarity_15>(15, 4, 14, 80); }
TEST_CASE("similarity: 21 x 21, samples 8.8, too few bits for products") { run_window<Vsimilarity_21>(21, 16, 4, 40); }

TEST_CASE("similarity: a reset forgets what is on its way") {
  INFO("seed " << test_seed());
  Bench<Vsimilarity_13> bench(13, 10, 13);
  bench.run_plane(Texture::kRandom, 30, 20, 0);
  bench.expected.clear();
  bench.sim.reset(1);
  const size_t before = bench.v.compared();
  bench.sim.run(60);
  CHECK(bench.surplus == 0);
  bench.run_plane(Texture::kEqual, 20, 15, 0);
  bench.check();
  CHECK(bench.v.compared() == before + 8 * 3);
}
