// SPDX-License-Identifier: Apache-2.0
// Model of entity divider_mul: divide_fraction() by a multiplication. The reciprocal of the denominator is a straight
// line in each of 2^(bits/2) intervals; the product is the quotient or one more, which is seen when it is multiplied
// back.
#pragma once
#include <algorithm>
#include <cstdint>

namespace psweep::golden {

class DividerMul {
 public:
  // quot_bits: 8 .. 16. Denominators have quot_bits + 3 bits, the highest of them set.
  explicit DividerMul(int quot_bits)
      : bits_(quot_bits), power_(2 * quot_bits + 5), low_(quot_bits + 2 - quot_bits / 2) {}

  int power() const { return power_; }
  int lines() const { return 1 << (bits_ / 2); }
  // The denominators of a line: the first one; as many as count().
  int64_t first(int64_t line) const { return ((int64_t{2} << (bits_ / 2)) - 1 - line) << low_; }
  int64_t count() const { return int64_t{1} << low_; }
  // 2^power() / den or a little more.
  int64_t reciprocal(int64_t den) const {
    const int64_t from = den >> low_ << low_, last = from + count() - 1, base = inverse(last);
    const int64_t slope = ((inverse(from) - base) * count() + count() - 2) / (count() - 1);
    return ((base << low_) + count() - 1 + slope * (last - den)) >> low_;
  }
  // Requires 0 <= num <= den.
  int quotient(int64_t num, int64_t den) const {
    const int64_t product = num * reciprocal(den) >> (power_ - bits_);
    const int64_t exact = product - (product * den > num << bits_ ? 1 : 0);
    return static_cast<int>(std::min(exact, (int64_t{1} << bits_) - 1));
  }

 private:
  int64_t inverse(int64_t den) const { return ((int64_t{1} << power_) - 1) / den + 1; }
  int bits_, power_, low_;
};

}  // namespace psweep::golden
