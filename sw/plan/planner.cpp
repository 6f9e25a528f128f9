// SPDX-License-Identifier: Apache-2.0
// Contract: planner.hpp.
#include "plan/planner.hpp"

#include <cmath>
#include <limits>
#include <string>

#include "core/error.hpp"
#include "golden/address_generator.hpp"
#include "golden/control.hpp"

namespace psweep {
namespace {

constexpr int64_t kOne = int64_t{1} << golden::kPosFrac;
constexpr int64_t kPosMin = std::numeric_limits<int32_t>::min();
constexpr int64_t kPosMax = std::numeric_limits<int32_t>::max();

void require(bool ok, const std::string& message) {
  if (!ok) throw InputError(message);
}
void require_range(int value, int lo, int hi, const std::string& field) {
  require(value >= lo && value <= hi,
          field + " = " + std::to_string(value) + ", must be " + std::to_string(lo) + " .. " + std::to_string(hi));
}

// floor(a / b) for b > 0.
int64_t floor_div(int64_t a, int64_t b) { return a / b - (a % b < 0); }

struct Range {
  int64_t lo = 0, hi = 0;  // half open
  bool empty() const { return lo >= hi; }
};
Range intersect(Range a, Range b) { return {std::max(a.lo, b.lo), std::min(a.hi, b.hi)}; }

// Half a unit of the interpolation weight: with it the hardware's truncation rounds to nearest.
int64_t rounding_half(const golden::Config& format) {
  return int64_t{1} << (golden::kPosFrac - format.weight_bits - 1);
}

// One image, one axis, one plane: position(s) = start + s * step for the sample that belongs to map column (row) s,
// absolute, rounding half included. 64 bits: no wrap here, so what would wrap in 32 bits can be seen.
struct Line {
  int64_t start = 0, step = 1;
  int64_t at(int64_t s) const { return start + s * step; }
};

// The samples inside the image of `size` pixels: 0 <= position <= size - 1 after truncation to the weight's bits.
Range inside(const Line& line, int size, int weight_bits) {
  const int64_t unit = int64_t{1} << (golden::kPosFrac - weight_bits);
  const int64_t last = (size - 1) * kOne + unit - 1;  // the last position that truncates to size - 1
  return {-floor_div(line.start, line.step), floor_div(last - line.start, line.step) + 1};
}

// Both images of one axis at one plane.
struct LinePair {
  Line left, right;
};

struct Axis {
  std::vector<LinePair> planes;
  int size = 0;  // image pixels and map cells along this axis
};

// Samples inside both images at plane k.
Range usable(const SweepSetup& setup, const Axis& axis, size_t k) {
  const int w = setup.format.weight_bits;
  return intersect(inside(axis.planes[k].left, axis.size, w), inside(axis.planes[k].right, axis.size, w));
}
// Cells whose whole window is inside both images at plane k.
Range valid(const SweepSetup& setup, const Axis& axis, size_t k) {
  const int half = setup.format.window / 2;
  const Range samples = usable(setup, axis, k);
  return intersect({samples.lo + half, samples.hi - half}, {0, axis.size});
}

Axis make_axis(const SweepSetup& setup, const std::vector<golden::PlaneEntry>& table, bool horizontal) {
  const int64_t half = rounding_half(setup.format);
  Axis axis;
  axis.size = horizontal ? setup.rig.width : setup.rig.height;
  for (const auto& p : table) {
    axis.planes.push_back(horizontal ? LinePair{{p.x0_left + half, p.dx_left}, {p.x0_right + half, p.dx_right}}
                                     : LinePair{{p.y0_left + half, p.dy_left}, {p.y0_right + half, p.dy_right}});
  }
  return axis;
}

// Hull over all planes of the cells that are valid on this axis.
Range hull(const SweepSetup& setup, const Axis& axis) {
  Range all{axis.size, 0};
  for (size_t k = 0; k < axis.planes.size(); ++k) {
    const Range r = valid(setup, axis, k);
    if (r.empty()) continue;
    all.lo = std::min(all.lo, r.lo);
    all.hi = std::max(all.hi, r.hi);
  }
  return all.empty() ? Range{} : all;
}

// One tile's share of an axis.
struct Piece {
  int first = 0, cells = 0;  // map cells
  int left = 0, right = 0;   // first pixel of the windows
  int win = 0;               // pixels to load, the larger of both images
  bool used = false;         // some cell is valid at some plane
};

// The pixels a piece needs: for every plane and every sample inside both images, that sample and its neighbour.
// Position grows with the sample, so the ends of the range suffice.
Piece make_piece(const SweepSetup& setup, const Axis& axis, int first, int cells) {
  const int half = setup.format.window / 2;
  Piece piece;
  piece.first = first;
  piece.cells = cells;
  int64_t left_lo = kPosMax, left_hi = 0, right_lo = kPosMax, right_hi = 0;
  for (size_t k = 0; k < axis.planes.size(); ++k) {
    const Range r = intersect(usable(setup, axis, k), {first - half, first + cells + half});
    if (r.empty()) continue;
    const auto& p = axis.planes[k];
    left_lo = std::min(left_lo, p.left.at(r.lo) >> golden::kPosFrac);
    right_lo = std::min(right_lo, p.right.at(r.lo) >> golden::kPosFrac);
    left_hi = std::max(left_hi, p.left.at(r.hi - 1) >> golden::kPosFrac);
    right_hi = std::max(right_hi, p.right.at(r.hi - 1) >> golden::kPosFrac);
    if (!intersect(valid(setup, axis, k), {first, first + cells}).empty()) piece.used = true;
  }
  if (!piece.used) return piece;
  piece.left = static_cast<int>(left_lo);
  piece.right = static_cast<int>(right_lo);
  piece.win = static_cast<int>(std::max(left_hi - left_lo, right_hi - right_lo)) + 2;  // + the right neighbour
  return piece;
}

using Pieces = std::vector<Piece>;

// As few pieces as possible; `equal`: sizes differ by at most one, else all are full but the last.
Pieces split(const SweepSetup& setup, const Axis& axis, Range cells, int most, bool equal) {
  Pieces pieces;
  if (cells.empty()) return pieces;
  const int total = static_cast<int>(cells.hi - cells.lo);
  const int count = (total + most - 1) / most;
  int first = static_cast<int>(cells.lo);
  for (int i = 0; i < count; ++i) {
    const int left = static_cast<int>(cells.hi) - first;
    const int size = equal ? (left + count - i - 1) / (count - i) : std::min(most, left);
    pieces.push_back(make_piece(setup, axis, first, size));
    first += size;
  }
  return pieces;
}

int largest_window(const Pieces& pieces) {
  int most = 0;
  for (const auto& p : pieces) most = std::max(most, p.win);
  return most;
}

golden::Bounds make_bounds(const Rig& rig, int x, int y) { return {-x, rig.width - 1 - x, -y, rig.height - 1 - y}; }

// Register value: the engine adds modulo 2^32.
int32_t wrap(int64_t value) { return static_cast<int32_t>(static_cast<uint32_t>(static_cast<uint64_t>(value))); }

PlacedTile make_tile(const SweepSetup& setup, const std::vector<golden::PlaneEntry>& table, const Piece& x,
                     const Piece& y) {
  const int half_window = setup.format.window / 2;
  const int64_t half = rounding_half(setup.format);
  const auto& p = table.front();  // steps are the same at every plane
  auto offset = [&](const Piece& piece, uint32_t step, int origin) {
    return wrap((piece.first - half_window) * static_cast<int64_t>(step) - origin * kOne + half);
  };
  PlacedTile t;
  t.u0 = x.first;
  t.v0 = y.first;
  t.left_x = x.left;
  t.right_x = x.right;
  t.left_y = y.left;
  t.right_y = y.right;
  t.job.tile_cols = x.cells;
  t.job.tile_rows = y.cells;
  t.job.win_cols = x.win;
  t.job.win_rows = y.win;
  t.job.planes = setup.spacing.planes;
  t.job.threshold = setup.threshold;
  t.job.tx_left = offset(x, p.dx_left, x.left);
  t.job.ty_left = offset(y, p.dy_left, y.left);
  t.job.tx_right = offset(x, p.dx_right, x.right);
  t.job.ty_right = offset(y, p.dy_right, y.right);
  t.job.left = make_bounds(setup.rig, x.left, y.left);
  t.job.right = make_bounds(setup.rig, x.right, y.right);
  return t;
}

// A window position that leaves sfix(13,19) would wrap and might come back inside the image.
void check_no_wrap(const Axis& axis, const Piece& piece, int half_window, const std::string& field) {
  for (size_t k = 0; k < axis.planes.size(); ++k) {
    for (const auto& end : {piece.first - half_window, piece.first + piece.cells + half_window - 1}) {
      const int64_t left = axis.planes[k].left.at(end) - piece.left * kOne;
      const int64_t right = axis.planes[k].right.at(end) - piece.right * kOne;
      require(left >= kPosMin && left <= kPosMax && right >= kPosMin && right <= kPosMax,
              "plane " + std::to_string(k) + ": " + field + " of a sample leaves -4096 .. 4095 pixels of its window");
    }
  }
}

Plan make_plan(const SweepSetup& setup, const std::vector<golden::PlaneEntry>& table, const Axis& x, const Axis& y,
               const Pieces& columns, const Pieces& rows) {
  const int half_window = setup.format.window / 2;
  Plan plan;
  plan.table = table;
  const Range u = hull(setup, x), v = hull(setup, y);
  plan.u_lo = static_cast<int>(u.lo);
  plan.u_hi = static_cast<int>(u.hi);
  plan.v_lo = static_cast<int>(v.lo);
  plan.v_hi = static_cast<int>(v.hi);
  for (const auto& c : columns) {
    if (c.used) check_no_wrap(x, c, half_window, "x");
  }
  for (const auto& r : rows) {
    if (r.used) check_no_wrap(y, r, half_window, "y");
  }
  for (const auto& r : rows) {
    for (const auto& c : columns) {
      if (!r.used || !c.used) continue;
      plan.tiles.push_back(make_tile(setup, table, c, r));
      plan.max_win_cols = std::max(plan.max_win_cols, c.win);
      plan.max_win_rows = std::max(plan.max_win_rows, r.win);
    }
  }
  return plan;
}

// Of the four ways to split, the one with the fewest clocks among those whose windows fit `limit` pixels; if none fits,
// the one with the fewest clocks.
Plan best_plan(const SweepSetup& setup, int tile_cols, int tile_rows, BufferSize limit) {
  require(tile_cols >= 1, "tile width = " + std::to_string(tile_cols) + ", must be at least 1");
  require(tile_rows >= 1, "tile height = " + std::to_string(tile_rows) + ", must be at least 1");
  const auto table = plane_table(setup);
  const Axis x = make_axis(setup, table, true), y = make_axis(setup, table, false);
  Range u = hull(setup, x), v = hull(setup, y);
  if (u.empty() || v.empty()) u = v = Range{};
  Plan best;
  bool first = true, best_fits = false;
  for (const bool equal_cols : {true, false}) {
    for (const bool equal_rows : {true, false}) {
      const Plan plan = make_plan(setup, table, x, y, split(setup, x, u, tile_cols, equal_cols),
                                  split(setup, y, v, tile_rows, equal_rows));
      const bool fits = plan.max_win_cols <= limit.img_cols && plan.max_win_rows <= limit.img_rows;
      const bool cheaper = plan_clocks(setup.format, plan) < plan_clocks(setup.format, best);
      if (first || (fits && !best_fits) || (fits == best_fits && cheaper)) {
        best = plan;
        best_fits = fits;
      }
      first = false;
    }
  }
  return best;
}

int even(int value) { return value + (value & 1); }

void check_camera(const Camera& camera, const std::string& name) {
  require(std::isfinite(camera.fx) && camera.fx > 0, name + ".fx must be a positive number of pixels");
  require(std::isfinite(camera.fy) && camera.fy > 0, name + ".fy must be a positive number of pixels");
  require(std::isfinite(camera.cx), name + ".cx must be a number");
  require(std::isfinite(camera.cy), name + ".cy must be a number");
}

int32_t position_word(double pixels, int plane, const char* field) {
  const double word = std::round(pixels * static_cast<double>(kOne));
  require(word >= static_cast<double>(kPosMin) && word <= static_cast<double>(kPosMax),
          "plane " + std::to_string(plane) + ": " + field + " = " + std::to_string(pixels) +
              " leaves -4096 .. 4095 pixels");
  return static_cast<int32_t>(word);
}
uint32_t step_word(double step, const char* field) {
  const double word = std::round(step * static_cast<double>(kOne));
  require(word >= 1 && word < static_cast<double>(1 << golden::kStepBits),
          std::string("plane 0: ") + field + " = " + std::to_string(step) + ", must be above 0 and below 4");
  return static_cast<uint32_t>(word);
}

}  // namespace

int threshold_for(const golden::Config& format, double correlation) {
  const int ones = (1 << format.mncc_bits) - 1;
  const double v = std::ceil(correlation * (ones + 1));
  return v <= 0 ? 0 : v >= ones ? ones : static_cast<int>(v);
}

void check_setup(const SweepSetup& setup) {
  const auto& f = setup.format;
  require_range(f.window, 3, 21, "window");
  require(f.window % 2 == 1, "window = " + std::to_string(f.window) + ", must be odd");
  require_range(f.pix_bits, 1, 12, "pix_bits");
  require_range(f.weight_bits, 1, 12, "weight_bits");
  require_range(f.interp_frac, 0, 8, "interp_frac");
  require_range(f.mncc_bits, 4, 16, "mncc_bits");
  require_range(f.frac_bits, 2, 12, "frac_bits");
  require_range(f.rectified, 0, 1, "rectified");
  require_range(f.planes, 1, 1024, "format.planes");
  require_range(setup.threshold, 0, (1 << f.mncc_bits) - 1, "threshold");
  require_range(setup.spacing.planes, 1, f.planes, "planes");
  const auto& s = setup.spacing;
  require(std::isfinite(s.zmin) && s.zmin > 0, "zmin = " + std::to_string(s.zmin) + ", must be positive metres");
  require(std::isfinite(s.zmax) && (s.planes == 1 ? s.zmax >= s.zmin : s.zmax > s.zmin),
          "zmax = " + std::to_string(s.zmax) + ", must be above zmin = " + std::to_string(s.zmin));
  require_range(setup.rig.width, 1, 4096, "image width");
  require_range(setup.rig.height, 1, 4096, "image height");
  require(std::isfinite(setup.rig.baseline) && setup.rig.baseline > 0, "baseline must be positive metres");
  check_camera(setup.rig.left, "left");
  check_camera(setup.rig.right, "right");
}

std::vector<golden::PlaneEntry> plane_table(const SweepSetup& setup) {
  check_setup(setup);
  const Rig& rig = setup.rig;
  const Camera eye = rig.cyclopean();
  std::vector<golden::PlaneEntry> table;
  for (int k = 0; k < setup.spacing.planes; ++k) {
    const double shift = rig.baseline / (2 * setup.spacing.depth(k));  // of a point at (0,0,Z), in units of f
    auto x0 = [&](const Camera& c, double sign) { return c.cx - c.fx / eye.fx * eye.cx + sign * c.fx * shift; };
    auto y0 = [&](const Camera& c) { return c.cy - c.fy / eye.fy * eye.cy; };
    golden::PlaneEntry p;
    p.x0_left = position_word(x0(rig.left, 1), k, "x0_left");
    p.y0_left = position_word(y0(rig.left), k, "y0_left");
    p.x0_right = position_word(x0(rig.right, -1), k, "x0_right");
    p.y0_right = position_word(y0(rig.right), k, "y0_right");
    p.dx_left = step_word(rig.left.fx / eye.fx, "dx_left");
    p.dy_left = step_word(rig.left.fy / eye.fy, "dy_left");
    p.dx_right = step_word(rig.right.fx / eye.fx, "dx_right");
    p.dy_right = step_word(rig.right.fy / eye.fy, "dy_right");
    table.push_back(p);
  }
  if (setup.format.rectified) {
    const int64_t unit = int64_t{1} << (golden::kPosFrac - setup.format.weight_bits),
                  half = rounding_half(setup.format);
    for (const auto& p : table) {
      auto on_rows = [&](int32_t start, uint32_t step) {
        return step == kOne && ((start + half) & (kOne - unit)) == 0;
      };
      require(on_rows(p.y0_left, p.dy_left) && on_rows(p.y0_right, p.dy_right),
              "rig: the rows of both images do not correspond (fy, cy of left and right), but the engine is built for "
              "rectified pairs");
    }
  }
  // Samples of the cells that can be valid, skirt included.
  const Axis x = make_axis(setup, table, true), y = make_axis(setup, table, false);
  const Range u = hull(setup, x), v = hull(setup, y);
  if (u.empty() || v.empty()) return table;
  const int half = setup.format.window / 2;
  for (size_t k = 0; k < table.size(); ++k) {
    auto check = [&](const Line& line, Range cells, const char* field) {
      const int64_t lo = line.at(cells.lo - half), hi = line.at(cells.hi - 1 + half);
      require(lo >= kPosMin && hi <= kPosMax,
              "plane " + std::to_string(k) + ": " + field + " of a sample leaves -4096 .. 4095 pixels");
    };
    check(x.planes[k].left, u, "x_left");
    check(x.planes[k].right, u, "x_right");
    check(y.planes[k].left, v, "y_left");
    check(y.planes[k].right, v, "y_right");
  }
  return table;
}

CellRange valid_cells(const SweepSetup& setup, const golden::PlaneEntry& plane) {
  const Range u = valid(setup, make_axis(setup, {plane}, true), 0);
  const Range v = valid(setup, make_axis(setup, {plane}, false), 0);
  if (u.empty() || v.empty()) return {};
  return {static_cast<int>(u.lo), static_cast<int>(u.hi), static_cast<int>(v.lo), static_cast<int>(v.hi)};
}

Plan plan_tiles(const SweepSetup& setup, int tile_cols, int tile_rows) {
  const auto& f = setup.format;
  require(tile_cols <= f.plane_cols,
          "tile width = " + std::to_string(tile_cols) + " exceeds plane_cols = " + std::to_string(f.plane_cols));
  require(tile_rows <= f.plane_rows,
          "tile height = " + std::to_string(tile_rows) + " exceeds plane_rows = " + std::to_string(f.plane_rows));
  const Plan plan = best_plan(setup, tile_cols, tile_rows, {f.img_cols, f.img_rows, 0, 0});
  require(plan.max_win_cols <= f.img_cols, "tile width = " + std::to_string(tile_cols) +
                                               " needs img_cols = " + std::to_string(even(plan.max_win_cols)) +
                                               ", the engine has " + std::to_string(f.img_cols));
  require(plan.max_win_rows <= f.img_rows, "tile height = " + std::to_string(tile_rows) +
                                               " needs img_rows = " + std::to_string(even(plan.max_win_rows)) +
                                               ", the engine has " + std::to_string(f.img_rows));
  return plan;
}

BufferSize required_buffer(const SweepSetup& setup, int tile_cols, int tile_rows) {
  const int unlimited = std::numeric_limits<int>::max();
  const Plan plan = best_plan(setup, tile_cols, tile_rows, {unlimited, unlimited, 0, 0});
  BufferSize size{even(plan.max_win_cols), even(plan.max_win_rows), 0, 0};
  for (const auto& t : plan.tiles) {
    size.plane_cols = std::max(size.plane_cols, t.job.tile_cols);
    size.plane_rows = std::max(size.plane_rows, t.job.tile_rows);
  }
  return size;
}

TileSize largest_tile(const SweepSetup& setup) {
  const auto table = plane_table(setup);
  auto largest = [&](bool horizontal, int plane_limit, int img_limit, const char* field) {
    const Axis axis = make_axis(setup, table, horizontal);
    const Range cells = hull(setup, axis);
    const int total = static_cast<int>(cells.hi - cells.lo);
    for (int size = std::max(1, std::min(plane_limit, total)); size >= 1; --size) {
      if (largest_window(split(setup, axis, cells, size, false)) <= img_limit ||
          largest_window(split(setup, axis, cells, size, true)) <= img_limit) {
        return size;
      }
    }
    throw InputError(std::string(field) + " = " + std::to_string(img_limit) +
                     " is too small for even one cell over all planes");
  };
  return {largest(true, setup.format.plane_cols, setup.format.img_cols, "img_cols"),
          largest(false, setup.format.plane_rows, setup.format.img_rows, "img_rows")};
}

golden::Pixels cut_window(const Gray& image, int x, int y, int cols, int rows) {
  golden::Pixels window(cols, rows);
  for (int j = 0; j < rows; ++j) {
    const uint8_t* source = image.row(std::clamp(y + j, 0, image.height - 1));
    uint16_t* target = window.row(j);
    for (int i = 0; i < cols; ++i) target[i] = source[std::clamp(x + i, 0, image.width - 1)];
  }
  return window;
}

uint64_t plan_clocks(const golden::Config& format, const Plan& plan) {
  uint64_t sum = 0;
  for (const auto& t : plan.tiles) {
    sum += golden::load_clocks(t.job) + golden::sweep_clocks(format, t.job) + golden::unload_clocks(t.job);
  }
  return sum;
}

Image<golden::MapCell> blank_map(const Rig& rig) {
  golden::MapCell outside;
  outside.mask = kMaskOutside;
  return Image<golden::MapCell>(rig.width, rig.height, outside);
}

void place_cells(const PlacedTile& tile, const std::vector<golden::MapCell>& cells, Image<golden::MapCell>& map) {
  for (int j = 0; j < tile.job.tile_rows; ++j) {
    std::copy_n(cells.begin() + static_cast<std::ptrdiff_t>(j) * tile.job.tile_cols, tile.job.tile_cols,
                map.row(tile.v0 + j) + tile.u0);
  }
}

Image<golden::MapCell> assemble(const Rig& rig, const Plan& plan,
                                const std::vector<std::vector<golden::MapCell>>& cells) {
  Image<golden::MapCell> map = blank_map(rig);
  for (size_t i = 0; i < plan.tiles.size(); ++i) place_cells(plan.tiles[i], cells.at(i), map);
  return map;
}

DepthResult to_result(const SweepSetup& setup, const Image<golden::MapCell>& map) {
  const double steps = static_cast<double>(1 << setup.format.frac_bits);
  const double full = static_cast<double>(1 << setup.format.mncc_bits);
  DepthResult out;
  out.depth = FloatImage(map.width, map.height, std::numeric_limits<float>::infinity());
  out.position = FloatImage(map.width, map.height, std::numeric_limits<float>::quiet_NaN());
  out.mncc = FloatImage(map.width, map.height, 0.0f);
  out.mask = Image<uint8_t>(map.width, map.height);
  for (size_t i = 0; i < map.data.size(); ++i) {
    const golden::MapCell& cell = map.data[i];
    out.mask.data[i] = cell.mask;
    if (cell.v == 0) continue;  // no winner
    const bool local = (cell.mask & kMaskNotLocal) == 0;
    const double position = local ? cell.plane - 0.5 + (cell.frac + 0.5) / steps : cell.plane;
    out.position.data[i] = static_cast<float>(position);
    out.mncc.data[i] = static_cast<float>(cell.v / full);
    if (cell.mask == 0) out.depth.data[i] = static_cast<float>(setup.spacing.depth(position));
  }
  return out;
}

}  // namespace psweep
