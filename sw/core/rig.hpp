// SPDX-License-Identifier: Apache-2.0
// Rig: two parallel pinhole cameras (image planes coplanar up to focal length, no rotation) and the cyclopean eye
// midway between them (paper, section 3.1).
//   x_left  = left.fx  * (X + b/2) / Z + left.cx      y_left  = left.fy  * Y / Z + left.cy
//   x_right = right.fx * (X - b/2) / Z + right.cx     y_right = right.fy * Y / Z + right.cy
// with X right, Y down, Z forward in metres from the cyclopean eye, b the baseline. A row offset between the images is
// the difference of the two cy. Pixel centres have integer coordinates.
#pragma once

namespace psweep {

struct Camera {
  double fx = 0, fy = 0;  // focal lengths, pixels
  double cx = 0, cy = 0;  // principal point, pixels
};

struct Rig {
  Camera left, right;
  double baseline = 0;        // metres, > 0
  int width = 0, height = 0;  // of both images and of the cyclopean depth map, pixels

  // Intrinsics of the cyclopean eye: the mean of both cameras'. Map cell (u,v) at depth Z is the point
  // X = (u - cx) Z / fx, Y = (v - cy) Z / fy.
  Camera cyclopean() const {
    return {(left.fx + right.fx) / 2, (left.fy + right.fy) / 2, (left.cx + right.cx) / 2, (left.cy + right.cy) / 2};
  }
};

}  // namespace psweep
