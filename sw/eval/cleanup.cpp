// SPDX-License-Identifier: Apache-2.0
// Contract: cleanup.hpp.
#include "eval/cleanup.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include "core/error.hpp"

namespace psweep {
namespace {

void drop(DepthResult& result, size_t cell, MaskBit why) {
  result.mask.data[cell] |= why;
  result.depth.data[cell] = std::numeric_limits<float>::infinity();
}

size_t uniqueness(DepthResult& result, const Rig& rig, double margin) {
  const Camera eye = rig.cyclopean();
  constexpr float kFree = std::numeric_limits<float>::infinity();
  std::vector<float> nearest(rig.width);
  std::vector<uint8_t> covered(rig.width);
  size_t count = 0;
  for (int v = 0; v < rig.height; ++v) {
    const float* depth = result.depth.row(v);
    std::fill(covered.begin(), covered.end(), uint8_t{0});
    for (const bool left : {true, false}) {
      const Camera& c = left ? rig.left : rig.right;
      const double shift = c.fx * (left ? rig.baseline : -rig.baseline) / 2, step = c.fx / eye.fx;
      // Column of the image on which the cell falls; cells of one map row share an image row.
      const auto column = [&](int u) {
        return static_cast<int>(std::floor((u - eye.cx) * step + c.cx + shift / depth[u] + 0.5));
      };
      std::fill(nearest.begin(), nearest.end(), kFree);
      for (int u = 0; u < rig.width; ++u) {
        if (!std::isfinite(depth[u])) continue;
        const int x = column(u);
        if (x >= 0 && x < rig.width && depth[u] < nearest[x]) nearest[x] = depth[u];
      }
      for (int u = 0; u < rig.width; ++u) {
        if (!std::isfinite(depth[u])) continue;
        const int x = column(u);
        if (x >= 0 && x < rig.width && depth[u] > nearest[x] + margin) covered[u] = 1;
      }
    }
    for (int u = 0; u < rig.width; ++u) {
      if (!covered[u]) continue;
      drop(result, static_cast<size_t>(v) * rig.width + u, kMaskUniqueness);
      ++count;
    }
  }
  return count;
}

size_t speckle(DepthResult& result, const Rig& rig, int cells, double pixels) {
  const double fb = rig.cyclopean().fx * rig.baseline;
  const int w = rig.width, h = rig.height;
  std::vector<uint8_t> seen(result.depth.data.size());
  std::vector<int> piece;
  size_t count = 0;
  for (int start = 0; start < w * h; ++start) {
    if (seen[start] || !std::isfinite(result.depth.data[start])) continue;
    piece.assign(1, start);
    seen[start] = 1;
    for (size_t next = 0; next < piece.size(); ++next) {
      const int at = piece[next], u = at % w, v = at / w;
      const double disparity = fb / result.depth.data[at];
      const auto visit = [&](bool exists, int other) {
        if (!exists || seen[other] || !std::isfinite(result.depth.data[other])) return;
        if (std::abs(fb / result.depth.data[other] - disparity) > pixels) return;
        seen[other] = 1;
        piece.push_back(other);
      };
      visit(u > 0, at - 1);
      visit(u + 1 < w, at + 1);
      visit(v > 0, at - w);
      visit(v + 1 < h, at + w);
    }
    // Neighbours of a dropped piece have been compared with it already, so dropping at once changes no other piece.
    if (piece.size() >= static_cast<size_t>(cells)) continue;
    for (const int at : piece) drop(result, static_cast<size_t>(at), kMaskSpeckle);
    count += piece.size();
  }
  return count;
}

}  // namespace

CleanupCounts clean_up(DepthResult& result, const Rig& rig, const CleanupOptions& options) {
  if (result.depth.width != rig.width || result.depth.height != rig.height) {
    throw InputError("clean-up: the map's size is not the calibration's");
  }
  CleanupCounts counts;
  if (options.uniqueness) counts.uniqueness = uniqueness(result, rig, options.uniqueness_m);
  if (options.speckle) counts.speckle = speckle(result, rig, options.speckle_cells, options.speckle_px);
  return counts;
}

}  // namespace psweep
