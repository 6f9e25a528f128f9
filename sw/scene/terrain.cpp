// SPDX-License-Identifier: Apache-2.0
// Contract: terrain.hpp. Lengths in metres throughout.
#include "scene/terrain.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <mutex>
#include <thread>

#include "scene/noise.hpp"

namespace psweep::scene {
namespace {

// Ground that the three eyes can see, with a margin for hills: the far image corner looks 1.9 m sideways at 4.4 m.
constexpr double kLeft = -2.5, kRight = 2.5, kNear = 0.2, kFar = 5.2;

// Towards the sun, unit length. High and hazy: on Mars dust scatters much of the light, so shadows are soft and weak.
constexpr double kSunX = -0.5883, kSunY = 0.3922, kSunH = 0.7071;
constexpr float kAmbient = 0.56f, kSun = 0.44f;

struct Kind {
  double relief;               // height of one octave of undulation per wavelength
  double grit;                 // the same for wavelengths under 6 cm
  double ripple;               // height of wind ripples
  double rocks_per_m2;         // rocks larger than kSmallest
  double largest;              // diameter of the largest rock
  double rock_tone, tone_var;  // brightness of rock against sand
};
constexpr double kSmallest = 0.005;  // diameter
// No rock higher than a wheel can climb lies within the rover's own length: it could not have come to stand there.
constexpr double kWheelRock = 0.14, kWheelReach = 1.0;
constexpr Kind kRockyKind{0.024, 0.040, 0.0, 520, 0.25, 0.98, 0.22};
constexpr Kind kFlatKind{0.014, 0.026, 0.0035, 210, 0.10, 0.98, 0.16};

struct Facet {
  double nx, ny, offset, slope;  // height over the centre = offset - slope * (nx * x + ny * y)
};

// Unit vector of uniform direction, without trigonometry.
void random_direction(Random& random, double& x, double& y) {
  for (;;) {
    x = random.uniform(-1, 1);
    y = random.uniform(-1, 1);
    const double r2 = x * x + y * y;
    if (r2 > 0.01 && r2 <= 1) {
      const double r = std::sqrt(r2);
      x /= r;
      y /= r;
      return;
    }
  }
}

// min(a,b) with the edge rounded over a width k.
double smooth_min(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * k * 0.25;
}

uint8_t to_byte(double x) { return static_cast<uint8_t>(std::min(255.0, std::max(0.0, x + 0.5))); }

// Mean over (2r+1)^2 nodes, borders repeated: two passes of running sums.
std::vector<float> box_mean(const std::vector<float>& in, int cols, int rows, int r, int threads) {
  std::vector<float> across(in.size()), out(in.size());
  const double scale = 1.0 / (2 * r + 1);
  for_rows(rows, threads, [&](int j) {
    const float* src = &in[static_cast<size_t>(j) * cols];
    float* dst = &across[static_cast<size_t>(j) * cols];
    double sum = 0;
    for (int i = -r; i <= r; ++i) sum += src[std::clamp(i, 0, cols - 1)];
    for (int i = 0; i < cols; ++i) {
      dst[i] = static_cast<float>(sum * scale);
      sum += src[std::min(i + r + 1, cols - 1)] - src[std::max(i - r, 0)];
    }
  });
  constexpr int kStrip = 64;
  for_rows((cols + kStrip - 1) / kStrip, threads, [&](int strip) {
    const int first = strip * kStrip, last = std::min(cols, first + kStrip);
    std::array<double, kStrip> sum{};
    const auto add = [&](int j, double sign) {
      const float* row = &across[static_cast<size_t>(std::clamp(j, 0, rows - 1)) * cols];
      for (int i = first; i < last; ++i) sum[i - first] += sign * row[i];
    };
    for (int j = -r; j <= r; ++j) add(j, 1);
    for (int j = 0; j < rows; ++j) {
      for (int i = first; i < last; ++i) {
        out[static_cast<size_t>(j) * cols + i] = static_cast<float>(sum[i - first] * scale);
      }
      add(j + r + 1, 1);
      add(j - r, -1);
    }
  });
  return out;
}

}  // namespace

void for_rows(int rows, int threads, const std::function<void(int)>& body,
              const std::function<void(double)>& progress) {
  std::atomic<int> next{0};
  std::mutex mutex;
  int done = 0;
  const auto work = [&] {
    for (int j = next++; j < rows; j = next++) {
      body(j);
      if (progress) {
        const std::lock_guard<std::mutex> lock(mutex);
        progress(static_cast<double>(++done) / rows);
      }
    }
  };
  std::vector<std::thread> workers;
  for (int i = 1; i < threads; ++i) workers.emplace_back(work);
  work();
  for (auto& worker : workers) worker.join();
}

Terrain::Terrain(SceneKind kind, uint64_t seed, double pitch, int threads, const std::function<void(double)>& progress)
    : pitch_(pitch), x0_(kLeft), y0_(kNear) {
  cols_ = static_cast<int>((kRight - kLeft) / pitch) + 1;
  rows_ = static_cast<int>((kFar - kNear) / pitch) + 1;
  const size_t nodes = static_cast<size_t>(cols_) * rows_;
  height_.resize(nodes);
  radiance_.resize(nodes);
  rock_.assign(nodes, 0);
  steep_.resize(nodes);
  tone_.assign(nodes, 128);
  Random random(seed * 2 + (kind == SceneKind::kRocky ? 1 : 0));
  build_ground(kind, random.bits(), threads);
  if (progress) progress(0.4);
  place_rocks(kind, seed);
  light(threads, progress);
  build_levels();
  if (progress) progress(1);
}

void Terrain::build_ground(SceneKind kind, uint32_t seed, int threads) {
  const Kind& k = kind == SceneKind::kRocky ? kRockyKind : kFlatKind;
  for_rows(rows_, threads, [&](int j) {
    const double y = y0_ + j * pitch_;
    float* row = &height_[static_cast<size_t>(j) * cols_];
    for (int i = 0; i < cols_; ++i) {
      const double x = x0_ + i * pitch_;
      double h = 0;
      uint32_t octave = 0;
      // Axes turned by 37 degrees from octave to octave, so that no lattice shows.
      double u = x, v = y;
      for (double wave = 2.4; wave > 3 * pitch_ && wave > 0.004; wave *= 0.5) {
        const double gain = wave < 0.06 ? k.grit : k.relief;
        h += gain * wave * noise2(seed + ++octave, u / wave, v / wave);
        const double turned = 0.8 * u - 0.6 * v;
        v = 0.6 * u + 0.8 * v;
        u = turned;
      }
      if (k.ripple > 0) {
        const double warp = 0.16 * noise2(seed + 101, x * 2.3, y * 2.3) + 0.03 * noise2(seed + 102, x * 9, y * 9);
        const double phase = (y + 0.35 * x + warp) / 0.085;
        const float p = static_cast<float>(phase - floor_int(phase));
        const float crest = p < 0.68f ? fade(p / 0.68f) : fade((1 - p) / 0.32f);
        const float patch = 0.5f + 0.5f * noise2(seed + 103, x * 1.1, y * 1.1);  // ripples come and go
        h += k.ripple * patch * crest;
      }
      row[i] = static_cast<float>(h);
    }
  });
}

void Terrain::place_rocks(SceneKind kind, uint64_t seed) {
  const Kind& k = kind == SceneKind::kRocky ? kRockyKind : kFlatKind;
  Random random(seed ^ 0x726f636b73ull);
  const std::vector<float> ground = height_;
  const int count = static_cast<int>(k.rocks_per_m2 * (kRight - kLeft) * (kFar - kNear));
  const std::array<double, 5> half_turn{0.72654, 0.57735, 0.48157, 0.41421, 0.36397};  // tan(pi / n), n = 5 .. 9
  for (int r = 0; r < count; ++r) {
    // Every rock draws the same amount from its own generator, so the lattice's pitch cannot change the others.
    Random own((static_cast<uint64_t>(random.bits()) << 32) | random.bits());
    const double x = own.uniform(kLeft, kRight), y = own.uniform(kNear, kFar);
    // Cumulative number ~ diameter^-2, cut off at the largest.
    const double least = (kSmallest / k.largest) * (kSmallest / k.largest);
    const double diameter = kSmallest / std::sqrt(own.uniform(least, 1));
    const double radius = diameter / 2;
    const uint32_t own_seed = own.bits();
    double cx, cy;
    random_direction(own, cx, cy);
    const double stretch = own.uniform(0.72, 1.0);
    const double tall = diameter * own.uniform(0.32, 0.62);
    const double tone = std::max(0.5, k.rock_tone + k.tone_var * own.uniform(-1, 1));
    const bool rounded = own.uniform() < 0.45;
    std::array<Facet, 12> facets;
    int n = 0;
    const size_t corners = own.bits() % half_turn.size();
    const double t = half_turn[corners];
    const double step_c = (1 - t * t) / (1 + t * t), step_s = 2 * t / (1 + t * t);
    double fx, fy;
    random_direction(own, fx, fy);
    for (size_t f = 0; f < corners + 5; ++f) {
      double jx, jy;
      random_direction(own, jx, jy);
      double nx = fx + 0.3 * jx, ny = fy + 0.3 * jy;
      const double length = std::sqrt(nx * nx + ny * ny);
      nx /= length;
      ny /= length;
      const double slope = own.uniform(0.7, 2.8);
      facets[n++] = {nx, ny, slope * radius * own.uniform(0.78, 1.0), slope};
      const double turned = step_c * fx - step_s * fy;
      fy = step_s * fx + step_c * fy;
      fx = turned;
    }
    for (int top = 0; top < 2; ++top) {
      double nx, ny;
      random_direction(own, nx, ny);
      facets[n++] = {nx, ny, tall * own.uniform(0.85, 1.15), own.uniform(0.05, 0.45)};
    }
    if (diameter < 2.5 * pitch_) continue;  // below the lattice
    if (diameter > kWheelRock && y < kWheelReach) continue;
    const int ci = static_cast<int>((x - x0_) / pitch_), cj = static_cast<int>((y - y0_) / pitch_);
    const double foot = ground[static_cast<size_t>(cj) * cols_ + ci] - tall * own.uniform(0.05, 0.3);
    const int reach = static_cast<int>(radius * 1.35 / pitch_) + 1;
    for (int j = std::max(0, cj - reach); j <= std::min(rows_ - 1, cj + reach); ++j) {
      for (int i = std::max(0, ci - reach); i <= std::min(cols_ - 1, ci + reach); ++i) {
        const double dx = x0_ + i * pitch_ - x, dy = y0_ + j * pitch_ - y;
        const double a = cx * dx + cy * dy, b = (cx * dy - cy * dx) / stretch;
        double h;
        if (rounded) {
          // A lumpy dome with one broken side and a worn top.
          const double lump = 1 + 0.45 * noise2(own_seed + 9, a / diameter * 2.2, b / diameter * 2.2);
          const double q = (a * a + b * b) / (radius * radius) * lump;
          if (q >= 1.2) continue;
          h = tall * (q < 1 ? std::sqrt(1 - q * q) : -4 * (q - 1));
          for (const int f : {0, 2, n - 1}) {
            h = smooth_min(h, facets[f].offset - facets[f].slope * (facets[f].nx * a + facets[f].ny * b),
                           0.12 * diameter);
          }
        } else {
          h = facets[0].offset - facets[0].slope * (facets[0].nx * a + facets[0].ny * b);
          for (int f = 1; f < n; ++f) {
            h = smooth_min(h, facets[f].offset - facets[f].slope * (facets[f].nx * a + facets[f].ny * b),
                           0.06 * diameter);
          }
          if (h < -tall) continue;
        }
        // Weathered surface: three octaves of displacement relative to the rock's size.
        double wave = diameter * 0.45, gain = 0.13;
        for (uint32_t o = 0; o < 4 && wave > 3 * pitch_; ++o, wave *= 0.45) {
          h += gain * wave * noise2(own_seed + o, dx / wave, dy / wave);
        }
        const size_t at = static_cast<size_t>(j) * cols_ + i;
        const double surface = foot + h;
        if (surface > height_[at]) {
          height_[at] = static_cast<float>(surface);
          rock_[at] = 255;
          tone_[at] = to_byte(128 * tone);
        } else if (rock_[at] == 0 && surface > height_[at] - 0.08 * diameter) {
          // Sand blown against the foot: a shallow skirt rounds the crease.
          const double over = 1 - (height_[at] - surface) / (0.08 * diameter);
          height_[at] += static_cast<float>(0.02 * diameter * over * over);
        }
      }
    }
  }
}

void Terrain::light(int threads, const std::function<void(double)>& progress) {
  constexpr std::array<double, 3> kRadii{0.008, 0.03, 0.11};
  std::vector<float> sky(height_.size(), 0.0f);  // how far a node lies below its surroundings, relative to their size
  for (size_t s = 0; s < kRadii.size(); ++s) {
    const int r = static_cast<int>(kRadii[s] / pitch_);
    if (r < 1) continue;
    const std::vector<float> mean = box_mean(height_, cols_, rows_, r, threads);
    const float scale = static_cast<float>(1 / kRadii[s]);
    for (size_t i = 0; i < sky.size(); ++i) sky[i] += std::max(0.0f, mean[i] - height_[i]) * scale;
    if (progress) progress(0.5 + 0.1 * static_cast<double>(s));
  }
  const double rise = kSunH / std::sqrt(kSunX * kSunX + kSunY * kSunY);
  const double toward_x = kSunX / std::sqrt(kSunX * kSunX + kSunY * kSunY);
  const double toward_y = kSunY / std::sqrt(kSunX * kSunX + kSunY * kSunY);
  constexpr double kPenumbra = 0.5;  // slope over which a shadow fades in: a hazy sun
  const float level = kAmbient + kSun * static_cast<float>(kSunH);
  for_rows(rows_, threads, [&](int j) {
    const int above = std::max(j - 1, 0), below = std::min(j + 1, rows_ - 1);
    for (int i = 0; i < cols_; ++i) {
      const int before = std::max(i - 1, 0), after = std::min(i + 1, cols_ - 1);
      const double gx = (height(after, j) - height(before, j)) / ((after - before) * pitch_);
      const double gy = (height(i, below) - height(i, above)) / ((below - above) * pitch_);
      const double nh = 1 / std::sqrt(1 + gx * gx + gy * gy);
      const double cosine = std::max(0.0, nh * (kSunH - gx * kSunX - gy * kSunY));
      const double here = height(i, j);
      double lit = 1;
      for (double d = 3 * pitch_; d < 0.5 && lit > 0; d *= 1.5) {
        const int si = i + floor_int(toward_x * d / pitch_ + 0.5), sj = j + floor_int(toward_y * d / pitch_ + 0.5);
        if (si < 0 || sj < 0 || si >= cols_ || sj >= rows_) break;
        const double excess = ((height(si, sj) - here) / d - rise) / kPenumbra;
        lit = std::min(lit, std::max(0.0, 0.5 - excess));
      }
      const size_t at = static_cast<size_t>(j) * cols_ + i;
      const float open = 1 / (1 + 1.1f * sky[at]);
      // Dust lies where a face is nearly level, and has the brightness of sand.
      const float dust = 0.6f * fade(std::min(1.0f, std::max(0.0f, static_cast<float>(nh - 0.75) * 5.0f)));
      const float tone = lerp(tone_[at] * (1.0f / 128.0f), 1.0f, dust);
      const float light =
          kAmbient * static_cast<float>(0.5 + 0.5 * nh) * open + kSun * static_cast<float>(cosine * std::min(1.0, lit));
      radiance_[at] = light / level * tone;
      steep_[at] = to_byte(255 * nh);
    }
  });
}

void Terrain::build_levels() {
  top_ = *std::max_element(height_.begin(), height_.end());
  for (const int shift : {2, 4, 6}) {
    Level level;
    level.shift = shift;
    const int size = 1 << shift;
    level.cols = (cols_ - 1 + size - 1) / size;
    level.rows = (rows_ - 1 + size - 1) / size;
    level.max.resize(static_cast<size_t>(level.cols) * level.rows);
    for (int j = 0; j < level.rows; ++j) {
      for (int i = 0; i < level.cols; ++i) {
        float best = -1e9f;
        for (int y = j * size; y <= std::min((j + 1) * size, rows_ - 1); ++y) {
          for (int x = i * size; x <= std::min((i + 1) * size, cols_ - 1); ++x) best = std::max(best, height(x, y));
        }
        level.max[static_cast<size_t>(j) * level.cols + i] = best;
      }
    }
    levels_.push_back(std::move(level));
  }
}

double Terrain::cast(const Ray& ray) const {
  // Lattice coordinates; the parameter stays that of the ray.
  const double ox = (ray.x - x0_) / pitch_, oy = (ray.y - y0_) / pitch_;
  const double dx = ray.dx / pitch_, dy = ray.dy / pitch_;
  double t = std::max(0.0, (top_ - ray.h) / ray.dh);
  const auto exit = [&](int i, int j, int size) {
    const double tx = dx > 0 ? ((i + 1) * size - ox) / dx : dx < 0 ? (i * size - ox) / dx : 1e30;
    const double ty = dy > 0 ? ((j + 1) * size - oy) / dy : dy < 0 ? (j * size - oy) / dy : 1e30;
    return std::min(tx, ty);
  };
  constexpr double kNudge = 1e-9;  // past a cell border; a nanometre of surface may be missed
  int level = 2;
  for (;;) {
    const double x = ox + (t + kNudge) * dx, y = oy + (t + kNudge) * dy;
    if (!(x >= 0 && y >= 0 && x < cols_ - 1 && y < rows_ - 1)) return -1;
    const int xi = static_cast<int>(x), yi = static_cast<int>(y);
    if (level >= 0) {
      const Level& l = levels_[level];
      const int i = xi >> l.shift, j = yi >> l.shift;
      const double end = std::max(exit(i, j, 1 << l.shift), t + kNudge);
      if (ray.h + end * ray.dh > l.max[static_cast<size_t>(j) * l.cols + i]) {
        t = end;
        if (level < 2) ++level;
      } else {
        --level;
      }
      continue;
    }
    // One cell: height along the ray is quadratic, so three values give it exactly.
    const double end = std::max(exit(xi, yi, 1), t + kNudge);
    const double h00 = height(xi, yi), h10 = height(xi + 1, yi) - h00, h01 = height(xi, yi + 1) - h00;
    const double h11 = height(xi + 1, yi + 1) - h00 - h10 - h01;
    const auto gap = [&](double s) {  // ray over surface
      const double u = ox + s * dx - xi, v = oy + s * dy - yi;
      return ray.h + s * ray.dh - (h00 + h10 * u + h01 * v + h11 * u * v);
    };
    const double f0 = gap(t), f2 = gap(end);
    if (f0 <= 0) return t;
    const double f1 = gap((t + end) / 2);
    // f(s) = f0 + b s + a s^2, s = 0 .. 1 over the cell
    const double a = 2 * (f0 + f2 - 2 * f1), b = f2 - f0 - a;
    const double disc = b * b - 4 * a * f0;
    if (disc >= 0) {
      const double root = 2 * f0 / (-b + std::sqrt(disc));  // the smaller positive root, without cancellation
      if (-b + std::sqrt(disc) > 0 && root <= 1) return t + root * (end - t);
    }
    if (f2 <= 0) return end;
    t = end;
    level = 0;
  }
}

Terrain::Surface Terrain::surface(double x, double y) const {
  const double u = std::min(std::max((x - x0_) / pitch_, 0.0), cols_ - 1.001);
  const double v = std::min(std::max((y - y0_) / pitch_, 0.0), rows_ - 1.001);
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const float fu = static_cast<float>(u - i), fv = static_cast<float>(v - j);
  const size_t at = static_cast<size_t>(j) * cols_ + i;
  const auto blend = [&](const auto& grid) {
    const float a = lerp(static_cast<float>(grid[at]), static_cast<float>(grid[at + 1]), fu);
    const float b = lerp(static_cast<float>(grid[at + cols_]), static_cast<float>(grid[at + cols_ + 1]), fu);
    return lerp(a, b, fv);
  };
  return {blend(radiance_), blend(rock_) * (1.0f / 255.0f), blend(steep_) * (1.0f / 255.0f)};
}

}  // namespace psweep::scene
