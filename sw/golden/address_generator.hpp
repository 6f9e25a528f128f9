// SPDX-License-Identifier: Apache-2.0
// Bit-true model of entity address_generator (paper, section 4.2): where each sample of a plane lies in both images.
#pragma once
#include "contract/config.hpp"

namespace psweep::golden {

// Position of one sample in one image, in coordinates of the loaded window.
struct Sample {
  int xi = 0, yi = 0;     // integer part (floor), -4096 .. 4095
  int fx = 0, fy = 0;     // fraction truncated to weight_bits: 0 .. 2^weight_bits - 1
  bool inside_x = false;  // x_lo <= x <= x_hi on the truncated position, likewise y
  bool inside_y = false;
  bool in_window = false;  // all four neighbours (xi,yi) .. (xi+1,yi+1) are loaded; with `rectified` also fy == 0
};

inline int32_t wrap_add(int32_t a, uint32_t b) { return static_cast<int32_t>(static_cast<uint32_t>(a) + b); }

inline int floor_position(int32_t pos) { return pos >> kPosFrac; }
inline int fraction(const Config& c, int32_t pos) {
  return static_cast<int>((static_cast<uint32_t>(pos) & ((1u << kPosFrac) - 1)) >> (kPosFrac - c.weight_bits));
}
// lo <= position <= hi, with the fraction truncated to weight_bits.
inline bool within(int integer, int frac, int lo, int hi) {
  return integer >= lo && (integer < hi || (integer == hi && frac == 0));
}

// Sample from its two positions. `win_cols/rows`: loaded pixels.
inline Sample make_sample(const Config& c, int32_t x, int32_t y, const Bounds& b, int win_cols, int win_rows) {
  Sample s;
  s.xi = floor_position(x);
  s.yi = floor_position(y);
  s.fx = fraction(c, x);
  s.fy = fraction(c, y);
  s.inside_x = within(s.xi, s.fx, b.x_lo, b.x_hi);
  s.inside_y = within(s.yi, s.fy, b.y_lo, b.y_hi);
  s.in_window = s.xi >= 0 && s.xi + 1 < win_cols && s.yi >= 0 && s.yi + 1 < win_rows;
  // A build for rectified pairs has no weight between rows: such a sample counts as not loaded.
  if (c.rectified && s.fy != 0) s.in_window = false, s.fy = 0;
  return s;
}

// Sample (i,j) of a plane in the left image; the right one likewise.
inline Sample left_sample(const Config& c, const TileJob& t, const PlaneEntry& p, int i, int j) {
  const int32_t x =
      wrap_add(wrap_add(p.x0_left, static_cast<uint32_t>(t.tx_left)), static_cast<uint32_t>(i) * p.dx_left);
  const int32_t y =
      wrap_add(wrap_add(p.y0_left, static_cast<uint32_t>(t.ty_left)), static_cast<uint32_t>(j) * p.dy_left);
  return make_sample(c, x, y, t.left, t.win_cols, t.win_rows);
}
inline Sample right_sample(const Config& c, const TileJob& t, const PlaneEntry& p, int i, int j) {
  const int32_t x =
      wrap_add(wrap_add(p.x0_right, static_cast<uint32_t>(t.tx_right)), static_cast<uint32_t>(i) * p.dx_right);
  const int32_t y =
      wrap_add(wrap_add(p.y0_right, static_cast<uint32_t>(t.ty_right)), static_cast<uint32_t>(j) * p.dy_right);
  return make_sample(c, x, y, t.right, t.win_cols, t.win_rows);
}

// What travels on to the similarity: the sample counts for its column / row if both images agree.
// A sample inside the image but outside the loaded window is an error of the plan: counted, and treated as outside.
struct SampleFlags {
  bool usable = false;        // both images: inside and loaded; else the interpolated pixels are 0
  bool window_error = false;  // inside both images, but not loaded in at least one of them
};
inline SampleFlags sample_flags(const Sample& l, const Sample& r) {
  const bool inside = l.inside_x && l.inside_y && r.inside_x && r.inside_y;
  const bool loaded = l.in_window && r.in_window;
  return {inside && loaded, inside && !loaded};
}

}  // namespace psweep::golden
