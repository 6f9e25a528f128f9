// SPDX-License-Identifier: Apache-2.0
// The forecast of plan/link_plan.hpp: block RAMs against figures of Yosys, cases with a result on paper, and what must
// hold for any link (more buffers, lanes, clocks, wire: never slower). Against the Verilated chip:
// tb/chip/test_link_plan_chip.cpp.
#include <cmath>

#include "core/error.hpp"
#include "forecast/link_plan.hpp"
#include "golden/control.hpp"
#include "plan/planner.hpp"
#include "scene/scene.hpp"
#include "support/catch.hpp"

using namespace psweep;

namespace {

constexpr double kByte = 80e-9;  // 100 Mbit/s
// A frame with a full chunk, gap included: preamble 8, headers 42, message 16, chunk, FCS 4, gap 12.
double chunk_time(const net::ArbiterConfig& c) { return kByte * (8 + 42 + 16 + c.chunk_bytes + 4 + 12); }

net::ArbiterConfig board(bool bands) {
  net::ArbiterConfig c;
  golden::Config& e = c.engine;
  e.img_cols = bands ? 1120 : 362, e.img_rows = bands ? 44 : 144;
  e.plane_cols = bands ? 1092 : 256, e.plane_rows = bands ? 30 : 130;
  return c;
}
net::ArbiterConfig with_buffers(net::ArbiterConfig c, int row_chunks, int map_chunks) {
  c.row_slots = row_chunks;
  c.map_depth = map_chunks * c.chunk_cells();
  return c;
}
// The paper's pair.
std::vector<golden::TileJob> pair_of(const net::ArbiterConfig& c) {
  const SweepSetup setup{rover_rig(1120), {c.engine.planes, 1.0, 4.0}, c.engine, 1000};
  std::vector<golden::TileJob> jobs;
  for (const PlacedTile& t : plan_tiles(setup, c.engine.plane_cols, c.engine.plane_rows).tiles) jobs.push_back(t.job);
  return jobs;
}
golden::TileJob full_tile(const net::ArbiterConfig& c, int planes) {
  golden::TileJob t;
  t.tile_cols = c.engine.plane_cols, t.tile_rows = c.engine.plane_rows;
  t.win_cols = c.engine.img_cols, t.win_rows = c.engine.img_rows;
  t.planes = planes;
  return t;
}
uint64_t chunks(uint64_t items, int per) {
  return (items + static_cast<uint64_t>(per) - 1) / static_cast<uint64_t>(per);
}
std::string text(const net::ArbiterConfig& c, const LinkPlanOptions& o) {
  return std::to_string(c.engine.plane_cols) + " columns, " + std::to_string(c.row_slots) + " slots, " +
         std::to_string(c.map_depth) + " cells, " + std::to_string(o.clk_mhz) + " MHz, " + std::to_string(o.lanes) +
         " lanes, " + std::to_string(o.in_flight) + " in flight" + (o.half_duplex ? ", half duplex" : "");
}

}  // namespace

TEST_CASE("link plan: block RAMs are those that Yosys takes") {
  struct Figure {
    int width, depth;
    double blocks;
  };
  // Entity ram_sdp, synth_xilinx -family xc6v.
  for (const Figure& f : std::vector<Figure>{
           {16, 32, 0},     {16, 64, 0},       {16, 128, 0},    {16, 334, 0.5},  {16, 704, 0.5},  {16, 1024, 0.5},
           {16, 1408, 1},   {16, 2048, 1},     {16, 2816, 1.5}, {16, 3520, 2},   {16, 4096, 2},   {16, 5632, 3},
           {16, 8192, 4},   {16, 11264, 5.5},  {16, 22528, 11}, {16, 49280, 25}, {16, 52096, 26}, {27, 334, 0.5},
           {27, 704, 1},    {27, 1024, 1},     {27, 1408, 1.5}, {27, 2816, 2.5}, {27, 5632, 4.5}, {27, 11264, 8.5},
           {27, 32760, 24}, {27, 33280, 25.5}, {4, 334, 0},     {4, 704, 0.5},   {4, 1024, 0.5},  {4, 1408, 0.5},
           {4, 2816, 0.5},  {4, 5632, 1},      {4, 11264, 1.5}, {4, 32760, 4},   {4, 33280, 4.5}, {24, 502, 0.5},
           {24, 1004, 1},   {24, 1506, 1.5},   {18, 502, 0.5},  {18, 1004, 0.5}, {18, 1506, 1}}) {
    INFO(f.width << " x " << f.depth);
    CHECK(ram36(f.width, f.depth) == f.blocks);
  }
  // Sizes that no buffer has. Yosys does not always find the fewest.
  for (const Figure& f : std::vector<Figure>{{22, 3000, 2.5},
                                             {13, 5000, 2.5},
                                             {7, 9000, 2.5},
                                             {10, 20000, 7.5},
                                             {31, 6000, 6},
                                             {40, 1500, 2},
                                             {12, 800, 0.5},
                                             {20, 40000, 25},
                                             {3, 3000, 0.5}}) {
    INFO(f.width << " x " << f.depth);
    CHECK(std::abs(ram36(f.width, f.depth) - f.blocks) <= 1);
  }
  CHECK_THROWS_AS(ram36(0, 16), InputError);
  CHECK_THROWS_AS(ram36(16, 0), InputError);
}

TEST_CASE("link plan: the buffers' block RAMs are those that Yosys takes") {
  struct Figure {
    bool bands;
    int chunks;
    double rows, map;  // entities row_buffer and map_buffer
  };
  for (const Figure& f : std::vector<Figure>{{true, 2, 1, 1},
                                             {true, 4, 2, 1.5},
                                             {true, 8, 3, 4},
                                             {true, 16, 6, 6},
                                             {true, 64, 22, 20},
                                             {true, 32, 11, 11},
                                             {true, 0, 24.5, 28},
                                             {false, 0, 26, 28.5}}) {
    INFO((f.bands ? "bands, " : "tiles, ") << f.chunks << " chunks");
    const BufferRam ram = buffer_ram(with_buffers(board(f.bands), f.chunks, f.chunks));
    CHECK(ram.rows == f.rows);
    CHECK(ram.map == f.map);
    CHECK(ram.total() == f.rows + f.map);
  }
  // Other widths: 12 bit pixels in 9 slots of 469; 22 bit cells, 334 of them.
  net::ArbiterConfig c = with_buffers(board(true), 9, 0);
  c.engine.pix_bits = 12;
  CHECK(buffer_ram(c).rows == 3.5);
  c = net::ArbiterConfig{{60000, 502, 5, 300, 4, 50}, {{62, 38, 37, 23, 19, 7, 8, 6, 4, 11, 5, 1}}};
  CHECK(buffer_ram(c).map == 0.5);
}

TEST_CASE("link plan: one tile, on paper") {
  const net::ArbiterConfig c = board(false);
  const golden::TileJob t = full_tile(c, 301);
  const LinkForecast f = forecast_link(c, {t}, {});
  const uint64_t up = chunks(golden::load_clocks(t), c.chunk_pairs());
  const uint64_t down = chunks(golden::unload_clocks(t), c.chunk_cells());
  // Rows at the wire's speed behind one round trip of START (25 us), and the last one taken; the sweep without a
  // stall; the map at the wire's speed, of which the first chunk leaves at once and the last is shorter.
  CHECK(f.launch == approx(25e-6 + static_cast<double>(up) * chunk_time(c)).margin(30e-6));
  CHECK(f.engine_clocks == golden::engine_clocks(c.engine, t));
  CHECK(f.stall() <= 2);
  CHECK(f.last_beat - f.launch == approx(static_cast<double>(f.engine_clocks) / 166e6).margin(1e-7));
  const double unload = static_cast<double>(golden::unload_clocks(t)) / 166e6;
  CHECK(f.end - (f.last_beat - unload) == approx(static_cast<double>(down) * chunk_time(c)).margin(150e-6));
  CHECK(f.map_packets == down);
  CHECK(f.map_repeated == 0);
  CHECK(f.collisions == 0);
  CHECK(f.frames_up >= up + 3);
  CHECK(f.frames_down >= down + 3);
}

TEST_CASE("link plan: one tile in flight, the gap between tiles on paper") {
  const net::ArbiterConfig c = board(false);
  constexpr int kTiles = 6;
  const golden::TileJob t = full_tile(c, 301);
  LinkPlanOptions o;
  o.in_flight = 1;
  const LinkForecast f = forecast_link(c, std::vector<golden::TileJob>(kTiles, t), o);
  // The map of one, then the rows of the next; the map's first chunks leave during the unload.
  const double wire = static_cast<double>(chunks(golden::load_clocks(t), c.chunk_pairs()) +
                                          chunks(golden::unload_clocks(t), c.chunk_cells())) *
                      chunk_time(c);
  const double unload = static_cast<double>(golden::unload_clocks(t)) / 166e6;
  CHECK(static_cast<double>(f.stall_idle) / (kTiles - 1) == approx((wire - unload) * 166e6).epsilon(0.01));
  CHECK(f.stall_load + f.stall_unload <= kTiles);
}

TEST_CASE("link plan: double buffers and a sweep longer than the wire needs: no stall") {
  for (const bool bands : {true, false})
    for (const bool half_duplex : {false, true})
      for (const double mhz : {60.0, 166.0}) {
        const net::ArbiterConfig c = board(bands);
        LinkPlanOptions o;
        o.clk_mhz = mhz, o.half_duplex = half_duplex;
        const golden::TileJob t = full_tile(c, 301);
        const std::vector<golden::TileJob> tiles(8, t);
        const double wire = static_cast<double>(chunks(golden::load_clocks(t), c.chunk_pairs()) +
                                                chunks(golden::unload_clocks(t), c.chunk_cells())) *
                            chunk_time(c);
        REQUIRE(wire < 0.5 * static_cast<double>(golden::sweep_clocks(c.engine, t)) / (1e6 * mhz));
        INFO(text(c, o));
        // 22 clocks of the scheduler between two tiles, and rounding.
        CHECK(forecast_link(c, tiles, o).stall() <= 8 * 24);
      }
}

TEST_CASE("link plan: nothing beats engine or wire") {
  for (const bool bands : {true, false})
    for (const bool half_duplex : {false, true})
      for (const int lanes : {1, 2, 4, 16, 64})
        for (const int map : {2, 0}) {
          const net::ArbiterConfig c = with_buffers(board(bands), 0, map);
          LinkPlanOptions o;
          o.clk_mhz = 300, o.half_duplex = half_duplex, o.lanes = lanes;
          const auto tiles = pair_of(c);
          uint64_t up = 0, down = 0, clocks = 0;
          for (const golden::TileJob& t : tiles) {
            up += chunks(golden::load_clocks(t), c.chunk_pairs());
            down += chunks(golden::unload_clocks(t), c.chunk_cells());
            clocks += golden::load_clocks(t) + golden::unload_clocks(t) + golden::sweep_clocks(c.engine, t) / lanes;
          }
          // Down: all chunks but the short last ones of the tiles.
          const double up_time = static_cast<double>(up) * chunk_time(c);
          const double down_time = static_cast<double>(down - tiles.size()) * chunk_time(c);
          const LinkForecast f = forecast_link(c, tiles, o);
          INFO(text(c, o));
          CHECK(f.end > static_cast<double>(clocks) / 300e6);
          CHECK(f.end > (half_duplex ? up_time + down_time : std::max(up_time, down_time)));
          CHECK(f.map_packets - f.map_repeated >= down);
          CHECK(f.engine_clocks >= clocks);
          CHECK(f.busy() <= 1);
          CHECK((f.collisions > 0) == half_duplex);
          CHECK(f.launch < f.last_beat);
          CHECK(f.last_beat < f.end);
          if (lanes == 64 && map == 0) CHECK(f.end < 1.7 * (up_time + down_time));  // and the wire is well used
        }
}

TEST_CASE("link plan: never slower with more buffers, clocks, lanes, tiles in flight, or a wire for each way") {
  // Half duplex is a matter of chance: 2 % for it.
  for (const bool bands : {true, false}) {
    const net::ArbiterConfig whole = board(bands);
    const auto tiles = pair_of(whole);
    auto seconds = [&](int rows, int map, const LinkPlanOptions& o) {
      return forecast_link(with_buffers(whole, rows, map), tiles, o).end;
    };
    for (const bool half_duplex : {false, true}) {
      const double slack = half_duplex ? 1.02 : 1.0005;
      for (const int in_flight : {1, 2})
        for (const double mhz : {60.0, 166.0, 300.0}) {
          LinkPlanOptions o;
          o.clk_mhz = mhz, o.in_flight = in_flight, o.half_duplex = half_duplex;
          INFO(text(whole, o));
          const double none = seconds(2, 2, o), rows = seconds(0, 2, o), map = seconds(2, 0, o),
                       both = seconds(0, 0, o);
          CHECK(rows <= none * slack);
          CHECK(map <= none * slack);
          CHECK(both <= rows * slack);
          CHECK(both <= map * slack);
          LinkPlanOptions faster = o;
          faster.clk_mhz *= 1.5;
          CHECK(seconds(2, 2, faster) <= none * slack);
          CHECK(seconds(0, 0, faster) <= both * slack);
          LinkPlanOptions lanes = o;
          lanes.lanes = 2;
          CHECK(seconds(0, 0, lanes) <= both * slack);
          if (in_flight == 1) {
            LinkPlanOptions two = o;
            two.in_flight = 2;
            CHECK(seconds(2, 2, two) <= none * slack);
            CHECK(seconds(0, 0, two) <= both * slack);
          }
          if (!half_duplex) {
            LinkPlanOptions half = o;
            half.half_duplex = true;
            CHECK(none <= seconds(2, 2, half));
            CHECK(both <= seconds(0, 0, half) * 1.0001);
          }
          if (mhz == 166) {
            LinkPlanOptions late = o;
            late.turnaround = 3e-4;
            CHECK(none <= seconds(2, 2, late) * slack);
            CHECK(both <= seconds(0, 0, late) * slack);
          }
        }
    }
  }
}

TEST_CASE("link plan: rings of rows, deeper is faster") {
  const net::ArbiterConfig c = board(false);
  const auto tiles = pair_of(c);
  double before = 1e9;
  for (const int slots : {2, 4, 8, 16, 32, 64, 0}) {
    const double s = forecast_link(with_buffers(c, slots, 0), tiles, {}).end;
    INFO(slots << " slots");
    CHECK(s < before);
    before = s;
  }
}

TEST_CASE("link plan: the same seed, the same forecast, and options out of range are named") {
  const net::ArbiterConfig c = board(true);
  const std::vector<golden::TileJob> tiles(3, full_tile(c, 3));
  LinkPlanOptions o;
  o.half_duplex = true;
  const LinkForecast a = forecast_link(c, tiles, o), b = forecast_link(c, tiles, o);
  CHECK(a.end == b.end);
  CHECK(a.collisions == b.collisions);
  o.seed = 2;
  CHECK(forecast_link(c, tiles, o).end != a.end);
  CHECK(forecast_link(c, tiles, o).end == approx(a.end).epsilon(0.1));

  CHECK_THROWS_WITH(forecast_link(c, {}, {}), contains("no tiles"));
  auto refuses = [&](const char* name, const LinkPlanOptions& bad) {
    CHECK_THROWS_WITH(forecast_link(c, tiles, bad), contains(name));
  };
  LinkPlanOptions bad;
  bad.clk_mhz = 0;
  refuses("clk_mhz", bad);
  bad = {};
  bad.lanes = 0;
  refuses("lanes", bad);
  bad = {};
  bad.in_flight = 3;
  refuses("in_flight", bad);
  bad = {};
  bad.turnaround = -1;
  refuses("turnaround", bad);
  bad = {};
  bad.window = 0;
  refuses("window", bad);
  bad = {};
  bad.medium_delay = 41;
  refuses("medium_delay", bad);
}
