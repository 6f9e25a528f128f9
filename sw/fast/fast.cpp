// SPDX-License-Identifier: Apache-2.0
// Contract: fast.hpp. Here: where samples lie, bands, threads, choice of instruction set; the sweep itself is in
// sweep_*.cpp.
#include "fast/fast.hpp"

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <thread>

#include "core/error.hpp"
#include "fast/sweep.hpp"

namespace psweep {
namespace {

using fast::Band;
using fast::PlaneWork;
using fast::SweepLevel;
using golden::Config;

constexpr int64_t kOne = int64_t{1} << golden::kPosFrac;

// One image, one axis, one plane: position(s) = start + s * step of sample s, in pixels of the given picture.
struct Line {
  int64_t start = 0, step = 0;
  int64_t at(int64_t s) const { return start + s * step; }
  bool operator==(const Line& o) const { return start == o.start && step == o.step; }
};
// One plane over the swept region. Samples and cells count from the region's first.
struct PlaneLines {
  Line left_x, left_y, right_x, right_y;
  CellRange valid;
};

// What is swept: a rectangle of cells at all planes.
struct Region {
  Config format;
  int cols = 0, rows = 0;
  std::vector<PlaneLines> planes;
  golden::Pixels left, right;  // every sample of a valid cell has its four neighbours here
  int threshold = 0;
  int u0 = 0, v0 = 0;  // map cell of the region's first, for the trace
};

template <class T>
struct FreeAligned {
  void operator()(T* p) const { ::operator delete (p, std::align_val_t{64}); }
};
// Zeroed array on a cache line, so that vector loads are aligned.
template <class T>
class Aligned {
 public:
  explicit Aligned(size_t count) : data_(static_cast<T*>(::operator new (count * sizeof(T), std::align_val_t{64}))) {
    std::memset(static_cast<void*>(data_.get()), 0, count * sizeof(T));
  }
  T* get() const { return data_.get(); }

 private:
  std::unique_ptr<T, FreeAligned<T>> data_;
};

// Widest numbers that the sums of a format need. Samples are centred, within +-h; n = M*M. Window sums of squares reach
// n 2h^2, their products n * n 2h^2. Where the former fit 31 bits, vertical sums M h fit the 16 bits of the strided
// sweep: (M h)^2 <= 2^30.
fast::SumWidth sum_width(const Config& c) {
  const double half = std::ldexp(1.0, c.sample_bits() - 1), n = c.window * c.window, squares = n * 2 * half * half;
  if (squares <= 2147483647.0) return fast::SumWidth::k32;
  return n * squares <= std::ldexp(1.0, 52) ? fast::SumWidth::k53 : fast::SumWidth::k64;
}

const SweepLevel& sweep_level(SimdLevel level, fast::SumWidth sums) {
#ifdef PSWEEP_X86
  const bool strided = sums == fast::SumWidth::k32;
  if (level == SimdLevel::kAvx512) return strided ? fast::kStridedAvx512 : fast::kRasterAvx512;
  if (level == SimdLevel::kAvx2) return strided ? fast::kStridedAvx2 : fast::kRasterAvx2;
#endif
  (void)level;
  (void)sums;
  return fast::kRasterPlain;
}

// The planes' weights are constant and their rows whole pixels: interpolation is one multiply-add per pixel of 16 bits.
bool unit_steps(const Region& r) {
  if (r.format.pix_bits > 8 || r.format.pix_bits + r.format.weight_bits > 16 ||
      r.format.interp_frac > r.format.weight_bits) {
    return false;
  }
  const int w = r.format.weight_bits;
  auto whole = [&](const Line& y) { return ((y.start >> (golden::kPosFrac - w)) & ((1 << w) - 1)) == 0; };
  const PlaneLines* first = nullptr;
  for (const auto& p : r.planes) {
    if (p.valid.empty()) continue;
    if (!first) first = &p;
    if (p.left_x.step != kOne || p.right_x.step != kOne || p.left_y.step != kOne || p.right_y.step != kOne ||
        !whole(p.left_y) || !whole(p.right_y) || !(p.left_y == first->left_y) || !(p.right_y == first->right_y)) {
      return false;
    }
  }
  return true;
}

// Vertically interpolated rows of a band's pictures. Vertical interpolation comes first (the bilinear form is exact, so
// the order does not matter) and is kept over the planes as long as rows do not move: with a rig they never do.
class BlendedRows {
 public:
  BlendedRows(const Region& region, int first_row, int rows) : region_(region), first_row_(first_row), rows_(rows) {}

  static fast::RowSource rows_of(void* context, int k) {
    auto* self = static_cast<BlendedRows*>(context);
    const PlaneLines& p = self->region_.planes[static_cast<size_t>(k)];
    self->blend(self->left_, self->region_.left, p.left_y);
    self->blend(self->right_, self->region_.right, p.right_y);
    return {self->left_.data.data(), self->right_.data.data(), self->region_.left.width, self->region_.right.width};
  }

 private:
  struct Rows {
    Line y;
    std::vector<int32_t> data;  // rows_ x picture width, ufix(pix_bits, weight_bits)
  };

  void blend(Rows& rows, const golden::Pixels& picture, const Line& y) const {
    if (!rows.data.empty() && rows.y == y) return;
    const int w = region_.format.weight_bits, width = picture.width;
    rows.y = y;
    rows.data.resize(static_cast<size_t>(rows_) * width);
    for (int j = 0; j < rows_; ++j) {
      const int64_t pos = y.at(first_row_ + j);
      const int yi = static_cast<int>(std::clamp<int64_t>(pos >> golden::kPosFrac, 0, picture.height - 1));
      const int32_t fy = static_cast<int32_t>(pos >> (golden::kPosFrac - w)) & ((1 << w) - 1);
      const uint16_t* top = picture.row(yi);
      const uint16_t* bottom = picture.row(std::min(yi + 1, picture.height - 1));
      int32_t* target = rows.data.data() + static_cast<size_t>(j) * width;
      for (int x = 0; x < width; ++x) target[x] = (top[x] << w) + (bottom[x] - top[x]) * fy;
    }
  }

  const Region& region_;
  int first_row_, rows_;
  Rows left_, right_;
};

// Rows first_row .. first_row + rows - 1 of the region, all planes.
class BandSweep {
 public:
  BandSweep(const Region& region, const SweepLevel& level, bool unit, int first_row, int rows, bool trace)
      : region_(region),
        level_(level),
        first_row_(first_row),
        lanes_(level.lanes),
        stride_((region.cols + lanes_ - 1) / lanes_),
        taps_(stride_ + region.format.window - 1),
        row_len_((stride_ * lanes_ + 31) / 32 * 32),
        sample_rows_(rows + region.format.window - 1),
        blended_(region, first_row, sample_rows_),
        planes_(plane_work(rows)),
        map_(static_cast<size_t>(rows) * row_len_ * 5),
        textured_(static_cast<size_t>(rows) * stride_),
        cell_index_(static_cast<size_t>(row_len_)),
        v_(static_cast<size_t>(row_len_)),
        ring_(static_cast<size_t>(region.format.window) * taps_ * lanes_ * 2),
        column_(static_cast<size_t>(taps_) * lanes_ * 4),
        windows_(static_cast<size_t>(taps_) * 4),
        line_(2 * (static_cast<size_t>(stride_) * lanes_ + region.format.window - 1)) {
    const Config& c = region.format;
    band_.window = c.window;
    band_.pix_bits = c.pix_bits;
    band_.weight_bits = c.weight_bits;
    band_.interp_frac = c.interp_frac;
    band_.mncc_bits = c.mncc_bits;
    band_.frac_bits = c.frac_bits;
    band_.cols = region.cols;
    band_.rows = rows;
    band_.stride = stride_;
    band_.taps = taps_;
    band_.row_len = row_len_;
    if (unit) {
      stride_picture(region.left, &PlaneLines::left_x, &PlaneLines::left_y, &PlaneWork::left_first,
                     &PlaneWork::left_weight, left_, band_.left_len);
      stride_picture(region.right, &PlaneLines::right_x, &PlaneLines::right_y, &PlaneWork::right_first,
                     &PlaneWork::right_weight, right_, band_.right_len);
    }
    band_.left = left_ ? left_->get() : nullptr;
    band_.right = right_ ? right_->get() : nullptr;
    band_.rows_of = BlendedRows::rows_of;
    band_.rows_context = &blended_;
    band_.sums = sum_width(c);
    band_.planes = planes_.data();
    const size_t words = static_cast<size_t>(rows) * row_len_;
    band_.best = map_.get();
    band_.prev = map_.get() + words;
    band_.plane = map_.get() + 2 * words;
    band_.frac = map_.get() + 3 * words;
    band_.flags = map_.get() + 4 * words;
    std::fill_n(band_.plane, words, fast::kNoPlane);
    band_.textured = textured_.get();
    for (int i = 0; i < row_len_; ++i) {
      const int u = i < stride_ * lanes_ ? i % lanes_ * stride_ + i / lanes_ : region.cols;
      cell_index_.get()[i] = static_cast<uint16_t>(u < region.cols ? u : 0xFFFF);
    }
    band_.cell_index = cell_index_.get();
    band_.v = v_.get();
    band_.ring = ring_.get();
    band_.column = column_.get();
    band_.windows = windows_.get();
    band_.line = line_.get();
    band_.trace_v = nullptr;
    band_.trace_l = band_.trace_r = nullptr;
    if (trace) {
      const size_t samples = static_cast<size_t>(sample_rows_) * taps_ * lanes_;
      trace_v_ = std::make_unique<Aligned<uint16_t>>(words);
      trace_samples_ = std::make_unique<Aligned<int32_t>>(2 * samples);
      band_.trace_v = trace_v_->get();
      band_.trace_l = trace_samples_->get();
      band_.trace_r = trace_samples_->get() + samples;
    }
  }

  void sweep(int first, int last) { level_.sweep(band_, first, last); }

  // One plane, and what it computed. Only for a band that is the whole region.
  FastTrace sweep_traced(int k) {
    const size_t words = static_cast<size_t>(band_.rows) * row_len_;
    const std::vector<uint16_t> before(band_.textured, band_.textured + static_cast<size_t>(band_.rows) * stride_);
    std::fill_n(band_.textured, before.size(), uint16_t{0});
    std::fill_n(band_.trace_v, words, uint16_t{0});
    sweep(k, k + 1);
    FastTrace t;
    t.plane = k;
    t.u0 = region_.u0;
    t.v0 = region_.v0;
    t.cols = band_.cols;
    t.rows = band_.rows;
    const PlaneWork& p = planes_[static_cast<size_t>(k)];
    t.valid = {p.u_lo, p.u_hi, p.v_lo, p.v_hi};
    for (int v = 0; v < band_.rows; ++v) {
      for (int u = 0; u < band_.cols; ++u) {
        const bool valid = !p.empty && u >= p.u_lo && u < p.u_hi && v >= p.v_lo && v < p.v_hi;
        t.v.push_back(valid ? band_.trace_v[element(u, v)] : 0);
        t.textured.push_back(texture(u, v));
      }
    }
    const int m = band_.window;
    for (int j = 0; j < sample_rows_; ++j) {
      for (int i = 0; i < band_.cols + m - 1; ++i) {
        const int lane = std::min(i / stride_, lanes_ - 1);
        const size_t at = (static_cast<size_t>(j) * taps_ + (i - lane * stride_)) * lanes_ + lane;
        t.l.push_back(band_.trace_l[at]);
        t.r.push_back(band_.trace_r[at]);
      }
    }
    for (size_t i = 0; i < before.size(); ++i) band_.textured[i] = static_cast<uint16_t>(band_.textured[i] | before[i]);
    return t;
  }

  // Map cells of the band's row v.
  void unload(int v, golden::MapCell* out) const {
    // How many planes start or stop being valid at each cell of this row.
    std::vector<int> change(static_cast<size_t>(band_.cols) + 1, 0);
    for (const auto& p : planes_) {
      if (p.empty || v < p.v_lo || v >= p.v_hi) continue;
      ++change[static_cast<size_t>(p.u_lo)];
      --change[static_cast<size_t>(p.u_hi)];
    }
    int planes_inside = 0;
    for (int u = 0; u < band_.cols; ++u) {
      planes_inside += change[static_cast<size_t>(u)];
      const size_t at = element(u, v);
      golden::Cell cell;
      cell.best = band_.best[at];
      cell.plane = cell.best > 0 ? band_.plane[at] : 0;
      cell.frac = cell.best > 0 ? band_.frac[at] : (planes_inside > 0 ? 1 : 0) | (texture(u, v) ? 2 : 0);
      cell.local_max = cell.best > 0 && level_.local_max(band_, at);
      out[u] = golden::unload(cell, region_.threshold);
    }
  }

 private:
  size_t element(int u, int v) const {
    return static_cast<size_t>(v) * row_len_ + static_cast<size_t>(u % stride_) * lanes_ + u / stride_;
  }
  bool texture(int u, int v) const {
    return (band_.textured[static_cast<size_t>(v) * stride_ + u % stride_] >> (u / stride_)) & 1;
  }

  std::vector<PlaneWork> plane_work(int rows) const {
    std::vector<PlaneWork> work;
    for (const auto& p : region_.planes) {
      PlaneWork w;
      w.u_lo = p.valid.u_lo;
      w.u_hi = p.valid.u_hi;
      w.v_lo = std::max(p.valid.v_lo - first_row_, 0);
      w.v_hi = std::min(p.valid.v_hi - first_row_, rows);
      w.empty = w.u_lo >= w.u_hi || w.v_lo >= w.v_hi;
      w.left_start = p.left_x.start;
      w.right_start = p.right_x.start;
      w.left_step = static_cast<uint32_t>(p.left_x.step);
      w.right_step = static_cast<uint32_t>(p.right_x.step);
      if (w.empty) w.u_lo = w.u_hi = w.v_lo = w.v_hi = 0;
      work.push_back(w);
    }
    return work;
  }

  // The band's rows of a picture in strided layout, wide enough for all planes; the picture's border repeats (those
  // samples belong to no valid cell).
  void stride_picture(const golden::Pixels& picture, Line PlaneLines::*x, Line PlaneLines::*y, int PlaneWork::*first,
                      int PlaneWork::*weight, std::unique_ptr<Aligned<uint8_t>>& out, size_t& len) {
    const int w = region_.format.weight_bits;
    int64_t lo = INT64_MAX, hi = INT64_MIN;
    Line row_line;
    for (size_t k = 0; k < planes_.size(); ++k) {
      if (planes_[k].empty) continue;
      const int64_t pixel = (region_.planes[k].*x).start >> golden::kPosFrac;
      lo = std::min(lo, pixel);
      hi = std::max(hi, pixel);
      row_line = region_.planes[k].*y;
    }
    if (lo > hi) lo = hi = 0;
    for (size_t k = 0; k < planes_.size(); ++k) {
      const int64_t start = (region_.planes[k].*x).start;
      if (planes_[k].empty) continue;
      planes_[k].*first = static_cast<int>((start >> golden::kPosFrac) - lo);
      planes_[k].*weight = static_cast<int>(start >> (golden::kPosFrac - w)) & ((1 << w) - 1);
    }
    const int vectors = taps_ + 1 + static_cast<int>(hi - lo);
    len = static_cast<size_t>(vectors) * lanes_;
    out = std::make_unique<Aligned<uint8_t>>(len * sample_rows_);
    for (int j = 0; j < sample_rows_; ++j) {
      const int64_t row = row_line.at(first_row_ + j) >> golden::kPosFrac;
      const uint16_t* source = picture.row(static_cast<int>(std::clamp<int64_t>(row, 0, picture.height - 1)));
      uint8_t* target = out->get() + static_cast<size_t>(j) * len;
      for (int t = 0; t < vectors; ++t) {
        for (int lane = 0; lane < lanes_; ++lane) {
          const int64_t pixel = lo + static_cast<int64_t>(lane) * stride_ + t;
          target[t * lanes_ + lane] = static_cast<uint8_t>(source[std::clamp<int64_t>(pixel, 0, picture.width - 1)]);
        }
      }
    }
  }

  const Region& region_;
  const SweepLevel& level_;
  int first_row_, lanes_, stride_, taps_, row_len_, sample_rows_;
  BlendedRows blended_;
  std::vector<PlaneWork> planes_;
  Aligned<uint16_t> map_, textured_, cell_index_, v_;
  Aligned<int32_t> ring_;
  Aligned<int64_t> column_, windows_;
  Aligned<int32_t> line_;
  std::unique_ptr<Aligned<uint8_t>> left_, right_;
  std::unique_ptr<Aligned<uint16_t>> trace_v_;
  std::unique_ptr<Aligned<int32_t>> trace_samples_;
  Band band_{};
};

// Map words (10 bytes a cell) and pixels of a band should stay in a second-level cache, yet a band's skirt of M-1 rows
// should not cost much.
int default_band_rows(const Region& r) {
  const int fit = 1 << 20;
  const int bytes = r.cols * (10 + 2 * 2);
  return std::max(4 * r.format.window, fit / std::max(bytes, 1));
}

// Calls done(v, cells) for every row v of the region; rows are given once each, from several threads.
template <class Done>
void sweep_region(const Region& region, const FastOptions& options, Done&& done) {
  const SweepLevel& level = sweep_level(options.level, sum_width(region.format));
  const bool unit = level.lanes > 1 && unit_steps(region);
  const int planes = static_cast<int>(region.planes.size());
  std::vector<golden::MapCell> row(static_cast<size_t>(region.cols));
  if (options.trace) {
    BandSweep band(region, level, unit, 0, region.rows, true);
    for (int k = 0; k < planes; ++k) options.trace(band.sweep_traced(k));
    for (int v = 0; v < region.rows; ++v) {
      band.unload(v, row.data());
      done(v, row);
    }
    return;
  }
  const int wanted_rows = options.band_rows > 0 ? options.band_rows : default_band_rows(region);
  const int count = std::max(1, (region.rows + wanted_rows / 2) / wanted_rows);
  std::atomic<int> next{0};
  std::mutex progress_mutex;
  int64_t planes_done = 0;
  std::exception_ptr failure;
  auto work = [&](std::vector<golden::MapCell> cells) {
    try {
      for (int i = next++; i < count; i = next++) {
        const int first = static_cast<int>(static_cast<int64_t>(region.rows) * i / count);
        const int last = static_cast<int>(static_cast<int64_t>(region.rows) * (i + 1) / count);
        BandSweep band(region, level, unit, first, last - first, false);
        for (int k = 0; k < planes; k += 16) {
          const int end = std::min(planes, k + 16);
          band.sweep(k, end);
          if (!options.progress) continue;
          const std::lock_guard<std::mutex> lock(progress_mutex);
          planes_done += end - k;
          options.progress(static_cast<double>(planes_done) / (static_cast<double>(planes) * count));
        }
        for (int v = first; v < last; ++v) {
          band.unload(v - first, cells.data());
          done(v, cells);
        }
      }
    } catch (...) {
      const std::lock_guard<std::mutex> lock(progress_mutex);
      if (!failure) failure = std::current_exception();
      next = count;
    }
  };
  std::vector<std::thread> helpers;
  for (int i = 1; i < std::min(options.threads, count); ++i) helpers.emplace_back(work, row);
  work(row);
  for (auto& t : helpers) t.join();
  if (failure) std::rethrow_exception(failure);
}

golden::Pixels checked_pixels(const Gray& image, const SweepSetup& setup, const std::string& name) {
  if (image.width != setup.rig.width || image.height != setup.rig.height) {
    throw InputError(name + " image is " + std::to_string(image.width) + "x" + std::to_string(image.height) +
                     ", the rig " + std::to_string(setup.rig.width) + "x" + std::to_string(setup.rig.height));
  }
  for (const uint8_t v : image.data) {
    if (v >> std::min(setup.format.pix_bits, 8)) {
      throw InputError(name + " image has a pixel of " + std::to_string(v) +
                       ", pix_bits = " + std::to_string(setup.format.pix_bits) + " is too small");
    }
  }
  // A sample on the last column or row has that neighbour too.
  return cut_window(image, 0, 0, image.width + 1, image.height + 1);
}

// Samples with lo <= position <= hi, half open, cut to 0 .. count.
struct Range {
  int64_t lo = 0, hi = 0;
};
Range samples_between(const Line& line, int64_t lo, int64_t hi, int count) {
  if (line.step == 0) return line.start >= lo && line.start <= hi ? Range{0, count} : Range{0, 0};
  auto first_at_least = [&](int64_t value) {  // smallest s with position(s) >= value
    const int64_t d = value - line.start;
    return d <= 0 ? -((-d) / line.step) : (d + line.step - 1) / line.step;
  };
  return {std::max<int64_t>(first_at_least(lo), 0), std::min<int64_t>(first_at_least(hi + 1), count)};
}
Range intersect(Range a, Range b) { return {std::max(a.lo, b.lo), std::min(a.hi, b.hi)}; }
int64_t length(Range r) { return std::max<int64_t>(r.hi - r.lo, 0); }

}  // namespace

const char* simd_name(SimdLevel level) {
  return level == SimdLevel::kAvx512 ? "avx512" : level == SimdLevel::kAvx2 ? "avx2" : "plain";
}

std::vector<SimdLevel> simd_levels() {
  std::vector<SimdLevel> levels{SimdLevel::kPlain};
#ifdef PSWEEP_X86
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    levels.push_back(SimdLevel::kAvx2);
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl")) {
      levels.push_back(SimdLevel::kAvx512);
    }
  }
#endif
  return levels;
}

SimdLevel best_simd_level() {
  const auto levels = simd_levels();
  const char* wanted = std::getenv("PSWEEP_SIMD");
  if (!wanted || !*wanted) return levels.back();
  for (const SimdLevel level : levels) {
    if (std::strcmp(wanted, simd_name(level)) == 0) return level;
  }
  throw InputError(std::string("PSWEEP_SIMD = ") + wanted + ": not an instruction set of this machine (" + "plain .. " +
                   simd_name(levels.back()) + ")");
}

Image<golden::MapCell> run_fixed(const Gray& left, const Gray& right, const SweepSetup& setup,
                                 const FastOptions& options) {
  const auto table = plane_table(setup);
  Region region;
  region.format = setup.format;
  region.left = checked_pixels(left, setup, "left");
  region.right = checked_pixels(right, setup, "right");
  region.threshold = setup.threshold;
  Image<golden::MapCell> map = blank_map(setup.rig);
  CellRange all{map.width, 0, map.height, 0};
  std::vector<CellRange> valid;
  for (const auto& p : table) {
    valid.push_back(valid_cells(setup, p));
    if (valid.back().empty()) continue;
    all = {std::min(all.u_lo, valid.back().u_lo), std::max(all.u_hi, valid.back().u_hi),
           std::min(all.v_lo, valid.back().v_lo), std::max(all.v_hi, valid.back().v_hi)};
  }
  if (all.empty()) return map;
  region.u0 = all.u_lo;
  region.v0 = all.v_lo;
  region.cols = all.u_hi - all.u_lo;
  region.rows = all.v_hi - all.v_lo;
  const int64_t half = int64_t{1} << (golden::kPosFrac - setup.format.weight_bits - 1);
  const int64_t u = all.u_lo - setup.format.window / 2, v = all.v_lo - setup.format.window / 2;
  for (size_t k = 0; k < table.size(); ++k) {
    const auto& p = table[k];
    PlaneLines lines;
    lines.left_x = {p.x0_left + half + u * p.dx_left, p.dx_left};
    lines.left_y = {p.y0_left + half + v * p.dy_left, p.dy_left};
    lines.right_x = {p.x0_right + half + u * p.dx_right, p.dx_right};
    lines.right_y = {p.y0_right + half + v * p.dy_right, p.dy_right};
    const CellRange& c = valid[k];
    if (!c.empty()) lines.valid = {c.u_lo - all.u_lo, c.u_hi - all.u_lo, c.v_lo - all.v_lo, c.v_hi - all.v_lo};
    region.planes.push_back(lines);
  }
  sweep_region(region, options, [&](int row, const std::vector<golden::MapCell>& cells) {
    std::copy(cells.begin(), cells.end(), map.row(all.v_lo + row) + all.u_lo);
  });
  return map;
}

golden::TileResult run_tile_fast(const Config& format, const golden::TileJob& job,
                                 const std::vector<golden::PlaneEntry>& table, const golden::Pixels& left,
                                 const golden::Pixels& right, const FastOptions& options) {
  const int m = format.window, cols = golden::sweep_cols(format, job), rows = golden::sweep_rows(format, job);
  const int64_t unit = int64_t{1} << (golden::kPosFrac - format.weight_bits);
  Region region;
  region.format = format;
  region.cols = job.tile_cols;
  region.rows = job.tile_rows;
  region.left = left;
  region.right = right;
  region.threshold = job.threshold;
  golden::TileResult result;
  // First position as the hardware adds it up; the last one shows whether it wraps on the way.
  auto line = [](int32_t x0, int32_t tx, uint32_t step) {
    return Line{golden::wrap_add(x0, static_cast<uint32_t>(tx)), step};
  };
  auto wraps = [](const Line& l, int count) { return l.at(count - 1) > INT32_MAX; };
  for (int k = 0; k < job.planes; ++k) {
    const auto& p = table[static_cast<size_t>(k)];
    PlaneLines lines;
    lines.left_x = line(p.x0_left, job.tx_left, p.dx_left);
    lines.left_y = line(p.y0_left, job.ty_left, p.dy_left);
    lines.right_x = line(p.x0_right, job.tx_right, p.dx_right);
    lines.right_y = line(p.y0_right, job.ty_right, p.dy_right);
    const int64_t fraction = kOne - unit;
    const bool between_rows =
        ((lines.left_y.start | lines.left_y.step | lines.right_y.start | lines.right_y.step) & fraction) != 0;
    if ((format.rectified && between_rows) || wraps(lines.left_x, cols) || wraps(lines.left_y, rows) ||
        wraps(lines.right_x, cols) || wraps(lines.right_y, rows)) {
      return golden::run_tile(format, job, table, left, right);  // no plan makes such a tile
    }
    auto inside = [&](const Line& l, int lo, int hi, int count) {
      return samples_between(l, lo * kOne, hi * kOne + unit - 1, count);
    };
    auto loaded = [&](const Line& l, int size, int count) {
      return samples_between(l, 0, (size - 1) * kOne - 1, count);
    };
    const Range x = intersect(inside(lines.left_x, job.left.x_lo, job.left.x_hi, cols),
                              inside(lines.right_x, job.right.x_lo, job.right.x_hi, cols));
    const Range y = intersect(inside(lines.left_y, job.left.y_lo, job.left.y_hi, rows),
                              inside(lines.right_y, job.right.y_lo, job.right.y_hi, rows));
    const Range ux =
        intersect(x, intersect(loaded(lines.left_x, job.win_cols, cols), loaded(lines.right_x, job.win_cols, cols)));
    const Range uy =
        intersect(y, intersect(loaded(lines.left_y, job.win_rows, rows), loaded(lines.right_y, job.win_rows, rows)));
    result.window_errors += static_cast<uint64_t>(length(x) * length(y) - length(ux) * length(uy));
    lines.valid = {static_cast<int>(ux.lo), static_cast<int>(ux.hi) - m + 1, static_cast<int>(uy.lo),
                   static_cast<int>(uy.hi) - m + 1};
    if (lines.valid.empty()) lines.valid = {};
    region.planes.push_back(lines);
  }
  result.cells.resize(static_cast<size_t>(job.tile_cols) * job.tile_rows);
  sweep_region(region, options, [&](int row, const std::vector<golden::MapCell>& cells) {
    std::copy(cells.begin(), cells.end(), result.cells.begin() + static_cast<std::ptrdiff_t>(row) * job.tile_cols);
  });
  return result;
}

}  // namespace psweep
