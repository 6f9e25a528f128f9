// SPDX-License-Identifier: Apache-2.0
// Bit-true model of entity interpolation (paper, section 4.2.1): bilinear, exact until one final rounding.
#pragma once
#include "golden/storage.hpp"

namespace psweep::golden {

// Result: ufix(pix_bits, interp_frac), rounded half up; cannot exceed the largest of the four pixels, so no saturation.
inline int interpolate(const Config& c, const Quad& q, int fx, int fy) {
  const int w = c.weight_bits;
  const int64_t top = (static_cast<int64_t>(q.p00) << w) + static_cast<int64_t>(q.p10 - q.p00) * fx;     // ufix(pix, w)
  const int64_t bottom = (static_cast<int64_t>(q.p01) << w) + static_cast<int64_t>(q.p11 - q.p01) * fx;  // ufix(pix, w)
  const int64_t exact = (top << w) + (bottom - top) * fy;  // ufix(pix, 2w)
  const int drop = 2 * w - c.interp_frac;
  if (drop <= 0) return static_cast<int>(exact << -drop);
  return static_cast<int>((exact + (int64_t{1} << (drop - 1))) >> drop);
}

}  // namespace psweep::golden
