// SPDX-License-Identifier: Apache-2.0
// From the cyclopean depth map to what users of stereo expect: a disparity map in the left image, and a point cloud.
#pragma once
#include <vector>

#include "core/image.hpp"
#include "core/rig.hpp"
#include "io/ply.hpp"

namespace psweep {

// Disparity x_left - x_right in pixels for each pixel of the left image, +inf where no cell lands.
// Each cell goes where it appears in the left image; between horizontal neighbours whose left columns are less than 2
// apart (one surface) disparity is interpolated at the pixel centres in between; the nearest surface wins. Rows do not
// depend on depth with parallel cameras, so a left row takes the map row that lies nearest.
FloatImage left_disparity(const Rig& rig, const FloatImage& depth);

// One point per cell with finite depth, raster order. grey: left image, bilinear, where the point appears in it (0
// outside); confidence: mncc.
std::vector<CloudPoint> point_cloud(const Rig& rig, const FloatImage& depth, const FloatImage& mncc, const Gray& left);

}  // namespace psweep
