// SPDX-License-Identifier: Apache-2.0
#include "io/reprojection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace psweep {
namespace {

// Bilinear, rounded to nearest; 0 outside the image.
uint8_t sample(const Gray& image, double x, double y) {
  if (!(x >= 0 && y >= 0 && x <= image.width - 1 && y <= image.height - 1)) return 0;
  const int xi = static_cast<int>(x), yi = static_cast<int>(y);
  const int xr = std::min(xi + 1, image.width - 1), yb = std::min(yi + 1, image.height - 1);
  const double fx = x - xi, fy = y - yi;
  const double top = image.at(xi, yi) * (1 - fx) + image.at(xr, yi) * fx;
  const double bottom = image.at(xi, yb) * (1 - fx) + image.at(xr, yb) * fx;
  return static_cast<uint8_t>(std::lround(top * (1 - fy) + bottom * fy));
}

}  // namespace

FloatImage left_disparity(const Rig& rig, const FloatImage& depth) {
  const float none = std::numeric_limits<float>::infinity();
  const Camera eye = rig.cyclopean();
  FloatImage out(rig.width, rig.height, none);
  const double half = rig.baseline / 2;
  for (int row = 0; row < rig.height; ++row) {
    const long v = std::lround((row - rig.left.cy) * eye.fy / rig.left.fy + eye.cy);
    if (v < 0 || v >= depth.height) continue;
    std::vector<float> nearest(rig.width, none);  // depth of the surface a pixel shows
    auto place = [&](int x, double z, double d) {
      if (x < 0 || x >= rig.width || !(z < nearest[x])) return;
      nearest[x] = static_cast<float>(z);
      out.at(x, row) = static_cast<float>(d);
    };
    double last_x = 0, last_d = 0, last_z = -1;
    for (int u = 0; u < depth.width; ++u) {
      const double z = depth.at(u, static_cast<int>(v));
      if (!std::isfinite(z)) {
        last_z = -1;
        continue;
      }
      const double x3 = (u - eye.cx) * z / eye.fx;
      const double x = rig.left.fx * (x3 + half) / z + rig.left.cx;
      const double d = x - (rig.right.fx * (x3 - half) / z + rig.right.cx);
      place(static_cast<int>(std::lround(x)), z, d);
      if (last_z > 0 && x > last_x && x - last_x < 2) {
        for (int c = static_cast<int>(std::ceil(last_x)); c <= x; ++c) {
          const double t = (c - last_x) / (x - last_x);
          place(c, std::min(z, last_z), last_d + t * (d - last_d));
        }
      }
      last_x = x;
      last_d = d;
      last_z = z;
    }
  }
  return out;
}

std::vector<CloudPoint> point_cloud(const Rig& rig, const FloatImage& depth, const FloatImage& mncc, const Gray& left) {
  const Camera eye = rig.cyclopean();
  std::vector<CloudPoint> out;
  for (int v = 0; v < depth.height; ++v) {
    for (int u = 0; u < depth.width; ++u) {
      const double z = depth.at(u, v);
      if (!std::isfinite(z)) continue;
      const double x = (u - eye.cx) * z / eye.fx, y = (v - eye.cy) * z / eye.fy;
      const double xl = rig.left.fx * (x + rig.baseline / 2) / z + rig.left.cx;
      const double yl = rig.left.fy * y / z + rig.left.cy;
      out.push_back(
          {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z), sample(left, xl, yl), mncc.at(u, v)});
    }
  }
  return out;
}

}  // namespace psweep
