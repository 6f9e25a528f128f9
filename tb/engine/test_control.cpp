// SPDX-License-Identifier: Apache-2.0
// Bad input and interruptions: each leads to the defined state, error bit and counters, and the next good tile is
// right in every stage.
#include "engine/configurations.hpp"
#include "engine/engine_bench.hpp"

using namespace psweep;
using namespace psweep::tb;
using golden::State;

namespace {

using Bench = EngineBench<Vpsweep_tiny>;

struct Status {
  unsigned errors, error_count, done, dropped, state;
};
Status status(const Bench& b) {
  return {b.dut.errors, b.dut.error_count, b.dut.tiles_done, b.dut.tiles_dropped, b.dut.state};
}
void check(const Bench& b, unsigned errors, unsigned error_count, unsigned done, unsigned dropped, State state) {
  const Status s = status(b);
  INFO("errors: " << golden::error_names(s.errors) << ", expected " << golden::error_names(errors));
  CHECK(s.errors == errors);
  CHECK(s.error_count == error_count);
  CHECK(s.done == done);
  CHECK(s.dropped == dropped);
  CHECK(s.state == static_cast<unsigned>(state));
}

// A bench with table and registers of a tile written, and a maker for more.
struct Prepared {
  golden::Config config = Tiny::config();
  scene::StimulusMaker maker{config, test_seed()};
  Bench bench;
  scene::Stimulus tile;

  explicit Prepared(Stalls stalls = {}) : bench(config, test_seed(), stalls) {
    tile = maker.make(scene::Texture::kStereo, scene::Geometry::kInside, 7, 6, 4);
    bench.write_table(tile.table);
    bench.write_job(tile.job);
    bench.flush_cfg();
  }
  // The engine is none the worse: a random tile is right from end to end.
  void good_tile() {
    bench.run(
        maker.make(scene::Texture::kStereo, scene::Geometry::kInside, 1 + maker.below(16), 1 + maker.below(12), 5));
    bench.run(maker.any());
  }
};

}  // namespace

TEST_CASE("errors: state after reset") {
  Prepared p;
  check(p.bench, 0, 0, 0, 0, State::kIdle);
  CHECK(p.bench.dut.busy == 0);
  CHECK(p.bench.dut.m_map_tvalid == 0);
  CHECK(p.bench.dut.s_pix_tready == 0);
  CHECK(p.bench.dut.window_errors == 0);
}

TEST_CASE("errors: a size register out of range refuses the tile and drains its pixels") {
  struct Bad {
    uint16_t address;
    uint32_t value;
  };
  const golden::Config c = Tiny::config();
  const auto u = [](int v) { return static_cast<uint32_t>(v); };
  const Bad bad = GENERATE_COPY(values<Bad>({
      {golden::kRegTileCols, 0},
      {golden::kRegTileCols, u(c.plane_cols) + 1},
      {golden::kRegTileRows, 0},
      {golden::kRegTileRows, u(c.plane_rows) + 1},
      {golden::kRegWinCols, 0},
      {golden::kRegWinCols, u(c.img_cols) + 1},
      {golden::kRegWinRows, 0},
      {golden::kRegWinRows, u(c.img_rows) + 1},
      {golden::kRegPlanes, 0},
      {golden::kRegPlanes, u(c.planes) + 1},
      {golden::kRegThreshold, 1u << c.mncc_bits},
      {golden::kRegTileCols, 0x80000001},  // only high bits wrong
      {golden::kRegPlanes, 0xFFFFFFFF},
  }));
  INFO("register " << bad.address << " value " << bad.value);
  Prepared p;
  p.bench.write(bad.address, bad.value);
  p.bench.command(golden::kCommandStart);
  p.bench.flush_cfg();
  check(p.bench, golden::kErrorConfig, 1, 0, 1, State::kDrain);
  CHECK(p.bench.dut.busy == 1);
  p.bench.send_pixels(p.tile);
  p.bench.run_until_state(State::kIdle);
  CHECK(p.bench.pix.done());
  check(p.bench, golden::kErrorConfig, 1, 0, 1, State::kIdle);
  CHECK(p.bench.map.beats() == 0);
  p.good_tile();
  CHECK(p.bench.dut.tiles_dropped == 1);
}

TEST_CASE("errors: start right after reset, nothing written") {
  const golden::Config config = Tiny::config();
  Bench bench(config, test_seed());
  bench.command(golden::kCommandStart);
  bench.flush_cfg();
  check(bench, golden::kErrorConfig, 1, 0, 1, State::kDrain);
}

TEST_CASE("errors: planes beyond the written table refuse the tile") {
  const golden::Config config = Tiny::config();
  const int missing_words = GENERATE(1, 8, 32);
  Bench bench(config, test_seed());
  scene::StimulusMaker maker(config, test_seed());
  const scene::Stimulus s = maker.make(scene::Texture::kRandom, scene::Geometry::kInside, 5, 5, 4);
  auto words = golden::table_writes(s.table);
  words.resize(words.size() - static_cast<size_t>(missing_words));
  for (const auto& w : words) bench.write(w.address, w.value);
  bench.write_job(s.job);
  bench.command(golden::kCommandStart);
  bench.flush_cfg();
  check(bench, golden::kErrorTable, 1, 0, 1, State::kDrain);
  bench.send_pixels(s, 1);  // a packet of one pixel is drained as well
  bench.run_until_state(State::kIdle);
  bench.run(s);
  check(bench, golden::kErrorTable, 1, 1, 1, State::kIdle);
}

TEST_CASE("errors: short packet drops the tile") {
  Prepared p({0, 0.3, 0});
  const size_t all = p.tile.left.data.size();
  unsigned n = 0;
  for (size_t count : {size_t{1}, size_t{2}, all / 2, all - 1}) {
    INFO("pixels " << count << " of " << all);
    p.bench.send_pixels(p.tile, count);
    p.bench.command(golden::kCommandStart);
    p.bench.flush_cfg();
    p.bench.run_until_state(State::kIdle);
    p.bench.sim.tick();
    ++n;
    check(p.bench, golden::kErrorShort, n, n - 1, n, State::kIdle);
    CHECK(p.bench.map.protocol_errors() == 0);
    p.bench.run(p.tile);
  }
  p.good_tile();
}

TEST_CASE("errors: long packet drops the tile and is swallowed up to tlast") {
  Prepared p({0, 0.3, 0});
  unsigned n = 0;
  for (int surplus : {1, 2, 50}) {
    INFO("surplus pixels " << surplus);
    p.bench.send_pixels(p.tile, ~size_t{0}, false);
    for (int i = 0; i < surplus; ++i) p.bench.pix.push(0x55, i + 1 == surplus);
    p.bench.command(golden::kCommandStart);
    p.bench.flush_cfg();
    p.bench.run_until_state(State::kDrain);
    ++n;
    CHECK(p.bench.dut.errors == golden::kErrorLong);
    p.bench.run_until_state(State::kIdle);
    CHECK(p.bench.pix.done());
    check(p.bench, golden::kErrorLong, n, n - 1, n, State::kIdle);
    p.bench.run(p.tile);
  }
  p.good_tile();
}

TEST_CASE("errors: samples not loaded are counted, one event a tile, and the tile goes on") {
  Prepared p;
  unsigned events = 0;
  uint64_t lost = 0;
  for (int i = 0; i < 6; ++i) {
    const scene::Stimulus s =
        p.maker.make(scene::Texture::kStereo, scene::Geometry::kLost, 1 + p.maker.below(16), 1 + p.maker.below(12), 5);
    p.bench.run(s);  // compares window_errors, error_count and every stage
    lost = p.bench.dut.window_errors;
    events = p.bench.dut.error_count;
  }
  CHECK(events == 6);
  CHECK(lost > 100);
  CHECK(p.bench.dut.errors == golden::kErrorWindow);
  p.bench.run(p.maker.make(scene::Texture::kStereo, scene::Geometry::kInside, 9, 9, 5));
  CHECK(p.bench.dut.error_count == events);
}

TEST_CASE("errors: unknown registers and table words out of order are refused") {
  Prepared p;
  unsigned n = 0;
  for (int address : {0x0007, 0x000C, 0x000D, 0x000E, 0x000F, 0x0018, 0x001F, 0x0020, 0x0100, 0x4000, 0x7FFF}) {
    INFO("register " << address);
    p.bench.write(static_cast<uint16_t>(address), 1);
    p.bench.flush_cfg();
    check(p.bench, golden::kErrorAddress, ++n, 0, 0, State::kIdle);
  }
  // The table holds 4 planes: word 32 is the next one, 33 is out of order; the last legal word is planes*8 - 1.
  const auto table = [](int word) { return static_cast<uint16_t>(golden::kRegTable + word); };
  for (int word : {33, 8 * p.config.planes - 1, 8 * p.config.planes, 0x7FFF}) {
    INFO("table word " << word);
    p.bench.write(table(word), 0);
    p.bench.flush_cfg();
    check(p.bench, golden::kErrorAddress, ++n, 0, 0, State::kIdle);
  }
  p.bench.write(table(32), 0);
  p.bench.write(table(33), 0);
  p.bench.write(table(5), p.tile.table[0].dy_left);  // written ones in any order
  p.bench.flush_cfg();
  check(p.bench, golden::kErrorAddress, n, 0, 0, State::kIdle);
  p.bench.run(p.tile);
  p.good_tile();
}

TEST_CASE("errors: the last word of a full table is accepted, the next one not") {
  const golden::Config config = Tiny::config();
  Bench bench(config, test_seed());
  scene::StimulusMaker maker(config, test_seed());
  bench.run(maker.make(scene::Texture::kStereo, scene::Geometry::kInside, 16, 12, config.planes));
  CHECK(bench.dut.errors == 0);
  bench.write(static_cast<uint16_t>(golden::kRegTable + 8 * config.planes), 0);
  bench.flush_cfg();
  CHECK(bench.dut.errors == golden::kErrorAddress);
}

TEST_CASE("errors: writes and starts while a tile is in work are refused and change nothing") {
  const State state = GENERATE(State::kLoad, State::kSweep, State::kFlush, State::kUnload);
  INFO("state " << static_cast<int>(state));
  Prepared p;
  p.bench.map.set_stall(state == State::kUnload ? 0.9 : 0);
  p.bench.expect(p.tile);
  p.bench.command(golden::kCommandStart);
  p.bench.flush_cfg();
  if (state != State::kLoad) p.bench.send_pixels(p.tile);
  p.bench.run_until_state(state);
  const golden::TileJob other = p.maker.any().job;
  for (const auto& w : golden::job_writes(other)) p.bench.write(w.address, w.value);
  p.bench.write(golden::kRegTable, 0);
  p.bench.write(0x0007, 0);  // unknown, but busy comes first
  p.bench.command(golden::kCommandStart);
  // Flush lasts only some clocks, so not every write falls into it; all fall into the tile.
  p.bench.sim.run(state == State::kFlush ? 4 : 25);
  if (state == State::kLoad) p.bench.send_pixels(p.tile);
  if (state == State::kFlush) p.bench.cfg.clear();
  p.bench.finish();
  INFO(p.bench.report());
  CHECK(p.bench.ok());
  CHECK(p.bench.dut.errors == golden::kErrorBusy);
  if (state == State::kFlush)
    CHECK(p.bench.dut.error_count > 0);
  else
    CHECK(p.bench.dut.error_count == 21);
  CHECK(p.bench.dut.tiles_done == 1);
  CHECK(p.bench.dut.tiles_dropped == 0);
  // Registers kept their values: the same tile again without writing anything.
  p.bench.map.set_stall(0);
  p.bench.expect(p.tile);
  p.bench.send_pixels(p.tile);
  p.bench.command(golden::kCommandStart);
  p.bench.finish();
  CHECK(p.bench.ok());
  p.good_tile();
}

TEST_CASE("errors: start while draining is refused") {
  Prepared p;
  p.bench.write(golden::kRegPlanes, 0);
  p.bench.command(golden::kCommandStart);
  p.bench.command(golden::kCommandStart);
  p.bench.flush_cfg();
  check(p.bench, golden::kErrorConfig | golden::kErrorBusy, 2, 0, 1, State::kDrain);
  p.bench.send_pixels(p.tile, 3);
  p.bench.run_until_state(State::kIdle);
  p.good_tile();
}

TEST_CASE("errors: abort and reset in every state at many clocks, the next tile is right") {
  const bool by_reset = GENERATE(false, true);
  const State state = GENERATE(State::kLoad, State::kSweep, State::kFlush, State::kUnload, State::kDrain);
  INFO("seed " << test_seed() << (by_reset ? " reset" : " abort") << " state " << static_cast<int>(state));
  Prepared p;
  unsigned dropped = 0, done = 0;
  for (int round = 0; round < 8; ++round) {
    INFO("round " << round);
    p.bench.map.set_stall(state == State::kUnload ? 0.7 : 0);
    const bool drain = state == State::kDrain;
    p.bench.write_table(p.tile.table);
    p.bench.write_job(p.tile.job);
    if (drain) p.bench.write(golden::kRegPlanes, 0);
    p.bench.command(golden::kCommandStart);
    if (!drain) p.bench.expect(p.tile);
    if (state != State::kLoad && !drain) p.bench.send_pixels(p.tile);
    if (state == State::kLoad || drain) p.bench.send_pixels(p.tile, 5 + static_cast<size_t>(round), false);
    p.bench.run_until_state(state);
    // Flush is short; the sweep of this tile takes some 400 clocks.
    const int most = state == State::kSweep ? 350 : state == State::kFlush ? 20 : 30;
    const int wait = p.maker.below(most);
    for (int i = 0; i < wait && p.bench.dut.state == static_cast<int>(state); ++i) p.bench.sim.tick();
    const unsigned left = p.bench.dut.state;
    const bool was_busy = p.bench.dut.busy;
    p.bench.interrupt();
    if (by_reset) {
      p.bench.cfg.clear();
      p.bench.pix.clear();
      p.bench.sim.reset(1);
      dropped = done = 0;
    } else {
      done = p.bench.dut.tiles_done;
      p.bench.command(golden::kCommandAbort);
      p.bench.cfg.set_stall(0);
      p.bench.flush_cfg();
      p.bench.pix.clear();
      // A tile that just ended needs no abort; a drained one was counted when it was refused.
      if (p.bench.dut.tiles_done > done)
        done = p.bench.dut.tiles_done;
      else if (was_busy)
        ++dropped;
    }
    INFO("interrupted in state " << left << " after " << wait);
    p.bench.forget();
    CHECK(p.bench.dut.state == static_cast<int>(State::kIdle));
    CHECK(p.bench.dut.busy == 0);
    CHECK(p.bench.dut.m_map_tvalid == 0);
    CHECK(p.bench.dut.tiles_dropped == dropped);
    CHECK(p.bench.dut.tiles_done == done);
    p.bench.map.set_stall(0);
    const auto before = p.bench.mismatches();
    p.good_tile();
    done += 2;
    REQUIRE(p.bench.mismatches() == before);
  }
}

TEST_CASE("errors: after a reset the table is empty and the sizes are missing") {
  Prepared p;
  p.bench.sim.reset();
  p.bench.command(golden::kCommandStart);
  p.bench.flush_cfg();
  check(p.bench, golden::kErrorConfig, 1, 0, 1, State::kDrain);
  p.bench.send_pixels(p.tile, 1);
  p.bench.run_until_state(State::kIdle);
  p.bench.write_job(p.tile.job);
  p.bench.command(golden::kCommandStart);
  p.bench.flush_cfg();
  check(p.bench, golden::kErrorConfig | golden::kErrorTable, 2, 0, 2, State::kDrain);
}

TEST_CASE("errors: clear resets bits and counters and nothing else, also in mid-tile") {
  Prepared p;
  p.bench.write(0x0007, 0);
  p.bench.send_pixels(p.tile, 2);
  p.bench.command(golden::kCommandStart);
  p.bench.flush_cfg();
  p.bench.run_until_state(State::kIdle);
  p.bench.run(p.maker.make(scene::Texture::kStereo, scene::Geometry::kLost, 5, 5, 3));
  p.bench.run(p.tile);
  check(p.bench, golden::kErrorAddress | golden::kErrorShort | golden::kErrorWindow, 3, 2, 1, State::kIdle);
  CHECK(p.bench.dut.window_errors > 0);
  const unsigned clocks = p.bench.dut.tile_clocks;
  p.bench.command(golden::kCommandClear);
  p.bench.flush_cfg();
  check(p.bench, 0, 0, 0, 0, State::kIdle);
  CHECK(p.bench.dut.window_errors == 0);
  CHECK(p.bench.dut.tile_clocks == clocks);

  p.bench.write(0x0007, 0);
  p.bench.expect(p.tile);
  p.bench.send_pixels(p.tile);
  p.bench.command(golden::kCommandStart);
  p.bench.run_until_state(State::kSweep);
  p.bench.command(golden::kCommandClear);
  p.bench.finish();
  INFO(p.bench.report());
  CHECK(p.bench.ok());
  check(p.bench, 0, 0, 1, 0, State::kIdle);
}

TEST_CASE("errors: abort beats start in one command, clear goes with both") {
  Prepared p;
  p.bench.command(golden::kCommandStart | golden::kCommandAbort);
  p.bench.flush_cfg();
  check(p.bench, 0, 0, 0, 0, State::kIdle);
  p.bench.write(0x0007, 0);
  p.bench.expect(p.tile);
  p.bench.send_pixels(p.tile);
  p.bench.command(golden::kCommandStart | golden::kCommandClear);
  p.bench.finish();
  CHECK(p.bench.ok());
  check(p.bench, 0, 0, 1, 0, State::kIdle);
}

TEST_CASE("errors: pixels before the start command wait") {
  Prepared p;
  p.bench.send_pixels(p.tile);
  p.bench.sim.run(50);
  CHECK(p.bench.pix.sent() == 0);
  p.bench.expect(p.tile);
  p.bench.command(golden::kCommandStart);
  p.bench.finish();
  CHECK(p.bench.ok());
}

TEST_CASE("errors: counters of window errors saturate") {
  Prepared p;
  // 16x12 cells, 12 planes, nothing loaded but one pixel: 20*16*12 lost samples a tile, so 18 tiles pass 65535.
  scene::Stimulus s = p.maker.make(scene::Texture::kConstant, scene::Geometry::kInside, 16, 12, 12);
  s.job.win_cols = s.job.win_rows = 1;
  s.left = s.right = golden::Pixels(1, 1);
  for (int i = 0; i < 19; ++i) p.bench.run(s);
  CHECK(p.bench.dut.window_errors == 65535);
}
