// SPDX-License-Identifier: Apache-2.0
// The scene generator: same bytes everywhere (checksums), independence of threads, geometry of rig and ground truth,
// and that both images show what the truth says.
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.hpp"
#include "scene/noise.hpp"
#include "scene/scene.hpp"
#include "scene/terrain.hpp"
#include "support/catch.hpp"

using namespace psweep;

namespace {

// FNV-1a.
uint64_t checksum(const void* data, size_t bytes) {
  const auto* p = static_cast<const uint8_t*>(data);
  uint64_t h = 0xcbf29ce484222325u;
  for (size_t i = 0; i < bytes; ++i) h = (h ^ p[i]) * 0x100000001b3u;
  return h;
}
uint64_t checksum(const Gray& image) { return checksum(image.data.data(), image.data.size()); }
uint64_t checksum(const FloatImage& image) { return checksum(image.data.data(), 4 * image.data.size()); }

double sample(const Gray& image, double x, double y) {
  const int xi = std::clamp(static_cast<int>(x), 0, image.width - 2);
  const int yi = std::clamp(static_cast<int>(y), 0, image.height - 2);
  const double fx = x - xi, fy = y - yi;
  return (1 - fy) * ((1 - fx) * image.at(xi, yi) + fx * image.at(xi + 1, yi)) +
         fy * ((1 - fx) * image.at(xi, yi + 1) + fx * image.at(xi + 1, yi + 1));
}

// Median difference in grey levels between both images at what the truth, scaled, says is the same point.
double disagreement(const Scene& s, double scale) {
  const Camera eye = s.rig.cyclopean();
  std::vector<double> all;
  for (int v = 0; v < s.rig.height; ++v) {
    for (int u = 0; u < s.rig.width; ++u) {
      const double shift = eye.fx * s.rig.baseline / 2 / (scale * s.truth.at(u, v));
      if (u - shift < 0 || u + shift > s.rig.width - 1) continue;
      all.push_back(std::abs(sample(s.left, u + shift, v) - sample(s.right, u - shift, v)));
    }
  }
  REQUIRE(all.size() > 1000);
  std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), all.end());
  return all[all.size() / 2];
}

}  // namespace

TEST_CASE("the same bytes for a seed on every machine") {
  struct Pinned {
    SceneKind kind;
    uint64_t seed, left, right, truth;
  };
  const Pinned pinned[] = {
      {SceneKind::kRocky, 1, 0xd1f1871d2bd5bc42u, 0x69902c528fef6b73u, 0x6d7d7c59cb007782u},
      {SceneKind::kFlat, 7, 0x41db84de10ebe436u, 0x95f7eb539d87760cu, 0xccc3bb982c0102ddu},
  };
  for (const auto& p : pinned) {
    const Scene s = render(p.kind, p.seed, 96);
    INFO(std::hex << "0x" << checksum(s.left) << ", 0x" << checksum(s.right) << ", 0x" << checksum(s.truth));
    CHECK(checksum(s.left) == p.left);
    CHECK(checksum(s.right) == p.right);
    CHECK(checksum(s.truth) == p.truth);
  }
}

TEST_CASE("threads change nothing, seeds and kinds do") {
  const Scene one = render(SceneKind::kRocky, 3, 64, 1);
  double last = 0;
  bool ascending = true;
  const Scene three = render(SceneKind::kRocky, 3, 64, 3, [&](double done) {
    ascending &= done >= last;
    last = done;
  });
  CHECK(one.left.data == three.left.data);
  CHECK(one.right.data == three.right.data);
  CHECK(one.truth.data == three.truth.data);
  CHECK(ascending);
  CHECK(last == 1);
  CHECK(render(SceneKind::kRocky, 4, 64).left.data != one.left.data);
  CHECK(render(SceneKind::kFlat, 3, 64).left.data != one.left.data);
  CHECK(one.left.data != one.right.data);
}

TEST_CASE("rig and depth range are the paper's") {
  const Rig full = rover_rig(1120);
  CHECK(full.width == 1120);
  CHECK(full.height == 1120);
  CHECK(full.left.fx == 1200);
  CHECK(full.right.fy == 1200);
  CHECK(full.left.cx == 559.5);
  CHECK(full.baseline == 0.20);
  const Scene s = render(SceneKind::kFlat, 2, 112);
  CHECK(s.rig.left.fx == approx(120));
  CHECK(s.rig.right.cy == 55.5);
  // Level ground 1 m below the eye, looked at 39 degrees down: Z = 1 / (sin 39 + y cos 39); hills stay within 12 %.
  size_t near = 0;
  for (int v = 0; v < 112; ++v) {
    const double level = 1 / (0.6293204 + (v - 55.5) / 120 * 0.7771460);
    for (int u = 0; u < 112; ++u) {
      REQUIRE(std::isfinite(s.truth.at(u, v)));
      near += std::abs(s.truth.at(u, v) / level - 1) < 0.12;
    }
  }
  CHECK(near > 112 * 112 * 98 / 100);
}

TEST_CASE("both images show what the truth says") {
  const SceneKind kind = GENERATE(SceneKind::kRocky, SceneKind::kFlat);
  const Scene s = render(kind, test_seed(), 280);
  const double right = disagreement(s, 1), near = disagreement(s, 0.95), far = disagreement(s, 1.05);
  INFO("median grey difference at the truth " << right << ", 5 % nearer " << near << ", farther " << far);
  CHECK(right < 3);
  CHECK(near > 1.3 * right);
  CHECK(far > 1.3 * right);
  // low contrast, but not flat
  double sum = 0, squares = 0;
  for (const uint8_t g : s.left.data) {
    sum += g;
    squares += static_cast<double>(g) * g;
  }
  const double n = static_cast<double>(s.left.data.size()), mean = sum / n;
  const double deviation = std::sqrt(squares / n - mean * mean);
  INFO("mean " << mean << " deviation " << deviation);
  CHECK((mean > 90 && mean < 160));
  CHECK((deviation > 6 && deviation < 30));
}

TEST_CASE("a ray stops at the first surface") {
  // Against small steps along the same rays: no earlier crossing, and the surface is met within a step.
  const scene::Terrain ground(SceneKind::kRocky, 5, 0.01, 1, {});
  scene::Random random(9);
  int checked = 0;
  for (int i = 0; i < 300; ++i) {
    const scene::Ray ray{random.uniform(-0.2, 0.2), 0, 1.0, random.uniform(-0.45, 0.45), random.uniform(0.55, 1.05),
                         -random.uniform(0.27, 0.9)};
    const double hit = ground.cast(ray);
    REQUIRE(hit > 0);
    // A ray straight down from high above meets the surface at its height: the second way to the same number.
    const auto surface = [&](double t) {
      const scene::Ray down{ray.x + t * ray.dx, ray.y + t * ray.dy, 10, 0, 0, -1};
      return 10 - ground.cast(down);
    };
    CHECK(ray.h + hit * ray.dh == approx(surface(hit)).margin(1e-6));
    for (double t = hit - 0.0005; t > hit - 0.3 && t > 0.4; t -= 0.0005) {
      if (ray.h + t * ray.dh < surface(t) - 1e-6) FAIL_CHECK("surface already met at " << t << ", cast says " << hit);
    }
    ++checked;
  }
  CHECK(checked == 300);
}

TEST_CASE("noise has the statistics it promises") {
  double sum = 0, squares = 0;
  for (int i = 0; i < 40000; ++i) {
    const double g = scene::gaussian(11, i % 200, i / 200);
    sum += g;
    squares += g * g;
  }
  CHECK(std::abs(sum / 40000) < 0.02);
  CHECK(squares / 40000 == approx(1).margin(0.03));
  for (int i = 0; i < 1000; ++i) {
    const double x = i * 0.37 - 90, y = i * 0.11 - 40;
    CHECK(std::abs(scene::noise2(3, x, y)) <= 1);
    CHECK(std::abs(scene::noise3(3, x, y, x - y)) <= 1);
    CHECK(std::abs(scene::noise2(3, x + 1e-4, y) - scene::noise2(3, x, y)) < 1e-3);  // continuous
  }
}

TEST_CASE("bad arguments are refused by name") {
  CHECK_THROWS_AS(render(SceneKind::kFlat, 1, 15), InputError);
  CHECK_THROWS_AS(render(SceneKind::kFlat, 1, 5000), InputError);
  CHECK_THROWS_AS(render(SceneKind::kFlat, 1, 64, 0), InputError);
}
