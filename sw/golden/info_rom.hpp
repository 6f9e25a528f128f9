// SPDX-License-Identifier: Apache-2.0
// Model of entity info_rom: the words of INFO (docs/protocol.md).
#pragma once
#include <array>
#include <cstdint>

#include "contract/protocol.hpp"

namespace psweep::golden {

// depth: cells that the map buffer has room for.
inline std::array<uint32_t, net::kInfoWords> info_words(const net::ArbiterConfig& a, int depth, uint64_t mac) {
  const auto u = [](auto v) { return static_cast<uint32_t>(v); };
  std::array<uint32_t, net::kInfoWords> w{};
  for (const auto& field : kEngineFields) w[field.info] = u(a.engine.*field.value);
  for (const auto& field : kChipFields) w[field.info] = u(a.*field.value);
  w[0] = uint32_t{net::kVersion} << 16 | net::kInfoWords;  // that was the place of fields without a word
  w[13] = u(a.cell_bits());
  w[14] = u(mac >> 32), w[15] = u(mac);
  w[18] = u(a.pair_bytes()), w[19] = u(a.chunk_pairs()), w[20] = u(a.slots());
  w[21] = u(a.cell_bytes()), w[22] = u(a.chunk_cells()), w[23] = u(depth);
  w[26] = net::kCounterWords;
  return w;
}

}  // namespace psweep::golden
