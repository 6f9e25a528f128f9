// SPDX-License-Identifier: Apache-2.0
// The generics of engine and chip: structs with a member each, and tables to loop over them.
// Written by scripts/configurations.py header from rtl/configs/{engine,chip}.schema.json; not by hand.
#pragma once
#include <array>
#include <cstdint>

namespace psweep {

// size: what is asked for must fit into it; format: it decides the bits of the results; build: neither.
enum class Role { size, format, build };

// One generic. Legal values: if allowed is not 0, it has a one for each; else lowest .. highest with value mod
// multiple = rest, and not forbidden.
template <class Struct>
struct Generic {
  const char* key;
  const char* generic;
  const char* meaning;
  const char* range;  // in words
  Role role;
  int Struct::*value;
  int lowest, highest, multiple, rest, forbidden;
  uint64_t allowed;
  int info;  // word of the INFO message, 0: none

  constexpr bool holds(int64_t v) const {
    if (allowed != 0) return v >= 0 && v < 64 && (allowed >> v & 1) != 0;
    return v >= lowest && v <= highest && v % multiple == rest && v != forbidden;
  }
};

// Generics of entity psweep.
struct EngineFields {
  // G_IMG_COLS: image buffer, columns; 4 .. 4096, even
  int img_cols = 340;
  // G_IMG_ROWS: image buffer, rows; 4 .. 4096, even
  int img_rows = 144;
  // G_PLANE_COLS: largest tile, columns of cells; 1 .. 4096
  int plane_cols = 256;
  // G_PLANE_ROWS: largest tile, rows of cells; 1 .. 4096
  int plane_rows = 130;
  // G_PLANES: largest number of planes; 1 .. 1024
  int planes = 301;
  // G_WINDOW: side of the correlation window M; 3 .. 21, odd
  int window = 13;
  // G_PIX_W: bits of a pixel; 1 .. 12
  int pix_bits = 8;
  // G_WEIGHT_W: fraction bits of a sample position that reach the interpolation; 1 .. 12
  int weight_bits = 8;
  // G_INTERP_F: fraction bits of an interpolated pixel; 0 .. 8
  int interp_frac = 2;
  // G_MNCC_W: bits of the score V; 4 .. 16
  int mncc_bits = 13;
  // G_FRAC_W: fraction bits of a cell's position between planes; 2 .. 12
  int frac_bits = 8;
  // G_LANES: planes swept at once; 1, 2 or 4
  int lanes = 1;
  // G_RECTIFIED: 1: smaller build without interpolation between rows; 0 or 1
  int rectified = 0;
  // G_DIVIDER: divider of the score, 0: digit by digit, 1: by multiplication; the results are the same; 0 or 1
  int divider = 0;
  // G_SPLIT: 1: products in two parts, for multipliers of 18 x 18 bits; the results and clocks are the same; 0 or 1
  int split = 0;
};

// clang-format off
inline constexpr std::array<Generic<EngineFields>, 15> kEngineFields = {{
    {"img_cols", "G_IMG_COLS",
     "image buffer, columns",
     "4 .. 4096, even", Role::size, &EngineFields::img_cols, 4, 4096, 2, 0, -1, 0, 1},
    {"img_rows", "G_IMG_ROWS",
     "image buffer, rows",
     "4 .. 4096, even", Role::size, &EngineFields::img_rows, 4, 4096, 2, 0, -1, 0, 2},
    {"plane_cols", "G_PLANE_COLS",
     "largest tile, columns of cells",
     "1 .. 4096", Role::size, &EngineFields::plane_cols, 1, 4096, 1, 0, -1, 0, 3},
    {"plane_rows", "G_PLANE_ROWS",
     "largest tile, rows of cells",
     "1 .. 4096", Role::size, &EngineFields::plane_rows, 1, 4096, 1, 0, -1, 0, 4},
    {"planes", "G_PLANES",
     "largest number of planes",
     "1 .. 1024", Role::size, &EngineFields::planes, 1, 1024, 1, 0, -1, 0, 5},
    {"window", "G_WINDOW",
     "side of the correlation window M",
     "3 .. 21, odd", Role::format, &EngineFields::window, 3, 21, 2, 1, -1, 0, 6},
    {"pix_bits", "G_PIX_W",
     "bits of a pixel",
     "1 .. 12", Role::format, &EngineFields::pix_bits, 1, 12, 1, 0, -1, 0, 7},
    {"weight_bits", "G_WEIGHT_W",
     "fraction bits of a sample position that reach the interpolation",
     "1 .. 12", Role::format, &EngineFields::weight_bits, 1, 12, 1, 0, -1, 0, 8},
    {"interp_frac", "G_INTERP_F",
     "fraction bits of an interpolated pixel",
     "0 .. 8", Role::format, &EngineFields::interp_frac, 0, 8, 1, 0, -1, 0, 9},
    {"mncc_bits", "G_MNCC_W",
     "bits of the score V",
     "4 .. 16", Role::format, &EngineFields::mncc_bits, 4, 16, 1, 0, -1, 0, 10},
    {"frac_bits", "G_FRAC_W",
     "fraction bits of a cell's position between planes",
     "2 .. 12", Role::format, &EngineFields::frac_bits, 2, 12, 1, 0, -1, 0, 11},
    {"lanes", "G_LANES",
     "planes swept at once",
     "1, 2 or 4", Role::build, &EngineFields::lanes, 1, 4, 1, 0, -1, 22, 12},
    {"rectified", "G_RECTIFIED",
     "1: smaller build without interpolation between rows",
     "0 or 1", Role::build, &EngineFields::rectified, 0, 1, 1, 0, -1, 3, 27},
    {"divider", "G_DIVIDER",
     "divider of the score, 0: digit by digit, 1: by multiplication; the results are the same",
     "0 or 1", Role::build, &EngineFields::divider, 0, 1, 1, 0, -1, 3, 0},
    {"split", "G_SPLIT",
     "1: products in two parts, for multipliers of 18 x 18 bits; the results and clocks are the same",
     "0 or 1", Role::build, &EngineFields::split, 0, 1, 1, 0, -1, 3, 0},
}};
// clang-format on

// Those that psweep_top adds.
struct ChipFields {
  // G_CLK_KHZ: clock of the engine in kHz; 1000 .. 1000000
  int clk_khz = 166000;
  // G_CHUNK_BYTES: data bytes of a packet; 16 .. 1440
  int chunk_bytes = 1408;
  // G_ROW_SLOTS: chunks that the row buffer holds; 0: as many as the largest window needs; 0 .. 1024, not 1
  int row_slots = 0;
  // G_MAP_DEPTH: cells that the map buffer holds, rounded up to chunks; 0: the largest tile; at least 0
  int map_depth = 0;
  // G_RX_SLOTS: frames that may wait for the responder; 2 or 4
  int rx_slots = 2;
  // G_SESSION_MS: silence in ms that ends a session; 1 .. 65535
  int session_ms = 10000;
  // G_UDP_PORT: UDP port; 1 .. 65535
  int udp_port = 20563;
  // G_MAC_HI: MAC address, upper 24 bits (02:00:50); 0 .. 16777215
  int mac_hi = 131152;
  // G_MAC_LO: MAC address, lower 24 bits (53:57:01); 0 .. 16777215
  int mac_lo = 5461761;
  // G_IP_HI: IPv4 address, upper 16 bits (10.5); 0 .. 65535
  int ip_hi = 2565;
  // G_IP_LO: IPv4 address, lower 16 bits (0.2); 0 .. 65535
  int ip_lo = 2;
};

// clang-format off
inline constexpr std::array<Generic<ChipFields>, 11> kChipFields = {{
    {"clk_khz", "G_CLK_KHZ",
     "clock of the engine in kHz",
     "1000 .. 1000000", Role::build, &ChipFields::clk_khz, 1000, 1000000, 1, 0, -1, 0, 16},
    {"chunk_bytes", "G_CHUNK_BYTES",
     "data bytes of a packet",
     "16 .. 1440", Role::size, &ChipFields::chunk_bytes, 16, 1440, 1, 0, -1, 0, 17},
    {"row_slots", "G_ROW_SLOTS",
     "chunks that the row buffer holds; 0: as many as the largest window needs",
     "0 .. 1024, not 1", Role::size, &ChipFields::row_slots, 0, 1024, 1, 0, 1, 0, 20},
    {"map_depth", "G_MAP_DEPTH",
     "cells that the map buffer holds, rounded up to chunks; 0: the largest tile",
     "at least 0", Role::size, &ChipFields::map_depth, 0, 2147483647, 1, 0, -1, 0, 23},
    {"rx_slots", "G_RX_SLOTS",
     "frames that may wait for the responder",
     "2 or 4", Role::size, &ChipFields::rx_slots, 2, 4, 1, 0, -1, 20, 25},
    {"session_ms", "G_SESSION_MS",
     "silence in ms that ends a session",
     "1 .. 65535", Role::build, &ChipFields::session_ms, 1, 65535, 1, 0, -1, 0, 24},
    {"udp_port", "G_UDP_PORT",
     "UDP port",
     "1 .. 65535", Role::build, &ChipFields::udp_port, 1, 65535, 1, 0, -1, 0, 0},
    {"mac_hi", "G_MAC_HI",
     "MAC address, upper 24 bits (02:00:50)",
     "0 .. 16777215", Role::build, &ChipFields::mac_hi, 0, 16777215, 1, 0, -1, 0, 0},
    {"mac_lo", "G_MAC_LO",
     "MAC address, lower 24 bits (53:57:01)",
     "0 .. 16777215", Role::build, &ChipFields::mac_lo, 0, 16777215, 1, 0, -1, 0, 0},
    {"ip_hi", "G_IP_HI",
     "IPv4 address, upper 16 bits (10.5)",
     "0 .. 65535", Role::build, &ChipFields::ip_hi, 0, 65535, 1, 0, -1, 0, 0},
    {"ip_lo", "G_IP_LO",
     "IPv4 address, lower 16 bits (0.2)",
     "0 .. 65535", Role::build, &ChipFields::ip_lo, 0, 65535, 1, 0, -1, 0, 0},
}};
// clang-format on

}  // namespace psweep
