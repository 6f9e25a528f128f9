// SPDX-License-Identifier: Apache-2.0
// Between fast.cpp and the sweeps compiled per instruction set: plain data and function pointers only, so that no
// inline function compiled with wide instructions can end up in code for other machines.
//
// Strided layout: a row of cells is cut into `lanes` stretches of `stride` cells; element t * lanes + lane belongs to
// cell lane * stride + t. All lanes of a vector advance through their stretches together, so the horizontal running
// sums of the hardware become vector additions. Each stretch needs its own skirt of M-1 samples: `taps` =
// stride + M - 1 vectors of samples per row. With one lane this is the plain raster.
#pragma once
#include <cstddef>
#include <cstdint>

namespace psweep::fast {

// One plane of one band. Cells and samples count from the band's first.
struct PlaneWork {
  bool empty = true;                           // no valid cell in this band
  int u_lo = 0, u_hi = 0, v_lo = 0, v_hi = 0;  // valid cells
  int64_t left_start = 0, right_start = 0;     // x of sample 0, 19 fraction bits, in pixels of the picture
  uint32_t left_step = 0, right_step = 0;      // per sample
  int left_first = 0, right_first = 0;         // unit steps: vector of the strided source that holds sample 0 of lane 0
  int left_weight = 0, right_weight = 0;       // unit steps: fx, the same for the whole plane
};

// Vertically interpolated rows of both pictures, ufix(pix_bits, weight_bits): one row per row of samples.
struct RowSource {
  const int32_t* left;
  const int32_t* right;
  int left_width, right_width;
};

// What the window sums need: 32 bits; 64 bits, but all products of sums exact in doubles; 64 bits.
enum class SumWidth { k32, k53, k64 };

struct Band {
  // Format.
  int window, pix_bits, weight_bits, interp_frac, mncc_bits, frac_bits;
  // Geometry.
  int cols, rows;    // cells
  int stride, taps;  // see above
  int row_len;       // elements of a row of map words: stride * lanes, rounded up to 32
  const PlaneWork* planes;
  SumWidth sums;
  // Samples. Unit steps without vertical fraction: pixels in strided layout, left_len elements per row of samples.
  // Otherwise null, and rows_of() gives the rows that plane k interpolates from.
  const uint8_t* left;
  const uint8_t* right;
  size_t left_len, right_len;
  RowSource (*rows_of)(void* context, int k);
  void* rows_context;
  // Map words: rows * row_len elements, zero before the first plane but for plane = kNoPlane.
  uint16_t* best;
  uint16_t* prev;
  uint16_t* plane;
  uint16_t* frac;
  uint16_t* flags;     // opaque, see SweepLevel::local_max
  uint16_t* textured;  // rows * stride words, bit per lane: A + B > 0 at some plane where valid
  // Scratch, no meaning between calls.
  const uint16_t* cell_index;  // row_len: the cell of each element, 0xFFFF beyond the last
  uint16_t* v;                 // row_len
  int32_t* ring;               // window * taps * lanes * 2
  void* column;                // taps * lanes * 4 * 8 bytes
  void* windows;               // taps * 4 * 8 bytes, raster sweep only
  int32_t* line;               // 2 * (stride * lanes + window - 1), zero at first: rows of samples in raster order
  // Trace, or null: V and samples of the (single) plane swept.
  uint16_t* trace_v;  // rows * row_len
  int32_t* trace_l;   // (rows + M - 1) * taps * lanes, strided
  int32_t* trace_r;
};
constexpr uint16_t kNoPlane = 0xFFFE;

struct SweepLevel {
  int lanes;
  // Sweeps planes first .. last-1 and updates the map words.
  void (*sweep)(const Band& band, int first, int last);
  // The winner of element `at` (row * row_len + t * lanes + lane) is a local maximum.
  bool (*local_max)(const Band& band, size_t at);
};
// Strided, for SumWidth::k32 only; and raster, for any.
extern const SweepLevel kStridedAvx2, kStridedAvx512;
extern const SweepLevel kRasterPlain, kRasterAvx2, kRasterAvx512;

}  // namespace psweep::fast
