// SPDX-License-Identifier: Apache-2.0
// Model of entity divider: one fraction num / den.
#pragma once
#include <cstdint>

namespace psweep::golden {

// Restoring division, one quotient bit a step: floor(num * 2^bits / den), which is all ones when num >= den.
// Requires 0 <= num <= den, den > 0. Shared by MNCC and the depth fraction.
inline int divide_fraction(int64_t num, int64_t den, int bits) {
  int quotient = 0;
  int64_t remainder = num;
  for (int i = 0; i < bits; ++i) {
    remainder <<= 1;
    quotient <<= 1;
    if (remainder >= den) {
      remainder -= den;
      quotient |= 1;
    }
  }
  return quotient;
}

}  // namespace psweep::golden
