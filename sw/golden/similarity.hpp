// SPDX-License-Identifier: Apache-2.0
// Bit-true model of entity similarity: MNCC over M x M windows (paper, equation 1) in the sum/difference form.
//   p = l + r, q = l - r, n = M*M, A = n S(p^2) - (S p)^2, B = n S(q^2) - (S q)^2   (exact integers)
//   MNCC = 2 cov(l,r) / (var(l) + var(r)) = (A - B) / (A + B)
// The entity keeps vertical sums of M rows per column and a horizontal running sum of M columns; being exact integers
// they equal the plain sums below.
#pragma once
#include "golden/config.hpp"

namespace psweep::golden {

struct Similarity {
  int v = 0;              // ufix(0,mncc_bits), 0 .. 2^mncc_bits - 1; negative correlation is 0
  bool valid = false;     // all M*M samples of the window are usable
  bool textured = false;  // valid and A + B > 0
};

// The four window sums.
struct Sums {
  int64_t p = 0, p2 = 0, q = 0, q2 = 0;
  void add(int l, int r) {
    const int64_t sp = l + r, sq = l - r;
    p += sp;
    p2 += sp * sp;
    q += sq;
    q2 += sq * sq;
  }
};

// Restoring division, one quotient bit a step: floor(num * 2^bits / den), which is all ones when num >= den.
// Requires 0 <= num <= den, den > 0. Shared by MNCC and the depth fraction (entity divider).
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

// Both operands shifted alike, so that the leading one of den comes to bit norm_bits-1; bits that fall out are dropped.
inline void normalise(int64_t& num, int64_t& den, int norm_bits) {
  int msb = 63;
  while (msb > 0 && !((den >> msb) & 1)) --msb;
  const int shift = msb - (norm_bits - 1);
  if (shift >= 0) {
    num >>= shift;
    den >>= shift;
  } else {
    num <<= -shift;
    den <<= -shift;
  }
}

inline Similarity mncc(const Config& c, const Sums& s, bool valid) {
  const int64_t n = static_cast<int64_t>(c.window) * c.window;
  const int64_t a = n * s.p2 - s.p * s.p;
  const int64_t b = n * s.q2 - s.q * s.q;
  int64_t num = a - b;
  int64_t den = a + b;
  Similarity out;
  out.valid = valid;
  out.textured = valid && den > 0;
  if (!out.textured || num <= 0) return out;
  normalise(num, den, c.norm_bits());
  out.v = divide_fraction(num, den, c.mncc_bits);
  return out;
}

}  // namespace psweep::golden
