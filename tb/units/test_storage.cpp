// SPDX-License-Identifier: Apache-2.0
// storage: any 2x2 neighbourhood of any loaded window comes out of both images at once, one sample per clock, with its
// sidebands, after the promised latency; windows of every size, one loaded over the other; with 1, 2 and 4 lanes that
// read at places of their own, some of them resting.
#include <array>
#include <deque>
#include <random>

#include "Vstorage_mid.h"
#include "Vstorage_mid_2.h"
#include "Vstorage_mid_4.h"
#include "Vstorage_rectified.h"
#include "Vstorage_rectified_4.h"
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

template <class Dut>
struct Bench : Agent {
  golden::Config config = mid_config();
  Sim<Dut> sim{1000000, test_seed()};
  Dut& dut = sim.dut();
  Scoreboard pixels{"quad"}, sideband{"sideband"}, latency{"latency"};
  std::mt19937 random{test_seed()};

  struct Expected {
    bool usable;
    golden::Quad left, right;
    uint64_t sideband, clock;
    Place place;
  };
  std::array<std::deque<Expected>, 4> expected;  // by lane
  uint64_t surplus = 0;

  Bench(int lanes, int rectified) {
    config.lanes = lanes, config.rectified = rectified;
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

  // Field of lane n in a bundle.
  static int at(uint64_t bundle, int n, int bits) {
    return static_cast<int>(bundle >> n * bits & ((uint64_t{1} << bits) - 1));
  }
  template <class Port>
  static void put(Port& bundle, int n, int bits, uint64_t value) {
    const uint64_t mask = ((uint64_t{1} << bits) - 1) << n * bits;
    bundle = static_cast<Port>((bundle & ~mask) | (value << n * bits & mask));
  }

  void sample() override {
    for (int n = 0; n < config.lanes; ++n)
      if (dut.m_valid >> n & 1) sample_lane(n);
  }
  void sample_lane(int n) {
    auto& queue = expected[static_cast<size_t>(n)];
    if (queue.empty()) {
      ++surplus;
      return;
    }
    const Expected e = queue.front();
    queue.pop_front();
    const uint64_t now = sim.cycle();
    const int w = config.weight_bits, p = config.pix_bits;
    latency.compare(now, e.clock + kLatency, e.place, now);
    const auto strobes = static_cast<uint64_t>(at(dut.m_row_first, n, 1) << 4 | at(dut.m_plane_first, n, 1) << 3 |
                                               at(dut.m_plane_last, n, 1) << 2 | at(dut.m_usable_x, n, 1) << 1 |
                                               at(dut.m_usable_y, n, 1));
    sideband.compare(pack(strobes, at(dut.m_fx_left, n, w), at(dut.m_fy_left, n, w), at(dut.m_fx_right, n, w),
                          at(dut.m_fy_right, n, w)),
                     e.sideband, e.place, now);
    if (!e.usable) return;
    auto word = [](int p00, int p10, int p01, int p11) {
      return static_cast<uint64_t>(p00) << 48 | static_cast<uint64_t>(p10) << 32 | static_cast<uint64_t>(p01) << 16 |
             static_cast<uint64_t>(p11);
    };
    pixels.compare(
        word(at(dut.m_p00_left, n, p), at(dut.m_p10_left, n, p), at(dut.m_p01_left, n, p), at(dut.m_p11_left, n, p)),
        word(e.left.p00, e.left.p10, e.left.p01, e.left.p11), e.place, now);
    pixels.compare(word(at(dut.m_p00_right, n, p), at(dut.m_p10_right, n, p), at(dut.m_p01_right, n, p),
                        at(dut.m_p11_right, n, p)),
                   word(e.right.p00, e.right.p10, e.right.p01, e.right.p11), e.place, now);
  }

  int below(int n) { return static_cast<int>(static_cast<uint32_t>(random()) % static_cast<uint32_t>(n)); }

  void load(const golden::Pixels& left, const golden::Pixels& right, double stall) {
    std::bernoulli_distribution idle(stall);
    // As behind the last sample of a plane.
    dut.s_row_even_left = 0, dut.s_row_odd_left = 0, dut.s_row_even_right = 0, dut.s_row_odd_right = 0;
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

  // Rows of samples at random places, each lane at its own; some of them not usable, then with addresses beyond
  // everything. Lanes beyond the first `active` rest.
  void read(const golden::Pixels& left, const golden::Pixels& right, int rows, int cols, int active) {
    auto row_address = [&](int yi, int parity) {
      return static_cast<uint64_t>(
          golden::bank_address(config, 0, config.rectified || (yi & 1) == parity ? yi : yi + 1));
    };
    const int w = config.weight_bits, bank = config.rectified ? 8 : 7;
    struct Row {
      bool usable;
      int yl, yr, fyl, fyr;
    };
    std::array<Row, 4> row;
    for (int j = 0; j < rows; ++j) {
      for (auto& r : row) r = {below(5) != 0, below(left.height - 1), below(left.height - 1), below(64), below(64)};
      for (int i = 0; i < cols; ++i) {
        const bool strobes[] = {i == 0, j == 0, i == cols - 1 && j == rows - 1};
        for (int n = 0; n < config.lanes; ++n) {
          const Row& at_row = row[static_cast<size_t>(n)];
          const bool on = n < active, usable_y = at_row.usable, usable_x = below(5) != 0;
          golden::Sample l, r;
          l.xi = below(left.width - 1), r.xi = below(left.width - 1);
          l.yi = at_row.yl, r.yi = at_row.yr;
          const int fxl = below(64), fxr = below(64);
          put(dut.s_valid, n, 1, on);
          put(dut.s_row_first, n, 1, on && strobes[0]);
          put(dut.s_plane_first, n, 1, strobes[1]);
          put(dut.s_plane_last, n, 1, strobes[2]);
          put(dut.s_usable_x, n, 1, usable_x);
          put(dut.s_usable_y, n, 1, usable_y);
          put(dut.s_xi_left, n, 13, static_cast<uint64_t>(usable_x ? l.xi : below(8192)));
          put(dut.s_xi_right, n, 13, static_cast<uint64_t>(usable_x ? r.xi : below(8192)));
          put(dut.s_fx_left, n, w, static_cast<uint64_t>(fxl));
          put(dut.s_fx_right, n, w, static_cast<uint64_t>(fxr));
          if (i == 0) {
            put(dut.s_yi_left, n, 13, static_cast<uint64_t>(at_row.yl));
            put(dut.s_yi_right, n, 13, static_cast<uint64_t>(at_row.yr));
            put(dut.s_fy_left, n, w, static_cast<uint64_t>(at_row.fyl));
            put(dut.s_fy_right, n, w, static_cast<uint64_t>(at_row.fyr));
            auto address = [&](int yi, int parity) {
              return usable_y ? row_address(yi, parity) : static_cast<uint64_t>(below(1 << bank));
            };
            put(dut.s_row_even_left, n, bank, address(at_row.yl, 0));
            put(dut.s_row_odd_left, n, bank, address(at_row.yl, 1));
            put(dut.s_row_even_right, n, bank, address(at_row.yr, 0));
            put(dut.s_row_odd_right, n, bank, address(at_row.yr, 1));
          }
          if (!on) continue;
          Expected e;
          e.usable = usable_x && usable_y;
          if (e.usable) e.left = golden::fetch(config, left, l), e.right = golden::fetch(config, right, r);
          e.sideband = pack(
              static_cast<uint64_t>(strobes[0] << 4 | strobes[1] << 3 | strobes[2] << 2 | usable_x << 1 | usable_y),
              fxl, at_row.fyl, fxr, at_row.fyr);
          e.clock = sim.cycle();
          e.place = {-1, n, i, j};
          expected[static_cast<size_t>(n)].push_back(e);
        }
        sim.tick();
      }
    }
    dut.s_valid = 0;
    dut.s_row_first = 0;
    sim.run(10);
  }
};

template <class Dut>
void run_lanes(int lanes, int rectified) {
  Bench<Dut> bench(lanes, rectified);
  INFO("seed " << test_seed() << " lanes " << lanes << " rectified " << rectified);
  for (int round = 0; round < 25; ++round) {
    // The first rounds are the full buffer and the smallest window, then any.
    const int cols = round == 0 ? 26 : round == 1 ? 2 : 2 + bench.below(25);
    const int rows = round == 0 ? 18 : round == 1 ? 2 : 2 + bench.below(17);
    golden::Pixels left(cols, rows), right(cols, rows);
    for (auto* image : {&left, &right})
      for (auto& p : image->data) p = static_cast<uint16_t>(bench.below(256));
    bench.load(left, right, round % 3 * 0.3);
    bench.read(left, right, 20, 8 + bench.below(30), round % 3 == 2 ? 1 + bench.below(lanes) : lanes);
  }
  for (const Scoreboard* board : {&bench.pixels, &bench.sideband, &bench.latency}) {
    INFO(board->report());
    CHECK(board->ok());
  }
  for (const auto& queue : bench.expected) CHECK(queue.empty());
  CHECK(bench.surplus == 0);
}

}  // namespace

TEST_CASE("storage: every neighbourhood of windows of many sizes") { run_lanes<Vstorage_mid>(1, 0); }
TEST_CASE("storage: two lanes, each at its own place") { run_lanes<Vstorage_mid_2>(2, 0); }
TEST_CASE("storage: four lanes, each at its own place") { run_lanes<Vstorage_mid_4>(4, 0); }
TEST_CASE("storage: two banks an image for rectified pairs") { run_lanes<Vstorage_rectified>(1, 1); }
TEST_CASE("storage: two banks an image, four lanes") { run_lanes<Vstorage_rectified_4>(4, 1); }
