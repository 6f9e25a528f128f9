// SPDX-License-Identifier: Apache-2.0
// Model of entity chunk_check: as many chunks as the pixels fill, the last one perhaps in part.
#pragma once
#include <cstdint>

namespace psweep::golden {

inline bool chunks_fit(uint32_t pixels, uint32_t chunks, uint32_t chunk_pairs) {
  return chunks == (pixels + chunk_pairs - 1) / chunk_pairs;
}

}  // namespace psweep::golden
