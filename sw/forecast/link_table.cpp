// SPDX-License-Identifier: Apache-2.0
// link_table: what the arbiter's buffers cost and what they buy, for the paper's pair (1120 x 1120 pixels, 301 planes,
// window 13) in the paper's bands and in tiles, as the Markdown tables of docs/arbiter.md (make link-table). All of it
// is forecast (plan/link_plan.hpp), nothing measured.
//   link_table             the tables
//   link_table --chip IMG_COLS IMG_ROWS PLANE_COLS PLANE_ROWS LANES ROW_SLOTS MAP_DEPTH MHZ
//                          one chip as JSON, full duplex, two tiles in flight: seconds that its engine waits for the
//                          link, and all of the pair; sizes like the generics (scripts/cost/report.py)
#include <cstdio>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "forecast/link_plan.hpp"
#include "plan/planner.hpp"
#include "scene/scene.hpp"

namespace psweep {
namespace {

constexpr int kLeast = 2;  // chunks: the smallest ring
constexpr double kClocks[] = {60, 166, 300};

struct Geometry {
  const char* name;
  net::ArbiterConfig chip;
  std::vector<golden::TileJob> tiles;
};

Geometry geometry(const char* name, int img_cols, int img_rows, int plane_cols, int plane_rows) {
  Geometry g;
  g.name = name;
  golden::Config& e = g.chip.engine;
  e.img_cols = img_cols, e.img_rows = img_rows, e.plane_cols = plane_cols, e.plane_rows = plane_rows;
  const SweepSetup setup{rover_rig(1120), {e.planes, 1.0, 4.0}, e, threshold_for(e, 0.85)};
  for (const PlacedTile& t : plan_tiles(setup, plane_cols, plane_rows).tiles) g.tiles.push_back(t.job);
  return g;
}

net::ArbiterConfig buffers(const Geometry& g, int row_chunks, int map_chunks) {  // 0: whole
  net::ArbiterConfig c = g.chip;
  c.row_slots = row_chunks;
  c.map_depth = map_chunks * c.chunk_cells();
  return c;
}

struct Buffering {
  const char* name;
  int rows, map;
};
constexpr Buffering kBufferings[] = {
    {"none", kLeast, kLeast}, {"rows", 0, kLeast}, {"map", kLeast, 0}, {"rows and map", 0, 0}};

std::string cell(const LinkForecast& f) {
  char text[64];
  std::snprintf(text, sizeof text, "%.1f / %.2f", 1e-6 * static_cast<double>(f.stall()), f.end);
  return text;
}

void by_buffering(const std::vector<Geometry>& all, bool half_duplex) {
  std::printf("\n%s duplex: millions of stall clocks a pair / seconds a pair\n\n", half_duplex ? "Half" : "Full");
  std::printf("| | buffered | RAMB36 | 60 MHz, 1 | 60 MHz, 2 | 166 MHz, 1 | 166 MHz, 2 | 300 MHz, 1 | 300 MHz, 2 |\n");
  std::printf("|---|---|---|---|---|---|---|---|---|\n");
  for (const Geometry& g : all)
    for (const Buffering& b : kBufferings) {
      const net::ArbiterConfig c = buffers(g, b.rows, b.map);
      const BufferRam ram = buffer_ram(c);
      std::printf("| %s | %s | %g + %g |", g.name, b.name, ram.rows, ram.map);
      for (const double mhz : kClocks)
        for (const int in_flight : {1, 2}) {
          LinkPlanOptions o;
          o.clk_mhz = mhz, o.in_flight = in_flight, o.half_duplex = half_duplex;
          std::printf(" %s |", cell(forecast_link(c, g.tiles, o)).c_str());
        }
      std::printf("\n");
    }
}

void by_ring(const Geometry& g) {
  std::printf("\nRings, %s, 166 MHz, two in flight, full duplex; host answers at once / after 100 us\n\n", g.name);
  std::printf(
      "| chunks | rows: RAMB36 | stall, Mclk | s | map: RAMB36 | stall, Mclk | s |\n|---|---|---|---|---|---|---|\n");
  for (const int chunks : {2, 4, 8, 16, 32, 64, 0}) {
    std::printf("| %s |", chunks > 0 ? std::to_string(chunks).c_str() : "whole");
    for (const bool rows : {true, false}) {
      const net::ArbiterConfig c = rows ? buffers(g, chunks, 0) : buffers(g, 0, chunks);
      LinkPlanOptions o;
      const LinkForecast now = forecast_link(c, g.tiles, o);
      o.turnaround = 1e-4;
      const LinkForecast late = forecast_link(c, g.tiles, o);
      const BufferRam ram = buffer_ram(c);
      std::printf(" %g | %.1f / %.1f | %.2f / %.2f |", rows ? ram.rows : ram.map,
                  1e-6 * static_cast<double>(now.stall()), 1e-6 * static_cast<double>(late.stall()), now.end, late.end);
    }
    std::printf("\n");
  }
}

void by_lanes(const std::vector<Geometry>& all) {
  std::printf("\nLanes, rows and map buffered, two in flight: seconds a pair / share of it that the engine works\n\n");
  std::printf(
      "| | lanes | 60 MHz, full | 60 MHz, half | 166 MHz, full | 166 MHz, half | 300 MHz, full | 300 MHz, half |\n");
  std::printf("|---|---|---|---|---|---|---|---|\n");
  for (const Geometry& g : all)
    for (const int lanes : {1, 2, 4}) {
      std::printf("| %s | %d |", g.name, lanes);
      for (const double mhz : kClocks)
        for (const bool half_duplex : {false, true}) {
          LinkPlanOptions o;
          o.clk_mhz = mhz, o.lanes = lanes, o.half_duplex = half_duplex;
          const LinkForecast f = forecast_link(g.chip, g.tiles, o);
          std::printf(" %.2f / %.1f %% |", f.end, 100 * static_cast<double>(f.engine_clocks) / (1e6 * mhz) / f.end);
        }
      std::printf("\n");
    }
}

void one_chip(const std::vector<int>& n) {
  Geometry g = geometry("", n[0], n[1], n[2], n[3]);
  g.chip.row_slots = n[5];
  g.chip.map_depth = n[6];
  LinkPlanOptions o;
  o.lanes = n[4];
  o.clk_mhz = n[7];
  const LinkForecast f = forecast_link(g.chip, g.tiles, o);
  std::printf("{\"mhz\": %d, \"wait\": %.3f, \"seconds\": %.3f}\n", n[7],
              static_cast<double>(f.stall()) / (1e6 * o.clk_mhz), f.end);
}

void run() {
  const std::vector<Geometry> all = {geometry("bands", 1120, 44, 1092, 30), geometry("tiles", 362, 144, 256, 130)};
  for (const bool half_duplex : {false, true}) by_buffering(all, half_duplex);
  by_ring(all[1]);
  by_lanes(all);
}

}  // namespace
}  // namespace psweep

int main(int argc, char** argv) {
  const bool chip = argc == 10 && std::string(argv[1]) == "--chip";
  if (argc > 1 && !chip) {
    std::fprintf(stderr,
                 "usage: link_table [--chip IMG_COLS IMG_ROWS PLANE_COLS PLANE_ROWS LANES ROW_SLOTS MAP_DEPTH MHZ]\n");
    return 2;
  }
  try {
    if (chip) {
      std::vector<int> numbers;
      for (int i = 2; i < argc; ++i) numbers.push_back(std::stoi(argv[i]));
      psweep::one_chip(numbers);
    } else {
      psweep::run();
    }
  } catch (const std::exception& e) {
    std::fprintf(stderr, "link_table: %s\n", e.what());
    return 1;
  }
}
