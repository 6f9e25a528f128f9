// SPDX-License-Identifier: Apache-2.0
// Tiles over the link: sends windows, starts tiles, collects maps, with several tiles in work at once. Survives loss,
// repetition, reordering and corruption of any packet, a pulled cable (shorter than the client's timeout) and a chip
// that forgot its session or was reset, and tiles that the engine dropped; docs/host.md says how.
// Errors: LinkError if the chip falls silent before every cell has arrived, or if one tile fails three times: dropped,
// refused, or with samples outside the loaded window.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "contract/tile.hpp"
#include "net/client.hpp"

namespace psweep::net {

struct LinkOptions {
  int in_flight = 2;  // 1: the next tile is sent after the map of this one; 2: as soon as the chip takes it
  int window = 16;    // chunks of rows under way; requests that are urgent wait behind them
};

struct LinkFigures {
  uint64_t pixel_bytes = 0, cell_bytes = 0;  // useful ones: every chunk once
  double seconds = 0;                        // from before the session to after it
  uint64_t engine_clocks = 0;                // sum of the chip's tile_clocks
  uint64_t wait_rows_clocks = 0, wait_map_clocks = 0;
  // Tiles that failed and were sent again; how often each of the engine's error bits was the reason.
  uint64_t tiles_repeated = 0;
  std::array<uint64_t, 8> repeated_by_error{};
  // Tiles, one at most, whose cells had all arrived when the chip fell silent before it said that no error came up.
  int tiles_unconfirmed = 0;
  std::vector<uint32_t> counters_before, counters_after;  // after: empty if the chip was silent by then
};

// Payloads. Exposed for tests and the link's benchmark.
Bytes start_payload(const ArbiterConfig& c, const golden::TileJob& job, uint16_t table);
std::vector<Bytes> row_chunks(const ArbiterConfig& c, const golden::TileInput& tile);
Bytes read_payload(uint16_t count, uint16_t keep);
// One chunk of cells; false if a cell cannot come from this tile.
bool decode_cells(const ArbiterConfig& c, const golden::TileJob& job, const Bytes& bytes, size_t first,
                  std::vector<golden::MapCell>& cells);
// Writes the plane table as table 1 of a fresh session. False if the session was lost; LinkError if the chip refuses.
bool write_table(Client& client, const ArbiterConfig& c, const std::vector<golden::PlaneEntry>& table);

// Tiles 0 .. count-1. `input` is called in order, once for each tile and again for those that have to be repeated;
// `output` once for each, in order; `progress` with cells received. The session is opened and closed here.
LinkFigures run_link_tiles(Client& client, const Capabilities& chip, const std::vector<golden::PlaneEntry>& table,
                           int count, const LinkOptions& options, const std::function<golden::TileInput(int)>& input,
                           const std::function<void(int, std::vector<golden::MapCell>)>& output,
                           const std::function<void(uint64_t cells)>& progress);

}  // namespace psweep::net
