// SPDX-License-Identifier: Apache-2.0
// Bit-true model of entity storage (paper, section 4.2.1, equation 2): the loaded window of one image in four banks
// interleaved by the parities of x and y, so that any 2x2 neighbourhood is read in one clock.
#pragma once
#include "contract/tile.hpp"
#include "golden/address_generator.hpp"

namespace psweep::golden {

// The 2x2 neighbourhood of a sample: p10 is the right neighbour of p00, p01 the one below.
struct Quad {
  int p00 = 0, p10 = 0, p01 = 0, p11 = 0;
};

// With `rectified` two banks by the parity of x, each with all rows.
inline int bank(const Config& c, int xi, int yi) { return (c.rectified ? 0 : (yi & 1) * 2) + (xi & 1); }
// Word address inside a bank; the row pitch is half the generic G_IMG_COLS, whatever was loaded.
inline int bank_address(const Config& c, int xi, int yi) {
  return (c.rectified ? yi : yi >> 1) * (c.img_cols / 2) + (xi >> 1);
}

// Requires s.in_window; the value for other samples is not defined by the contract (the interpolation replaces it by
// 0).
// With `rectified` the lower neighbours are 0: nobody reads them.
inline Quad fetch(const Config& c, const Pixels& window, const Sample& s) {
  if (c.rectified) return {window.at(s.xi, s.yi), window.at(s.xi + 1, s.yi), 0, 0};
  return {window.at(s.xi, s.yi), window.at(s.xi + 1, s.yi), window.at(s.xi, s.yi + 1), window.at(s.xi + 1, s.yi + 1)};
}

}  // namespace psweep::golden
