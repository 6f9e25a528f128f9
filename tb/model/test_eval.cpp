// SPDX-License-Identifier: Apache-2.0
// Metrics against hand-made maps whose figures are known, comparison of results, and clean-up.
#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "eval/cleanup.hpp"
#include "eval/metrics.hpp"
#include "support/catch.hpp"

using namespace psweep;

namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
const PlaneSpacing kSpacing{301, 1.0, 4.0};

// f b = 24: at 2 m a shift of 6 px per image.
Rig small_rig() {
  Rig rig;
  rig.left = rig.right = {120, 120, 31.5, 23.5};
  rig.baseline = 0.2;
  rig.width = 64;
  rig.height = 48;
  return rig;
}

DepthResult result_of(const FloatImage& depth) {
  DepthResult r;
  r.depth = depth;
  r.mask = Image<uint8_t>(depth.width, depth.height);
  r.position = r.mncc = FloatImage(depth.width, depth.height);
  return r;
}

}  // namespace

TEST_CASE("evaluated cells are those whose window lies inside both images at the true depth") {
  const Rig rig = small_rig();
  FloatImage truth(64, 48, 2.0f);
  const Image<uint8_t> cells = evaluated_cells(truth, rig, kSpacing, 5);
  // Shift 6 px, half window 2: columns 8 .. 55, rows 2 .. 45.
  size_t count = 0;
  for (int v = 0; v < 48; ++v) {
    for (int u = 0; u < 64; ++u) {
      const bool expected = u >= 8 && u <= 55 && v >= 2 && v <= 45;
      CHECK((cells.at(u, v) != 0) == expected);
      count += cells.at(u, v);
    }
  }
  CHECK(count == 48 * 44);

  truth.at(20, 20) = 0.999f;
  truth.at(21, 20) = 4.001f;
  truth.at(22, 20) = kInf;
  const Image<uint8_t> fewer = evaluated_cells(truth, rig, kSpacing, 5);
  CHECK(fewer.at(20, 20) == 0);
  CHECK(fewer.at(21, 20) == 0);
  CHECK(fewer.at(22, 20) == 0);
  CHECK(fewer.at(23, 20) == 1);
}

TEST_CASE("unequal cameras move the evaluated cells") {
  Rig rig = small_rig();
  rig.right.cy += 3;  // row offset
  const Image<uint8_t> cells = evaluated_cells(FloatImage(64, 48, 2.0f), rig, kSpacing, 5);
  // Cyclopean cy is 1.5 lower: left samples at v - 1.5, right ones at v + 1.5.
  CHECK(cells.at(30, 3) == 0);
  CHECK(cells.at(30, 4) == 1);
  CHECK(cells.at(30, 43) == 1);
  CHECK(cells.at(30, 44) == 0);
}

TEST_CASE("metrics of a map with known errors") {
  const Rig rig = small_rig();
  const FloatImage truth(64, 48, 2.0f);
  FloatImage depth(64, 48, 2.0f);
  const size_t all = 48 * 44;
  // 100 cells 1 cm off, 10 cells 5 cm off, outside the evaluated set a gross error that must not count
  for (int i = 0; i < 100; ++i) depth.at(10 + i % 40, 10 + i / 40) = i % 2 ? 2.01f : 1.99f;
  for (int i = 0; i < 10; ++i) depth.at(10 + i, 20) = 2.05f;
  depth.at(1, 1) = 3.5f;
  // two holes: one of 3 cells joined across a corner, one of 2 cells
  depth.at(30, 30) = depth.at(31, 30) = depth.at(32, 31) = kInf;
  depth.at(40, 40) = depth.at(40, 41) = kInf;
  depth.at(2, 2) = kInf;  // not evaluated
  const Metrics m = evaluate(depth, truth, rig, kSpacing, 5);
  const double good = static_cast<double>(all - 5);
  CHECK(m.evaluated == all);
  CHECK(m.reconstructed == all - 5);
  CHECK(m.large_errors == 10);
  CHECK(m.holes == 2);
  CHECK(m.M1_mm == approx(1000 * std::sqrt(100 * 1e-4 / (good - 10))).epsilon(1e-4));
  CHECK(m.M2a_percent == approx(100 * 10 / good));
  CHECK(m.M2b_mm == approx(50).epsilon(1e-4));
  CHECK(m.M3_percent == approx(100 * good / static_cast<double>(all)));
  CHECK(m.M4_px == approx(2.5));
  CHECK(m.rms_mm == approx(1000 * std::sqrt((100 * 1e-4 + 10 * 25e-4) / good)).epsilon(1e-4));
}

TEST_CASE("metrics of perfect and of empty maps") {
  const Rig rig = small_rig();
  const FloatImage truth(64, 48, 2.0f);
  const Metrics perfect = evaluate(truth, truth, rig, kSpacing, 5);
  CHECK(perfect.M3_percent == 100);
  CHECK(perfect.M4_px == 0);
  CHECK(perfect.rms_mm == 0);
  const Metrics empty = evaluate(FloatImage(64, 48, kInf), truth, rig, kSpacing, 5);
  CHECK(empty.M3_percent == 0);
  CHECK(empty.holes == 1);
  CHECK(empty.M4_px == 48 * 44);
}

TEST_CASE("metrics refuse what they cannot judge") {
  const Rig rig = small_rig();
  CHECK_THROWS_AS(evaluate(FloatImage(63, 48), FloatImage(64, 48, 2.0f), rig, kSpacing, 5), InputError);
  CHECK_THROWS_AS(evaluate(FloatImage(64, 48), FloatImage(64, 47, 2.0f), rig, kSpacing, 5), InputError);
  CHECK_THROWS_AS(evaluate(FloatImage(64, 48), FloatImage(64, 48, 9.0f), rig, kSpacing, 5), InputError);
  CHECK_THROWS_AS(compare(FloatImage(4, 4), FloatImage(4, 5)), InputError);
  CHECK_THROWS_AS(compare(FloatImage(4, 4), FloatImage(4, 4), Image<uint8_t>(4, 4)), InputError);
}

TEST_CASE("comparison of two results") {
  FloatImage a(10, 10, 2.0f), b(10, 10, 2.0f);
  b.at(0, 0) = 2.0002f;  // within a quarter of a millimetre
  b.at(1, 0) = 2.0009f;  // neither
  b.at(2, 0) = 2.03f;    // off
  b.at(6, 0) = 2.004f;   // more than 1 mm, less than 5 mm
  a.at(3, 0) = a.at(4, 0) = b.at(4, 0) = b.at(5, 0) = kInf;
  const Comparison c = compare(a, b);
  CHECK(c.both == 97);
  CHECK(c.reference_holes == 2);
  CHECK(c.cells == 100);
  CHECK(c.within_quarter_mm == approx(100.0 * 94 / 97));
  CHECK(c.off_1mm == approx(100.0 * 2 / 97));
  CHECK(c.off_5mm == approx(100.0 / 97));
  CHECK(c.off_2cm == approx(100.0 / 97));
  CHECK(c.holes_gained == 1);
  CHECK(c.holes_lost == 1);
  CHECK(c.same_holes == approx(50));
  CHECK(c.same_coverage == approx(98));
  Image<uint8_t> one(10, 10);
  one.at(2, 0) = 1;
  CHECK(compare(a, b, one).off_2cm == 100);
}

TEST_CASE("uniqueness drops the cell behind another one on the same pixel") {
  const Rig rig = small_rig();
  FloatImage depth(64, 48, kInf);
  // Shifts 24/2/Z: 6 px at 2 m, 4 px at 3 m. Left: u=20 and u=22 both on pixel 26; right: u=20 and u=18 on 14.
  depth.at(20, 5) = 2.0f;
  depth.at(22, 5) = 3.0f;
  depth.at(18, 5) = 3.0f;
  depth.at(24, 5) = 3.0f;  // pixel 28 and 20: alone
  depth.at(22, 6) = 3.0f;  // another row
  DepthResult r = result_of(depth);
  CleanupOptions options;
  options.speckle = false;
  CHECK(clean_up(r, rig, options).uniqueness == 2);
  CHECK(r.mask.at(22, 5) == kMaskUniqueness);
  CHECK(r.mask.at(18, 5) == kMaskUniqueness);
  CHECK(std::isinf(r.depth.at(22, 5)));
  CHECK(r.mask.at(20, 5) == 0);
  CHECK(r.depth.at(20, 5) == 2.0f);
  CHECK(r.mask.at(24, 5) == 0);
  CHECK(r.mask.at(22, 6) == 0);

  DepthResult untouched = result_of(depth);
  options.uniqueness = false;
  CHECK(clean_up(untouched, rig, options).uniqueness == 0);
  CHECK(untouched.depth.data == depth.data);
}

TEST_CASE("uniqueness keeps what lies within its margin") {
  const Rig rig = small_rig();
  FloatImage depth(64, 48, kInf);
  depth.at(20, 5) = 2.0f;
  depth.at(21, 5) = 2.5f;  // left pixel 26 (20 + 6) and 26 (21 + 4.8 = 25.8)
  DepthResult wide = result_of(depth), narrow = result_of(depth);
  CleanupOptions options;
  options.speckle = false;
  options.uniqueness_m = 0.51;
  CHECK(clean_up(wide, rig, options).uniqueness == 0);
  options.uniqueness_m = 0.49;
  CHECK(clean_up(narrow, rig, options).uniqueness == 1);
}

TEST_CASE("the speckle filter drops small pieces and keeps large ones") {
  const Rig rig = small_rig();
  FloatImage depth(64, 48, kInf);
  for (int v = 10; v < 20; ++v) {
    for (int u = 10; u < 20; ++u) depth.at(u, v) = 2.0f;  // 100 cells
    for (int u = 30; u < 40; ++u) depth.at(u, v) = 2.0f;  // 99 cells
  }
  depth.at(30, 10) = kInf;
  depth.at(20, 20) = 2.0f;  // touches the first piece by a corner only
  DepthResult r = result_of(depth);
  CleanupOptions options;
  options.uniqueness = false;
  CHECK(clean_up(r, rig, options).speckle == 100);
  CHECK(r.mask.at(15, 15) == 0);
  CHECK(r.mask.at(35, 15) == kMaskSpeckle);
  CHECK(std::isinf(r.depth.at(35, 15)));
  CHECK(r.mask.at(20, 20) == kMaskSpeckle);
  CHECK(r.mask.at(30, 10) == 0);  // a hole before: not the filter's doing

  options.speckle_cells = 99;
  DepthResult kept = result_of(depth);
  CHECK(clean_up(kept, rig, options).speckle == 1);
  options.speckle = false;
  DepthResult off = result_of(depth);
  CHECK(clean_up(off, rig, options).speckle == 0);
}

TEST_CASE("a jump in depth separates pieces, a slope does not") {
  const Rig rig = small_rig();
  FloatImage depth(64, 48, 2.0f);
  // Disparity 12 px at 2 m: 1.9 m is 12.63, within a pixel; 1.8 m is 13.33, beyond.
  for (int u = 5; u < 10; ++u) depth.at(u, 5) = 1.9f;
  for (int u = 5; u < 10; ++u) depth.at(u, 10) = 1.8f;
  DepthResult r = result_of(depth);
  CleanupOptions options;
  options.uniqueness = false;
  CHECK(clean_up(r, rig, options).speckle == 5);
  CHECK(r.mask.at(5, 5) == 0);
  CHECK(r.mask.at(5, 10) == kMaskSpeckle);
}
