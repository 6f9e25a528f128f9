// SPDX-License-Identifier: Apache-2.0
// Tiles made up for one engine: jobs, plane tables and pixels that hit what real pairs hit and what they never do.
#pragma once
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "contract/config.hpp"
#include "contract/tile.hpp"

namespace psweep::scene {

struct Stimulus {
  std::string name;
  golden::TileJob job;
  std::vector<golden::PlaneEntry> table;
  golden::Pixels left, right;  // win_cols x win_rows
};

enum class Texture {
  kStereo,  // has a best plane at every cell
  kRandom,
  kConstant,
  kSaturated,  // 0 and all ones
  kFaint,      // constant but for a few pixels, by 1: the smallest variances
};
enum class Geometry {
  kInside,  // every sample inside the images and loaded, steps near 1
  kBorder,  // the tile begins outside the images, at whole steps (bounds are hit exactly)
  kSkewed,  // unequal steps and sub-pixel starts left and right, parts outside
  kLost,    // some samples are inside the images, but not loaded
};

class StimulusMaker {
 public:
  StimulusMaker(const golden::Config& config, uint32_t seed) : config_(config), random_(seed) {}

  int below(int n) { return static_cast<int>(static_cast<uint32_t>(random_()) % static_cast<uint32_t>(n)); }
  double uniform(double lo, double hi) { return lo + (hi - lo) * (static_cast<uint32_t>(random_()) / 4294967296.0); }

  static int32_t fixed(double pixels) { return static_cast<int32_t>(std::lround(pixels * (1 << golden::kPosFrac))); }

  Stimulus make(Texture texture, Geometry geometry, int tile_cols, int tile_rows, int planes) {
    static const char* const textures[] = {"stereo", "random", "constant", "saturated", "faint"};
    static const char* const geometries[] = {"inside", "border", "skewed", "lost"};
    Stimulus s;
    s.name = std::string(textures[static_cast<int>(texture)]) + " texture, " + geometries[static_cast<int>(geometry)] +
             ", " + std::to_string(tile_cols) + "x" + std::to_string(tile_rows) + " cells, " + std::to_string(planes) +
             " planes";
    golden::TileJob& t = s.job;
    t.tile_cols = tile_cols, t.tile_rows = tile_rows, t.planes = planes;
    const int cols = golden::sweep_cols(config_, t), rows = golden::sweep_rows(config_, t);
    // Half the disparity runs over as many columns as the buffer has to spare.
    const double spare_cols = std::max(0, config_.img_cols - cols - 2), spare_rows = config_.img_rows - rows - 1;
    const double shift_range = std::min(spare_cols, 0.7 * planes);
    t.win_cols = std::min(config_.img_cols, cols + 2 + static_cast<int>(shift_range));
    t.win_rows = std::min(config_.img_rows, rows + 1 + below(1 + std::max(0, static_cast<int>(spare_rows))));
    t.threshold = below(4) == 0 ? below(1 << config_.mncc_bits) : (1 << config_.mncc_bits) * 3 / 4;

    const bool whole = geometry == Geometry::kBorder;
    auto step = [&] { return geometry == Geometry::kSkewed ? uniform(0.6, 1.4) : 1.0; };
    const double dxl = step(), dxr = step();
    double dyl = step(), dyr = step();
    double x_left = 0.2, x_right = 0.3, y_left = 0, y_right = 0;
    if (whole) x_left = -3, x_right = -1, y_left = -2, y_right = -1;
    if (geometry == Geometry::kSkewed)
      x_left = uniform(-4, 2), x_right = uniform(-4, 2), y_left = uniform(-2, 1), y_right = uniform(-2, 1);
    t.left = t.right = {-1000, 2000, -1000, 2000};
    if (geometry == Geometry::kBorder || geometry == Geometry::kSkewed) {
      // The window's last column and row are replicated ones beyond the image.
      t.left = {0, t.win_cols - 2, 0, t.win_rows - 2};
      t.right = {1, t.win_cols - 3, 0, t.win_rows - 2};
    } else if (geometry == Geometry::kLost) {
      x_left -= 1 + below(3);
      t.win_rows -= below(3);
      t.win_rows = std::max(t.win_rows, 1);
    }
    // A build for rectified pairs refuses samples between rows: half of the skewed tiles are so in x only.
    if (config_.rectified && below(2) == 0) dyl = dyr = 1, y_left = std::floor(y_left), y_right = std::floor(y_right);
    // Only the sum of start and tile offset counts.
    auto split = [&](int32_t& offset) { offset = fixed(uniform(-50, 50)); };
    split(t.tx_left), split(t.ty_left), split(t.tx_right), split(t.ty_right);

    for (int k = 0; k < planes; ++k) {
      const double shift = planes > 1 ? shift_range * k / (planes - 1) : 0;
      auto start = [&](double at, int32_t offset) { return fixed(whole ? std::floor(at) : at) - offset; };
      golden::PlaneEntry p;
      p.x0_left = start(x_left + shift, t.tx_left);
      p.x0_right = start(x_right + shift_range - shift, t.tx_right);
      p.y0_left = start(y_left, t.ty_left);
      p.y0_right = start(y_right, t.ty_right);
      p.dx_left = static_cast<uint32_t>(fixed(dxl)), p.dx_right = static_cast<uint32_t>(fixed(dxr));
      p.dy_left = static_cast<uint32_t>(fixed(dyl)), p.dy_right = static_cast<uint32_t>(fixed(dyr));
      s.table.push_back(p);
    }

    s.left = golden::Pixels(t.win_cols, t.win_rows);
    s.right = golden::Pixels(t.win_cols, t.win_rows);
    const int top = (1 << config_.pix_bits) - 1;
    if (texture == Texture::kStereo) {
      // One smooth texture, seen by both cameras at a plane that grows with the column: a maximum at every cell.
      std::vector<double> noise(static_cast<size_t>(t.win_cols + 64) * t.win_rows);
      for (auto& n : noise) n = uniform(0, 1);
      for (size_t i = 1; i < noise.size(); ++i) noise[i] = 0.55 * noise[i] + 0.45 * noise[i - 1];
      for (int y = 0; y < t.win_rows; ++y) {
        for (int x = 0; x < t.win_cols; ++x) {
          const double depth = 0.2 + 0.6 * x / t.win_cols;  // share of the planes
          auto at = [&](double column) {
            const double c = std::min(std::max(column, 0.0), t.win_cols + 62.0);
            const auto i = static_cast<size_t>(y) * (t.win_cols + 64) + static_cast<size_t>(c);
            const double f = c - std::floor(c);
            return static_cast<uint16_t>(top * (noise[i] * (1 - f) + noise[i + 1] * f));
          };
          s.left.at(x, y) = at(x - x_left - shift_range * depth + 20);
          s.right.at(x, y) = at(x - x_right - shift_range * (1 - depth) + 20);
        }
      }
    } else {
      const auto level = static_cast<uint16_t>(below(top + 1));
      for (auto* image : {&s.left, &s.right})
        for (auto& pixel : image->data)
          pixel = texture == Texture::kConstant    ? level
                  : texture == Texture::kFaint     ? static_cast<uint16_t>(level ^ (below(12) == 0 ? 1 : 0))
                  : texture == Texture::kSaturated ? static_cast<uint16_t>(below(2) * top)
                                                   : static_cast<uint16_t>(below(top + 1));
    }
    return s;
  }
  Stimulus any() {
    return make(static_cast<Texture>(below(5)), static_cast<Geometry>(below(4)), 1 + below(config_.plane_cols),
                1 + below(config_.plane_rows), 1 + below(config_.planes));
  }

 private:
  golden::Config config_;
  std::mt19937 random_;
};

}  // namespace psweep::scene
