// SPDX-License-Identifier: Apache-2.0
// Soak: tile after tile of an engine that is treated badly. Good tiles of all kinds, compared in every stage, and
// between them refused, short, long, aborted and reset ones, writes and starts in the wrong moment, unknown registers,
// all under random stalls on all streams. Every error bit and every counter has to be as expected after each.
// Environment: PSWEEP_CONFIG (configuration), PSWEEP_SEED, PSWEEP_TILES (good and bad ones, 300 if not set),
// PSWEEP_FIRST (session to begin with; 24 tiles a session, each with an engine and a seed of its own).
#include <chrono>
#include <cstdio>

#include "engine/engine_bench.hpp"
#include "golden/control.hpp"
#include "replay/recorded_psweep.hpp"

using namespace psweep;
using namespace psweep::tb;
using golden::State;

namespace {

std::string from_environment(const char* name, const char* otherwise) {
  const char* text = std::getenv(name);
  return text ? text : otherwise;
}

struct Counts {
  uint64_t good = 0, refused = 0, cut = 0, aborted = 0, reset = 0, wrong_writes = 0, errors = 0, clocks = 0;
  uint64_t left_in[6] = {};  // state at an abort or a reset
};

class Session {
 public:
  Session(const golden::Config& config, uint32_t seed, Counts& counts)
      : config_(config), counts_(counts), maker_(config, seed), bench_(config, seed, stalls(), 4000000) {}
  ~Session() { counts_.clocks += bench_.sim.cycle(); }

  // One tile, with what goes before it.
  void tile() {
    const int kind = maker_.below(20);
    if (kind < 9) {
      good();
    } else if (kind < 11) {
      refused();
    } else if (kind < 13) {
      wrong_length(maker_.below(2) != 0);
    } else if (kind < 15) {
      interrupted(false);
    } else if (kind < 16) {
      interrupted(true);
    } else if (kind < 18) {
      unknown_registers();
    } else {
      disturbed();
    }
    INFO("what was done: " << what_);
    check_status();
    // Whatever it was, the next good tile is right.
    if (kind >= 9) good();
    check_status();
  }

 private:
  Stalls stalls() {
    auto any = [&] { return maker_.below(3) == 0 ? 0.0 : maker_.uniform(0, 0.8); };
    const double cfg = any(), pix = any(), map = any();
    return {cfg, pix, map};
  }
  // Small ones: many tiles say more than large ones.
  scene::Stimulus make() {
    for (;;) {
      const scene::Stimulus s = maker_.any();
      if (golden::engine_clocks(config_, s.job) < 4000 || maker_.below(200) == 0) return s;
    }
  }
  void good() {
    const scene::Stimulus s = make();
    what_ = s.name;
    bench_.run(s);
    ++counts_.good;
    ++expected_.done;
    // Samples that are not loaded were counted, and compared by the bench.
    if (bench_.dut.errors & golden::kErrorWindow && bench_.dut.error_count > expected_.error_count) {
      ++expected_.error_count;
      expected_.errors |= golden::kErrorWindow;
    }
  }
  void expect_error(unsigned bit, unsigned count = 1) {
    expected_.errors |= bit;
    expected_.error_count += count;
    counts_.errors += count;
  }
  void prepare(const scene::Stimulus& s) {
    bench_.write_table(s.table);
    bench_.write_job(s.job);
  }
  void until_idle() {
    bench_.flush_cfg();
    bench_.wait([&] { return bench_.pix.done() && !bench_.dut.busy; });
    bench_.sim.run(3);
  }

  void refused() {
    const scene::Stimulus s = make();
    what_ = "refused, " + s.name;
    prepare(s);
    struct Bad {
      uint16_t address;
      int above;
    };
    const Bad all[] = {
        {golden::kRegTileCols, config_.plane_cols}, {golden::kRegTileRows, config_.plane_rows},
        {golden::kRegWinCols, config_.img_cols},    {golden::kRegWinRows, config_.img_rows},
        {golden::kRegPlanes, config_.planes},       {golden::kRegThreshold, (1 << config_.mncc_bits) - 1}};
    const Bad bad = all[maker_.below(6)];
    const uint32_t value = bad.address != golden::kRegThreshold && maker_.below(3) == 0
                               ? 0
                               : static_cast<uint32_t>(bad.above) + 1 + static_cast<uint32_t>(maker_.below(1 << 30));
    bench_.write(bad.address, value);
    bench_.command(golden::kCommandStart);
    if (maker_.below(2)) bench_.flush_cfg();
    bench_.send_pixels(s, 1 + static_cast<size_t>(maker_.below(40)));
    until_idle();
    expect_error(golden::kErrorConfig);
    ++expected_.dropped;
    ++counts_.refused;
  }
  void wrong_length(bool too_long) {
    scene::Stimulus s = make();
    while (s.left.data.size() < 2) s = make();
    what_ = (too_long ? "long packet, " : "short packet, ") + s.name;
    prepare(s);
    bench_.flush_cfg();
    bench_.interrupt();  // its samples are nobody's business
    if (too_long) {
      bench_.send_pixels(s, ~size_t{0}, false);
      for (int i = 1 + maker_.below(30); i > 0; --i) bench_.pix.push(0x2a, i == 1);
    } else {
      bench_.send_pixels(s, 1 + static_cast<size_t>(maker_.below(static_cast<int>(s.left.data.size()) - 1)));
    }
    bench_.command(golden::kCommandStart);
    until_idle();
    bench_.forget();
    expect_error(too_long ? golden::kErrorLong : golden::kErrorShort);
    ++expected_.dropped;
    ++counts_.cut;
  }
  // An abort or a reset in a random clock of the tile, or just before or behind it.
  void interrupted(bool by_reset) {
    const scene::Stimulus s = make();
    what_ = (by_reset ? "reset, " : "abort, ") + s.name;
    prepare(s);
    bench_.flush_cfg();
    bench_.interrupt();
    const unsigned done = bench_.dut.tiles_done;
    bench_.send_pixels(s);
    bench_.command(golden::kCommandStart);
    const uint64_t most = golden::engine_clocks(config_, s.job) * (maker_.below(4) == 0 ? 3 : 1) + 40;
    // Now and then just where the flush is, which is short.
    if (maker_.below(6) == 0) {
      bench_.run_until_state(State::kFlush);
      bench_.sim.run(static_cast<uint64_t>(maker_.below(30)));
    } else {
      bench_.sim.run(static_cast<uint64_t>(maker_.uniform(0, static_cast<double>(most))));
    }
    const int left_in = bench_.dut.state;
    bench_.cfg.clear();
    if (by_reset) {
      bench_.pix.clear();
      bench_.sim.reset(1 + maker_.below(3));
      expected_ = {};
      ++counts_.reset;
    } else {
      // A session's stalls may have kept even the start command back.
      bench_.cfg.set_stall(0);
      const bool was_busy = abort_now();
      bench_.pix.clear();
      expected_.done += bench_.dut.tiles_done - done;
      if (was_busy && bench_.dut.tiles_done == done) ++expected_.dropped;
      // Samples that were lost before the abort: one event of the tile.
      if (bench_.dut.error_count > expected_.error_count) {
        CHECK((bench_.dut.errors & golden::kErrorWindow) != 0);
        ++expected_.error_count;
        expected_.errors |= golden::kErrorWindow;
      }
      ++counts_.aborted;
    }
    bench_.forget();
    CHECK(bench_.dut.state == static_cast<int>(State::kIdle));
    CHECK(bench_.dut.m_map_tvalid == 0);
    ++counts_.left_in[left_in];
    if (by_reset) {
      check_status();
      missing_table();
    }
  }
  // Only behind a reset is the table empty: a tile that needs a word more than was written.
  void missing_table() {
    const scene::Stimulus s = make();
    what_ = "table too short, " + s.name;
    auto words = golden::table_writes(s.table);
    words.pop_back();
    for (const auto& w : words) bench_.write(w.address, w.value);
    bench_.write_job(s.job);
    bench_.command(golden::kCommandStart);
    bench_.send_pixels(s, 1 + static_cast<size_t>(maker_.below(40)));
    until_idle();
    expect_error(golden::kErrorTable);
    ++expected_.dropped;
    ++counts_.refused;
  }
  // Whether the engine was busy when the command came.
  bool abort_now() {
    bench_.command(golden::kCommandAbort);
    bool busy = bench_.dut.busy;
    while (!bench_.cfg.done()) {
      busy = bench_.dut.busy;
      bench_.sim.tick();
    }
    bench_.sim.run(3);
    return busy;
  }
  void unknown_registers() {
    what_ = "unknown registers";
    const int n = 1 + maker_.below(6);
    for (int i = 0; i < n; ++i) {
      static const uint16_t unknown[] = {0x0007, 0x000c, 0x000f, 0x0018, 0x001f, 0x0020, 0x0400, 0x7fff, 0xffff};
      bench_.write(unknown[maker_.below(9)], static_cast<uint32_t>(maker_.below(1 << 30)));
    }
    until_idle();
    expect_error(golden::kErrorAddress, static_cast<unsigned>(n));
    counts_.wrong_writes += static_cast<uint64_t>(n);
  }
  // Writes and starts while the tile waits for its pixels: refused, and the tile is right.
  void disturbed() {
    const scene::Stimulus s = make();
    what_ = "disturbed, " + s.name;
    prepare(s);
    bench_.flush_cfg();
    bench_.expect(s);
    bench_.command(golden::kCommandStart);
    bench_.flush_cfg();
    const int n = 1 + maker_.below(6);
    for (int i = 0; i < n; ++i) {
      if (maker_.below(3) == 0)
        bench_.command(golden::kCommandStart);
      else
        bench_.write(static_cast<uint16_t>(maker_.below(2) ? 1 + maker_.below(31) : 0x8000 + maker_.below(16)), 3);
    }
    bench_.flush_cfg();
    const unsigned lost = bench_.dut.window_errors;
    bench_.send_pixels(s);
    bench_.finish();
    {
      INFO(what_ << '\n' << bench_.report());
      CHECK(bench_.ok());
    }
    expect_error(golden::kErrorBusy, static_cast<unsigned>(n));
    if (bench_.dut.window_errors != lost) {
      ++expected_.error_count;
      expected_.errors |= golden::kErrorWindow;
    }
    ++expected_.done;
    ++counts_.good;
    counts_.wrong_writes += static_cast<uint64_t>(n);
  }
  void check_status() {
    const auto& d = bench_.dut;
    INFO("errors: " << golden::error_names(d.errors) << ", expected " << golden::error_names(expected_.errors));
    REQUIRE(d.errors == expected_.errors);
    REQUIRE(d.error_count == expected_.error_count);
    REQUIRE(d.tiles_done == expected_.done);
    REQUIRE(d.tiles_dropped == expected_.dropped);
    REQUIRE(d.busy == 0);
    REQUIRE(bench_.mismatches() == 0);
    REQUIRE(bench_.map.protocol_errors() == 0);
  }

  struct Status {
    unsigned errors = 0, error_count = 0, done = 0, dropped = 0;
  };
  golden::Config config_;
  Counts& counts_;
  scene::StimulusMaker maker_;
  EngineBench<replay::RecordedPsweep> bench_;
  Status expected_;
  std::string what_;
};

constexpr int kTilesOfSession = 24;

}  // namespace

TEST_CASE("soak: whatever happens to a tile, it is counted, and the next good one is right") {
  const std::string name = from_environment("PSWEEP_CONFIG", "tiny");
  const int tiles = std::stoi(from_environment("PSWEEP_TILES", "300"));
  const int first = std::stoi(from_environment("PSWEEP_FIRST", "0"));
  const replay::Engine& e = replay::engine(name);
  replay::RecordedPsweep::next_engine = &e;
  Counts counts;
  const auto begun = std::chrono::steady_clock::now();
  double told = 0;
  int n = 0;
  for (int session = first; n < tiles; ++session) {
    INFO("again: PSWEEP_CONFIG=" << name << " PSWEEP_SEED=" << test_seed() << " PSWEEP_FIRST=" << session
                                 << " PSWEEP_TILES=" << kTilesOfSession << " build/tb/soak/soak");
    Session s(e.config, test_seed() * 100003u + static_cast<uint32_t>(session), counts);
    for (int i = 0; i < kTilesOfSession && n < tiles; ++i, ++n) s.tile();
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    if (seconds > told + 5 && n < tiles) {
      told = seconds;
      std::fprintf(stderr, "soak: %s: %d of %d tiles, %.0f s left\n", name.c_str(), n, tiles,
                   seconds / n * (tiles - n));
    }
  }
  CHECK(counts.good > 0);
  std::printf("soak: %s: aborts and resets in idle %llu, load %llu, sweep %llu, flush %llu, unload %llu\n",
              name.c_str(), static_cast<unsigned long long>(counts.left_in[0]),
              static_cast<unsigned long long>(counts.left_in[1]), static_cast<unsigned long long>(counts.left_in[2]),
              static_cast<unsigned long long>(counts.left_in[3]), static_cast<unsigned long long>(counts.left_in[4]));
  std::printf(
      "soak: %s: %d tiles and %llu behind bad ones: %llu good, %llu refused, %llu cut or too long, %llu aborted, "
      "%llu in a reset; %llu wrong writes; %llu errors, all counted; %.2f M clocks\n",
      name.c_str(), n,
      static_cast<unsigned long long>(counts.good + counts.refused + counts.cut + counts.aborted + counts.reset) -
          static_cast<unsigned long long>(n),
      static_cast<unsigned long long>(counts.good), static_cast<unsigned long long>(counts.refused),
      static_cast<unsigned long long>(counts.cut), static_cast<unsigned long long>(counts.aborted),
      static_cast<unsigned long long>(counts.reset), static_cast<unsigned long long>(counts.wrong_writes),
      static_cast<unsigned long long>(counts.errors), static_cast<double>(counts.clocks) / 1e6);
}
