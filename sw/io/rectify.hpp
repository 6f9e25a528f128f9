// SPDX-License-Identifier: Apache-2.0
// Rectification of a raw pair with OpenCV: stereoRectify (zero disparity at infinity, alpha = 0: no pixel without
// picture), initUndistortRectifyMap, remap (bilinear).
#pragma once
#include "core/image.hpp"
#include "io/calibration.hpp"

namespace psweep {

struct RectifiedPair {
  Gray left, right;
  Rig rig;
};

// Images of equal size. Errors: InputError if the result is no pair of cameras side by side.
RectifiedPair rectify_pair(const Calibration& calibration, const Gray& left, const Gray& right);

}  // namespace psweep
