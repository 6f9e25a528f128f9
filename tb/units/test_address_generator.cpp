// SPDX-License-Identifier: Apache-2.0
// address_generator: positions, fractions, tests and bank rows of every sample equal the model, rows of every length
// back to back, planes back to back, positions that wrap, steps from 0 to the largest; latency as in the header. A word
// of table or offsets that is not what was written is told, whichever bit it is, by a row that reads it and by no
// other.
#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <deque>
#include <random>

#include "Vaddress_generator_mid.h"
#include "Vaddress_generator_min.h"
#include "Vaddress_generator_rectified.h"
#include "contract/registers.hpp"
#include "golden/address_generator.hpp"
#include "golden/control.hpp"
#include "golden/storage.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

constexpr uint64_t kLatency = golden::kAddressLatency;

// Low `bits` of a signed or unsigned value, as a port shows them.
uint64_t bits_of(int64_t value, int bits) { return static_cast<uint64_t>(value) & ((uint64_t{1} << bits) - 1); }

template <class Dut>
struct Bench : Agent {
  golden::Config config;
  Sim<Dut> sim{2000000, test_seed()};
  Dut& dut = sim.dut();
  Scoreboard position{"position"}, flags{"flags"}, strobes{"strobes"}, rows{"bank rows"}, latency{"latency"};

  struct Expected {
    golden::Sample left, right;
    bool usable_x, usable_y, window_error, row_first, plane_first, plane_last;
    uint64_t clock;
    Place place;
  };
  std::deque<Expected> expected;
  uint64_t surplus = 0, on_row = 0, between_rows = 0;
  std::vector<uint64_t> word_errors;  // clocks of them

  explicit Bench(const golden::Config& c) : config(c) {
    dut.table_we = 0;
    dut.offset_we = 0;
    idle();
    sim.add(*this);
    sim.reset();
  }
  void idle() {
    dut.s_valid = 0;
    dut.s_row_first = 0;
    dut.s_plane_last = 0;
  }
  void sample() override {
    if (dut.m_word_error) word_errors.push_back(sim.cycle());
    if (!dut.m_valid) {
      if (dut.m_row_first || dut.m_window_error) ++surplus;
      return;
    }
    if (expected.empty()) {
      ++surplus;
      return;
    }
    const Expected e = expected.front();
    expected.pop_front();
    const uint64_t now = sim.cycle();
    auto pos = [&](uint64_t rtl, int64_t model, int bits) {
      position.compare(rtl, bits_of(model, bits), e.place, now);
    };
    pos(dut.m_xi_left, e.left.xi, 13);
    pos(dut.m_yi_left, e.left.yi, 13);
    pos(dut.m_fx_left, e.left.fx, config.weight_bits);
    pos(dut.m_fy_left, e.left.fy, config.weight_bits);
    pos(dut.m_xi_right, e.right.xi, 13);
    pos(dut.m_yi_right, e.right.yi, 13);
    pos(dut.m_fx_right, e.right.fx, config.weight_bits);
    pos(dut.m_fy_right, e.right.fy, config.weight_bits);
    auto packed = [](bool a, bool b, bool c) { return uint64_t{a} << 2 | uint64_t{b} << 1 | uint64_t{c}; };
    flags.compare(packed(dut.m_usable_x, dut.m_usable_y, dut.m_window_error),
                  packed(e.usable_x, e.usable_y, e.window_error), e.place, now);
    strobes.compare(packed(dut.m_row_first, dut.m_plane_first, dut.m_plane_last),
                    packed(e.row_first, e.plane_first, e.plane_last), e.place, now);
    latency.compare(now, e.clock + kLatency, e.place, now);
    if (e.usable_y) {
      // Address of column 0 of whichever of the rows yi, yi+1 is even / odd.
      auto row = [&](int yi, int parity) {
        return static_cast<uint64_t>(
            golden::bank_address(config, 0, config.rectified || (yi & 1) == parity ? yi : yi + 1));
      };
      rows.compare(dut.m_row_even_left, row(e.left.yi, 0), e.place, now);
      rows.compare(dut.m_row_odd_left, row(e.left.yi, 1), e.place, now);
      rows.compare(dut.m_row_even_right, row(e.right.yi, 0), e.place, now);
      rows.compare(dut.m_row_odd_right, row(e.right.yi, 1), e.place, now);
    }
  }

  // The bit of `wrong`, 0 to 31 of the word or 32 for its parity, is not what it should be.
  void write_data(uint32_t word, int wrong = -1) {
    dut.cfg_parity = (std::bitset<32>(word).count() & 1) ^ (wrong == 32);
    dut.cfg_data = word ^ (wrong >= 0 && wrong < 32 ? uint32_t{1} << wrong : 0);
  }
  void load(const golden::TileJob& t, const std::vector<golden::PlaneEntry>& table) {
    dut.table_we = 1;
    for (size_t k = 0; k < table.size(); ++k) {
      const auto words = golden::table_words(table[k]);
      for (size_t f = 0; f < 8; ++f) {
        dut.table_addr = static_cast<std::remove_reference_t<decltype(dut.table_addr)>>(8 * k + f);
        write_data(words[f]);
        sim.tick();
      }
    }
    dut.table_we = 0;
    dut.offset_we = 1;
    const int32_t offsets[4] = {t.tx_left, t.ty_left, t.tx_right, t.ty_right};
    for (unsigned i = 0; i < 4; ++i) {
      dut.offset_addr = static_cast<CData>(i);
      write_data(static_cast<uint32_t>(offsets[i]));
      sim.tick();
    }
    dut.offset_we = 0;
    dut.win_last_col = static_cast<std::remove_reference_t<decltype(dut.win_last_col)>>(t.win_cols - 1);
    dut.win_last_row = static_cast<std::remove_reference_t<decltype(dut.win_last_row)>>(t.win_rows - 1);
    auto bound = [](int v) { return static_cast<SData>(v & 0x1FFF); };
    dut.left_x_lo = bound(t.left.x_lo), dut.left_x_hi = bound(t.left.x_hi);
    dut.left_y_lo = bound(t.left.y_lo), dut.left_y_hi = bound(t.left.y_hi);
    dut.right_x_lo = bound(t.right.x_lo), dut.right_x_hi = bound(t.right.x_hi);
    dut.right_y_lo = bound(t.right.y_lo), dut.right_y_hi = bound(t.right.y_hi);
    sim.run(2);
  }

  // `gap`: idle clocks between planes.
  void sweep(const golden::TileJob& t, const std::vector<golden::PlaneEntry>& table, int cols, int rows_of_plane,
             int gap) {
    for (size_t k = 0; k < table.size(); ++k) {
      for (int j = 0; j < rows_of_plane; ++j) {
        for (int i = 0; i < std::max(cols, golden::kRowMin); ++i) {
          idle();
          dut.s_plane = static_cast<std::remove_reference_t<decltype(dut.s_plane)>>(k);
          dut.s_plane_first = j == 0;
          if (i < cols) {
            dut.s_valid = 1;
            dut.s_row_first = i == 0;
            dut.s_plane_last = i == cols - 1 && j == rows_of_plane - 1;
            Expected e;
            e.left = golden::left_sample(config, t, table[k], i, j);
            e.right = golden::right_sample(config, t, table[k], i, j);
            auto x_loaded = [&](const golden::Sample& s) { return s.xi >= 0 && s.xi + 1 < t.win_cols; };
            auto y_loaded = [&](const golden::Sample& s) { return s.yi >= 0 && s.yi + 1 < t.win_rows; };
            e.usable_x = e.left.inside_x && e.right.inside_x && x_loaded(e.left) && x_loaded(e.right);
            e.usable_y = e.left.inside_y && e.right.inside_y && y_loaded(e.left) && y_loaded(e.right);
            if (config.rectified && e.usable_y) {
              golden::Config full = config;
              full.rectified = 0;
              const bool on_rows = golden::left_sample(full, t, table[k], i, j).fy == 0 &&
                                   golden::right_sample(full, t, table[k], i, j).fy == 0;
              e.usable_y = on_rows;
              (on_rows ? on_row : between_rows) += 1;
            }
            const golden::SampleFlags want = golden::sample_flags(e.left, e.right);
            REQUIRE(want.usable == (e.usable_x && e.usable_y));
            e.window_error = want.window_error;
            e.row_first = i == 0;
            e.plane_first = j == 0;
            e.plane_last = dut.s_plane_last;
            e.clock = sim.cycle();
            e.place = {-1, static_cast<int>(k), i, j};
            expected.push_back(e);
          }
          sim.tick();
        }
      }
      idle();
      sim.run(static_cast<uint64_t>(gap));
    }
    idle();
    sim.run(20);
  }

  void check() {
    for (const Scoreboard* board : {&position, &flags, &strobes, &rows, &latency}) {
      INFO(board->report());
      CHECK(board->ok());
    }
    CHECK(expected.empty());
    CHECK(surplus == 0);
    CHECK(word_errors.empty());
  }
};

golden::Config mid_config() {
  golden::Config c;
  c.img_cols = 62, c.img_rows = 38, c.planes = 5, c.weight_bits = 6;
  return c;
}

int32_t fixed(double pixels) { return static_cast<int32_t>(std::lround(pixels * (1 << golden::kPosFrac))); }

}  // namespace

template <class Dut>
void around_the_window(Bench<Dut>& bench) {
  const uint32_t seed = test_seed();
  INFO("seed " << seed);
  std::mt19937 random(seed);
  auto uniform = [&](double lo, double hi) { return lo + (hi - lo) * (static_cast<double>(random()) / 4294967296.0); };
  for (int cols : {1, 3, 7, 8, 9, 23, 70}) {
    golden::TileJob t;
    t.win_cols = 20 + static_cast<int>(random() % 43);
    t.win_rows = 10 + static_cast<int>(random() % 29);
    t.left = {static_cast<int>(random() % 8) - 4, t.win_cols - static_cast<int>(random() % 8), -2, t.win_rows - 2};
    t.right = {static_cast<int>(random() % 8) - 4, t.win_cols - 2, 1, t.win_rows + 3};
    t.tx_left = fixed(uniform(-8, 8)), t.ty_left = fixed(uniform(-4, 4));
    t.tx_right = fixed(uniform(-8, 8)), t.ty_right = fixed(uniform(-4, 4));
    std::vector<golden::PlaneEntry> table(5);
    for (auto& p : table) {
      p.x0_left = fixed(uniform(-5, 10)), p.y0_left = fixed(uniform(-2, 3));
      p.x0_right = fixed(uniform(-5, 10)), p.y0_right = fixed(uniform(-2, 3));
      // One plane of five with whole steps and starts, where fractions are 0 and bounds are hit exactly.
      const bool whole = &p == &table[2];
      auto step = [&] { return static_cast<uint32_t>(fixed(whole ? 1 : uniform(0, 1.9))); };
      p.dx_left = step(), p.dy_left = step(), p.dx_right = step(), p.dy_right = step();
      if (whole) {
        p.x0_left = fixed(-3) - t.tx_left, p.y0_left = fixed(-3) - t.ty_left;
        p.x0_right = fixed(-3) - t.tx_right, p.y0_right = fixed(0) - t.ty_right;
      }
    }
    bench.load(t, table);
    bench.sweep(t, table, cols, 40, 0);
  }
  bench.check();
}

TEST_CASE("address_generator: samples around the window, rows of every length") {
  Bench<Vaddress_generator_mid> bench(mid_config());
  around_the_window(bench);
}

TEST_CASE("address_generator: built for rectified pairs, samples between rows are refused") {
  golden::Config c = mid_config();
  c.rectified = 1;
  Bench<Vaddress_generator_rectified> bench(c);
  around_the_window(bench);
  CHECK(bench.on_row > 100);
  CHECK(bench.between_rows > 100);
}

TEST_CASE("address_generator: positions anywhere, wrapping modulo 2^32") {
  Bench<Vaddress_generator_mid> bench(mid_config());
  std::mt19937 random(test_seed() + 1);
  for (int round = 0; round < 20; ++round) {
    golden::TileJob t;
    t.win_cols = 1 + static_cast<int>(random() % 62), t.win_rows = 1 + static_cast<int>(random() % 38);
    auto bounds = [&] {
      auto any = [&] { return static_cast<int>(random() % 8192) - 4096; };
      const int a = any(), b = any(), c = any(), d = any();
      return golden::Bounds{std::min(a, b), std::max(a, b), std::min(c, d), std::max(c, d)};
    };
    t.left = bounds(), t.right = bounds();
    auto word = [&] { return static_cast<int32_t>(static_cast<uint32_t>(random())); };
    t.tx_left = word(), t.ty_left = word(), t.tx_right = word(), t.ty_right = word();
    std::vector<golden::PlaneEntry> table(5);
    for (auto& p : table) {
      p.x0_left = word(), p.y0_left = word(), p.x0_right = word(), p.y0_right = word();
      for (uint32_t* step : {&p.dx_left, &p.dy_left, &p.dx_right, &p.dy_right})
        *step = static_cast<uint32_t>(random()) & ((1u << golden::kStepBits) - 1);
    }
    bench.load(t, table);
    bench.sweep(t, table, 11, 9, round % 3);
  }
  // Such positions are hardly ever inside, so bank rows and flags are compared by the other cases.
  INFO(bench.position.report());
  CHECK(bench.position.ok());
  INFO(bench.flags.report());
  CHECK(bench.flags.ok());
  CHECK(bench.strobes.ok());
  CHECK(bench.latency.ok());
  CHECK(bench.rows.errors() == 0);
  CHECK(bench.surplus == 0);
}

TEST_CASE("address_generator: smallest buffer, one plane, widest weights") {
  golden::Config c;
  c.img_cols = 4, c.img_rows = 4, c.planes = 1, c.weight_bits = 12;
  Bench<Vaddress_generator_min> bench(c);
  golden::TileJob t;
  t.win_cols = 4, t.win_rows = 4;
  t.left = t.right = {0, 3, 0, 3};
  std::vector<golden::PlaneEntry> table(1);
  for (uint32_t* step : {&table[0].dx_left, &table[0].dy_left, &table[0].dx_right, &table[0].dy_right})
    *step = static_cast<uint32_t>(fixed(0.03));
  bench.load(t, table);
  bench.sweep(t, table, 120, 120, 0);
  bench.check();
}

TEST_CASE("address_generator: reset in mid-row, then a good plane") {
  Bench<Vaddress_generator_mid> bench(mid_config());
  golden::TileJob t;
  t.win_cols = 40, t.win_rows = 30;
  t.left = t.right = {0, 38, 0, 28};
  std::vector<golden::PlaneEntry> table(2);
  for (auto& p : table) p.dx_left = p.dy_left = p.dx_right = p.dy_right = 1u << golden::kPosFrac;
  bench.load(t, table);
  for (int stop = 1; stop < 14; ++stop) {
    for (int i = 0; i < stop; ++i) {  // the row is cut off after `stop` clocks
      bench.dut.s_valid = 1;
      bench.dut.s_row_first = i == 0;
      bench.dut.s_plane_first = 1;
      bench.dut.s_plane = 0;
      bench.dut.clk = 0, bench.dut.eval();  // unseen by the bench: these samples must not come out
      bench.dut.clk = 1, bench.dut.eval();
    }
    bench.idle();
    bench.sim.reset(1);
    bench.sim.run(3);
    bench.sweep(t, table, 12, 5, 0);
  }
  bench.check();
}

TEST_CASE("address_generator: a bit of a table or offset word that is wrong is told by the rows that read it") {
  Bench<Vaddress_generator_mid> bench(mid_config());
  golden::TileJob t;
  t.win_cols = 40, t.win_rows = 30;
  t.left = t.right = {0, 38, 0, 28};
  std::mt19937 random(test_seed());
  auto any = [&] { return static_cast<int32_t>(static_cast<uint32_t>(random())); };
  t.tx_left = any(), t.ty_left = any(), t.tx_right = any(), t.ty_right = any();
  std::vector<golden::PlaneEntry> table(3);
  for (auto& p : table) {
    p.x0_left = any(), p.y0_left = any(), p.x0_right = any(), p.y0_right = any();
    for (uint32_t* step : {&p.dx_left, &p.dy_left, &p.dx_right, &p.dy_right})
      *step = static_cast<uint32_t>(random()) & ((1u << golden::kStepBits) - 1);
  }
  constexpr int kRows = 3, kCols = 5;  // rows shorter than their eight clocks
  const uint64_t row = golden::kRowMin;
  bench.load(t, table);
  auto run = [&] {
    bench.expected.clear();
    bench.word_errors.clear();
    const uint64_t begun = bench.sim.cycle();
    bench.sweep(t, table, kCols, kRows, 0);
    return begun;
  };
  run();
  CHECK(bench.word_errors.empty());
  // Which rows of a plane read a word: y0 the first one, dy the others, the rest all. Told within the eight clocks.
  auto in_row = [&](uint64_t clock, uint64_t begun) { return clock > begun && clock <= begun + row; };
  for (int field = 0; field < 8; ++field) {
    for (int bit = 0; bit <= 32; ++bit) {
      INFO("field " << field << " bit " << bit);
      const uint32_t word = golden::table_words(table[1])[static_cast<size_t>(field)];
      bench.dut.table_we = 1;
      bench.dut.table_addr = static_cast<std::remove_reference_t<decltype(bench.dut.table_addr)>>(8 + field);
      bench.write_data(word, bit);
      bench.sim.tick();
      bench.dut.table_we = 0;
      const uint64_t begun = run() + kRows * row;  // of plane 1
      const bool first = field != 5 && field != 7, others = field != 1 && field != 3;
      std::vector<uint64_t> rows;
      for (uint64_t j = 0; j < kRows; ++j)
        if (j == 0 ? first : others) rows.push_back(begun + j * row);
      REQUIRE(bench.word_errors.size() == rows.size());
      for (size_t k = 0; k < rows.size(); ++k) CHECK(in_row(bench.word_errors[k], rows[k]));
      bench.dut.table_we = 1;
      bench.write_data(word);
      bench.sim.tick();
      bench.dut.table_we = 0;
    }
  }
  // y offsets are read by the first row of each plane, x offsets by every row.
  const int32_t offsets[4] = {t.tx_left, t.ty_left, t.tx_right, t.ty_right};
  for (unsigned which = 0; which < 4; ++which) {
    for (int bit = 0; bit <= 32; ++bit) {
      INFO("offset " << which << " bit " << bit);
      bench.dut.offset_we = 1;
      bench.dut.offset_addr = static_cast<CData>(which);
      bench.write_data(static_cast<uint32_t>(offsets[which]), bit);
      bench.sim.tick();
      bench.dut.offset_we = 0;
      const uint64_t begun = run();
      std::vector<uint64_t> rows;
      for (uint64_t j = 0; j < table.size() * kRows; ++j)
        if (which % 2 == 0 || j % kRows == 0) rows.push_back(begun + j * row);
      for (const uint64_t at : rows)
        CHECK(std::any_of(bench.word_errors.begin(), bench.word_errors.end(),
                          [&](uint64_t clock) { return in_row(clock, at); }));
      bench.dut.offset_we = 1;
      bench.write_data(static_cast<uint32_t>(offsets[which]));
      bench.sim.tick();
      bench.dut.offset_we = 0;
    }
  }
  run();
  CHECK(bench.word_errors.empty());
  // What was never written is not read by a row, so it is no error: planes 3 and 4. Nor is anything told in a reset.
  bench.sim.reset(3);
  bench.sim.run(20);
  CHECK(bench.word_errors.empty());
}
