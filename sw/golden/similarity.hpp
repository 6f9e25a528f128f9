// SPDX-License-Identifier: Apache-2.0
// Bit-true model of entity similarity: MNCC over M x M windows (paper, equation 1).
//   MNCC = 2 cov(l,r) / (var(l) + var(r)) = 2 (n S(lr) - S(l) S(r)) / (n S(l^2 + r^2) - S(l)^2 - S(r)^2), n = M*M
// The entity keeps vertical sums of M rows per column and a horizontal running sum of M columns, of samples less an
// offset and mirrored; all being exact integers, its numerator and denominator equal the plain ones below.
#pragma once
#include "contract/config.hpp"
#include "golden/divider.hpp"

namespace psweep::golden {

struct Similarity {
  int v = 0;              // ufix(0,mncc_bits), 0 .. 2^mncc_bits - 1; negative correlation is 0
  bool valid = false;     // all M*M samples of the window are usable
  bool textured = false;  // valid and var(l) + var(r) > 0
};

// The four sums of a window or of one of its columns: l, r, l r, l^2 + r^2.
struct Sums {
  int64_t l = 0, r = 0, x = 0, y = 0;
  void add(int64_t left, int64_t right) {
    l += left;
    r += right;
    x += left * right;
    y += left * left + right * right;
  }
  // Adds `sign` times the other sums.
  void add(const Sums& other, int sign) {
    l += sign * other.l;
    r += sign * other.r;
    x += sign * other.x;
    y += sign * other.y;
  }
  // n^2 cov and n^2 (var + var) of n samples.
  int64_t covariance(int64_t n) const { return n * x - l * r; }
  int64_t variances(int64_t n) const { return n * y - l * l - r * r; }
};

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
  int64_t num = 2 * s.covariance(n);
  int64_t den = s.variances(n);
  Similarity out;
  out.valid = valid;
  out.textured = valid && den > 0;
  if (!out.textured || num <= 0) return out;
  normalise(num, den, c.norm_bits());
  out.v = divide_fraction(num, den, c.mncc_bits);
  return out;
}

}  // namespace psweep::golden
