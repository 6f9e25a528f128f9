// SPDX-License-Identifier: Apache-2.0
// Height field of a scene: heights, radiance and material baked on a square lattice, and exact ray casting on it.
// World: x right, y forward on the ground, h up, metres; the mast stands at (0,0).
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "scene/scene.hpp"

namespace psweep::scene {

struct Ray {
  double x, y, h;     // origin
  double dx, dy, dh;  // per unit of the parameter; dh < 0
};

class Terrain {
 public:
  // `pitch`: lattice spacing in metres. Detail below the lattice is left out, so coarser lattices give the same ground
  // with less detail.
  Terrain(SceneKind kind, uint64_t seed, double pitch, int threads, const std::function<void(double)>& progress);

  // Parameter of the first point where the ray meets the bilinearly interpolated surface, or a negative number.
  double cast(const Ray& ray) const;

  struct Surface {
    float radiance;  // 1: level sand, fully lit
    float rock;      // 0 sand .. 1 rock
    float steep;     // cosine of the slope
  };
  Surface surface(double x, double y) const;

 private:
  struct Level {
    int shift = 0, cols = 0, rows = 0;
    std::vector<float> max;  // highest node of each block of 2^shift x 2^shift cells
  };

  float height(int i, int j) const { return height_[static_cast<size_t>(j) * cols_ + i]; }
  void build_ground(SceneKind kind, uint32_t seed, int threads);
  void place_rocks(SceneKind kind, uint64_t seed);
  void light(int threads, const std::function<void(double)>& progress);
  void build_levels();

  int cols_ = 0, rows_ = 0;  // nodes
  double pitch_, x0_, y0_;
  float top_ = 0;
  std::vector<float> height_, radiance_;
  std::vector<uint8_t> rock_, steep_;
  std::vector<uint8_t> tone_;  // brightness of the material, 128 = 1.0
  std::vector<Level> levels_;
};

// body(j) for all rows; rows are independent.
void for_rows(int rows, int threads, const std::function<void(int)>& body,
              const std::function<void(double)>& progress = {});

}  // namespace psweep::scene
