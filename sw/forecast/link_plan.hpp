// SPDX-License-Identifier: Apache-2.0
// What the arbiter's buffers buy: how long the engine stands still for the wire, and how many block RAMs that costs
// (docs/arbiter.md). A forecast, by simulation of events: frames on the wire, messages in the chip, chunks through the
// buffers, load, sweep and unload of each tile, and a host that asks as sw/net/link_engine.cpp does. No packet is ever
// lost, and no time-out strikes.
//   Chip   : docs/protocol.md, 'Life of a tile'; clocks of the engine from golden/control.hpp, of the messages below
//   Wire   : 100 Mbit/s. Half duplex: one medium, CSMA/CD with collisions and backoff (IEEE 802.3, 4.2.3.2.5)
//   Units  : seconds from the first START on; clocks of clk
//   Checked: against the Verilated chip by tb/chip/test_link_plan_chip.cpp
// Errors: InputError if there is no tile, or an option is out of its range.
#pragma once
#include <cstdint>
#include <vector>

#include "contract/config.hpp"
#include "contract/protocol.hpp"

namespace psweep {

struct LinkPlanOptions {
  double clk_mhz = 166;
  int lanes = 1;  // planes swept at once; the sweep takes so many times fewer clocks
  bool half_duplex = false;
  int in_flight = 2;      // 1: the next tile is sent after the map of this one
  double turnaround = 0;  // seconds from a packet's arrival at the host until it reacts
  int window = 16;        // chunks of rows under way, net::LinkOptions
  int medium_delay = 10;  // nibble times each way, half duplex
  uint32_t seed = 1;      // of the backoff
};

struct LinkForecast {
  double launch = 0;           // first tile launched
  double last_beat = 0;        // last map beat of the last tile
  double end = 0;              // last cell at the host
  uint64_t engine_clocks = 0;  // of all tiles without any stall
  // Clocks from the first launch to the last map beat that the engine stood still: between two tiles (for rows, for
  // START), for pixels during load, and for room during unload.
  uint64_t stall_idle = 0, stall_load = 0, stall_unload = 0;
  uint64_t frames_up = 0, frames_down = 0, map_packets = 0, map_repeated = 0, collisions = 0;

  uint64_t stall() const { return stall_idle + stall_load + stall_unload; }
  double busy() const { return static_cast<double>(engine_clocks) / static_cast<double>(engine_clocks + stall()); }
};
LinkForecast forecast_link(const net::ArbiterConfig& chip, const std::vector<golden::TileJob>& tiles,
                           const LinkPlanOptions& options);

// Block RAMs of 36 Kb (halves: RAMB18) that a memory of this width and depth takes on xc6v, as Yosys maps it.
double ram36(int width, int depth);

// Likewise entity ram_deep, with G_NINES.
double ram_deep36(int width, int depth, int nines);

struct BufferRam {
  double rows = 0, map = 0;  // row_buffer, map_buffer
  double total() const { return rows + map; }
};
BufferRam buffer_ram(const net::ArbiterConfig& chip);

}  // namespace psweep
