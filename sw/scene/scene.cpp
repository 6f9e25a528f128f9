// SPDX-License-Identifier: Apache-2.0
// Contract: scene.hpp.
#include "scene/scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "scene/noise.hpp"
#include "scene/terrain.hpp"

namespace psweep {
namespace {

using scene::Ray;
using scene::Terrain;

constexpr double kMast = 1.0, kBaseline = 0.20;
constexpr double kSinTilt = 0.62932039104983745, kCosTilt = 0.77714596145697088;  // 39 degrees

// Samples per pixel, across and down. More down: far ground is seen at 15 degrees, four times as long as wide.
constexpr int kAcross = 2, kDown = 4;
// Point spread of pixel and lens, in samples: a tent two pixels wide, so that the sampling is nearly alias-free.
constexpr std::array<float, 4> kSpreadAcross{1 / 8.0f, 3 / 8.0f, 3 / 8.0f, 1 / 8.0f};
constexpr std::array<float, 6> kSpreadDown{1 / 18.0f, 3 / 18.0f, 5 / 18.0f, 5 / 18.0f, 3 / 18.0f, 1 / 18.0f};

struct Look {
  float mean;        // grey value of level, fully lit sand
  float sand, rock;  // contrast of one octave of texture
  float noise;       // sensor: grey levels, standard deviation at the mean
};
constexpr Look kRockyLook{124, 0.070f, 0.085f, 1.2f};
constexpr Look kFlatLook{136, 0.050f, 0.070f, 1.2f};

// Ray of pixel coordinates (px,py) from an eye `shift` metres right of the cyclopean one; the parameter is depth Z.
Ray pixel_ray(const Camera& c, double shift, double px, double py) {
  const double xn = (px - c.cx) / c.fx, yn = (py - c.cy) / c.fy;
  return {shift, 0, kMast, xn, kCosTilt - yn * kSinTilt, -(kSinTilt + yn * kCosTilt)};
}

// Texture of the material at a point, mean 0: octaves from 30 cm down to the sand grain, each faded out before its
// wavelength reaches what the samples can carry. Three-dimensional, so that steep faces carry it too.
float texture(uint32_t seed, double x, double y, double h, double shortest) {
  double u = x, v = y, w = h;
  float sum = 0;
  double wave = 0.32;
  for (uint32_t octave = 0; wave > shortest && wave > 0.0006; ++octave, wave *= 0.5) {
    const float keep = static_cast<float>(std::min(1.0, wave / shortest - 1));
    // Grain and grit dominate, stains are faint: texture is even everywhere, near and far.
    const float gain = wave > 0.03 ? 0.3f : wave > 0.015 ? 1.0f : 1.6f;
    sum += keep * gain * scene::noise3(seed + octave, u / wave, v / wave, w / wave);
    const double turned = 0.8 * u - 0.6 * v;
    v = 0.6 * u + 0.8 * v;
    u = 0.8 * turned - 0.6 * w;
    w = 0.6 * turned + 0.8 * w;
  }
  return sum;
}

class Renderer {
 public:
  Renderer(const Terrain& terrain, SceneKind kind, uint32_t seed, const Rig& rig, int threads)
      : terrain_(terrain),
        look_(kind == SceneKind::kRocky ? kRockyLook : kFlatLook),
        seed_(seed),
        rig_(rig),
        threads_(threads) {}

  Gray image(const Camera& camera, double shift, uint32_t noise_seed, const std::function<void(double)>& progress) {
    const int cols = rig_.width * kAcross + 2, rows = rig_.height * kDown + 2;  // one sample of margin on each side
    FloatImage samples(cols, rows);
    scene::for_rows(
        rows, threads_,
        [&](int j) {
          for (int i = 0; i < cols; ++i) {
            const double px = (i - 1 + 0.5) / kAcross - 0.5, py = (j - 1 + 0.5) / kDown - 0.5;
            samples.at(i, j) = sample(pixel_ray(camera, shift, px, py), camera.fx);
          }
        },
        progress);
    Gray out(rig_.width, rig_.height);
    scene::for_rows(rig_.height, threads_, [&](int y) {
      for (int x = 0; x < rig_.width; ++x) {
        float grey = 0;
        for (size_t b = 0; b < kSpreadDown.size(); ++b) {
          const float* row = samples.row(y * kDown + static_cast<int>(b)) + x * kAcross;
          float line = 0;
          for (size_t a = 0; a < kSpreadAcross.size(); ++a) line += kSpreadAcross[a] * row[a];
          grey += kSpreadDown[b] * line;
        }
        // Shot noise grows with the root of the signal.
        const float sigma = look_.noise * std::sqrt(std::max(grey, 1.0f) / look_.mean);
        grey += sigma * scene::gaussian(noise_seed, x, y);
        out.at(x, y) = static_cast<uint8_t>(std::min(255.0f, std::max(0.0f, grey + 0.5f)));
      }
    });
    return out;
  }

  FloatImage truth() {
    FloatImage out(rig_.width, rig_.height);
    const Camera eye = rig_.cyclopean();
    scene::for_rows(rig_.height, threads_, [&](int y) {
      for (int x = 0; x < rig_.width; ++x) {
        const double z = terrain_.cast(pixel_ray(eye, 0, x, y));
        out.at(x, y) = z >= 0 ? static_cast<float>(z) : std::numeric_limits<float>::infinity();
      }
    });
    return out;
  }

 private:
  float sample(const Ray& ray, double f) const {
    const double z = terrain_.cast(ray);
    if (z < 0) return look_.mean;  // beyond the lattice: cannot happen with the rover's rig
    const double x = ray.x + z * ray.dx, y = ray.y + z * ray.dy, h = ray.h + z * ray.dh;
    const Terrain::Surface s = terrain_.surface(x, y);
    // Footprint: a pixel is z / f wide and, on level ground, longer by the slant.
    const double across = z / f;
    const double slant = -ray.dh / std::sqrt(ray.dx * ray.dx + ray.dy * ray.dy + ray.dh * ray.dh);
    const double along = across / std::max(slant, static_cast<double>(1 - s.steep));
    const double shortest = std::max(2.0 * across / kAcross, 2.0 * along / kDown);
    const float contrast = look_.sand + s.rock * (look_.rock - look_.sand);
    const float albedo = 1 + contrast * texture(seed_, x, y, h, shortest) / 0.27f * 0.5f;
    return look_.mean * s.radiance * std::max(0.1f, albedo);
  }

  const Terrain& terrain_;
  const Look& look_;
  uint32_t seed_;
  const Rig& rig_;
  int threads_;
};

}  // namespace

Rig rover_rig(int size) {
  Rig rig;
  const double f = 1200.0 * size / 1120.0, c = (size - 1) / 2.0;
  rig.left = rig.right = {f, f, c, c};
  rig.baseline = kBaseline;
  rig.width = rig.height = size;
  return rig;
}

Scene render(SceneKind kind, uint64_t seed, int size, int threads, const std::function<void(double)>& progress) {
  if (size < 16 || size > 4096) throw InputError("size: found " + std::to_string(size) + ", expected 16 .. 4096");
  if (threads < 1) throw InputError("threads: found " + std::to_string(threads) + ", expected at least 1");
  const auto part = [&](double from, double to) -> std::function<void(double)> {
    if (!progress) return {};
    return [&progress, from, to](double done) { progress(from + (to - from) * done); };
  };
  Scene out;
  out.rig = rover_rig(size);
  const Terrain terrain(kind, seed, 0.00125 * 1120 / size, threads, part(0, 0.3));
  scene::Random random(seed + 77);
  const uint32_t texture_seed = random.bits(), left_noise = random.bits(), right_noise = random.bits();
  Renderer renderer(terrain, kind, texture_seed, out.rig, threads);
  out.left = renderer.image(out.rig.left, -kBaseline / 2, left_noise, part(0.3, 0.64));
  out.right = renderer.image(out.rig.right, kBaseline / 2, right_noise, part(0.64, 0.98));
  out.truth = renderer.truth();
  if (progress) progress(1);
  return out;
}

}  // namespace psweep
