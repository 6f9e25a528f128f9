// SPDX-License-Identifier: Apache-2.0
#include "waves/capture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>

namespace psweep::waves {
namespace {

// Clocks in the file before the first sample and behind the write; before: also in the full dump before the set.
constexpr uint64_t kMargin = 12, kBehind = 24, kLead = 100;
constexpr int kColumnBits = 14, kPlaneBits = 11;

std::string signal_error(const Layout& layout, const LayoutSignal& s, const std::string& problem) {
  return layout.file + ':' + std::to_string(s.line) + ": " + problem;
}

std::string bits_of(int64_t value, int width) {
  std::string text(static_cast<size_t>(width), '0');
  for (int i = 0; i < width; ++i)
    if (value >> i & 1) text[static_cast<size_t>(width - 1 - i)] = '1';
  return text;
}

// Beats at one place, clock by clock: number since the tile began.
class Beats {
 public:
  Beats(uint64_t first, uint64_t last) : first_(first), numbers_(last - first + 1, -1) {}
  void set(uint64_t clock, int64_t number) { numbers_[clock - first_] = number; }
  int64_t at(uint64_t clock) const {
    return clock < first_ || clock - first_ >= numbers_.size() ? -1 : numbers_[clock - first_];
  }

 private:
  uint64_t first_;
  std::vector<int64_t> numbers_;
};

struct Sideband {
  bool there = false, here = false, window = false;
  int plane = 0, column = 0, row = 0;
};

// What beat `number` of a place is.
Sideband decode(const Capture& c, int place, int64_t number) {
  Sideband s;
  if (number < 0) return s;
  const golden::Config& config = c.engine->config;
  const golden::TileJob& t = c.stimulus.job;
  const bool samples = place < kSimilarityOut;
  const int64_t cols = samples ? golden::sweep_cols(config, t) : t.tile_cols;
  const int64_t rows = samples ? golden::sweep_rows(config, t) : t.tile_rows;
  const int skirt = samples ? config.window - 1 : 0;
  s.there = true;
  s.plane = static_cast<int>(number / (cols * rows)) * config.lanes + c.lane;
  s.column = static_cast<int>(number % cols) - skirt;
  s.row = static_cast<int>(number / cols % rows) - skirt;
  s.here = s.plane == c.cell.plane && s.column == c.cell.column && s.row == c.cell.row;
  s.window = s.plane == c.cell.plane && s.column >= c.cell.column - skirt && s.column <= c.cell.column &&
             s.row >= c.cell.row - skirt && s.row <= c.cell.row;
  return s;
}

void append(NewSignal& s, uint64_t clock, const std::string& bits) {
  if (s.changes.empty() || s.changes.back().second != bits) s.changes.emplace_back(clock * kPicosecondsPerClock, bits);
}

// Signals in scope `cell` that tell which cell is at a group of signals.
void add_sideband(const Capture& c, const LayoutGroup& group, const std::vector<Beats>& beats,
                  std::map<std::string, NewSignal>& added) {
  const std::string scope = group.module + '.' + group.name + '.';
  if (added.count(scope + "here")) return;
  NewSignal here{scope + "here", 1, {}}, window{scope + "window", 1, {}}, plane{scope + "plane", kPlaneBits, {}},
      column{scope + "column", kColumnBits, {}}, row{scope + "row", kColumnBits, {}};
  const int place = base_of(group.module);
  for (uint64_t clock = c.first; clock <= c.last; ++clock) {
    const auto from = static_cast<int64_t>(clock) - group.offset;
    const Sideband s =
        decode(c, place, from < 0 ? -1 : beats[static_cast<size_t>(place)].at(static_cast<uint64_t>(from)));
    append(here, clock, s.here ? "1" : "0");
    append(window, clock, s.window ? "1" : "0");
    append(plane, clock, s.there ? bits_of(s.plane, kPlaneBits) : std::string(kPlaneBits, 'x'));
    append(column, clock, s.there ? bits_of(s.column, kColumnBits) : std::string(kColumnBits, 'x'));
    append(row, clock, s.there ? bits_of(s.row, kColumnBits) : std::string(kColumnBits, 'x'));
  }
  for (NewSignal* s : {&here, &window, &plane, &column, &row}) added.emplace(s->path, *s);
}

// The part of a signal that a layout asks for: position of the lowest bit, and width; nothing if it is the whole.
std::optional<std::pair<int, int>> part_of(const Capture& c, const LayoutSignal& s, int width) {
  if (s.bit >= 0) return std::make_pair(s.bit, 1);
  const int lanes = c.engine->config.lanes;
  if (s.lane && lanes > 1) return std::make_pair(c.lane * (width / lanes), width / lanes);
  if (s.held) return std::make_pair(0, width);
  return std::nullopt;
}
std::string part_path(const LayoutGroup& group, const LayoutSignal& s) {
  return group.module + '.' + group.name + (s.held ? ".held." : ".") + (s.alias.empty() ? s.name : s.alias);
}

uint64_t sub(uint64_t a, uint64_t b) { return a > b ? a - b : 0; }

}  // namespace

const char* place_name(int place) {
  static const char* const names[] = {"control",       "address_generator", "storage",
                                      "interpolation", "similarity",        "updating"};
  return names[place];
}

int base_of(const std::string& module) {
  if (module == "u_control" || module == "u_address_generator") return kControlOut;
  if (module == "u_storage") return kAddressOut;
  if (module == "u_interpolation") return kStorageOut;
  if (module == "u_similarity") return kInterpolationOut;
  if (module == "u_updating") return kSimilarityOut;
  throw WaveError("samples are not counted in " + module);
}

std::string scope_of(const FstReader& waves, const std::string& module, bool per_lane, int lane) {
  if (module == "psweep") return module;
  const std::string number = "_n" + std::to_string(lane + 1) + '_';
  for (const Signal& s : waves.signals()) {
    const size_t begin = s.path.find("psweep.");
    if (begin == std::string::npos || (begin > 0 && s.path[begin - 1] != '.')) continue;
    const size_t from = begin + 7, to = s.path.find('.', from);
    if (to == std::string::npos) continue;
    const std::string name = s.path.substr(from, to - from);
    if (!per_lane ? name == module
                  : name.size() > module.size() && name.find(number) != std::string::npos &&
                        name.compare(name.size() - module.size() - 1, std::string::npos, '_' + module) == 0)
      return "psweep." + name;
  }
  throw WaveError("no instance " + module + (per_lane ? " of lane " + std::to_string(lane) : "") + " in the waves");
}

void check_cell(const Engine& engine, const scene::Stimulus& stimulus, const Cell& cell) {
  const golden::TileJob& t = stimulus.job;
  auto check = [&](const char* what, int value, int count) {
    if (value < 0 || value >= count)
      throw WaveError(std::string(what) + ' ' + std::to_string(value) + ": " + engine.name + " has " + what +
                      "s 0 to " + std::to_string(count - 1));
  };
  check("plane", cell.plane, t.planes);
  check("column", cell.column, t.tile_cols);
  check("row", cell.row, t.tile_rows);
}

std::vector<Layout> read_layouts(const std::string& folder, const Engine& engine, const Cell& cell) {
  std::map<std::string, int> keys = engine.keys;
  keys["lane"] = cell.plane % engine.config.lanes;
  std::vector<Layout> layouts;
  for (const std::string& stage : stages()) layouts.push_back(read_layout(folder, stage, keys));
  return layouts;
}

namespace {

// The two runs of a capture, and what is made of the second one's waves.
class Capturing {
 public:
  Capturing(const Engine& engine, const scene::Stimulus& stimulus, const Cell& cell, const std::vector<Layout>& layouts,
            const std::string& file)
      : engine_(engine), layouts_(layouts) {
    const golden::Config& config = engine.config;
    c_.engine = &engine;
    c_.stimulus = stimulus;
    c_.cell = cell;
    c_.fst = file;
    c_.lane = cell.plane % config.lanes;
    c_.set = cell.plane / config.lanes;
    c_.keys = engine.keys;
    c_.keys["lane"] = c_.lane;
    run_.stimulus = &stimulus;
    run_.lane = c_.lane;
  }

  Capture capture() {
    find_cell();
    run_with_waves();
    const FstReader full(run_.fst);
    last_ = std::min(run_.last, full_log_.last_clock - 1);
    find_parts(full);
    const Values values(full, wanted_);
    number_beats(values);
    add_sidebands();
    add_parts(values);
    write(full);
    std::remove(run_.fst.c_str());
    return std::move(c_);
  }

 private:
  struct Part {
    uint32_t from;
    int low, width;
    std::string path;
    const LayoutGroup* held;  // nullptr: all values, else that at the cell's clock in this group
  };

  // First run: when does the cell come, and its window, and its set?
  void find_cell() {
    const golden::Config& config = engine_.config;
    const golden::TileJob& t = c_.stimulus.job;
    const auto cols = static_cast<uint64_t>(golden::sweep_cols(config, t));
    const auto set_samples = cols * static_cast<uint64_t>(golden::sweep_rows(config, t));
    const auto set = static_cast<uint64_t>(c_.set), skirt = static_cast<uint64_t>(config.window - 1);
    const auto column = static_cast<uint64_t>(c_.cell.column), row = static_cast<uint64_t>(c_.cell.row);
    set_begin_ = set * set_samples;
    window_begin_ = set_begin_ + row * cols + column;
    window_end_ = window_begin_ + skirt * cols + skirt;
    const uint64_t cell_number =
        (set * static_cast<uint64_t>(t.tile_rows) + row) * static_cast<uint64_t>(t.tile_cols) + column;
    std::vector<uint64_t> samples{set_begin_};
    if (window_begin_ != set_begin_) samples.push_back(window_begin_);
    samples.push_back(window_end_);
    run_.wanted = {samples, samples, samples, {cell_number}, {cell_number}};
    log_ = engine_.run(config, run_);
    for (int tap = 0; tap < kTaps; ++tap) {
      if (log_.clocks[tap].size() != run_.wanted[tap].size())
        throw WaveError("the cell does not come to " + std::string(place_name(tap + 1)));
      c_.here[tap + 1] = log_.clocks[tap].back();
      c_.entered[tap + 1] = tap < kSim ? log_.clocks[tap][samples.size() - 2] : c_.here[tap + 1];
    }
    c_.cells = log_.cells;
  }

  // Second run: the same with waves, from the beginning of the set on.
  void run_with_waves() {
    run_.fst = c_.fst + ".full";
    run_.first = sub(log_.clocks[kSample][0], kLead);
    run_.last = c_.here[kMapWrite] + kBehind;
    full_log_ = engine_.run(engine_.config, run_);
    if (full_log_.clocks != log_.clocks) throw WaveError("two runs differ");
  }

  // The signals that are read: those that number the beats, and the layouts' parts.
  void find_parts(const FstReader& full) {
    auto handle = [&](const std::string& name) { return full.get("psweep." + name).handle; };
    valid_ = {handle("dbg_sample_valid"), handle("dbg_quad_valid"), handle("dbg_interp_valid"), handle("dbg_sim_valid"),
              handle("dbg_map_we")};
    control_valid_ = handle("u_control.m_valid"), control_row_ = handle("u_control.m_row_first");
    control_plane_ = handle("u_control.m_plane_first"), control_set_ = handle("u_control.m_plane");
    wanted_.assign(valid_.begin(), valid_.end());
    wanted_.insert(wanted_.end(), {control_valid_, control_row_, control_plane_, control_set_});
    for (const Layout& layout : layouts_) {
      for (const LayoutGroup& group : layout.groups) {
        const std::string scope = scope_of(full, group.module, group.module_per_lane, c_.lane);
        for (const LayoutSignal& s : group.signals) find_part(full, layout, group, s, scope);
      }
    }
  }
  void find_part(const FstReader& full, const Layout& layout, const LayoutGroup& group, const LayoutSignal& s,
                 const std::string& scope) {
    const std::string end = scope + '.' + s.name;
    const Signal* found = nullptr;
    for (const Signal& candidate : full.signals())
      if (candidate.path.size() > end.size() - 1 &&
          candidate.path.compare(candidate.path.size() - end.size(), std::string::npos, end) == 0)
        found = &candidate;
    if (!found) throw WaveError(signal_error(layout, s, "no signal " + s.name + " in " + scope));
    const auto part = part_of(c_, s, found->width);
    if (!part) return;
    if (s.held && !group.timed) throw WaveError(signal_error(layout, s, "held in a group without an offset"));
    if (part->first < 0 || part->first + part->second > found->width)
      throw WaveError(signal_error(layout, s, s.name + " has only " + std::to_string(found->width) + " bits"));
    parts_.push_back({found->handle, part->first, part->second, part_path(group, s), s.held ? &group : nullptr});
    wanted_.push_back(found->handle);
  }

  // What is where, clock by clock.
  void number_beats(const Values& values) {
    beats_.assign(kPlaces, Beats(run_.first, last_));
    std::array<uint64_t, kTaps> count = full_log_.before;
    std::vector<std::pair<uint64_t, bool>> control;  // clock, and whether the set begins
    for (uint64_t clock = run_.first; clock <= last_; ++clock) {
      for (int tap = 0; tap < kTaps; ++tap)
        if (values.at_clock(valid_[tap], clock) >> (tap == kMap ? 0 : c_.lane) & 1)
          beats_[static_cast<size_t>(tap + 1)].set(clock, static_cast<int64_t>(count[tap]++));
      if (!values.at_clock(control_valid_, clock)) continue;
      const bool begins = values.at_clock(control_row_, clock) && values.at_clock(control_plane_, clock) &&
                          values.at_clock(control_set_, clock) == static_cast<uint64_t>(c_.set);
      control.emplace_back(clock, begins);
    }
    const auto begin = std::find_if(control.begin(), control.end(), [](const auto& beat) { return beat.second; });
    if (begin == control.end()) throw WaveError("control does not begin the set within the dump");
    for (auto beat = control.begin(); beat != control.end(); ++beat) {
      const int64_t number = static_cast<int64_t>(set_begin_) + (beat - begin);
      beats_[kControlOut].set(beat->first, number);
      if (number == static_cast<int64_t>(window_begin_)) c_.entered[kControlOut] = beat->first;
      if (number == static_cast<int64_t>(window_end_)) c_.here[kControlOut] = beat->first;
    }
    c_.first = std::max(run_.first, sub(c_.entered[kControlOut], kMargin));
    c_.last = std::min(last_, c_.here[kMapWrite] + kBehind);
  }

  // The delays in the layouts are those of the hardware: what leaves an entity by its layout enters the next one.
  void add_sidebands() {
    for (const Layout& layout : layouts_) {
      for (const LayoutGroup& group : layout.groups) {
        if (!group.timed) continue;
        add_sideband(c_, group, beats_, added_);
        if (group.name != "m" || group.module == "u_control") continue;
        const auto place = static_cast<size_t>(base_of(group.module));
        const uint64_t leaves = c_.here[place] + static_cast<uint64_t>(group.offset);
        if (leaves != c_.here[place + 1])
          throw WaveError(layout.file + ": group m of " + group.module + " is at clock " + std::to_string(leaves) +
                          ", but the cell is handed on at clock " + std::to_string(c_.here[place + 1]));
      }
    }
  }

  void add_parts(const Values& values) {
    for (const Part& part : parts_) {
      if (added_.count(part.path)) continue;
      NewSignal s{part.path, part.width, {}};
      auto field = [&part](const std::string& bits) {
        return bits.substr(bits.size() - static_cast<size_t>(part.low + part.width), static_cast<size_t>(part.width));
      };
      if (part.held) {
        const uint64_t time = kPicosecondsPerClock * (c_.here[static_cast<size_t>(base_of(part.held->module))] +
                                                      static_cast<uint64_t>(part.held->offset));
        s.changes.emplace_back(c_.first * kPicosecondsPerClock, std::string(static_cast<size_t>(part.width), 'z'));
        s.changes.emplace_back(time, field(values.bits(part.from, time)));
      } else {
        for (const auto& [time, bits] : values.all(part.from)) {
          if (time > c_.last * kPicosecondsPerClock) break;
          if (time <= c_.first * kPicosecondsPerClock) s.changes.clear();
          if (s.changes.empty() || s.changes.back().second != field(bits)) s.changes.emplace_back(time, field(bits));
        }
      }
      added_.emplace(part.path, s);
    }
  }

  void write(const FstReader& full) const {
    std::vector<NewSignal> list;
    for (const auto& s : added_) list.push_back(s.second);
    std::string root;
    for (const Signal& s : full.signals()) {
      const size_t at = s.path.find("psweep.");
      if (at == 0 || (at != std::string::npos && s.path[at - 1] == '.')) {
        root = s.path.substr(0, at + 6);
        break;
      }
    }
    write_trimmed(full, root, c_.first * kPicosecondsPerClock,
                  c_.last * kPicosecondsPerClock + kPicosecondsPerClock / 2, list, c_.fst);
  }

  const Engine& engine_;
  const std::vector<Layout>& layouts_;
  Capture c_;
  Run run_;
  RunLog log_, full_log_;
  uint64_t set_begin_ = 0, window_begin_ = 0, window_end_ = 0, last_ = 0;  // samples; the last clock of the dump
  std::array<uint32_t, kTaps> valid_{};
  uint32_t control_valid_ = 0, control_row_ = 0, control_plane_ = 0, control_set_ = 0;
  std::vector<uint32_t> wanted_;
  std::vector<Part> parts_;
  std::vector<Beats> beats_;
  std::map<std::string, NewSignal> added_;
};

}  // namespace

Capture capture(const Engine& engine, const scene::Stimulus& stimulus, const Cell& cell,
                const std::vector<Layout>& layouts, const std::string& file) {
  check_cell(engine, stimulus, cell);
  return Capturing(engine, stimulus, cell, layouts, file).capture();
}

void write_save_file(const Capture& c, const Layout& layout, const std::string& file) {
  const FstReader waves(c.fst);
  std::ofstream out(file);
  auto flags = [&](unsigned value) {
    char text[24];
    std::snprintf(text, sizeof text, "@%x\n", value);
    out << text;
  };
  constexpr unsigned kHex = 0x2, kDec = 0x4, kBin = 0x8, kRight = 0x20, kComment = 0x200, kSigned = 0x400,
                     kClosed = 0x400000, kGroupBegin = 0x800000, kGroupEnd = 0x1000000, kShift = 0x40000000;
  enum Colour { kPlain = 0, kOrange = 2, kYellow = 3 };
  auto show = [&](const std::string& path, const std::string& format, int fraction, int colour,
                  const std::string& alias) {
    const unsigned base = format == "hex"                        ? kHex
                          : format == "bin"                      ? kBin
                          : format == "sdec" || format == "sfix" ? kSigned
                                                                 : kDec;
    flags(base | kRight | (fraction > 0 ? kShift : 0));
    if (fraction > 0) out << "[fpshift_count] " << fraction << '\n';
    if (colour) out << "[color] " << colour << '\n';
    if (!alias.empty()) out << "+{" << alias << "} ";
    out << waves.get(path).full() << '\n';
  };
  auto group_line = [&](bool begin, const std::string& title, bool closed = false) {
    flags(kComment | (begin ? kGroupBegin : kGroupEnd) | (closed ? kClosed : 0));
    out << '-' << title << '\n';
  };

  // The engine's own layout: everything from control to the map; an entity's: from its input to its output.
  const bool whole = layout.stage == "psweep";
  uint64_t from = ~uint64_t{0}, to = 0;
  for (const LayoutGroup& group : layout.groups) {
    if (!group.timed) continue;
    const uint64_t clock = c.here[static_cast<size_t>(base_of(group.module))] + static_cast<uint64_t>(group.offset);
    from = std::min(from, clock);
    to = std::max(to, clock);
  }
  // Both in full: GTKWave then finds the waves from any folder, and when both files were moved.
  auto full = [](const std::string& name) { return std::filesystem::absolute(name).lexically_normal().string(); };
  out << "[*] psweep-waves: " << c.engine->name << ", " << layout.stage << ", plane " << c.cell.plane << ", cell "
      << c.cell.column << ',' << c.cell.row << '\n';
  out << "[dumpfile] \"" << full(c.fst) << "\"\n[savefile] \"" << full(file) << "\"\n";
  // About 1080 pixels are left for the waves; GTKWave's zoom is the negative binary logarithm of the time in 200.
  const uint64_t around = layout.stage == "control" ? 12 : 3;
  const uint64_t behind =
      whole ? kBehind / 2 : around;  // room for the last values; GTKWave shows nothing beyond the end
  const double per_pixel = static_cast<double>((to - from + 1 + around + behind) * kPicosecondsPerClock) / 1080;
  out << "[timestart] " << sub(from, around) * kPicosecondsPerClock << '\n';
  out << "[size] 1400 1000\n[pos] -1 -1\n";
  out << '*' << -std::log2(200 * per_pixel) << ' ' << to * kPicosecondsPerClock;
  for (int marker = 0; marker < 26; ++marker)
    out << ' '
        << (marker < kPlaces ? std::to_string(c.here[static_cast<size_t>(marker)] * kPicosecondsPerClock) : "-1");
  out << '\n';
  out << "[treeopen] psweep.\n[sst_width] 0\n[signals_width] 260\n[sst_expanded] 0\n";

  const std::string cell = "psweep.cell.";
  show("psweep.clk", "bin", 0, kPlain, "");
  group_line(true, "plane " + std::to_string(c.cell.plane) + ", cell " + std::to_string(c.cell.column) + ',' +
                       std::to_string(c.cell.row) + ": where it is");
  for (const LayoutGroup& group : layout.groups)
    if (group.timed)
      show(cell + group.module + '.' + group.name + ".here", "bin", 0, kYellow,
           (whole ? group.module.substr(2) + ' ' : "") + group.name);
  group_line(false, "");
  for (const LayoutGroup& group : layout.groups) {
    const std::string scope = scope_of(waves, group.module, group.module_per_lane, c.lane);
    group_line(true, (group.timed && !whole ? group.name + ": " : "") + group.title);
    bool first = true;
    for (const LayoutSignal& s : group.signals) {
      const Signal& original = waves.get(scope + '.' + s.name);
      if (part_of(c, s, original.width)) {
        show(cell + part_path(group, s), s.format, s.fraction, kPlain, "");
      } else {
        show(original.path, s.format, s.fraction, kPlain, s.alias);
      }
      // Behind the valid: whose it is.
      if (first && group.timed) {
        const std::string sideband = cell + group.module + '.' + group.name + '.';
        // In the whole engine's layout the plane and the row only where the way begins and ends.
        const bool inner = whole && group.module != "u_control" && group.module != "u_updating";
        if (!inner && (group.name == "s" || group.name == "m" || group.name == "sweep")) {
          show(sideband + "plane", "dec", 0, kOrange, "plane");
          show(sideband + "row", "sdec", 0, kOrange, "row");
        }
        show(sideband + "column", "sdec", 0, kOrange, "column");
        if (group.name == "s" && base_of(group.module) < kSimilarityOut)
          show(sideband + "window", "bin", 0, kOrange, "");
      }
      first = false;
    }
    group_line(false, "");
  }
  out.close();
  if (!out) throw WaveError(file + ": cannot be written");
}

}  // namespace psweep::waves
