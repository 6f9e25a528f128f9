// SPDX-License-Identifier: Apache-2.0
// DepthResult: what every engine (float, fixed, rtl) hands on, in the geometry of the cyclopean eye.
#pragma once
#include <cstdint>

#include "core/image.hpp"

namespace psweep {

// Reasons why a map cell holds no depth; bits of mask.png. 0 = the cell has a depth. Bits 0-3 come from the engine
// (bit 0 excludes all others, bit 1 excludes 2 and 3), bits 4-5 from the host's clean-up.
enum MaskBit : uint8_t {
  kMaskOutside = 1 << 0,     // the window left one of the images at every plane
  kMaskNoVariance = 1 << 1,  // inside at some plane, but both windows were constant wherever inside
  kMaskBelow = 1 << 2,       // best MNCC under the threshold
  kMaskNotLocal = 1 << 3,    // best MNCC is not a local maximum (first/last plane, or an invalid neighbour plane)
  kMaskUniqueness = 1 << 4,  // removed by clean-up: covered by a nearer cell in the left or right image
  kMaskSpeckle = 1 << 5,     // removed by clean-up: part of a small isolated piece
};

struct DepthResult {
  FloatImage depth;  // metres along Z, +inf where mask != 0
  FloatImage
      position;     // plane position b + offset (0 .. planes-1) of the winner, also where rejected; NaN if no winner
  FloatImage mncc;  // best MNCC, 0 .. 1; 0 where there is no winner
  Image<uint8_t> mask;  // MaskBit combination
};

}  // namespace psweep
