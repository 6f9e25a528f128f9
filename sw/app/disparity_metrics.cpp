// SPDX-License-Identifier: Apache-2.0
#include "app/disparity_metrics.hpp"

#include <cmath>
#include <limits>

namespace psweep {

DisparityMetrics evaluate_disparity(const FloatImage& disparity, const FloatImage& truth, const Gray& mask) {
  DisparityMetrics out;
  size_t bad1 = 0, bad2 = 0;
  double sum = 0;
  for (size_t i = 0; i < truth.data.size(); ++i) {
    if (!std::isfinite(truth.data[i]) || (!mask.empty() && mask.data[i] != 255)) continue;
    ++out.evaluated;
    if (!std::isfinite(disparity.data[i])) continue;
    ++out.matched;
    const double error = std::abs(static_cast<double>(disparity.data[i]) - truth.data[i]);
    bad1 += error > 1;
    bad2 += error > 2;
    if (error <= 1) sum += error;
  }
  const auto percent = [](size_t part, size_t all) {
    return all ? 100.0 * static_cast<double>(part) / static_cast<double>(all) : 0.0;
  };
  out.matched_percent = percent(out.matched, out.evaluated);
  out.bad1_percent = percent(bad1, out.matched);
  out.bad2_percent = percent(bad2, out.matched);
  out.bad1_all_percent = percent(bad1 + out.evaluated - out.matched, out.evaluated);
  out.mean_px = out.matched > bad1 ? sum / static_cast<double>(out.matched - bad1) : 0;
  return out;
}

FloatImage truth_from_png(const Gray& image, double scale) {
  FloatImage out(image.width, image.height, std::numeric_limits<float>::infinity());
  for (size_t i = 0; i < image.data.size(); ++i) {
    if (image.data[i] != 0) out.data[i] = static_cast<float>(image.data[i] / scale);
  }
  return out;
}

}  // namespace psweep
