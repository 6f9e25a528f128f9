// SPDX-License-Identifier: Apache-2.0
// The forecast of plan/link_plan.hpp against the Verilated chip, served by the host library over the in-process link:
// clocks from the first launch to the last map beat, and the engine's clocks among them, for whole and ring buffers,
// several clocks, one and two tiles in flight, both duplexes.
#include <algorithm>
#include <cstdio>

#include "chip/watched.hpp"
#include "forecast/link_plan.hpp"
#include "golden/control.hpp"
#include "net/link_engine.hpp"
#include "support/catch.hpp"
#include "verilated/chips.hpp"

using namespace psweep;
using namespace psweep::chip;

namespace {

const net::Address kHost{{0x02, 0x00, 0x00, 0x00, 0x00, 0x01}, 0x0a050001, 40000};

struct Case {
  const char* chip;
  const char* what;
  double mhz;
  int tile_cols, tile_rows, win_cols, win_rows, planes;
};

struct Measured {
  double elapsed = 0;      // clocks from the first launch to the last map beat
  double tile_clocks = 0;  // of all tiles, stalls of load and unload included
  double repeated = 0;     // map chunks
};

golden::TileJob job_of(const Case& k) {
  golden::TileJob t;
  t.tile_cols = k.tile_cols, t.tile_rows = k.tile_rows;
  t.win_cols = k.win_cols, t.win_rows = k.win_rows;
  t.planes = k.planes;
  t.left = t.right = {0, t.win_cols - 1, 0, t.win_rows - 1};
  return t;
}

Measured measure(const Case& k, int tiles, const LinkPlanOptions& o) {
  const Chip& chip = chip_named(k.chip);
  DeskSettings s;
  s.clk_mhz = o.clk_mhz;
  s.half_duplex = o.half_duplex;
  Desk desk(chip.make(), s);
  Station station(desk, kHost, chip.address.ip, chip.address.port);
  Watched transport(station, chip.address);
  net::Client client(transport, 1.0, 1);
  const auto capabilities = client.info();
  golden::PlaneEntry plane;
  plane.dx_left = plane.dy_left = plane.dx_right = plane.dy_right = 1u << golden::kPosFrac;
  net::LinkOptions options;
  options.in_flight = o.in_flight;
  const golden::TileJob job = job_of(k);
  const auto figures = net::run_link_tiles(
      client, capabilities, std::vector<golden::PlaneEntry>(static_cast<size_t>(k.planes), plane), tiles, options,
      [&](int) {
        const golden::Pixels blank(job.win_cols, job.win_rows);
        return golden::TileInput{job, blank, blank};
      },
      [](int, const std::vector<golden::MapCell>&) {}, [](uint64_t) {});
  REQUIRE(desk.chip().launches() == tiles);
  REQUIRE(transport.launch_clock > 0);
  CHECK(client.statistics().lost == 0);
  return {static_cast<double>(transport.busy_clock - transport.launch_clock),
          static_cast<double>(figures.engine_clocks), static_cast<double>(client.statistics().duplicates)};
}

}  // namespace

// What a tile has room for decides whether a ring shows: configuration `odd` holds 5 chunks of 251 pairs and 2 of 167
// cells, so a small tile is buffered as a whole and a large one is not.
// Tolerance: the forecast leaves out the clock crossings, the walk of the map buffer and the host's rounding to a
// microsecond, together some clocks a packet: 2 % of packets this small (of full ones much less). In half duplex two
// dozen collisions a tile, and their backoff, are a matter of chance: 20 %.
TEST_CASE("link plan: stall clocks of the forecast are those of the Verilated chip") {
  constexpr int kTiles = 12;
  const Case k = GENERATE(Case{"odd", "rows whole, map whole", 60, 18, 18, 40, 31, 19},
                          Case{"odd", "rows whole, map ring", 60, 24, 20, 32, 28, 19},
                          Case{"odd", "rows ring, map whole", 60, 18, 18, 62, 38, 19},
                          Case{"odd", "rows ring, map ring", 60, 37, 23, 62, 38, 19},
                          Case{"tiny", "rows whole, map whole", 166, 16, 12, 36, 26, 12},
                          Case{"tiny_min", "rows ring, map ring", 166, 16, 12, 36, 26, 12});
  const bool half_duplex = GENERATE(false, true);
  const int in_flight = GENERATE(1, 2);
  LinkPlanOptions o;
  o.clk_mhz = k.mhz;
  o.in_flight = in_flight;
  o.half_duplex = half_duplex;
  const Measured m = measure(k, kTiles, o);
  const golden::TileJob job = job_of(k);
  const net::ArbiterConfig& config = chip_named(k.chip).config;
  const LinkForecast f = forecast_link(config, std::vector<golden::TileJob>(kTiles, job), o);
  const double engine = kTiles * static_cast<double>(golden::engine_clocks(config.engine, job));
  const double stall = static_cast<double>(f.stall());
  const double tile_clocks = static_cast<double>(f.engine_clocks + f.stall_load + f.stall_unload);
  std::printf(
      "%s, %s, %g MHz, %s duplex, %d in flight: stall %.0f measured, %.0f forecast (%+.1f %%); tile_clocks %.0f "
      "and %.0f\n",
      k.chip, k.what, k.mhz, half_duplex ? "half" : "full", in_flight, m.elapsed - engine, stall,
      100 * (stall / (m.elapsed - engine) - 1), m.tile_clocks, tile_clocks);
  INFO(k.chip << ", " << k.what << (half_duplex ? ", half" : ", full") << " duplex, in flight " << in_flight);
  const double tolerance = half_duplex ? 0.2 : 0.02;
  CHECK(static_cast<double>(f.engine_clocks) == engine);
  CHECK(stall == approx(m.elapsed - engine).epsilon(tolerance));
  // With two in flight the unload may wait for the RELEASE of the map before.
  if (in_flight == 1) CHECK(tile_clocks == approx(m.tile_clocks).epsilon(tolerance));
  // Whole maps are asked for once, but in half duplex the host takes a map that waits for the medium for lost. Of a
  // ring's chunks it gets some twice.
  const bool ring = std::string(k.what).find("map ring") != std::string::npos;
  CHECK((f.map_repeated > 0) == ring);
  if (ring || !half_duplex) CHECK((m.repeated > 0) == ring);
}
