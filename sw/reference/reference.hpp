// SPDX-License-Identifier: Apache-2.0
// Plane sweep in floating point: the judge of accuracy (paper, section 3.1). Same algorithm and same map rule as the
// bit-true model, but positions, interpolation, window sums, MNCC and parabola are double or float, unrounded unless
// told so. docs/accuracy.md.
#pragma once
#include <functional>

#include "core/image.hpp"
#include "core/planes.hpp"
#include "core/result.hpp"
#include "core/rig.hpp"

namespace psweep {

// Which maximum along the planes wins.
enum class WinnerRule {
  kGlobalBest,  // the best of all; a hole if it is no local maximum (what the hardware does)
  kBestLocal,   // the best of all local maxima; needs one more value per cell
};

struct FloatOptions {
  // 0: MNCC and parabola unrounded. n > 0: MNCC cut to n bits and the parabola to frac_bits as in
  // golden::divide_fraction and golden::parabola, everything before stays exact (paper, figure 8).
  int mncc_bits = 0;
  int frac_bits = 8;
  WinnerRule rule = WinnerRule::kGlobalBest;
};

// window: odd, 3 or more; threshold: 0 .. 1; threads >= 1. A cell is inside at a plane if every sample x of its window
// satisfies 0 <= x <= width - 1 in both images, likewise y.
// The result does not depend on the number of threads. progress: fraction done, 0 .. 1, never from two threads at once.
// Errors: InputError if the images do not have the rig's size or an argument is out of its range.
DepthResult run_float(const Gray& left, const Gray& right, const Rig& rig, const PlaneSpacing& spacing, int window,
                      double threshold, const FloatOptions& options = {}, int threads = 1,
                      const std::function<void(double)>& progress = {});

}  // namespace psweep
