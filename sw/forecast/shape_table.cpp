// SPDX-License-Identifier: Apache-2.0
// shape_table: which shape of tiles sweeps the paper's pair (1120 x 1120 pixels, 301 planes, 1 m to 4 m) in the fewest
// clocks, for any size of the memory: the paper's figure 7 extended from bands to tiles (make shape-table). Clocks are
// golden::engine_clocks() of every tile of the plan; bits are those of the engine's memories, counted from the
// generics.
//   shape_table            Markdown tables of docs/tiles.md
//   shape_table --curve    the points of the picture: kind, Mbit, million clocks of 1, 2 and 4 lanes, columns, rows
//   shape_table --tile C R [PIXELS PLANES [WINDOW]]
//                          one shape as JSON, of PIXELS x PIXELS pixels (1120) and PLANES planes (301) with this window
//                          (13): clocks of the plan, useful ones, image buffer, bits of the memories with one lane
//                          (scripts/cost/report.py, scripts/dse)
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "golden/control.hpp"
#include "plan/planner.hpp"
#include "scene/scene.hpp"

namespace psweep {
namespace {

constexpr int kLanes[] = {1, 2, 4};

// Memories of the engine: `copies` memories of words x bits.
struct Memory {
  const char* name;
  int64_t copies, words, bits;
};

std::vector<Memory> memories(const golden::Config& c) {
  const int64_t cells = int64_t{c.plane_cols} * c.plane_rows, row = c.plane_cols + c.window - 1;
  const int64_t word = 2 * c.mncc_bits + c.plane_bits() + c.frac_bits + 2;
  // A column of the similarity's window sums: of both samples, and their squares and product halved.
  int steps = 0;
  while ((1 << steps) < c.window) ++steps;
  const int64_t column = 2 * (c.sample_bits() + steps) + 2 * (2 * c.sample_bits() - 1 + steps);
  return {{"image", int64_t{8} * ((c.lanes + 1) / 2), int64_t{c.img_cols} * c.img_rows / 4, c.pix_bits},
          {"map", 1, cells, word},
          {"plane table", c.lanes, int64_t{8} * ((c.planes + c.lanes - 1) / c.lanes), 32},
          {"rows of the window", c.lanes, row * c.window, int64_t{2} * c.sample_bits()},
          {"sums of columns", c.lanes, row, column}};
}

// Blocks of 36 kbit in the best of their shapes, halves of them counted as halves.
double blocks(const Memory& m) {
  double best = 1e9;
  for (const auto& [words, bits] :
       std::map<int64_t, int64_t>{{8192, 4}, {4096, 9}, {2048, 18}, {1024, 36}, {512, 72}}) {
    auto up = [](int64_t a, int64_t b) { return (a + b - 1) / b; };
    const double half = static_cast<double>(up(m.words, words / 2) * up(m.bits, bits)) / 2;
    best = std::min(best, half);
  }
  return best * static_cast<double>(m.copies);
}

struct Shape {
  TileSize size;
  golden::Config config;
  size_t tiles = 0;
  int64_t image_bits = 0, map_bits = 0, bits = 0;
  double ramb36 = 0;
  uint64_t load = 0, unload = 0, skirt = 0, fill = 0, useful = 0, all[3] = {};
};

Shape shape_of(const SweepSetup& any, TileSize size) {
  Shape s;
  s.size = size;
  SweepSetup setup = any;
  const BufferSize need = required_buffer(setup, size.cols, size.rows);
  golden::Config& c = setup.format;
  c.plane_cols = size.cols, c.plane_rows = size.rows;
  c.img_cols = need.img_cols + (need.img_cols & 1), c.img_rows = need.img_rows + (need.img_rows & 1);
  s.config = c;
  const Plan plan = plan_tiles(setup, size.cols, size.rows);
  s.tiles = plan.tiles.size();
  for (const PlacedTile& t : plan.tiles) {
    s.load += golden::load_clocks(t.job);
    s.unload += golden::unload_clocks(t.job);
    s.fill += golden::fill_clocks(c);
    s.useful += golden::unload_clocks(t.job) * static_cast<uint64_t>(t.job.planes);
    s.skirt += golden::sweep_clocks(c, t.job) - golden::unload_clocks(t.job) * static_cast<uint64_t>(t.job.planes);
    for (int n = 0; n < 3; ++n) {
      c.lanes = kLanes[n];
      s.all[n] += golden::engine_clocks(c, t.job);
      c.lanes = 1;
    }
  }
  for (const Memory& m : memories(s.config)) {
    s.bits += m.copies * m.words * m.bits;
    s.ramb36 += blocks(m);
    if (m.name == std::string("image")) s.image_bits = m.copies * m.words * m.bits;
    if (m.name == std::string("map")) s.map_bits = m.copies * m.words * m.bits;
  }
  return s;
}

// Largest tiles of any number of columns and rows of tiles that make sense, few bits first.
std::vector<Shape> shapes(const SweepSetup& setup, bool bands) {
  std::vector<Shape> all;
  const int cols = setup.rig.width, rows = setup.rig.height;
  for (int across = 1; across <= (bands ? 1 : 16); ++across) {
    for (int down = 1; down <= rows / 8; ++down) {
      const TileSize size{(cols - 72 + across - 1) / across, (rows - 12 + down - 1) / down};
      if (!all.empty() && all.back().size.cols == size.cols && all.back().size.rows == size.rows) continue;
      if (size.rows < 8) continue;
      all.push_back(shape_of(setup, size));
    }
  }
  std::sort(all.begin(), all.end(), [](const Shape& a, const Shape& b) { return a.bits < b.bits; });
  return all;
}

// Those that no other one beats in both bits and clocks.
std::vector<Shape> frontier(const std::vector<Shape>& all) {
  std::vector<Shape> best;
  for (const Shape& s : all)
    if (best.empty() || s.all[0] < best.back().all[0]) best.push_back(s);
  return best;
}

double mega(uint64_t v) { return static_cast<double>(v) / 1e6; }
double mbit(int64_t v) { return static_cast<double>(v) / 1e6; }

void print_row(const char* first, const Shape& s) {
  std::printf("| %s | %d x %d | %zu | %d x %d | %.2f | %.2f | %g | %.1f | %.1f | %.1f |\n", first, s.size.cols,
              s.size.rows, s.tiles, s.config.img_cols, s.config.img_rows, mbit(s.bits), mbit(s.map_bits), s.ramb36,
              mega(s.all[0]), mega(s.all[1]), mega(s.all[2]));
}

void print_tables(const std::vector<Shape>& tiles, const std::vector<Shape>& bands) {
  const char* const head =
      "| %s | largest tile | tiles | image buffer | Mbit | of them map | RAMB36 | M clocks | 2 lanes | 4 lanes |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n";
  std::printf(head, "memory, at most");
  for (const double limit : {1.0, 1.5, 2.0, 2.7, 4.0, 5.4, 8.0, 10.7, 15.0}) {
    const Shape* best = nullptr;
    for (const Shape& s : tiles)
      if (mbit(s.bits) <= limit && (!best || s.all[0] < best->all[0])) best = &s;
    char name[32];
    std::snprintf(name, sizeof name, "%.1f Mbit", limit);
    if (best) print_row(name, *best);
  }
  std::printf("\nBands, as in the paper\n\n");
  std::printf(head, "rows");
  for (const int rows : {10, 20, 30, 40, 60}) {
    const Shape* best = nullptr;
    for (const Shape& s : bands)
      if (s.size.rows <= rows && (!best || s.size.rows > best->size.rows)) best = &s;
    if (best) print_row(std::to_string(best->size.rows).c_str(), *best);
  }
}

void print_losses(const SweepSetup& setup) {
  std::printf(
      "\nWhere the clocks go, in millions (one lane)\n\n"
      "| largest tile | cells x planes | skirt | load | unload | fill | all |\n|---|---|---|---|---|---|---|\n");
  for (const TileSize size : {TileSize{1092, 30}, TileSize{256, 130}, TileSize{186, 140}}) {
    const Shape s = shape_of(setup, size);
    std::printf("| %d x %d | %.2f | %.2f | %.2f | %.2f | %.3f | %.2f |\n", size.cols, size.rows, mega(s.useful),
                mega(s.skirt), mega(s.load), mega(s.unload), mega(s.fill), mega(s.all[0]));
  }
}

int run(bool curve) {
  golden::Config c;
  const SweepSetup setup{rover_rig(1120), {c.planes, 1.0, 4.0}, c, threshold_for(c, 0.85)};
  const auto tiles = shapes(setup, false), bands = shapes(setup, true);
  if (!curve) {
    print_tables(tiles, bands);
    print_losses(setup);
    return 0;
  }
  auto points = [](const char* kind, const std::vector<Shape>& all) {
    for (const Shape& s : all)
      std::printf("%s %.3f %.2f %.2f %.2f %d %d\n", kind, mbit(s.bits), mega(s.all[0]), mega(s.all[1]), mega(s.all[2]),
                  s.size.cols, s.size.rows);
    std::printf("\n\n");
  };
  points("tiles", frontier(tiles));
  points("bands", frontier(bands));
  return 0;
}

int run_tile(const std::vector<std::string>& numbers) {
  golden::Config c;
  if (numbers.size() >= 4) c.planes = std::stoi(numbers[3]);
  if (numbers.size() == 5) c.window = std::stoi(numbers[4]);
  const int pixels = numbers.size() >= 4 ? std::stoi(numbers[2]) : 1120;
  const SweepSetup setup{rover_rig(pixels), {c.planes, 1.0, 4.0}, c, threshold_for(c, 0.85)};
  const Shape s = shape_of(setup, {std::stoi(numbers[0]), std::stoi(numbers[1])});
  std::printf(
      "{\"tile\": [%d, %d], \"pixels\": %d, \"planes\": %d, \"window\": %d, \"tiles\": %zu, \"buffer\": [%d, %d], "
      "\"bits\": %lld, \"useful\": %llu, \"clocks\": {\"1\": %llu, \"2\": %llu, \"4\": %llu}}\n",
      s.size.cols, s.size.rows, pixels, c.planes, c.window, s.tiles, s.config.img_cols, s.config.img_rows,
      static_cast<long long>(s.bits), static_cast<unsigned long long>(s.useful),
      static_cast<unsigned long long>(s.all[0]), static_cast<unsigned long long>(s.all[1]),
      static_cast<unsigned long long>(s.all[2]));
  return 0;
}

}  // namespace
}  // namespace psweep

int main(int argc, char** argv) {
  const std::string option = argc > 1 ? argv[1] : "";
  const bool tile = option == "--tile" && (argc == 4 || argc == 6 || argc == 7);
  if (!tile && (argc > 2 || (argc == 2 && option != "--curve"))) {
    std::fprintf(stderr, "usage: shape_table [--curve | --tile COLS ROWS [PIXELS PLANES [WINDOW]]]\n");
    return 2;
  }
  try {
    if (tile) return psweep::run_tile(std::vector<std::string>(argv + 2, argv + argc));
    return psweep::run(option == "--curve");
  } catch (const std::exception& e) {
    std::fprintf(stderr, "shape_table: %s\n", e.what());
    return 1;
  }
}
