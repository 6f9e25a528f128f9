// SPDX-License-Identifier: Apache-2.0
// The float engine: known planes are found to a fraction of a plane step, mask reasons, quantisation, winner rules,
// agreement with a slow literal implementation of equation 1, and independence of threads.
#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "core/error.hpp"
#include "reference/reference.hpp"
#include "support/catch.hpp"

using namespace psweep;

namespace {

constexpr int kW = 96, kH = 60, kM = 7;
const PlaneSpacing kSpacing{41, 1.0, 2.0};

Rig test_rig() {
  Rig rig;
  rig.left = rig.right = {100, 100, 47.5, 29.5};
  rig.baseline = 0.2;
  rig.width = kW;
  rig.height = kH;
  return rig;
}

// Smooth random texture, a function of real coordinates.
double texture(double x, double y) {
  return 128 + 40 * std::sin(0.9 * x + 0.3 * y) + 30 * std::sin(0.5 * y - 1.1 * x + 1) +
         25 * std::sin(0.8 * y + 0.23 * x) * std::cos(0.37 * x);
}

// Pair showing a fronto-parallel plane at depth z that carries the texture.
void plane_pair(const Rig& rig, double z, Gray& left, Gray& right) {
  const Camera eye = rig.cyclopean();
  left = right = Gray(rig.width, rig.height);
  for (const bool is_left : {true, false}) {
    const Camera& c = is_left ? rig.left : rig.right;
    const double half = is_left ? rig.baseline / 2 : -rig.baseline / 2;
    for (int y = 0; y < rig.height; ++y) {
      for (int x = 0; x < rig.width; ++x) {
        const double u = (x - c.cx - c.fx * half / z) / c.fx * eye.fx + eye.cx, v = (y - c.cy) / c.fy * eye.fy + eye.cy;
        (is_left ? left : right).at(x, y) = static_cast<uint8_t>(std::lround(texture(u, v)));
      }
    }
  }
}

struct Statistics {
  int found = 0;
  double worst = 0;  // plane steps
};
Statistics against(const DepthResult& r, double position) {
  Statistics s;
  for (size_t i = 0; i < r.depth.data.size(); ++i) {
    // Nearer the sides the window can be outside at the true plane and inside at others.
    const int u = static_cast<int>(i) % kW;
    if (u < 15 || u >= kW - 15 || r.mask.data[i] != 0) continue;
    ++s.found;
    s.worst = std::max(s.worst, std::abs(r.position.data[i] - position));
  }
  return s;
}

// V of one cell at one plane, straight from equation 1; nothing if the window leaves an image.
std::optional<double> literal_mncc(const Gray& left, const Gray& right, const Rig& rig, double z, int u, int v) {
  const Camera eye = rig.cyclopean();
  double sl = 0, sr = 0, sll = 0, srr = 0, slr = 0;
  const int half = kM / 2;
  for (int j = -half; j <= half; ++j) {
    for (int i = -half; i <= half; ++i) {
      double sample[2];
      for (const int side : {0, 1}) {
        const Camera& c = side ? rig.right : rig.left;
        const double b = side ? -rig.baseline / 2 : rig.baseline / 2;
        const double x = (u + i - eye.cx) / eye.fx * c.fx + c.fx * b / z + c.cx;
        const double y = (v + j - eye.cy) / eye.fy * c.fy + c.cy;
        if (x < 0 || y < 0 || x > rig.width - 1 || y > rig.height - 1) return std::nullopt;
        const Gray& image = side ? right : left;
        const int xi = std::min(static_cast<int>(x), rig.width - 2), yi = std::min(static_cast<int>(y), rig.height - 2);
        const double fx = x - xi, fy = y - yi;
        sample[side] = (1 - fy) * ((1 - fx) * image.at(xi, yi) + fx * image.at(xi + 1, yi)) +
                       fy * ((1 - fx) * image.at(xi, yi + 1) + fx * image.at(xi + 1, yi + 1));
      }
      sl += sample[0];
      sr += sample[1];
      sll += sample[0] * sample[0];
      srr += sample[1] * sample[1];
      slr += sample[0] * sample[1];
    }
  }
  const double n = kM * kM;
  const double den = n * sll - sl * sl + n * srr - sr * sr;
  if (den <= 1e-3) return 0.0;
  return std::max(0.0, 2 * (n * slr - sl * sr) / den);
}

Gray random_image(uint32_t seed) {
  std::mt19937 random(seed);
  Gray g(kW, kH);
  for (auto& p : g.data) p = static_cast<uint8_t>(random());
  return g;
}

}  // namespace

TEST_CASE("a plane on and between sweep planes is found at its position") {
  Rig rig = test_rig();
  SECTION("equal cameras") {}
  SECTION("unequal focal lengths, principal points and a row offset") { rig.right = {103, 98, 49.1, 31.2}; }
  for (const double position : {10.0, 20.0, 20.37, 25.5}) {
    Gray left, right;
    plane_pair(rig, kSpacing.depth(position), left, right);
    const DepthResult r = run_float(left, right, rig, kSpacing, kM, 0.85);
    const Statistics s = against(r, position);
    INFO("position " << position << " found " << s.found << " worst " << s.worst);
    CHECK(s.found > kW * kH / 2);
    CHECK(s.worst < 0.3);
    CHECK(r.depth.at(48, 30) == approx(kSpacing.depth(r.position.at(48, 30))));
  }
}

TEST_CASE("every winner is the one of a literal implementation") {
  Rig rig = test_rig();
  rig.right = {101, 99, 48.2, 30.1};
  const Gray left = random_image(test_seed()), right = random_image(test_seed() + 1);
  const DepthResult r = run_float(left, right, rig, kSpacing, kM, 0.1);
  int winners = 0, outside = 0;
  for (int v = 0; v < kH; v += 3) {
    for (int u = 0; u < kW; u += 3) {
      double best = 0;
      int plane = -1;
      std::vector<std::optional<double>> all(kSpacing.planes);
      bool inside = false;
      for (int k = 0; k < kSpacing.planes; ++k) {
        all[k] = literal_mncc(left, right, rig, kSpacing.depth(k), u, v);
        inside |= all[k].has_value();
        if (all[k] && *all[k] > best) {
          best = *all[k];
          plane = k;
        }
      }
      INFO("cell " << u << "," << v << " seed " << test_seed());
      if (!inside) {
        CHECK(r.mask.at(u, v) == kMaskOutside);
        ++outside;
        continue;
      }
      if (plane < 0) {
        CHECK(std::isnan(r.position.at(u, v)));
        continue;
      }
      ++winners;
      CHECK(r.mncc.at(u, v) == approx(best).margin(1e-5));
      const bool local = plane > 0 && plane + 1 < kSpacing.planes && all[plane - 1] && all[plane + 1];
      CHECK(((r.mask.at(u, v) & kMaskNotLocal) == 0) == local);
      CHECK(((r.mask.at(u, v) & kMaskBelow) != 0) == (best < 0.1));
      double position = plane;
      if (local) {
        const double a = best - *all[plane - 1], c = best - *all[plane + 1];
        position += (a - c) / (2 * (a + c));
      }
      CHECK(r.position.at(u, v) == approx(position).margin(2e-3));
    }
  }
  CHECK(winners > 100);
  CHECK(outside > 10);
}

TEST_CASE("mask reasons") {
  const Rig rig = test_rig();
  SECTION("constant images have no variance, borders are outside") {
    const DepthResult r = run_float(Gray(kW, kH, 90), Gray(kW, kH, 140), rig, kSpacing, kM, 0.85);
    CHECK(r.mask.at(48, 30) == kMaskNoVariance);
    CHECK(r.mask.at(48, 2) == kMaskOutside);
    CHECK(r.mask.at(48, 3) == kMaskNoVariance);
    CHECK(r.mask.at(4, 30) == kMaskOutside);
    CHECK(std::isinf(r.depth.at(48, 30)));
    CHECK(std::isnan(r.position.at(48, 30)));
  }
  SECTION("saturated images have no variance, too") {
    const DepthResult r = run_float(Gray(kW, kH, 255), Gray(kW, kH, 255), rig, kSpacing, kM, 0.85);
    CHECK(r.mask.at(48, 30) == kMaskNoVariance);
  }
  SECTION("unrelated images stay below the threshold") {
    const DepthResult r = run_float(random_image(3), random_image(4), rig, kSpacing, kM, 0.85);
    CHECK((r.mask.at(48, 30) & kMaskBelow) != 0);
    CHECK(against(r, 0).found == 0);
  }
  SECTION("a plane nearer than the first is not a local maximum") {
    Gray left, right;
    plane_pair(rig, 0.98, left, right);
    const DepthResult r = run_float(left, right, rig, kSpacing, kM, 0.0);
    CHECK(r.mask.at(48, 30) == kMaskNotLocal);
    CHECK(r.position.at(48, 30) == 0);
  }
}

TEST_CASE("results do not depend on the number of threads, nor on earlier calls") {
  const Rig rig = test_rig();
  const Gray left = random_image(5), right = random_image(6);
  const DepthResult one = run_float(left, right, rig, kSpacing, kM, 0.2);
  double last = 0;
  const DepthResult three =
      run_float(left, right, rig, kSpacing, kM, 0.2, {}, 3, [&](double done) { last = std::max(last, done); });
  CHECK(one.depth.data == three.depth.data);
  CHECK(one.mncc.data == three.mncc.data);
  CHECK(one.mask.data == three.mask.data);
  CHECK(last == 1);
}

TEST_CASE("quantised MNCC and parabola are cut to their bits") {
  const Rig rig = test_rig();
  Gray left, right;
  plane_pair(rig, kSpacing.depth(20.37), left, right);
  FloatOptions o;
  o.mncc_bits = 6;
  o.frac_bits = 3;
  const DepthResult plain = run_float(left, right, rig, kSpacing, kM, 0.5);
  const DepthResult cut = run_float(left, right, rig, kSpacing, kM, 0.5, o);
  int checked = 0, differ = 0;
  for (size_t i = 0; i < cut.depth.data.size(); ++i) {
    if (cut.mask.data[i] != 0) continue;
    ++checked;
    const double v = cut.mncc.data[i] * 64.0, offset = (cut.position.data[i] - std::floor(cut.position.data[i])) * 16;
    CHECK(v == std::floor(v));
    CHECK(std::abs(offset - std::round(offset)) < 1e-4);  // odd sixteenths: middles of eighths
    CHECK(static_cast<int>(std::lround(offset)) % 2 == 1);
    differ += plain.position.data[i] != cut.position.data[i];
  }
  CHECK(checked > 500);
  CHECK(differ > 500);
}

TEST_CASE("the best of all local maxima wins where the global best is none") {
  const Rig rig = test_rig();
  // The best match is in front of the first plane for half the texture's energy; random images have many maxima.
  const Gray left = random_image(7), right = random_image(8);
  FloatOptions o;
  o.rule = WinnerRule::kBestLocal;
  const DepthResult global = run_float(left, right, rig, kSpacing, kM, 0.0);
  const DepthResult local = run_float(left, right, rig, kSpacing, kM, 0.0, o);
  int same = 0, filled = 0;
  for (size_t i = 0; i < global.mask.data.size(); ++i) {
    if (global.mask.data[i] == 0) {
      ++same;
      CHECK(local.position.data[i] == global.position.data[i]);
      CHECK(local.mask.data[i] == 0);
    } else if (local.mask.data[i] == 0) {
      ++filled;
      CHECK(local.mncc.data[i] <= global.mncc.data[i]);
    }
  }
  CHECK(same > 100);
  CHECK(filled > 10);
}

TEST_CASE("bad arguments are refused by name") {
  const Rig rig = test_rig();
  const Gray g(kW, kH);
  CHECK_THROWS_AS(run_float(Gray(kW - 1, kH), g, rig, kSpacing, kM, 0.85), InputError);
  CHECK_THROWS_AS(run_float(g, Gray(kW, kH + 1), rig, kSpacing, kM, 0.85), InputError);
  CHECK_THROWS_AS(run_float(g, g, rig, kSpacing, 6, 0.85), InputError);
  CHECK_THROWS_AS(run_float(g, g, rig, kSpacing, kM, 1.5), InputError);
  CHECK_THROWS_AS(run_float(g, g, rig, PlaneSpacing{0, 1, 2}, kM, 0.85), InputError);
  CHECK_THROWS_AS(run_float(g, g, rig, PlaneSpacing{5, 2, 1}, kM, 0.85), InputError);
  CHECK_THROWS_AS(run_float(g, g, rig, kSpacing, kM, 0.85, {}, 0), InputError);
}
