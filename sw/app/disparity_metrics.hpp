// SPDX-License-Identifier: Apache-2.0
// Disparity map of the left image against ground truth, in the terms of the Middlebury evaluation.
#pragma once
#include <cstddef>

#include "core/image.hpp"

namespace psweep {

struct DisparityMetrics {
  size_t evaluated = 0;  // pixels with truth, inside the mask
  size_t matched = 0;    // of these, with a disparity
  double matched_percent = 0;
  double bad1_percent = 0;      // of the matched: off by more than 1 pixel
  double bad2_percent = 0;      // of the matched: off by more than 2 pixels
  double bad1_all_percent = 0;  // of the evaluated: off by more than 1 pixel, or without disparity
  double mean_px = 0;           // mean absolute error of the matched ones that are not bad by more than 1 pixel
};

// disparity, truth: pixels, +inf where unknown. mask: 255 = evaluate; empty = everywhere. Equal sizes required.
DisparityMetrics evaluate_disparity(const FloatImage& disparity, const FloatImage& truth, const Gray& mask);

// Ground truth from a PNG: value / scale, 0 = unknown.
FloatImage truth_from_png(const Gray& image, double scale);

}  // namespace psweep
