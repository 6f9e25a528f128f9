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

}  // namespace

std::vector<TableRow> compare_cell(const Capture& c, const scene::Stimulus& stimulus) {
  const golden::Config& config = c.engine->config;
  const golden::TileJob& t = stimulus.job;
  const int m = config.window, cols = golden::sweep_cols(config, t), lanes = config.lanes;
  const int i = c.cell.column + m - 1, j = c.cell.row + m - 1;
  const size_t at = static_cast<size_t>(j) * cols + i;
  const golden::PlaneTrace trace = trace_of(c, stimulus, c.cell.plane);
  const golden::Sample &l = trace.left[at], &r = trace.right[at];
  const golden::SampleFlags flags = trace.flags[at];
  const Probe probe(c);
  std::vector<TableRow> rows;

  std::string stage, module, place;
  bool per_lane = false;
  uint64_t base = 0;
  auto enter = [&](const char* name, const char* instance, bool one_per_lane, int where, bool is_sample) {
    stage = name, module = instance, per_lane = one_per_lane;
    base = c.here[static_cast<size_t>(where)];
    place = std::to_string(c.cell.plane) + (is_sample ? ": sample " : ": cell ") +
            std::to_string(is_sample ? i : c.cell.column) + ',' + std::to_string(is_sample ? j : c.cell.row);
  };
  struct Options {
    int fraction = -1;
    bool lane = false, is_signed = false, compared = true;
  };
  auto add = [&](const char* what, const std::string& signal, int offset, int64_t golden, const Options& o) {
    TableRow row;
    row.stage = stage, row.what = what, row.sample = place;
    row.clock = base + static_cast<uint64_t>(offset);
    row.golden = golden;
    row.rtl = probe.at(module, per_lane, signal, row.clock, o.lane, o.is_signed);
    row.fraction = o.fraction, row.compared = o.compared;
    rows.push_back(row);
  };

  enter("control", "u_control", false, kControlOut, true);
  add("column of the sample", "col", -1, i, {});  // counted a clock before the strobes
  add("row of the sample", "row", -1, j, {});
  add("set of planes", "m_plane", 0, c.set, {});

  enter("address_generator", "u_address_generator", true, kAddressOut, true);
  const int w = config.weight_bits;
  add("left xi", "m_xi_left", 0, l.xi, {-1, false, true, true});
  add("left fx", "m_fx_left", 0, l.fx, {w, false, false, true});
  add("left yi", "m_yi_left", 0, l.yi, {-1, false, true, true});
  add("left fy", "m_fy_left", 0, l.fy, {w, false, false, true});
  add("right xi", "m_xi_right", 0, r.xi, {-1, false, true, true});
  add("right fx", "m_fx_right", 0, r.fx, {w, false, false, true});
  add("right yi", "m_yi_right", 0, r.yi, {-1, false, true, true});
  add("right fy", "m_fy_right", 0, r.fy, {w, false, false, true});
  add("window error", "m_window_error", 0, flags.window_error, {});

  enter("storage", "u_storage", false, kStorageOut, true);
  auto quad = [&](const char* side, const golden::Pixels& image, const golden::Sample& s) {
    const golden::Quad q = flags.usable ? golden::fetch(config, image, s) : golden::Quad{};
    const std::string end = std::string("_") + side;
    const struct {
      const char* name;
      int golden;
    } pixels[] = {{"p00", q.p00}, {"p10", q.p10}, {"p01", q.p01}, {"p11", q.p11}};
    for (const auto& p : pixels)
      add((std::string(side) + ' ' + p.name).c_str(), std::string("m_") + p.name + end, 0, p.golden,
          {-1, true, false, flags.usable});
  };
  quad("left", stimulus.left, l);
  quad("right", stimulus.right, r);

  enter("interpolation", "u_interpolation", true, kInterpolationOut, true);
  add("left sample", "m_l", 0, trace.l[at], {config.interp_frac, false, false, true});
  add("right sample", "m_r", 0, trace.r[at], {config.interp_frac, false, false, true});

  enter("similarity", "u_similarity", true, kInterpolationOut, false);
  golden::Sums sums;
  const int64_t half = int64_t{1} << (config.sample_bits() - 1);
  int64_t equal = 0;
  const std::vector<uint64_t> clocks = window_clocks(c);
  for (int dj = 0; dj < m; ++dj) {
    for (int di = 0; di < m; ++di) {
      const size_t here = static_cast<size_t>(c.cell.row + dj) * cols + static_cast<size_t>(c.cell.column + di);
      const uint64_t clock = clocks[static_cast<size_t>(dj * m + di)];
      sums.add(trace.l[here] - half, half - 1 - trace.r[here]);
      equal += probe.at(module, true, "s_l", clock) == trace.l[here] &&
               probe.at(module, true, "s_r", clock) == trace.r[here];
    }
  }
  TableRow samples;
  samples.stage = stage, samples.what = "equal samples of the window", samples.sample = place, samples.clock = base;
  samples.golden = static_cast<int64_t>(m) * m;
  samples.rtl = equal;
  rows.push_back(samples);
  // As the entity sees them: left less half the range, right mirrored, so that the covariance changes its sign.
  const int64_t n = samples.golden;
  // The -1 of the last line comes with the left sum: S^2 - 1 = (S + 1) (S - 1).
  add("sum of l' - 1", "s8_l", 8, sums.l - 1, {-1, false, true, true});
  add("sum of r'", "s8_r", 8, sums.r, {-1, false, true, true});
  add("-n sum of l' r'", "s10_x", 10, -n * sums.x, {-1, false, true, true});
  // Modulo 2^bits, bits those of n^2 (var + var): the entity needs no more of it.
  int bits = 2 * config.sample_bits() - 1;
  while ((int64_t{1} << bits) < (n * n << (2 * config.sample_bits() - 1))) ++bits;
  add("-n sum of l'^2 + r'^2", "s10_y", 10, (-n * sums.y) & ((int64_t{1} << bits) - 1), {});
  add("n^2 cov", "s12_half", 12, -sums.covariance(n), {-1, false, true, true});
  add("-n^2 (var + var) - 1", "s12_nden", 12, -sums.variances(n) - 1, {-1, false, true, true});
  const golden::Similarity s = similarity_of(c, trace);
  base = c.here[kSimilarityOut];
  add("inside", "m_inside", 0, s.valid, {});
  add("textured", "m_textured", 0, s.textured, {});
  add("V", "m_v", 0, s.v, {config.mncc_bits, false, false, true});

  // The word before the set, and after all its planes.
  enter("updating", "u_updating", false, kSimilarityOut, false);
  golden::Cell word;
  const int set_begin = c.set * lanes, set_end = std::min(set_begin + lanes, t.planes);
  auto advance = [&](int from, int to) {
    for (int k = from; k < to; ++k)
      word = golden::update(config, word, k, similarity_of(c, k == c.cell.plane ? trace : trace_of(c, stimulus, k)));
  };
  auto add_word = [&](const std::string& when, const std::string& prefix, int offset, bool compared) {
    const std::string ok = prefix == "word_" ? "word_" : "dbg_map_";
    add(("best " + when).c_str(), ok + "best", offset, word.best, {config.mncc_bits, false, false, compared});
    add(("prev " + when).c_str(), ok + "prev", offset, word.prev, {config.mncc_bits, false, false, compared});
    add(("plane " + when).c_str(), ok + "plane", offset, word.plane, {-1, false, false, compared});
    add(("frac " + when).c_str(), ok + "frac", offset, word.frac, {config.frac_bits, false, false, compared});
    add(("local_max " + when).c_str(), ok + "local_max", offset, word.local_max, {-1, false, false, compared});
    add(("prev_valid " + when).c_str(), ok + "prev_valid", offset, word.prev_valid, {-1, false, false, compared});
  };
  const int64_t address = int64_t{c.cell.row} * t.tile_cols + c.cell.column;
  advance(0, set_begin);
  add("address read", "read_cell", 0, address, {});
  add_word("before", "word_", 2, c.set > 0);  // the first set ignores what it reads
  advance(set_begin, set_end);
  base = c.here[kMapWrite];
  add("address written", "dbg_map_addr", 0, address, {});
  add_word("after", "dbg_map_", 0, true);

  // What leaves in the end, long behind the waves.
  advance(set_end, t.planes);
  const golden::MapCell model = golden::unload(word, t.threshold);
  if (c.cells.size() <= static_cast<size_t>(address)) throw WaveError("the map is too short");
  const golden::MapCell& out = c.cells[static_cast<size_t>(address)];
  const struct {
    const char* what;
    int golden, rtl, fraction;
  } fields[] = {{"mask", model.mask, out.mask, -1},
                {"plane", model.plane, out.plane, -1},
                {"frac", model.frac, out.frac, config.frac_bits},
                {"V", model.v, out.v, config.mncc_bits}};
  for (const auto& f : fields) {
    TableRow row;
    row.stage = "map, unloaded", row.what = f.what, row.golden = f.golden, row.rtl = f.rtl, row.fraction = f.fraction;
    row.sample = "all: cell " + std::to_string(c.cell.column) + ',' + std::to_string(c.cell.row);
    rows.push_back(row);
  }
  return rows;
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
