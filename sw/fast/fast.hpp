// SPDX-License-Identifier: Apache-2.0
// The bit-true model at speed: every map cell equals golden::run_tile's, on any tiling, in any legal format.
// Whole frames need no tiles here: the map is cut into bands of rows, each swept over all planes while its map words
// stay in the cache. Results do not depend on the number of threads or the instruction set. docs/fast.md.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "golden/psweep.hpp"
#include "plan/planner.hpp"

namespace psweep {

// Instruction sets, ascending. kPlain: portable C++, any processor. Every level serves every format; the wider ones are
// fastest where window sums fit 32 bits (pixel plus interpolation bits up to 12 at M = 13, 11 at M = 21).
enum class SimdLevel { kPlain, kAvx2, kAvx512 };
const char* simd_name(SimdLevel level);
// Widest level of this machine; the environment variable PSWEEP_SIMD (plain, avx2, avx512) lowers it.
SimdLevel best_simd_level();
// Levels of this machine, ascending; at least kPlain.
std::vector<SimdLevel> simd_levels();

// Intermediate results of one plane over the swept cells, for tests.
struct FastTrace {
  int plane = 0;
  int u0 = 0, v0 = 0, cols = 0, rows = 0;  // swept cells: map cells u0 .. u0+cols-1, v0 .. v0+rows-1
  CellRange valid;                         // valid cells, relative to (u0,v0)
  std::vector<uint16_t> v;                 // cols * rows; 0 where not valid
  std::vector<uint8_t> textured;           // likewise; meaningful where v == 0 and valid
  std::vector<int> l, r;                   // (cols+M-1) * (rows+M-1) interpolated pixels; defined only where some
                                           // valid cell's window needs them
};

struct FastOptions {
  int threads = 1;  // at least 1
  SimdLevel level = best_simd_level();
  int band_rows = 0;                            // rows per band; 0: chosen for the cache
  std::function<void(double)> progress;         // fraction done, 0 .. 1; from any thread, never two at once
  std::function<void(const FastTrace&)> trace;  // after every plane, ascending; slow
};

// Whole frame. Throws InputError as plan_tiles() does, and if the images do not have the rig's size or a pixel does not
// fit pix_bits.
Image<golden::MapCell> run_fixed(const Gray& left, const Gray& right, const SweepSetup& setup,
                                 const FastOptions& options = {});

// One tile from its loaded windows: golden::run_tile without the observer.
golden::TileResult run_tile_fast(const golden::Config& format, const golden::TileJob& job,
                                 const std::vector<golden::PlaneEntry>& table, const golden::Pixels& left,
                                 const golden::Pixels& right, const FastOptions& options = {});

}  // namespace psweep
