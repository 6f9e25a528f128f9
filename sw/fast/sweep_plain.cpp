// SPDX-License-Identifier: Apache-2.0
// Portable sweep: any processor, any legal format, 64-bit sums. One lane, so strided layout = raster. Contract:
// sweep.hpp.
#include <cstring>

#include "fast/sweep.hpp"

namespace psweep::fast {
namespace {

constexpr uint16_t kPrevValid = 1, kLocalMax = 2;

// Vertical sums of one column. With n = M*M, (A - B)/2 = 2 (n S(lr) - Sl Sr) and (A + B)/2 = n S(l^2 + r^2) - Sl^2 -
// Sr^2: the same quotient as the contract's, and halving both operands leaves their normalised top bits alone.
struct Sums {
  int64_t l, r, lr, ss;
};

int bit_length(uint64_t value) {
  int bits = 0;
  for (int step = 32; step > 0; step /= 2) {
    if (value >> step) {
      value >>= step;
      bits += step;
    }
  }
  return bits + (value != 0);
}

// floor(num * 2^bits / den), all ones for num >= den. num < 2^20, bits <= 16: one division of 64-bit integers.
uint32_t divide(uint32_t num, uint32_t den, int bits) {
  if (num >= den) return (1u << bits) - 1;
  return static_cast<uint32_t>((static_cast<uint64_t>(num) << bits) / den);
}

uint32_t similarity(const Band& b, const Sums& s, bool& textured) {
  const int64_t n = static_cast<int64_t>(b.window) * b.window;
  const int64_t num = 2 * (n * s.lr - s.l * s.r);
  const int64_t den = n * s.ss - s.l * s.l - s.r * s.r;
  textured = den > 0;
  if (!textured || num <= 0) return 0;
  const int shift = bit_length(static_cast<uint64_t>(den)) - (b.mncc_bits + 3);
  if (shift >= 0) {
    return divide(static_cast<uint32_t>(num >> shift), static_cast<uint32_t>(den >> shift), b.mncc_bits);
  }
  return divide(static_cast<uint32_t>(num << -shift), static_cast<uint32_t>(den << -shift), b.mncc_bits);
}

void update(const Band& b, size_t at, int k, uint16_t v, bool valid) {
  const bool adjacent = b.plane[at] == static_cast<uint16_t>(k - 1);
  uint16_t flags = b.flags[at];
  if (v > b.best[at]) {
    if (adjacent) {
      b.prev[at] = b.best[at];
      flags = kPrevValid;
    }
    b.best[at] = v;
    b.plane[at] = static_cast<uint16_t>(k);
    b.frac[at] = 0;
    b.flags[at] = flags & kPrevValid;
    return;
  }
  if (adjacent) {
    const uint32_t before = b.best[at] - b.prev[at], after = b.best[at] - v;
    b.frac[at] = static_cast<uint16_t>(divide(before, before + after, b.frac_bits));
    flags = (flags & kPrevValid) && valid ? kLocalMax : 0;
  }
  b.prev[at] = v;
  b.flags[at] = static_cast<uint16_t>((flags & kLocalMax) | (valid ? kPrevValid : 0));
}

void sweep_plane(const Band& b, int k) {
  const PlaneWork& p = b.planes[k];
  const int m = b.window;
  const auto taps = static_cast<size_t>(b.taps);
  auto* column = static_cast<Sums*>(b.column);
  std::memset(b.column, 0, taps * sizeof(Sums));
  std::memset(b.ring, 0, taps * m * 2 * sizeof(int32_t));
  for (int j = 0; j < b.rows + m - 1; ++j) {
    const int row = j - (m - 1);
    if (!p.empty) {
      int32_t* l = b.line;
      int32_t* r = b.line + taps;
      b.fill(b.fill_context, k, j, l, r);
      int32_t* old_l = b.ring + (j % m) * 2 * taps;
      int32_t* old_r = old_l + taps;
      for (size_t i = 0; i < taps; ++i) {
        const int64_t a = l[i], c = r[i], oa = old_l[i], oc = old_r[i];
        column[i].l += a - oa;
        column[i].r += c - oc;
        column[i].lr += a * c - oa * oc;
        column[i].ss += a * a + c * c - oa * oa - oc * oc;
      }
      std::memcpy(old_l, l, taps * sizeof(int32_t));
      std::memcpy(old_r, r, taps * sizeof(int32_t));
      if (b.trace_l) {
        std::memcpy(b.trace_l + j * taps, l, taps * sizeof(int32_t));
        std::memcpy(b.trace_r + j * taps, r, taps * sizeof(int32_t));
      }
    }
    if (row < 0) continue;
    const bool row_valid = !p.empty && row >= p.v_lo && row < p.v_hi;
    const size_t first = static_cast<size_t>(row) * b.row_len;
    Sums w{0, 0, 0, 0};
    for (int i = 0; i < b.cols + m - 1; ++i) {
      if (row_valid) {
        w.l += column[i].l, w.r += column[i].r, w.lr += column[i].lr, w.ss += column[i].ss;
        if (i >= m) {
          const Sums& o = column[i - m];
          w.l -= o.l, w.r -= o.r, w.lr -= o.lr, w.ss -= o.ss;
        }
      }
      const int u = i - (m - 1);
      if (u < 0) continue;
      const bool valid = row_valid && u >= p.u_lo && u < p.u_hi;
      bool textured = false;
      const auto v = static_cast<uint16_t>(valid ? similarity(b, w, textured) : 0);
      if (textured) b.textured[static_cast<size_t>(row) * b.stride + u] = 1;
      if (b.trace_v) b.trace_v[first + u] = v;
      update(b, first + u, k, v, valid);
    }
  }
}

void sweep(const Band& b, int first, int last) {
  for (int k = first; k < last; ++k) sweep_plane(b, k);
}
bool local_max(const Band& b, size_t at) { return (b.flags[at] & kLocalMax) != 0; }

}  // namespace

const SweepLevel kSweepPlain = {1, sweep, local_max};

}  // namespace psweep::fast
