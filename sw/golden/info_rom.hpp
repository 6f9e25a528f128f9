// SPDX-License-Identifier: Apache-2.0
// Model of entity info_rom: the words of INFO (docs/protocol.md).
#pragma once
#include <array>
#include <cstdint>

#include "net/protocol.hpp"

namespace psweep::golden {

// depth: cells that the map buffer has room for.
inline std::array<uint32_t, net::kInfoWords> info_words(const net::ArbiterConfig& a, int depth, uint64_t mac) {
  const Config& c = a.engine;
  const auto u = [](auto v) { return static_cast<uint32_t>(v); };
  return {uint32_t{net::kVersion} << 16 | net::kInfoWords,
          u(c.img_cols),
          u(c.img_rows),
          u(c.plane_cols),
          u(c.plane_rows),
          u(c.planes),
          u(c.window),
          u(c.pix_bits),
          u(c.weight_bits),
          u(c.interp_frac),
          u(c.mncc_bits),
          u(c.frac_bits),
          u(c.lanes),
          u(a.cell_bits()),
          u(mac >> 32),
          u(mac),
          u(a.clk_khz),
          u(a.chunk_bytes),
          u(a.pair_bytes()),
          u(a.chunk_pairs()),
          u(a.slots()),
          u(a.cell_bytes()),
          u(a.chunk_cells()),
          u(depth),
          u(a.session_ms),
          u(a.rx_slots),
          net::kCounterWords,
          u(c.rectified)};
}

}  // namespace psweep::golden
