// SPDX-License-Identifier: Apache-2.0
// Exponentially spaced sweep planes: Z(p) = zmin (zmax/zmin)^(p/(planes-1)), p = 0 .. planes-1, fractional p allowed
// (paper, section 3.1; design: planes get sparser with distance as image discretisation does).
#pragma once
#include <cmath>

namespace psweep {

struct PlaneSpacing {
  int planes = 301;   // >= 1
  double zmin = 1.0;  // metres, > 0
  double zmax = 4.0;  // metres, > zmin (or == zmin with one plane)

  double depth(double position) const {
    return planes > 1 ? zmin * std::pow(zmax / zmin, position / (planes - 1)) : zmin;
  }
  // Inverse of depth(): the (fractional) plane position of a depth in metres.
  double position(double z) const { return planes > 1 ? (planes - 1) * std::log(z / zmin) / std::log(zmax / zmin) : 0; }
};

}  // namespace psweep
