// SPDX-License-Identifier: Apache-2.0
// Pictures for people: colour maps with a legend. All BGR, CV_8UC3.
#pragma once
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/image.hpp"
#include "core/planes.hpp"
#include "core/rig.hpp"
#include "io/ply.hpp"

namespace psweep {

// Depth in pseudo-colour, red near, blue far; the colour follows log(Z), as the planes do, over zmin .. zmax.
// Where there is no depth: dark grey. The scale bar on the right has ticks in metres (`metric`) or, for relative
// depths, in pixels of disparity with `focal_baseline` = f b.
cv::Mat depth_picture(const FloatImage& depth, const PlaneSpacing& range, bool metric = true,
                      double focal_baseline = 0);

// |value - truth| from 0 (dark) to `full` and beyond (bright); blue where only the truth exists (a hole), light grey
// where there is no truth. `scale` converts to the unit of the legend (1000 for m to mm).
cv::Mat error_picture(const FloatImage& value, const FloatImage& truth, double scale, double full,
                      const std::string& unit);

// The cloud seen from above its middle and a little from the left, in the grey of the points tinted by depth.
cv::Mat cloud_picture(const std::vector<CloudPoint>& points, const PlaneSpacing& range, int width, int height);

}  // namespace psweep
