// SPDX-License-Identifier: Apache-2.0
// One tile as an engine takes it: its registers and the loaded windows of both images.
#pragma once
#include "contract/config.hpp"
#include "core/image.hpp"

namespace psweep::golden {

using Pixels = Image<uint16_t>;  // pix_bits each

struct TileInput {
  TileJob job;
  Pixels left, right;  // win_cols x win_rows
};

}  // namespace psweep::golden
