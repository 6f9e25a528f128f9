// SPDX-License-Identifier: Apache-2.0
// Accuracy metrics M1 .. M4 of the paper (section 3.2, table 1), and the comparison of two results (section 4.3).
//
// Evaluated cells: truth within zmin .. zmax, and the M x M window at the true depth inside both images. Errors are
// along Z. A cell is reconstructed if its depth is finite.
#pragma once
#include <cstddef>

#include "core/image.hpp"
#include "core/planes.hpp"
#include "core/result.hpp"
#include "core/rig.hpp"

namespace psweep {

struct Metrics {
  double M1_mm = 0;        // RMS of the errors up to 2 cm
  double M2a_percent = 0;  // share of reconstructed cells with a larger error
  double M2b_mm = 0;       // RMS of those larger errors
  double M3_percent = 0;   // share of evaluated cells that are reconstructed
  double M4_px = 0;        // mean size of an 8-connected hole, cells; 0 without holes
  double rms_mm = 0;       // consolidated: RMS of all errors
  size_t evaluated = 0, reconstructed = 0, large_errors = 0, holes = 0;  // holes: connected pieces
};

// 1 where the cell is evaluated. window: odd.
Image<uint8_t> evaluated_cells(const FloatImage& truth, const Rig& rig, const PlaneSpacing& spacing, int window);

// InputError if depth or truth do not have the rig's size, or if no cell can be evaluated.
Metrics evaluate(const FloatImage& depth, const FloatImage& truth, const Rig& rig, const PlaneSpacing& spacing,
                 int window);

struct Comparison {
  size_t both = 0;                               // cells with a depth in both
  double within_quarter_mm = 0;                  // percent of them that differ by at most 0.25 mm
  double off_1mm = 0, off_5mm = 0, off_2cm = 0;  // percent of them that differ by more than that
  double same_holes = 0;                         // percent of the reference's holes that are holes in the other, too
  double same_coverage = 0;                      // percent of all cells that are hole in both or depth in both
  size_t cells = 0, reference_holes = 0;
  size_t holes_gained = 0, holes_lost = 0;  // cells that are hole only in the other, only in the reference
};

// Cells where `selected` is not 0, or all if it is empty. InputError if sizes differ or there is nothing to compare.
Comparison compare(const FloatImage& reference, const FloatImage& other, const Image<uint8_t>& selected = {});

}  // namespace psweep
