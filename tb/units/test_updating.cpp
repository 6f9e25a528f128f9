// SPDX-License-Identifier: Apache-2.0
// updating: every write into the map and every beat of the unload equal the model, for planes of random V, of a few
// values only (ties, plateaus), of maximal V, with invalid and textureless planes, and single cells; stalls, abort.
#include <deque>
#include <random>

#include "Vupdating_a.h"
#include "Vupdating_b.h"
#include "Vupdating_c.h"
#include "Vupdating_d.h"
#include "Vupdating_e.h"
#include "golden/control.hpp"
#include "golden/updating.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

template <class Dut>
struct Bench : Agent {
  golden::Config config;
  Sim<Dut> sim{10000000, test_seed()};
  Dut& dut = sim.dut();
  Scoreboard writes{"map write"}, beats{"map beat"}, latency{"latency"}, protocol{"m_map holds"};
  std::mt19937 random{test_seed()};
  std::deque<std::pair<uint64_t, Place>> expected_writes;  // clock and place
  std::deque<golden::Cell> expected_words;
  std::deque<golden::MapCell> expected_beats;
  size_t left = 0;  // beats of the tile still to come
  uint64_t surplus = 0, unloads_done = 0, held = 0;
  bool waiting = false;
  double stall = 0;
  int tile = 0;

  Bench(int planes, int mncc_bits, int frac_bits, int lanes) {
    config.planes = planes, config.mncc_bits = mncc_bits, config.frac_bits = frac_bits, config.lanes = lanes;
    dut.start = dut.cancel = dut.unload = dut.s_valid = dut.m_tready = 0;
    sim.add(*this);
    sim.reset();
  }
  int below(int n) { return static_cast<int>(static_cast<uint32_t>(random()) % static_cast<uint32_t>(n)); }
  void drive() override { dut.m_tready = !std::bernoulli_distribution(stall)(random); }

  void sample() override {
    const uint64_t now = sim.cycle();
    unloads_done += dut.unload_done;
    if (dut.dbg_map_we) {
      if (expected_words.empty()) {
        ++surplus;
      } else {
        const golden::Cell c = expected_words.front();
        const auto [clock, place] = expected_writes.front();
        expected_words.pop_front();
        expected_writes.pop_front();
        latency.compare(now, clock, place, now);
        writes.compare(dut.dbg_map_addr, static_cast<uint64_t>(place.x), place, now);
        writes.compare(dut.dbg_map_best, static_cast<uint64_t>(c.best), place, now);
        writes.compare(dut.dbg_map_prev, static_cast<uint64_t>(c.prev), place, now);
        writes.compare(dut.dbg_map_plane, static_cast<uint64_t>(c.plane), place, now);
        writes.compare(dut.dbg_map_frac, static_cast<uint64_t>(c.frac), place, now);
        writes.compare(static_cast<uint64_t>(dut.dbg_map_local_max << 1 | dut.dbg_map_prev_valid),
                       static_cast<uint64_t>(c.local_max << 1 | c.prev_valid), place, now);
      }
    }
    const uint64_t beat = static_cast<uint64_t>(dut.m_tdata) << 1 | dut.m_tlast;
    if (waiting) protocol.compare(dut.m_tvalid ? beat : ~uint64_t{0}, held, {tile}, now);
    waiting = dut.m_tvalid && !dut.m_tready && !dut.cancel;
    held = beat;
    if (!dut.m_tvalid || !dut.m_tready) return;
    if (expected_beats.empty()) {
      ++surplus;
      return;
    }
    const golden::MapCell c = expected_beats.front();
    expected_beats.pop_front();
    uint64_t want = c.mask;
    want = want << config.plane_bits() | c.plane;
    want = want << config.frac_bits | c.frac;
    want = want << config.mncc_bits | c.v;
    beats.compare(dut.m_tdata, want, {tile, -1, static_cast<int>(expected_beats.size()), 0}, now);
    beats.compare(dut.m_tlast, --left == 0, {tile, -1, static_cast<int>(expected_beats.size()), 0}, now);
  }

  golden::Similarity value(int kind) {
    const int top = (1 << config.mncc_bits) - 1;
    golden::Similarity s;
    s.valid = kind != 3 || below(3) != 0;
    s.textured = s.valid && below(10) != 0;
    if (s.textured) s.v = kind == 1 ? below(3) : kind == 2 ? top - below(2) : below(top + 1);
    return s;
  }

  std::vector<golden::Cell> sweep(int cells, int planes, int kind, int gap) {
    using golden::Cell;
    std::vector<Cell> map(static_cast<size_t>(cells));
    dut.start = 1;
    sim.tick();
    dut.start = 0;
    sim.run(3);
    for (int k = 0; k < planes; k += config.lanes) {
      for (int n = 0; n < cells; ++n) {
        // The planes of a set come at once; lanes beyond the last plane rest, whatever else their wires show.
        uint64_t valid = 0, inside = 0, textured = 0, v = 0;
        for (int lane = 0; lane < config.lanes; ++lane) {
          const golden::Similarity s = value(kind);
          const bool on = k + lane < planes;
          if (on) map[n] = golden::update(config, map[n], k + lane, s);
          valid |= uint64_t{on} << lane;
          inside |= uint64_t{s.valid} << lane;
          textured |= uint64_t{s.textured} << lane;
          // V of a window outside must not matter.
          v |= static_cast<uint64_t>(s.valid ? s.v : below(2)) << lane * config.mncc_bits;
        }
        dut.s_valid = static_cast<CData>(valid);
        dut.s_last = n == cells - 1;
        dut.s_inside = static_cast<CData>(inside);
        dut.s_textured = static_cast<CData>(textured);
        dut.s_v = static_cast<std::remove_reference_t<decltype(dut.s_v)>>(v);
        expected_words.push_back(map[n]);
        expected_writes.emplace_back(sim.cycle() + static_cast<uint64_t>(golden::updating_latency(config)),
                                     Place{tile, k, n, 0});
        sim.tick();
        dut.s_valid = 0;
        if (gap && below(gap) == 0) sim.run(static_cast<uint64_t>(below(4)));
      }
      for (int n = cells; n < 3 * golden::kRowMin; ++n) sim.tick();
    }
    return map;
  }

  void run_tile(int cells, int planes, int kind, int threshold, double map_stall) {
    stall = map_stall;
    dut.threshold = static_cast<std::remove_reference_t<decltype(dut.threshold)>>(threshold);
    unloads_done = 0;
    const auto map = sweep(cells, planes, kind, below(2) ? 5 : 0);
    sim.run(static_cast<uint64_t>(8 + config.lanes + config.frac_bits));
    CHECK(expected_words.empty());
    for (const auto& c : map) expected_beats.push_back(golden::unload(c, threshold));
    left = map.size();
    dut.unload = 1;
    sim.tick();
    dut.unload = 0;
    const uint64_t begin = sim.cycle();
    sim.run_until([&] { return unloads_done == 1 || sim.cycle() > begin + 50 * map.size() + 100; });
    CHECK(unloads_done == 1);
    if (map_stall == 0) CHECK(sim.cycle() - begin == map.size() + 5);  // five clocks to the first beat, no bubble
    ++tile;
  }
  void check() {
    sim.run(40);
    for (const Scoreboard* board : {&writes, &beats, &latency, &protocol}) {
      INFO(board->report());
      CHECK(board->ok());
    }
    CHECK(expected_words.empty());
    CHECK(expected_beats.empty());
    CHECK(surplus == 0);
  }
};

template <class Dut>
void run_format(int planes, int cells, int mncc_bits, int frac_bits, int lanes = 1) {
  INFO("seed " << test_seed() << " planes " << planes << " cells " << cells);
  Bench<Dut> bench(planes, mncc_bits, frac_bits, lanes);
  const int top = (1 << mncc_bits) - 1;
  for (int kind = 0; kind < 4; ++kind)
    for (const double stall : {0.0, 0.5, 0.9}) {
      bench.run_tile(cells, planes, kind, bench.below(top + 1), stall);
      bench.run_tile(1, 1 + bench.below(planes), kind, kind == 2 ? top : 0, stall);
      bench.run_tile(1 + bench.below(cells), 1 + bench.below(planes), kind, kind == 1 ? 2 : 1, stall);
    }
  bench.run_tile(cells, 1, 0, 0, 0.2);
  bench.check();
}

}  // namespace

TEST_CASE("updating: 13-bit V, 8-bit fraction") { run_format<Vupdating_a>(37, 29, 13, 8); }
TEST_CASE("updating: 4-bit V, 12-bit fraction, plane count a power of two") { run_format<Vupdating_b>(16, 64, 4, 12); }

TEST_CASE("updating: two planes at once") { run_format<Vupdating_c>(37, 29, 13, 8, 2); }
TEST_CASE("updating: four planes at once, few bits, more ties") { run_format<Vupdating_d>(18, 23, 5, 12, 4); }
TEST_CASE("updating: four planes at once, at most three of them there") { run_format<Vupdating_e>(3, 7, 8, 2, 4); }

TEST_CASE("updating: abort in sweep and in unload, the next tile is right") {
  INFO("seed " << test_seed());
  Bench<Vupdating_a> bench(37, 13, 8, 1);
  bench.stall = 0.5;
  for (int wait = 0; wait < 40; wait += 3) {
    const auto map = bench.sweep(11, 4, 0, 0);
    if (wait % 2) {  // in the unload
      bench.sim.run(20);
      bench.dut.unload = 1;
      for (const auto& c : map) bench.expected_beats.push_back(golden::unload(c, bench.dut.threshold));
      bench.left = map.size();
      bench.sim.tick();
      bench.dut.unload = 0;
      bench.sim.run(static_cast<uint64_t>(wait) / 2);
    }
    bench.dut.cancel = 1;
    bench.sim.tick();
    bench.dut.cancel = 0;
    bench.waiting = false;
    bench.expected_words.clear();
    bench.expected_writes.clear();
    bench.expected_beats.clear();
    bench.sim.run(30);
    CHECK(bench.surplus == 0);
    bench.run_tile(9, 6, 0, 100, 0.5);
  }
  bench.check();
}
