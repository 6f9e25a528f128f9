// SPDX-License-Identifier: Apache-2.0
// PFM, one channel ("Pf"): 32-bit floats, bottom row first; a negative scale means little endian. Written files are
// always little endian with scale -1. +inf and NaN pass through unchanged.
// Errors: InputError naming the file and the field (magic, width, height, scale, pixels).
#pragma once
#include <filesystem>

#include "core/image.hpp"

namespace psweep {

FloatImage read_pfm(const std::filesystem::path& path);
void write_pfm(const std::filesystem::path& path, const FloatImage& image);

}  // namespace psweep
