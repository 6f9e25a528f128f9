// SPDX-License-Identifier: Apache-2.0
// Bit-true model of entity updating (paper, section 4.2.3): winner takes all, local maximum, parabola, unload.
#pragma once
#include "core/result.hpp"
#include "golden/similarity.hpp"

namespace psweep::golden {

// One word of the map RAM.
struct Cell {
  int best = 0;             // Vb, 0 while there is no winner
  int prev = 0;             // Vm: V of the plane before the winner, or of the last plane seen
  int plane = 0;            // b
  int frac = 0;             // depth fraction; while best == 0: bit 0 = seen inside, bit 1 = seen with variance
  bool local_max = false;   // the plane after b was inside and not better, and so was the one before b
  bool prev_valid = false;  // prev comes from a plane at which the window was inside
};

// Parabola through V(b-1), V(b), V(b+1) with a = V(b) - V(b-1) > 0 and c = V(b) - V(b+1) >= 0:
// offset = (a - c) / (2 (a + c)), so offset + 1/2 = a / (a + c), returned as ufix(0,frac_bits), truncated.
inline int parabola(const Config& cfg, int before, int best, int after) {
  const int a = best - before, c = best - after;
  return divide_fraction(a, a + c, cfg.frac_bits);
}

// Plane k arrives at a cell. At k = 0 the stored word is ignored (so the map needs no clearing).
inline Cell update(const Config& cfg, Cell cell, int k, const Similarity& s) {
  if (k == 0) cell = Cell{};
  const bool adjacent = cell.best > 0 && cell.plane == k - 1;  // the winner was found at the previous plane
  if (s.valid && s.v > cell.best) {
    if (adjacent) {  // else prev already holds V(k-1)
      cell.prev = cell.best;
      cell.prev_valid = true;
    }
    cell.best = s.v;
    cell.plane = k;
    cell.frac = 0;
    cell.local_max = false;
    return cell;
  }
  const int v = s.valid ? s.v : 0;
  if (adjacent) {
    cell.frac = parabola(cfg, cell.prev, cell.best, v);
    cell.local_max = s.valid && cell.prev_valid;
  } else if (cell.best == 0) {
    cell.frac |= (s.valid ? 1 : 0) | (s.textured ? 2 : 0);
  }
  cell.prev = v;
  cell.prev_valid = s.valid;
  return cell;
}

inline MapCell unload(const Cell& cell, int threshold) {
  MapCell m;
  m.plane = static_cast<uint16_t>(cell.plane);
  m.frac = static_cast<uint16_t>(cell.frac);
  m.v = static_cast<uint16_t>(cell.best);
  if (cell.best == 0 && !(cell.frac & 1)) {
    m.mask = kMaskOutside;
  } else if (cell.best == 0 && !(cell.frac & 2)) {
    m.mask = kMaskNoVariance;
  } else {
    if (cell.best < threshold) m.mask |= kMaskBelow;
    if (!cell.local_max) m.mask |= kMaskNotLocal;
  }
  return m;
}

}  // namespace psweep::golden
