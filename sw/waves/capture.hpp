// SPDX-License-Identifier: Apache-2.0
// One cell of one plane on its way through the engine: its clocks, and a wave file trimmed to them.
//   Clocks     : found in a first run, on the debug ports; the second run dumps; control's are counted in the dump
//   Signals    : those of the VHDL, and scope `cell` with those that the layouts ask for: which cell is at a stage
//                (plane, column, row), whether it is this one (here), its lane's field of a bundle, one bit of a vector
//   Which cell : a sample belongs to the cell whose window it completes, the one M-1 columns left of and M-1 rows above
//                it; the first M-1 samples of a row and rows of a plane complete none: their columns and rows are < 0
#pragma once
#include <array>
#include <string>
#include <vector>

#include "waves/engines.hpp"
#include "waves/fst.hpp"
#include "waves/layout.hpp"

namespace psweep::waves {

struct Cell {
  int plane = 0, column = 0, row = 0;
};

// Hand-overs, in the order of the data: entity n's output, and the next one's input.
enum Place { kControlOut, kAddressOut, kStorageOut, kInterpolationOut, kSimilarityOut, kMapWrite, kPlaces };
const char* place_name(int place);

struct Capture {
  const Engine* engine = nullptr;
  scene::Stimulus stimulus;
  Cell cell;
  int lane = 0, set = 0;                    // plane = set * lanes + lane
  std::array<uint64_t, kPlaces> here{};     // clock at which the cell's last sample, then the cell, is there
  std::array<uint64_t, kPlaces> entered{};  // clock of the first sample of its window; of a cell: as here
  uint64_t first = 0, last = 0;             // clocks in the file
  std::string fst;
  std::vector<golden::MapCell> cells;
  std::map<std::string, int> keys;  // of the configuration, and lane
};

// Throws WaveError if the engine's configuration has no such cell.
void check_cell(const Engine& engine, const scene::Stimulus& stimulus, const Cell& cell);

// Runs the tile and writes the waves, with the signals that these layouts ask for.
Capture capture(const Engine& engine, const scene::Stimulus& stimulus, const Cell& cell,
                const std::vector<Layout>& layouts, const std::string& file);

// All layouts of a configuration.
std::vector<Layout> read_layouts(const std::string& folder, const Engine& engine, const Cell& cell);

// The GTKWave save file of one layout.
void write_save_file(const Capture& capture, const Layout& layout, const std::string& file);

// Path of an instance below psweep, "psweep.u_control"; of lane `lane` if there is one per lane.
std::string scope_of(const FstReader& waves, const std::string& module, bool per_lane, int lane);

// Where the samples or cells of an entity's signals are counted.
int base_of(const std::string& module);

}  // namespace psweep::waves
