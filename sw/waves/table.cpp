// SPDX-License-Identifier: Apache-2.0
#include "waves/table.hpp"

#include <cstdio>
#include <sstream>

#include "golden/psweep.hpp"

namespace psweep::waves {
namespace {

// Signals of instances at a clock.
class Probe {
 public:
  explicit Probe(const Capture& capture) : capture_(capture), waves_(capture.fst), values_(waves_, handles()) {}

  int64_t at(const std::string& module, bool per_lane, const std::string& name, uint64_t clock, bool lane = false,
             bool is_signed = false) const {
    const Signal& s = waves_.get(scope_of(waves_, module, per_lane, capture_.lane) + '.' + name);
    const int lanes = lane ? capture_.engine->config.lanes : 1, width = s.width / lanes;
    const std::string& all = values_.bits(s.handle, clock * kPicosecondsPerClock);
    const size_t low = lane ? static_cast<size_t>(capture_.lane * width) : 0;
    const uint64_t value =
        number(all.substr(all.size() - low - static_cast<size_t>(width), static_cast<size_t>(width)));
    if (is_signed && value >> (width - 1) & 1) return static_cast<int64_t>(value) - (int64_t{1} << width);
    return static_cast<int64_t>(value);
  }

 private:
  std::vector<uint32_t> handles() const {
    std::vector<uint32_t> all;
    for (const Signal& s : waves_.signals()) all.push_back(s.handle);
    return all;
  }
  const Capture& capture_;
  FstReader waves_;
  Values values_;
};

// The cell's word after planes 0 .. count-1, and the trace of the last of them.
struct History {
  golden::Cell word;
  golden::PlaneTrace trace;
};

golden::Similarity similarity_of(const Capture& c, const golden::PlaneTrace& trace) {
  return trace.similarity[static_cast<size_t>(c.cell.row) * c.stimulus.job.tile_cols + c.cell.column];
}
golden::PlaneTrace trace_of(const Capture& c, const scene::Stimulus& s, int plane) {
  return golden::sweep_plane(c.engine->config, s.job, s.table[static_cast<size_t>(plane)], s.left, s.right);
}

// Clock of sample (i,j) at the interpolation's output, for all samples of the window: what the sideband marks.
std::vector<uint64_t> window_clocks(const Capture& c) {
  const FstReader waves(c.fst);
  const uint32_t window = waves.get("psweep.cell.u_similarity.s.window").handle,
                 valid = waves.get(scope_of(waves, "u_similarity", true, c.lane) + ".s_valid").handle;
  const Values values(waves, {window, valid});
  std::vector<uint64_t> clocks;
  for (uint64_t clock = c.entered[kInterpolationOut]; clock <= c.here[kInterpolationOut]; ++clock)
    if (values.at_clock(window, clock) && values.at_clock(valid, clock)) clocks.push_back(clock);
  const auto wanted = static_cast<size_t>(c.engine->config.window * c.engine->config.window);
  if (clocks.size() != wanted)
    throw WaveError(std::to_string(clocks.size()) + " samples of the window in the waves, not " +
                    std::to_string(wanted));
  return clocks;
}

// The table, stage by stage.
class CellTable {
 public:
  CellTable(const Capture& c, const scene::Stimulus& stimulus)
      : c_(c),
        stimulus_(stimulus),
        config_(c.engine->config),
        job_(stimulus.job),
        m_(config_.window),
        cols_(golden::sweep_cols(config_, job_)),
        i_(c.cell.column + m_ - 1),
        j_(c.cell.row + m_ - 1),
        at_(static_cast<size_t>(j_) * cols_ + i_),
        trace_(trace_of(c, stimulus, c.cell.plane)),
        probe_(c) {}

  std::vector<TableRow> rows() {
    control();
    address_generator();
    storage();
    interpolation();
    similarity();
    updating();
    unloaded();
    return std::move(rows_);
  }

 private:
  struct Options {
    int fraction = -1;
    bool lane = false, is_signed = false, compared = true;
  };
  static constexpr Options kSigned{-1, false, true, true};

  void enter(const char* name, const char* instance, bool one_per_lane, int where, bool is_sample) {
    stage_ = name, module_ = instance, per_lane_ = one_per_lane;
    base_ = c_.here[static_cast<size_t>(where)];
    place_ = std::to_string(c_.cell.plane) + (is_sample ? ": sample " : ": cell ") +
             std::to_string(is_sample ? i_ : c_.cell.column) + ',' + std::to_string(is_sample ? j_ : c_.cell.row);
  }
  void add(const std::string& what, const std::string& signal, int offset, int64_t golden, const Options& o) {
    TableRow row;
    row.stage = stage_, row.what = what, row.sample = place_;
    row.clock = base_ + static_cast<uint64_t>(offset);
    row.golden = golden;
    row.rtl = probe_.at(module_, per_lane_, signal, row.clock, o.lane, o.is_signed);
    row.fraction = o.fraction, row.compared = o.compared;
    rows_.push_back(row);
  }

  void control() {
    enter("control", "u_control", false, kControlOut, true);
    add("column of the sample", "col", -1, i_, {});  // counted a clock before the strobes
    add("row of the sample", "row", -1, j_, {});
    add("set of planes", "m_plane", 0, c_.set, {});
  }

  void address_generator() {
    enter("address_generator", "u_address_generator", true, kAddressOut, true);
    const Options fraction{config_.weight_bits, false, false, true};
    const golden::Sample &l = trace_.left[at_], &r = trace_.right[at_];
    add("left xi", "m_xi_left", 0, l.xi, kSigned);
    add("left fx", "m_fx_left", 0, l.fx, fraction);
    add("left yi", "m_yi_left", 0, l.yi, kSigned);
    add("left fy", "m_fy_left", 0, l.fy, fraction);
    add("right xi", "m_xi_right", 0, r.xi, kSigned);
    add("right fx", "m_fx_right", 0, r.fx, fraction);
    add("right yi", "m_yi_right", 0, r.yi, kSigned);
    add("right fy", "m_fy_right", 0, r.fy, fraction);
    add("window error", "m_window_error", 0, trace_.flags[at_].window_error, {});
  }

  void storage() {
    enter("storage", "u_storage", false, kStorageOut, true);
    quad("left", stimulus_.left, trace_.left[at_]);
    quad("right", stimulus_.right, trace_.right[at_]);
  }
  void quad(const std::string& side, const golden::Pixels& image, const golden::Sample& s) {
    const bool usable = trace_.flags[at_].usable;
    const golden::Quad q = usable ? golden::fetch(config_, image, s) : golden::Quad{};
    const struct {
      const char* name;
      int golden;
    } pixels[] = {{"p00", q.p00}, {"p10", q.p10}, {"p01", q.p01}, {"p11", q.p11}};
    for (const auto& p : pixels)
      add(side + ' ' + p.name, std::string("m_") + p.name + '_' + side, 0, p.golden, {-1, true, false, usable});
  }

  void interpolation() {
    enter("interpolation", "u_interpolation", true, kInterpolationOut, true);
    add("left sample", "m_l", 0, trace_.l[at_], {config_.interp_frac, false, false, true});
    add("right sample", "m_r", 0, trace_.r[at_], {config_.interp_frac, false, false, true});
  }

  void similarity() {
    enter("similarity", "u_similarity", true, kInterpolationOut, false);
    const golden::Sums sums = window_sums();
    // As the entity sees them: left less half the range, right mirrored, so that the covariance changes its sign.
    const int64_t n = static_cast<int64_t>(m_) * m_;
    // The -1 of the last line comes with the left sum: S^2 - 1 = (S + 1) (S - 1).
    add("sum of l' - 1", "s8_l", 8, sums.l - 1, kSigned);
    add("sum of r'", "s8_r", 8, sums.r, kSigned);
    add("-n sum of l' r'", "s10_x", 10, -n * sums.x, kSigned);
    // Modulo 2^bits, bits those of n^2 (var + var): the entity needs no more of it.
    int bits = 2 * config_.sample_bits() - 1;
    while ((int64_t{1} << bits) < (n * n << (2 * config_.sample_bits() - 1))) ++bits;
    add("-n sum of l'^2 + r'^2", "s10_y", 10, (-n * sums.y) & ((int64_t{1} << bits) - 1), {});
    add("n^2 cov", "s12_half", 12, -sums.covariance(n), kSigned);
    add("-n^2 (var + var) - 1", "s12_nden", 12, -sums.variances(n) - 1, kSigned);
    const golden::Similarity s = similarity_of(c_, trace_);
    base_ = c_.here[kSimilarityOut];
    add("inside", "m_inside", 0, s.valid, {});
    add("textured", "m_textured", 0, s.textured, {});
    add("V", "m_v", 0, s.v, {config_.mncc_bits, false, false, true});
  }
  // Of the model; all samples of the window are compared on the way.
  golden::Sums window_sums() {
    golden::Sums sums;
    const int64_t half = int64_t{1} << (config_.sample_bits() - 1);
    const std::vector<uint64_t> clocks = window_clocks(c_);
    TableRow row;
    for (int dj = 0; dj < m_; ++dj) {
      for (int di = 0; di < m_; ++di) {
        const size_t here = static_cast<size_t>(c_.cell.row + dj) * cols_ + static_cast<size_t>(c_.cell.column + di);
        const uint64_t clock = clocks[static_cast<size_t>(dj * m_ + di)];
        sums.add(trace_.l[here] - half, half - 1 - trace_.r[here]);
        row.rtl += probe_.at(module_, true, "s_l", clock) == trace_.l[here] &&
                   probe_.at(module_, true, "s_r", clock) == trace_.r[here];
      }
    }
    row.stage = stage_, row.what = "equal samples of the window", row.sample = place_, row.clock = base_;
    row.golden = static_cast<int64_t>(m_) * m_;
    rows_.push_back(row);
    return sums;
  }

  // The word before the set, and after all its planes.
  void updating() {
    enter("updating", "u_updating", false, kSimilarityOut, false);
    const int set_begin = c_.set * config_.lanes, set_end = std::min(set_begin + config_.lanes, job_.planes);
    advance(0, set_begin);
    add("address read", "read_cell", 0, address(), {});
    add_word("before", "word_", 2, c_.set > 0);  // the first set ignores what it reads
    advance(set_begin, set_end);
    base_ = c_.here[kMapWrite];
    add("address written", "dbg_map_addr", 0, address(), {});
    add_word("after", "dbg_map_", 0, true);
    advance(set_end, job_.planes);
  }
  int64_t address() const { return int64_t{c_.cell.row} * job_.tile_cols + c_.cell.column; }
  void advance(int from, int to) {
    for (int k = from; k < to; ++k)
      word_ = golden::update(config_, word_, k,
                             similarity_of(c_, k == c_.cell.plane ? trace_ : trace_of(c_, stimulus_, k)));
  }
  void add_word(const std::string& when, const std::string& prefix, int offset, bool compared) {
    const Options v{config_.mncc_bits, false, false, compared}, whole{-1, false, false, compared};
    add("best " + when, prefix + "best", offset, word_.best, v);
    add("prev " + when, prefix + "prev", offset, word_.prev, v);
    add("plane " + when, prefix + "plane", offset, word_.plane, whole);
    add("frac " + when, prefix + "frac", offset, word_.frac, {config_.frac_bits, false, false, compared});
    add("local_max " + when, prefix + "local_max", offset, word_.local_max, whole);
    add("prev_valid " + when, prefix + "prev_valid", offset, word_.prev_valid, whole);
  }

  // What leaves in the end, long behind the waves.
  void unloaded() {
    const golden::MapCell model = golden::unload(word_, job_.threshold);
    if (c_.cells.size() <= static_cast<size_t>(address())) throw WaveError("the map is too short");
    const golden::MapCell& out = c_.cells[static_cast<size_t>(address())];
    const struct {
      const char* what;
      int golden, rtl, fraction;
    } fields[] = {{"mask", model.mask, out.mask, -1},
                  {"plane", model.plane, out.plane, -1},
                  {"frac", model.frac, out.frac, config_.frac_bits},
                  {"V", model.v, out.v, config_.mncc_bits}};
    for (const auto& f : fields) {
      TableRow row;
      row.stage = "map, unloaded", row.what = f.what, row.golden = f.golden, row.rtl = f.rtl, row.fraction = f.fraction;
      row.sample = "all: cell " + std::to_string(c_.cell.column) + ',' + std::to_string(c_.cell.row);
      rows_.push_back(row);
    }
  }

  const Capture& c_;
  const scene::Stimulus& stimulus_;
  const golden::Config& config_;
  const golden::TileJob& job_;
  const int m_, cols_, i_, j_;  // window; samples a row; the sample in the lower right corner of the cell's window
  const size_t at_;
  const golden::PlaneTrace trace_;
  const Probe probe_;
  std::vector<TableRow> rows_;
  std::string stage_, module_, place_;
  bool per_lane_ = false;
  uint64_t base_ = 0;
  golden::Cell word_;
};

}  // namespace

std::vector<TableRow> compare_cell(const Capture& c, const scene::Stimulus& stimulus) {
  return CellTable(c, stimulus).rows();
}

size_t differences(const std::vector<TableRow>& rows) {
  size_t n = 0;
  for (const TableRow& row : rows) n += !row.equal();
  return n;
}

std::string table_text(const Capture& c, const std::vector<TableRow>& rows) {
  std::ostringstream text;
  char line[200];
  auto value = [](int64_t v, int fraction) {
    char buffer[48];
    if (fraction > 0) {
      std::snprintf(buffer, sizeof buffer, "%lld %.5f", static_cast<long long>(v),
                    static_cast<double>(v) / static_cast<double>(int64_t{1} << fraction));
    } else {
      std::snprintf(buffer, sizeof buffer, "%lld        ", static_cast<long long>(v));
    }
    return std::string(buffer);
  };
  std::snprintf(line, sizeof line, "%-17s %8s  %-18s %-27s %20s %20s\n", "stage", "clock", "plane: place", "value",
                "model", "rtl");
  text << line;
  size_t compared = 0;
  std::string stage;
  for (const TableRow& row : rows) {
    const bool again = row.stage == stage;
    stage = row.stage;
    compared += row.compared;
    std::snprintf(line, sizeof line, "%-17s %8s  %-18s %-27s %20s %20s%s\n", again ? "" : row.stage.c_str(),
                  row.clock ? std::to_string(row.clock).c_str() : "-", row.sample.c_str(), row.what.c_str(),
                  row.compared ? value(row.golden, row.fraction).c_str() : "-         ",
                  value(row.rtl, row.fraction).c_str(), row.equal() ? "" : "   <-- differs");
    text << line;
  }
  text << c.engine->name << ", plane " << c.cell.plane << ", cell " << c.cell.column << ',' << c.cell.row << ": "
       << compared - differences(rows) << " of " << compared << " values equal\n";
  return text.str();
}

std::string window_text(const Capture& c, const scene::Stimulus& stimulus) {
  const golden::PlaneTrace trace = trace_of(c, stimulus, c.cell.plane);
  const int m = c.engine->config.window, cols = golden::sweep_cols(c.engine->config, stimulus.job);
  const std::vector<uint64_t> clocks = window_clocks(c);
  const Probe probe(c);
  std::ostringstream text;
  for (const bool right : {false, true}) {
    text << (right ? "right" : "left") << " samples of the window, in units of 2^-" << c.engine->config.interp_frac
         << "; model/rtl where they differ\n";
    for (int dj = 0; dj < m; ++dj) {
      for (int di = 0; di < m; ++di) {
        const size_t here = static_cast<size_t>(c.cell.row + dj) * cols + static_cast<size_t>(c.cell.column + di);
        const int64_t golden = right ? trace.r[here] : trace.l[here],
                      rtl = probe.at("u_similarity", true, right ? "s_r" : "s_l",
                                     clocks[static_cast<size_t>(dj * m + di)]);
        text << ' ' << golden;
        if (rtl != golden) text << '/' << rtl;
      }
      text << '\n';
    }
  }
  return text.str();
}

}  // namespace psweep::waves
