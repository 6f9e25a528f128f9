// SPDX-License-Identifier: Apache-2.0
// The host's clean-up of a finished map: uniqueness in both images and a speckle filter, each switchable. A cell that
// goes gets its reason in mask and +inf in depth; position and mncc stay. The raw map is what the RTL is compared with.
#pragma once
#include "core/result.hpp"
#include "core/rig.hpp"

namespace psweep {

struct CleanupOptions {
  // Uniqueness: an image pixel shows one surface. Of the cells of a map row that fall on one pixel of the left or right
  // image, those that lie more than `uniqueness_m` behind the nearest are dropped: they see through it.
  bool uniqueness = true;
  double uniqueness_m = 0.02;
  // Speckle: 4-connected pieces of fewer than `speckle_cells` cells are dropped; neighbours belong together if their
  // disparities differ by at most `speckle_px`. Mismatches come in pieces of the window's size, so the size does not
  // depend on the resolution; ground at 39 degrees changes by 0.16 px per cell, at any distance.
  bool speckle = true;
  int speckle_cells = 100;
  double speckle_px = 1.0;
};

struct CleanupCounts {
  size_t uniqueness = 0, speckle = 0;  // cells dropped
};

// Uniqueness first, then speckles. InputError if the result does not have the rig's size.
CleanupCounts clean_up(DepthResult& result, const Rig& rig, const CleanupOptions& options = {});

}  // namespace psweep
