// SPDX-License-Identifier: Apache-2.0
// RtlEngine: entity psweep, converted and Verilated, behind the same tile interface as the bit-true model.
// The generics are fixed when a configuration is built (rtl/configs/engine/*.json and, added by the user,
// <build>/configs/*.json); this header needs no Verilator.
//
//   golden::Config need = ..;                       // formats exact, sizes at least
//   const rtl::Configuration* c = rtl::find_configuration(need);
//   if (!c) throw InputError(".. build one with: " + rtl::build_command(need));
//   rtl::run_tiles(*c, table, tiles, threads, [&](int i) { return input of tile i; }, [&](int i, rtl::TileOutput out) {
//   .. });
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "contract/config.hpp"
#include "contract/tile.hpp"

namespace psweep::rtl {

class EngineModel;  // one Verilated engine, sw/verilated/engine_model.hpp

struct Configuration {
  std::string name;
  std::string description;
  golden::Config config;
  std::unique_ptr<EngineModel> (*make)();
};

// All configurations in this binary, sorted by name.
const std::vector<Configuration>& configurations();

// A configuration serves `need` if window and all number formats are equal and buffer, tile and planes are at least as
// large. Of several the one with the smallest map; nullptr if none.
bool serves(const golden::Config& built, const golden::Config& need);
const Configuration* find_configuration(const golden::Config& need);

// The shell command (in the root of the repository) which builds a configuration that serves `need`.
std::string build_command(const golden::Config& need);

// The engine refused or dropped a tile, or did not finish: says which error bits and where it stood.
class EngineError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct TileOutput {
  std::vector<golden::MapCell> cells;  // tile_cols * tile_rows, raster
  uint64_t clocks = 0;                 // port tile_clocks: start command to last map beat
  uint64_t all_clocks = 0;             // these, and register and table writes
  unsigned errors = 0;                 // sticky bits set by this tile; only `window` can come with a complete tile
  unsigned window_errors = 0;          // samples inside the image but not loaded, saturating at 65535
};

class RtlEngine {
 public:
  explicit RtlEngine(const Configuration& configuration);
  ~RtlEngine();
  RtlEngine(RtlEngine&&) noexcept;
  RtlEngine& operator=(RtlEngine&&) noexcept;

  const golden::Config& config() const;

  // Written into the engine's table with the next tile; stays for all later tiles. At most G_PLANES entries.
  void set_table(const std::vector<golden::PlaneEntry>& table);

  // One tile. Throws EngineError; the engine can be used again afterwards (it is reset).
  TileOutput run(const golden::TileJob& job, const golden::Pixels& left, const golden::Pixels& right);

  // Every simulated clock is added here as it happens (in steps of some thousand), for progress displays.
  void count_clocks_in(std::atomic<uint64_t>* counter);

 private:
  golden::Config config_;
  std::unique_ptr<EngineModel> model_;
};

// Runs tiles 0 .. count-1 on `threads` engines (0: one per core). `input` and `output` are called from the worker
// threads, never two at a time, in no particular order. The first exception stops all workers and is thrown again here.
void run_tiles(const Configuration& configuration, const std::vector<golden::PlaneEntry>& table, int count, int threads,
               const std::function<golden::TileInput(int)>& input, const std::function<void(int, TileOutput)>& output,
               std::atomic<uint64_t>* clock_counter = nullptr);

}  // namespace psweep::rtl
