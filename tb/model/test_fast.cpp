// SPDX-License-Identifier: Apache-2.0
// Fast model = plain bit-true model: every map cell and every intermediate result, for many formats, rigs, instruction
// sets, bands and numbers of threads.
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

#include "core/error.hpp"
#include "fast/fast.hpp"
#include "support/catch.hpp"

using namespace psweep;

namespace {

struct Pair {
  Gray left, right;
};

// Content 0: correlated noise; 1: noise with flat patches; 2: black and white; 3: constant; 4: a smooth slope, whose
// best plane moves slowly (many improvements in a row); 5: faint texture; 6: black left, white right, a few specks (the
// largest sums).
// (largest sums).
Pair make_pair_of_images(int width, int height, int bits, int content, unsigned seed) {
  std::mt19937 random(seed);
  const int most = (1 << std::min(bits, 8)) - 1;
  Pair p{Gray(width, height), Gray(width, height)};
  auto noise = [&] { return static_cast<int>(random() % static_cast<unsigned>(most + 1)); };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      int v = noise();
      if (content == 2) v = v * 2 > most ? most : 0;
      if (content == 3) v = most / 3;
      if (content == 4) v = static_cast<int>((std::sin(x * 0.21) + std::cos(y * 0.33 + x * 0.05) + 2) * most / 4);
      if (content == 5) v = most / 2 + (v & 1);
      if (content == 6) v = random() % 200 == 0 ? most : 0;
      p.left.at(x, y) = static_cast<uint8_t>(v);
    }
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int v = p.left.at(std::min(x + width / 9, width - 1), y);
      p.right.at(x, y) = static_cast<uint8_t>(content == 0                   ? (v * 7 + noise()) / 8
                                              : content == 2 || content == 6 ? most - v
                                                                             : v);
      if (content == 1 && x > width / 2 && y > height / 3)
        p.left.at(x, y) = p.right.at(x, y) = static_cast<uint8_t>(most / 2);
    }
  }
  return p;
}

SweepSetup make_setup(int width, int height, int planes) {
  SweepSetup s;
  s.rig.width = width;
  s.rig.height = height;
  s.rig.left = s.rig.right = {1.07 * width, 1.07 * width, (width - 1) / 2.0, (height - 1) / 2.0};
  s.rig.baseline = 0.2;
  s.spacing = {planes, 1.0, planes == 1 ? 1.0 : 4.0};
  s.format.planes = 64;
  s.format.window = 5;
  s.format.plane_cols = s.format.plane_rows = 4096;
  s.format.img_cols = s.format.img_rows = 4098;
  return s;
}

// The plain model over one tile that holds all cells that can be valid.
Image<golden::MapCell> golden_map(const SweepSetup& s, const Pair& p) {
  const Plan plan = plan_tiles(s, 4096, 4096);
  std::vector<std::vector<golden::MapCell>> cells;
  for (const auto& t : plan.tiles) {
    const auto result = golden::run_tile(s.format, t.job, plan.table,
                                         cut_window(p.left, t.left_x, t.left_y, t.job.win_cols, t.job.win_rows),
                                         cut_window(p.right, t.right_x, t.right_y, t.job.win_cols, t.job.win_rows));
    REQUIRE(result.window_errors == 0);
    cells.push_back(result.cells);
  }
  return assemble(s.rig, plan, cells);
}

// First difference, or empty.
std::string difference(const Image<golden::MapCell>& fast, const Image<golden::MapCell>& plain) {
  if (fast.data.empty() || fast.data.size() != plain.data.size()) return "nothing to compare";
  for (size_t i = 0; i < fast.data.size(); ++i) {
    const auto &f = fast.data[i], &g = plain.data[i];
    if (f == g) continue;
    auto text = [](const golden::MapCell& c) {
      return "plane " + std::to_string(c.plane) + " frac " + std::to_string(c.frac) + " v " + std::to_string(c.v) +
             " mask " + std::to_string(c.mask);
    };
    return "cell " + std::to_string(i % fast.width) + "," + std::to_string(i / fast.width) + ": fast " + text(f) +
           ", plain " + text(g);
  }
  return "";
}

void check_all_levels(const SweepSetup& s, const Pair& p) {
  const auto expected = golden_map(s, p);
  for (const SimdLevel level : simd_levels()) {
    for (const int band_rows : {0, 3}) {
      FastOptions options;
      options.level = level;
      options.band_rows = band_rows;
      CAPTURE(simd_name(level), band_rows);
      CHECK(difference(run_fixed(p.left, p.right, s, options), expected) == "");
    }
  }
}

}  // namespace

TEST_CASE("fast map equals the plain model: formats") {
  struct Format {
    int window, pix, weight, interp, mncc, frac;
  };
  const Format format = GENERATE(
      Format{13, 8, 8, 2, 13, 8}, Format{13, 8, 8, 0, 13, 8}, Format{13, 8, 8, 4, 13, 8}, Format{13, 8, 8, 6, 14, 8},
      Format{13, 8, 8, 8, 16, 12}, Format{3, 8, 8, 2, 16, 12}, Format{3, 8, 8, 8, 4, 2}, Format{21, 8, 8, 2, 16, 12},
      Format{21, 8, 8, 3, 13, 8}, Format{21, 8, 8, 4, 13, 8}, Format{15, 8, 8, 4, 13, 8}, Format{5, 1, 1, 0, 5, 3},
      Format{7, 4, 12, 5, 12, 12}, Format{7, 6, 3, 5, 9, 6}, Format{9, 8, 1, 8, 13, 8}, Format{5, 12, 12, 8, 16, 12},
      Format{21, 12, 12, 8, 16, 12}, Format{11, 8, 2, 3, 11, 7}, Format{5, 8, 8, 2, 15, 11}, Format{5, 10, 6, 2, 13, 8},
      Format{13, 8, 4, 4, 13, 8});
  const int content = GENERATE(0, 1, 2, 4, 6);
  SweepSetup s = make_setup(format.window * 2 + 25, format.window + 19, 13);
  s.format.window = format.window;
  s.format.pix_bits = format.pix;
  s.format.weight_bits = format.weight;
  s.format.interp_frac = format.interp;
  s.format.mncc_bits = format.mncc;
  s.format.frac_bits = format.frac;
  s.threshold = threshold_for(s.format, 0.7);
  CAPTURE(format.window, format.pix, format.weight, format.interp, format.mncc, format.frac, content);
  check_all_levels(s, make_pair_of_images(s.rig.width, s.rig.height, format.pix, content, 11));
}

TEST_CASE("fast map equals the plain model: rigs and contents") {
  SweepSetup s = make_setup(57, 29, 17);
  s.threshold = threshold_for(s.format, 0.85);
  const int rig = GENERATE(0, 1, 2, 3, 4, 5, 6);
  if (rig == 1) s.rig.left.cx += 0.5, s.rig.right.cx -= 3.25;
  if (rig == 2) s.rig.left.cy += 0.77;
  if (rig == 3) s.rig.left.fx *= 1.13, s.rig.left.fy *= 1.11, s.rig.right.cy += 1.9;
  if (rig == 4) s.spacing = {1, 1.7, 1.7};
  if (rig == 5) s.rig.left.cy += 3, s.rig.right.cy -= 2;  // whole rows apart: still unit steps, other rows
  if (rig == 6) s.spacing.zmin = 0.2;                     // the first planes have no valid cell at all
  const int content = GENERATE(0, 1, 2, 3, 4, 5);
  CAPTURE(rig, content);
  check_all_levels(s, make_pair_of_images(s.rig.width, s.rig.height, 8, content, 5));
}

TEST_CASE("fast map equals the plain model: sizes") {
  const int width = GENERATE(4, 5, 6, 16, 17, 21, 33, 64, 131);
  const int height = GENERATE(4, 5, 6, 14);
  SweepSetup s = make_setup(width, height, 7);
  s.rig.baseline = 0.03;
  CAPTURE(width, height);
  check_all_levels(s, make_pair_of_images(width, height, 8, 0, 3));
}

TEST_CASE("the map does not depend on threads and bands") {
  SweepSetup s = make_setup(90, 61, 11);
  const Pair p = make_pair_of_images(90, 61, 8, 1, 2);
  const auto expected = golden_map(s, p);
  for (const SimdLevel level : simd_levels()) {
    for (const int threads : {1, 2, 3, 7, 64}) {
      for (const int band_rows : {1, 5, 17, 1000}) {
        FastOptions options;
        options.level = level;
        options.threads = threads;
        options.band_rows = band_rows;
        double last = 0;
        bool ascending = true;
        options.progress = [&](double fraction) {
          ascending = ascending && fraction > last;
          last = fraction;
        };
        CAPTURE(simd_name(level), threads, band_rows);
        CHECK(difference(run_fixed(p.left, p.right, s, options), expected) == "");
        CHECK(ascending);
        CHECK(last == 1.0);
      }
    }
  }
}

TEST_CASE("every intermediate result of the fast model equals the plain model's") {
  SweepSetup s = make_setup(49, 33, 12);
  enum { kUnitSteps, kGeneral, kWideSums, kLargeWindow };
  const int kind = GENERATE(0, 1, 2, 3);
  if (kind == kGeneral) s.rig.left.fx *= 1.09, s.rig.right.cy += 0.6;
  if (kind == kWideSums) s.format.interp_frac = 8;
  if (kind == kLargeWindow) s.format.window = 13;
  const int content = GENERATE(0, 1, 3);
  const Pair p = make_pair_of_images(s.rig.width, s.rig.height, 8, content, 9);
  const Plan plan = plan_tiles(s, 4096, 4096);
  REQUIRE(plan.tiles.size() == 1);
  const PlacedTile& tile = plan.tiles[0];
  std::vector<golden::PlaneTrace> traces;
  golden::run_tile(s.format, tile.job, plan.table,
                   cut_window(p.left, tile.left_x, tile.left_y, tile.job.win_cols, tile.job.win_rows),
                   cut_window(p.right, tile.right_x, tile.right_y, tile.job.win_cols, tile.job.win_rows),
                   [&](int, const golden::PlaneTrace& t, const std::vector<golden::Cell>&) { traces.push_back(t); });
  const auto expected = golden_map(s, p);
  const int m = s.format.window;
  for (const SimdLevel level : simd_levels()) {
    CAPTURE(simd_name(level), kind, content);
    FastOptions options;
    options.level = level;
    int planes = 0;
    size_t cells = 0, samples = 0, wrong_cells = 0, wrong_samples = 0;
    options.trace = [&](const FastTrace& t) {
      REQUIRE(t.plane == planes++);
      REQUIRE(t.u0 == tile.u0);
      REQUIRE(t.v0 == tile.v0);
      REQUIRE(t.cols == tile.job.tile_cols);
      REQUIRE(t.rows == tile.job.tile_rows);
      const auto& g = traces[static_cast<size_t>(t.plane)];
      for (int v = 0; v < t.rows; ++v) {
        for (int u = 0; u < t.cols; ++u) {
          const size_t at = static_cast<size_t>(v) * t.cols + u;
          const auto& e = g.similarity[at];
          const bool valid = u >= t.valid.u_lo && u < t.valid.u_hi && v >= t.valid.v_lo && v < t.valid.v_hi;
          ++cells;
          wrong_cells += valid != e.valid || t.v[at] != e.v || (t.textured[at] != 0) != e.textured;
        }
      }
      if (t.valid.empty()) return;
      for (int j = t.valid.v_lo; j < t.valid.v_hi + m - 1; ++j) {
        for (int i = t.valid.u_lo; i < t.valid.u_hi + m - 1; ++i) {
          const size_t at = static_cast<size_t>(j) * (t.cols + m - 1) + i;
          ++samples;
          wrong_samples += !g.flags[at].usable || t.l[at] != g.l[at] || t.r[at] != g.r[at];
        }
      }
    };
    CHECK(difference(run_fixed(p.left, p.right, s, options), expected) == "");
    CHECK(planes == s.spacing.planes);
    CHECK(cells > 1000);
    CHECK(samples > cells / 2);
    CHECK(wrong_cells == 0);
    CHECK(wrong_samples == 0);
  }
}

TEST_CASE("a tile alone: any window, bounds, table and starts") {
  std::mt19937 random(21);
  auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  size_t window_errors = 0, winners = 0;
  for (int run = 0; run < 60; ++run) {
    golden::Config c;
    c.window = 3 + 2 * below(4);
    c.interp_frac = below(9);
    c.weight_bits = 1 + below(12);
    c.pix_bits = 1 + below(12);
    c.mncc_bits = 4 + below(13);
    c.frac_bits = 2 + below(11);
    golden::TileJob job;
    job.tile_cols = 1 + below(30);
    job.tile_rows = 1 + below(12);
    job.win_cols = 20 + below(40);
    job.win_rows = 12 + below(20);
    job.planes = 1 + below(6);
    job.threshold = below(1 << c.mncc_bits);
    const int edge = run % 3 == 0 ? 0 : 10;
    job.left = {-below(edge + 1), job.win_cols - 2 + below(edge + 1), -below(edge + 1),
                job.win_rows - 2 + below(edge + 1)};
    job.right = {below(3), job.win_cols - 2 - below(3), 0, job.win_rows - 2};
    std::vector<golden::PlaneEntry> table;
    for (int k = 0; k < job.planes; ++k) {
      auto start = [&](int pixels) {
        return static_cast<int32_t>((below(2 * pixels) - pixels) * (1 << 19) + below(1 << 19));
      };
      auto step = [&] { return static_cast<uint32_t>(run % 4 == 0 ? 1 << 19 : (1 << 18) + below(1 << 20)); };
      golden::PlaneEntry p{start(4), start(3), start(4), start(3), step(), step(), step(), step()};
      if (run == 7) p.dx_left = p.dy_right = 0;
      table.push_back(p);
    }
    if (run == 9) job.tx_left = 2147400000;  // wraps
    golden::Pixels left(job.win_cols, job.win_rows), right(job.win_cols, job.win_rows);
    for (size_t i = 0; i < left.data.size(); ++i) {
      left.data[i] = static_cast<uint16_t>(below(1 << c.pix_bits));
      right.data[i] = static_cast<uint16_t>((left.data[i] * 3 + below(1 << c.pix_bits)) / 4);
    }
    const auto expected = golden::run_tile(c, job, table, left, right);
    window_errors += expected.window_errors;
    for (const auto& cell : expected.cells) winners += cell.v > 0;
    for (const SimdLevel level : simd_levels()) {
      FastOptions options;
      options.level = level;
      const auto result = run_tile_fast(c, job, table, left, right, options);
      CAPTURE(run, simd_name(level));
      CHECK(result.window_errors == expected.window_errors);
      CHECK(result.cells == expected.cells);
    }
  }
  CHECK(window_errors > 0);
  CHECK(winners > 1000);
}

TEST_CASE("faint texture on black in the widest format: sums of 57 bits, variances of 32") {
  std::mt19937 random(31);
  auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  golden::Config c;
  c.window = 21, c.pix_bits = 12, c.weight_bits = 12, c.interp_frac = 8, c.mncc_bits = 16, c.frac_bits = 12;
  golden::TileJob job;
  job.tile_cols = 60, job.tile_rows = 40, job.win_cols = 90, job.win_rows = 70, job.planes = 12;
  job.left = job.right = {0, 88, 0, 68};
  std::vector<golden::PlaneEntry> table;
  for (int k = 0; k < job.planes; ++k) {
    auto start = [&] { return below(1 << 20); };
    table.push_back({start(), start(), start(), start(), 1 << 19, 1 << 19, (1 << 19) + 77, 1 << 19});
  }
  golden::Pixels left(job.win_cols, job.win_rows), right(job.win_cols, job.win_rows);
  for (auto& v : left.data) v = static_cast<uint16_t>(below(3));
  right.data = left.data;
  for (auto& v : right.data) v = static_cast<uint16_t>(below(4) ? v : below(3));
  const auto expected = golden::run_tile(c, job, table, left, right);
  for (const SimdLevel level : simd_levels()) {
    CAPTURE(simd_name(level));
    FastOptions options;
    options.level = level;
    CHECK(run_tile_fast(c, job, table, left, right, options).cells == expected.cells);
  }
}

TEST_CASE("wrong images and instruction sets are named") {
  const SweepSetup s = make_setup(20, 20, 3);
  auto message = [&](const Gray& left, const Gray& right, const SweepSetup& setup) -> std::string {
    try {
      run_fixed(left, right, setup);
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  };
  CHECK(message(Gray(20, 20), Gray(20, 20), s) == "no error");
  CHECK(message(Gray(20, 20), Gray(20, 21), s) == "right image is 20x21, the rig 20x20");
  SweepSetup narrow = s;
  narrow.format.pix_bits = 4;
  CHECK(message(Gray(20, 20, 16), Gray(20, 20), narrow) == "left image has a pixel of 16, pix_bits = 4 is too small");
  const char* before = std::getenv("PSWEEP_SIMD");
  const std::string kept = before ? before : "";
  setenv("PSWEEP_SIMD", "mmx", 1);
  CHECK_THROWS_AS(best_simd_level(), InputError);
  setenv("PSWEEP_SIMD", "plain", 1);
  CHECK(best_simd_level() == SimdLevel::kPlain);
  if (before) {
    setenv("PSWEEP_SIMD", kept.c_str(), 1);
  } else {
    unsetenv("PSWEEP_SIMD");
  }
}
