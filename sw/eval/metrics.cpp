// SPDX-License-Identifier: Apache-2.0
// Contract: metrics.hpp.
#include "eval/metrics.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.hpp"

namespace psweep {
namespace {

constexpr double kLarge = 0.02;  // metres

void require_size(const char* name, const FloatImage& image, int width, int height) {
  if (image.width != width || image.height != height) {
    throw InputError(std::string(name) + ": found " + std::to_string(image.width) + "x" + std::to_string(image.height) +
                     ", expected " + std::to_string(width) + "x" + std::to_string(height));
  }
}

// The window of samples around position `at` with this step lies on pixels 0 .. size-1. A nanopixel of tolerance: at
// integer positions rounding must not decide.
bool fits(double at, double step, int half, int size) {
  return at - half * step >= -1e-9 && at + half * step <= size - 1 + 1e-9;
}

double percent(size_t part, size_t whole) {
  return whole ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0;
}
double root_mean(double sum, size_t count) { return count ? std::sqrt(sum / static_cast<double>(count)) : 0; }

}  // namespace

Image<uint8_t> evaluated_cells(const FloatImage& truth, const Rig& rig, const PlaneSpacing& spacing, int window) {
  require_size("truth", truth, rig.width, rig.height);
  if (window < 1 || window % 2 == 0) throw InputError("window: must be odd and positive");
  const Camera eye = rig.cyclopean();
  const int half = window / 2;
  Image<uint8_t> out(rig.width, rig.height);
  for (int v = 0; v < rig.height; ++v) {
    for (int u = 0; u < rig.width; ++u) {
      const double z = truth.at(u, v);
      if (!(z >= spacing.zmin && z <= spacing.zmax)) continue;
      const auto inside = [&](const Camera& c, double half_baseline) {
        const double sx = c.fx / eye.fx, sy = c.fy / eye.fy;
        return fits((u - eye.cx) * sx + c.fx * half_baseline / z + c.cx, sx, half, rig.width) &&
               fits((v - eye.cy) * sy + c.cy, sy, half, rig.height);
      };
      out.at(u, v) = inside(rig.left, rig.baseline / 2) && inside(rig.right, -rig.baseline / 2);
    }
  }
  return out;
}

Metrics evaluate(const FloatImage& depth, const FloatImage& truth, const Rig& rig, const PlaneSpacing& spacing,
                 int window) {
  require_size("depth", depth, rig.width, rig.height);
  const Image<uint8_t> selected = evaluated_cells(truth, rig, spacing, window);
  Metrics m;
  double small = 0, large = 0;
  cv::Mat hole = cv::Mat::zeros(rig.height, rig.width, CV_8U);
  size_t hole_cells = 0;
  for (int v = 0; v < rig.height; ++v) {
    for (int u = 0; u < rig.width; ++u) {
      if (!selected.at(u, v)) continue;
      ++m.evaluated;
      const double z = depth.at(u, v);
      if (!std::isfinite(z)) {
        hole.at<uint8_t>(v, u) = 255;
        ++hole_cells;
        continue;
      }
      ++m.reconstructed;
      const double error = z - static_cast<double>(truth.at(u, v));
      if (std::abs(error) > kLarge) {
        ++m.large_errors;
        large += error * error;
      } else {
        small += error * error;
      }
    }
  }
  if (m.evaluated == 0) throw InputError("truth: no cell within zmin .. zmax whose window lies inside both images");
  cv::Mat labels;
  m.holes = static_cast<size_t>(cv::connectedComponents(hole, labels, 8, CV_32S)) - 1;  // without the background
  m.M1_mm = 1000 * root_mean(small, m.reconstructed - m.large_errors);
  m.M2a_percent = percent(m.large_errors, m.reconstructed);
  m.M2b_mm = 1000 * root_mean(large, m.large_errors);
  m.M3_percent = percent(m.reconstructed, m.evaluated);
  m.M4_px = m.holes ? static_cast<double>(hole_cells) / static_cast<double>(m.holes) : 0;
  m.rms_mm = 1000 * root_mean(small + large, m.reconstructed);
  return m;
}

Comparison compare(const FloatImage& reference, const FloatImage& other, const Image<uint8_t>& selected) {
  require_size("other", other, reference.width, reference.height);
  if (!selected.empty() && (selected.width != reference.width || selected.height != reference.height)) {
    throw InputError("selection: its size is not the reference's");
  }
  size_t near = 0, off_1mm = 0, off_5mm = 0, far = 0, hole_in_both = 0;
  Comparison c;
  for (size_t i = 0; i < reference.data.size(); ++i) {
    if (!selected.empty() && !selected.data[i]) continue;
    ++c.cells;
    const double a = reference.data[i], b = other.data[i];
    if (!std::isfinite(a)) {
      ++c.reference_holes;
      hole_in_both += !std::isfinite(b);
    } else if (std::isfinite(b)) {
      ++c.both;
      const double error = std::abs(a - b);
      near += error <= 0.00025;
      off_1mm += error > 0.001;
      off_5mm += error > 0.005;
      far += error > kLarge;
    } else {
      ++c.holes_gained;
    }
  }
  if (c.cells == 0) throw InputError("nothing to compare: no cell is selected");
  c.within_quarter_mm = percent(near, c.both);
  c.off_1mm = percent(off_1mm, c.both);
  c.off_5mm = percent(off_5mm, c.both);
  c.off_2cm = percent(far, c.both);
  c.holes_lost = c.reference_holes - hole_in_both;
  c.same_holes = c.reference_holes ? percent(hole_in_both, c.reference_holes) : 100;
  c.same_coverage = percent(hole_in_both + c.both, c.cells);
  return c;
}

}  // namespace psweep
