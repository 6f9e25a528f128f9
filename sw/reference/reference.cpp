// SPDX-License-Identifier: Apache-2.0
// Contract: reference.hpp. The map is cut into bands of rows of fixed height; a band sweeps all planes while its state
// stays in the cache. Window sums run down the columns and along the rows in double precision.
#include "reference/reference.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/error.hpp"

namespace psweep {
namespace {

constexpr int kBandRows = 48;
constexpr double kEdge = 1e-9;      // positions this far outside count as on the border: rounding of the projection
constexpr double kConstant = 1e-6;  // variance of both windows, grey levels squared, below which they are constant
constexpr float kInvalid = -1.0f;   // V of a cell that is not inside at this plane

void require(bool ok, const std::string& message) {
  if (!ok) throw InputError(message);
}

// Sampling positions along one axis: floor, fraction, and whether inside the image.
struct Axis {
  std::vector<int> at;
  std::vector<float> frac;
  int lo = 0, hi = 0;  // samples inside: lo <= s < hi

  // Sample s lies at start + s * step.
  Axis(int samples, double start, double step, int size) : at(samples), frac(samples), lo(samples) {
    for (int s = 0; s < samples; ++s) {
      const double x = start + s * step;
      if (x < -kEdge || x > size - 1 + kEdge) continue;
      lo = std::min(lo, s);
      hi = s + 1;
      const double inside = std::min(std::max(x, 0.0), size - 1.0);
      at[s] = std::min(static_cast<int>(inside), std::max(size - 2, 0));
      frac[s] = static_cast<float>(inside - at[s]);
    }
  }
};

// State of one map cell along the planes.
struct Cell {
  float best = 0;             // V of the winner, 0: none yet
  float before = 0;           // V of the last plane seen, 0 where invalid
  float before2 = 0;          // and the one before that
  float offset = 0;           // of the parabola, -0.5 .. 0.5
  int16_t plane = -1;         // of the winner
  bool before_valid = false;  // the last plane was inside
  bool before2_valid = false;
  bool local = false;  // the winner is a local maximum
  bool inside = false, textured = false;
};

struct Job {
  const Rig& rig;
  const PlaneSpacing& spacing;
  int window;
  double threshold;
  const FloatOptions& options;
  const FloatImage& left;  // resampled to the map's rows
  const FloatImage& right;
  const Axis& left_rows;
  const Axis& right_rows;
};

class Band {
 public:
  Band(const Job& job, int first, int rows) : job_(job), first_(first), rows_(rows), cols_(job.rig.width) {
    cells_.resize(static_cast<size_t>(rows) * cols_);
    v_.resize(cols_);
    textured_.resize(cols_);
    ring_p_.resize(static_cast<size_t>(job.window) * cols_);
    ring_q_ = ring_p_;
    for (auto& s : sums_) s.resize(cols_);
  }

  void sweep(int plane) {
    const Rig& rig = job_.rig;
    const double z = job_.spacing.depth(plane);
    const Camera eye = rig.cyclopean();
    const auto axis = [&](const Camera& c, double half_baseline) {
      return Axis(cols_, c.cx + c.fx * half_baseline / z - c.fx / eye.fx * eye.cx, c.fx / eye.fx, rig.width);
    };
    const Axis left = axis(rig.left, rig.baseline / 2), right = axis(rig.right, -rig.baseline / 2);
    const int half = job_.window / 2;
    // Samples inside both images; map rows likewise.
    lo_ = std::max(left.lo, right.lo);
    hi_ = std::min(left.hi, right.hi);
    const int row_lo = std::max({0, job_.left_rows.lo, job_.right_rows.lo});
    const int row_hi = std::min({rig.height, job_.left_rows.hi, job_.right_rows.hi});
    const bool any = hi_ - lo_ >= job_.window;
    for (auto& s : sums_) std::fill(s.begin(), s.end(), 0.0);
    int loaded = 0;  // rows in the column sums
    for (int row = first_ - half; row < first_ + rows_ + half; ++row) {
      const bool usable = any && row >= row_lo && row < row_hi;
      if (usable) {
        push_row(left, right, row, loaded >= job_.window);
        ++loaded;
      } else {
        loaded = 0;
        for (auto& s : sums_) std::fill(s.begin(), s.end(), 0.0);
      }
      const int centre = row - half;
      if (centre < first_) continue;
      if (loaded >= job_.window) {
        similarities();
      } else {
        std::fill(v_.begin(), v_.end(), kInvalid);
      }
      update_row(plane, centre);
    }
  }

  void finish(DepthResult& out) {
    for (int j = 0; j < rows_; ++j) {
      for (int u = 0; u < cols_; ++u) {
        const Cell& c = cells_[static_cast<size_t>(j) * cols_ + u];
        const int v = first_ + j;
        uint8_t& mask = out.mask.at(u, v);
        mask = 0;
        if (!c.inside) {
          mask = kMaskOutside;
        } else if (!c.textured) {
          mask = kMaskNoVariance;
        } else {
          if (c.best < job_.threshold) mask |= kMaskBelow;
          if (!c.local) mask |= kMaskNotLocal;
        }
        if (c.plane < 0) continue;
        const double position = c.plane + (c.local ? c.offset : 0.0f);
        out.position.at(u, v) = static_cast<float>(position);
        out.mncc.at(u, v) = c.best;
        if (mask == 0) out.depth.at(u, v) = static_cast<float>(job_.spacing.depth(position));
      }
    }
  }

 private:
  // Row `row` of both projected images enters the column sums; the one `window` rows above leaves them.
  void push_row(const Axis& left, const Axis& right, int row, bool full) {
    const float* l = job_.left.row(row);
    const float* r = job_.right.row(row);
    const size_t slot = static_cast<size_t>((row + job_.window) % job_.window) * cols_;
    float* const p_ring = &ring_p_[slot];
    float* const q_ring = &ring_q_[slot];
    double* const sp = sums_[0].data();
    double* const sp2 = sums_[1].data();
    double* const sq = sums_[2].data();
    double* const sq2 = sums_[3].data();
    if (full) {
      for (int s = lo_; s < hi_; ++s) {
        const double p = p_ring[s], q = q_ring[s];
        sp[s] -= p;
        sp2[s] -= p * p;
        sq[s] -= q;
        sq2[s] -= q * q;
      }
    }
    for (int s = lo_; s < hi_; ++s) {
      const int a = left.at[s], b = right.at[s];
      const float lv = l[a] + left.frac[s] * (l[a + 1] - l[a]);
      const float rv = r[b] + right.frac[s] * (r[b + 1] - r[b]);
      p_ring[s] = lv + rv;
      q_ring[s] = lv - rv;
    }
    for (int s = lo_; s < hi_; ++s) {
      const double p = p_ring[s], q = q_ring[s];
      sp[s] += p;
      sp2[s] += p * p;
      sq[s] += q;
      sq2[s] += q * q;
    }
  }

  // MNCC = (A - B) / (A + B) with A = n S(p^2) - (S p)^2, B = n S(q^2) - (S q)^2, p = l + r, q = l - r: equation 1.
  void similarities() {
    const int window = job_.window, half = window / 2;
    const double n = static_cast<double>(window) * window;
    std::fill(v_.begin(), v_.end(), kInvalid);
    double p = 0, p2 = 0, q = 0, q2 = 0;
    for (int s = lo_; s < hi_; ++s) {
      p += sums_[0][s];
      p2 += sums_[1][s];
      q += sums_[2][s];
      q2 += sums_[3][s];
      const int u = s - half;
      if (s - lo_ < window - 1) continue;
      const double a = n * p2 - p * p, b = n * q2 - q * q;
      const double num = a - b, den = a + b;  // den: 4 n^2 times the mean of both variances
      const bool textured = den > 4 * n * n * kConstant;
      textured_[u] = textured;
      v_[u] = textured && num > 0 ? quantise(num / den) : 0.0f;
      const int old = s - window + 1;
      p -= sums_[0][old];
      p2 -= sums_[1][old];
      q -= sums_[2][old];
      q2 -= sums_[3][old];
    }
  }

  float quantise(double v) const {
    const int bits = job_.options.mncc_bits;
    if (bits == 0) return static_cast<float>(std::min(v, 1.0));
    const double full = static_cast<double>(1 << bits);
    return static_cast<float>(std::min(std::floor(v * full), full - 1) / full);
  }

  // Peak of the parabola through three values, best > before, best >= after.
  float parabola(float before, float best, float after) const {
    const double a = static_cast<double>(best) - before, c = static_cast<double>(best) - after;
    double share = a / (a + c);
    if (job_.options.mncc_bits > 0) {
      const double full = static_cast<double>(1 << job_.options.frac_bits);
      share = (std::min(std::floor(share * full), full - 1) + 0.5) / full;
    }
    return static_cast<float>(share - 0.5);
  }

  void update_row(int plane, int row) {
    Cell* cells = &cells_[static_cast<size_t>(row - first_) * cols_];
    const bool best_local = job_.options.rule == WinnerRule::kBestLocal;
    for (int u = 0; u < cols_; ++u) {
      Cell& c = cells[u];
      const bool valid = v_[u] >= 0;
      const float v = valid ? v_[u] : 0;
      if (valid) {
        c.inside = true;
        c.textured |= textured_[u] != 0;
      }
      if (best_local) {
        // The plane before is a candidate if it beats its predecessor strictly and its successor weakly.
        if (valid && c.before_valid && c.before2_valid && c.before > c.before2 && c.before >= v && c.before > c.best) {
          c.best = c.before;
          c.plane = static_cast<int16_t>(plane - 1);
          c.offset = parabola(c.before2, c.before, v);
          c.local = true;
        }
      } else {
        if (c.plane >= 0 && c.plane == plane - 1 && !(valid && v > c.best)) {
          c.local = valid && c.before2_valid;
          c.offset = parabola(c.before2, c.best, v);
        }
        if (valid && v > c.best) {
          c.best = v;
          c.plane = static_cast<int16_t>(plane);
          c.local = false;
        }
      }
      c.before2 = c.before;
      c.before2_valid = c.before_valid;
      c.before = v;
      c.before_valid = valid;
    }
  }

  const Job& job_;
  int first_, rows_, cols_;
  int lo_ = 0, hi_ = 0;
  std::vector<Cell> cells_;
  std::vector<float> v_;
  std::vector<uint8_t> textured_;
  std::vector<float> ring_p_, ring_q_;  // the last `window` rows of l + r and l - r
  std::vector<double> sums_[4];         // per column: S p, S p^2, S q, S q^2
};

// The image at the rows of the map: y does not depend on the plane. Grey values relative to mid-grey: smaller sums.
FloatImage resample_rows(const Gray& image, const Axis& rows) {
  FloatImage out(image.width + 1, static_cast<int>(rows.at.size()));
  for (int v = rows.lo; v < rows.hi; ++v) {
    const uint8_t* a = image.row(rows.at[v]);
    const uint8_t* b = image.row(std::min(rows.at[v] + 1, image.height - 1));
    for (int x = 0; x < image.width; ++x) {
      out.at(x, v) = static_cast<float>(a[x]) + rows.frac[v] * (static_cast<float>(b[x]) - a[x]) - 128.0f;
    }
    out.at(image.width, v) = out.at(image.width - 1, v);
  }
  return out;
}

}  // namespace

DepthResult run_float(const Gray& left, const Gray& right, const Rig& rig, const PlaneSpacing& spacing, int window,
                      double threshold, const FloatOptions& options, int threads,
                      const std::function<void(double)>& progress) {
  require(left.width == rig.width && left.height == rig.height, "left image: its size is not the calibration's");
  require(right.width == rig.width && right.height == rig.height, "right image: its size is not the calibration's");
  require(rig.width > 0 && rig.height > 0, "rig: the size must be positive");
  require(rig.left.fx > 0 && rig.left.fy > 0 && rig.right.fx > 0 && rig.right.fy > 0,
          "rig: focal lengths must be positive");
  require(rig.baseline > 0, "rig: the baseline must be positive");
  require(spacing.planes >= 1 && spacing.planes <= 32767, "planes: must be 1 .. 32767");
  require(spacing.zmin > 0 && spacing.zmax >= spacing.zmin, "zmin, zmax: must satisfy 0 < zmin <= zmax");
  require(window >= 3 && window % 2 == 1, "window: must be odd and at least 3");
  require(threshold >= 0 && threshold <= 1, "threshold: must be 0 .. 1");
  require(options.mncc_bits >= 0 && options.mncc_bits <= 24, "mncc_bits: must be 0 .. 24");
  require(options.frac_bits >= 1 && options.frac_bits <= 24, "frac_bits: must be 1 .. 24");
  require(threads >= 1, "threads: must be at least 1");

  const Camera eye = rig.cyclopean();
  const auto rows_of = [&](const Camera& c) {
    return Axis(rig.height, c.cy - c.fy / eye.fy * eye.cy, c.fy / eye.fy, rig.height);
  };
  const Axis left_rows = rows_of(rig.left), right_rows = rows_of(rig.right);
  const FloatImage l = resample_rows(left, left_rows), r = resample_rows(right, right_rows);
  const Job job{rig, spacing, window, threshold, options, l, r, left_rows, right_rows};

  DepthResult out;
  out.depth = FloatImage(rig.width, rig.height, std::numeric_limits<float>::infinity());
  out.position = FloatImage(rig.width, rig.height, std::numeric_limits<float>::quiet_NaN());
  out.mncc = FloatImage(rig.width, rig.height);
  out.mask = Image<uint8_t>(rig.width, rig.height);
  const int bands = (rig.height + kBandRows - 1) / kBandRows;
  std::atomic<int> next{0};
  std::mutex mutex;
  int64_t done = 0;
  const auto work = [&] {
    for (int b = next++; b < bands; b = next++) {
      const int first = b * kBandRows;
      Band band(job, first, std::min(kBandRows, rig.height - first));
      for (int k = 0; k < spacing.planes; ++k) {
        band.sweep(k);
        if (!progress) continue;
        const std::lock_guard<std::mutex> lock(mutex);
        progress(static_cast<double>(++done) / (static_cast<double>(bands) * spacing.planes));
      }
      band.finish(out);
    }
  };
  std::vector<std::thread> workers;
  for (int i = 1; i < threads; ++i) workers.emplace_back(work);
  work();
  for (auto& worker : workers) worker.join();
  return out;
}

}  // namespace psweep
