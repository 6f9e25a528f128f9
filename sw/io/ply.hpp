// SPDX-License-Identifier: Apache-2.0
// Point clouds as binary little-endian PLY. Per vertex: float x y z (metres, cyclopean eye: X right, Y down, Z
// forward), uchar red green blue (all three the grey value, because viewers know those names), float confidence
// (best MNCC, 0 .. 1).
#pragma once
#include <cstdint>
#include <filesystem>
#include <vector>

namespace psweep {

struct CloudPoint {
  float x = 0, y = 0, z = 0;  // metres
  uint8_t grey = 0;
  float confidence = 0;
};

void write_ply(const std::filesystem::path& path, const std::vector<CloudPoint>& points);
// Reads back what write_ply wrote (the report page does); other layouts are refused.
std::vector<CloudPoint> read_ply(const std::filesystem::path& path);

}  // namespace psweep
