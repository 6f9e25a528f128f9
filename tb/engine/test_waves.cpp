// SPDX-License-Identifier: Apache-2.0
// make waves: for every configuration with waves and every stage the file is there, trimmed to the cell's way, the
// model's values stand at the marked clocks, and every signal of the save files exists. Wrong requests, layouts, values
// and clocks are told.
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>

#include "golden/psweep.hpp"
#include "support/catch.hpp"
#include "support/temporary_dir.hpp"
#include "waves/table.hpp"

using namespace psweep;
using namespace psweep::waves;

namespace {

scene::Stimulus stimulus_of(const Engine& engine, uint32_t seed, scene::Geometry geometry = scene::Geometry::kInside) {
  const golden::Config& c = engine.config;
  return scene::StimulusMaker(c, seed).make(scene::Texture::kStereo, geometry, c.plane_cols, c.plane_rows, c.planes);
}

const Engine& engine_of(const char* name) {
  for (const Engine& e : engines())
    if (e.name == name) return e;
  throw std::runtime_error(std::string("no engine ") + name);
}

struct SaveFile {
  struct Group {
    std::string valid, column;  // its first signal, and the cell's column if the group is in step with the samples
  };
  std::vector<Group> groups;
  std::vector<std::string> signals;
  std::vector<uint64_t> markers;  // ps
  uint64_t begin = 0;
};
SaveFile parse(std::istream& in) {
  SaveFile f;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '@') continue;
    if (line[0] == '-') {
      if (line.size() > 1) f.groups.push_back({});
    } else if (line.compare(0, 11, "[timestart]") == 0) {
      f.begin = std::stoull(line.substr(11));
    } else if (line[0] == '*') {
      std::istringstream words(line.substr(1));
      double zoom;
      int64_t time;
      words >> zoom >> time;
      for (int i = 0; i < 26 && words >> time; ++i)
        if (time >= 0) f.markers.push_back(static_cast<uint64_t>(time));
    } else if (line[0] != '[') {
      if (line[0] == '+') line = line.substr(line.find("} ") + 2);
      f.signals.push_back(line);
      if (f.groups.empty()) continue;
      SaveFile::Group& group = f.groups.back();
      if (group.valid.empty()) group.valid = line;
      if (line.find(".column[") != std::string::npos) group.column = line;
    }
  }
  return f;
}
SaveFile parse(const std::string& file) {
  std::ifstream in(file);
  return parse(in);
}

std::vector<std::string> missing(const SaveFile& save, const FstReader& waves) {
  std::set<std::string> there;
  for (const Signal& s : waves.signals()) there.insert(s.full());
  std::vector<std::string> names;
  for (const std::string& s : save.signals)
    if (!there.count(s)) names.push_back(s);
  return names;
}

// How many of the cell's values, at the clocks of the markers, are not the model's: read here without the table's code.
int wrong_at(const std::vector<uint64_t>& markers, const Capture& c, const FstReader& waves) {
  const golden::Config& config = c.engine->config;
  const golden::TileJob& t = c.stimulus.job;
  std::vector<golden::Cell> map(1);
  golden::PlaneTrace trace;
  const int last = std::min((c.set + 1) * config.lanes, t.planes);
  const size_t cell = static_cast<size_t>(c.cell.row) * t.tile_cols + c.cell.column;
  const size_t sample = static_cast<size_t>(c.cell.row + config.window - 1) * golden::sweep_cols(config, t) +
                        c.cell.column + config.window - 1;
  for (int k = 0; k < last; ++k) {
    auto now = golden::sweep_plane(config, t, c.stimulus.table[k], c.stimulus.left, c.stimulus.right);
    map[0] = golden::update(config, map[0], k, now.similarity[cell]);
    if (k == c.cell.plane) trace = std::move(now);
  }
  std::vector<uint32_t> handles;
  for (const Signal& s : waves.signals()) handles.push_back(s.handle);
  const Values values(waves, handles);
  auto field = [&](const std::string& port, uint64_t time, bool lane = true) {
    const Signal& s = waves.get("psweep.dbg_" + port);
    const size_t width = static_cast<size_t>(lane ? s.width / config.lanes : s.width);
    const std::string& bits = values.bits(s.handle, time);
    return number(bits.substr(bits.size() - width * static_cast<size_t>(lane ? c.lane + 1 : 1), width));
  };
  auto u = [](int v) { return static_cast<uint64_t>(v); };
  int wrong = 0;
  // Held values begin with the cell's clock.
  for (const auto& [name, place] : {std::make_pair("u_address_generator.m.held.m_xi_left", 1),
                                    std::make_pair("u_updating.m.held.dbg_map_best", 5)}) {
    const uint32_t handle = waves.get(std::string("psweep.cell.") + name).handle;
    const uint64_t time = markers[static_cast<size_t>(place)];
    wrong += values.bits(handle, time - kPicosecondsPerClock)[0] != 'z';
    wrong += values.bits(handle, time)[0] == 'z' ||
             number(values.bits(handle, time)) != (place == 1 ? u(trace.left[sample].xi) & 0x1fff : u(map[0].best));
  }
  wrong += field("sample_valid", markers[1]) != 1;
  wrong += field("xi_left", markers[1]) != (u(trace.left[sample].xi) & 0x1fff);
  wrong += field("fx_right", markers[1]) != u(trace.right[sample].fx);
  wrong += field("quad_valid", markers[2]) != 1;
  if (trace.flags[sample].usable)
    wrong += field("p10_left", markers[2]) != u(golden::fetch(config, c.stimulus.left, trace.left[sample]).p10);
  wrong += field("interp_valid", markers[3]) != 1;
  wrong += field("l", markers[3]) != u(trace.l[sample]);
  wrong += field("r", markers[3]) != u(trace.r[sample]);
  wrong += field("sim_valid", markers[4]) != 1;
  wrong += field("sim_inside", markers[4]) != u(trace.similarity[cell].valid);
  wrong += field("sim_v", markers[4]) != u(trace.similarity[cell].v);
  // Of bundles the field of the cell's lane.
  auto own = [&](const std::string& name, uint64_t time) {
    const std::string& bits = values.bits(waves.get("psweep.cell." + name).handle, time);
    return bits[0] == 'z' ? ~uint64_t{0} : number(bits);  // z: held, and not there yet
  };
  if (trace.flags[sample].usable)
    wrong += own("u_storage.m.held.m_p10_left", markers[2]) !=
             u(golden::fetch(config, c.stimulus.left, trace.left[sample]).p10);
  if (config.lanes > 1) wrong += own("u_updating.s.s_v", markers[4]) != u(trace.similarity[cell].v);
  wrong += field("map_we", markers[5], false) != 1;
  wrong += field("map_addr", markers[5], false) != cell;
  wrong += field("map_best", markers[5], false) != u(map[0].best);
  wrong += field("map_prev", markers[5], false) != u(map[0].prev);
  wrong += field("map_plane", markers[5], false) != u(map[0].plane);
  wrong += field("map_frac", markers[5], false) != u(map[0].frac);
  return wrong;
}

Capture take(const Engine& engine, const Cell& cell, const TemporaryDir& dir,
             const std::string& layouts = PSWEEP_LAYOUTS, scene::Geometry geometry = scene::Geometry::kInside) {
  return capture(engine, stimulus_of(engine, test_seed(), geometry), cell, read_layouts(layouts, engine, cell),
                 (dir / "x.fst").string());
}

// The delays in the layouts: clock by clock, until the cell has passed, a group's valid is up exactly when the sideband
// says that somebody is there (or, behind the window sums, somebody whose window is complete). How many groups agree.
int groups_in_step(const SaveFile& save, const Capture& c, const FstReader& waves) {
  std::map<std::string, uint32_t> handles;
  for (const Signal& s : waves.signals()) handles[s.full()] = s.handle;
  int agree = 0;
  for (const SaveFile::Group& group : save.groups) {
    if (group.column.empty()) continue;
    std::string row = group.column, here = group.column;
    row.replace(row.find(".column["), 8, ".row[");
    here.erase(here.find(".column[")).append(".here");
    const uint32_t v = handles.at(group.valid), x = handles.at(group.column), y = handles.at(row), h = handles.at(here);
    const Values values(waves, {v, x, y, h});
    bool all = true, complete = true, passed = false;
    for (uint64_t clock = c.first; !passed && clock <= c.last; ++clock) {
      const std::string &col = values.bits(x, clock * kPicosecondsPerClock),
                        &line = values.bits(y, clock * kPicosecondsPerClock);
      const bool valid = values.at_clock(v, clock) != 0, there = col[0] != 'x';
      all &= valid == there;
      complete &= valid == (there && col[0] == '0' && line[0] == '0');
      passed = values.at_clock(h, clock) != 0;
    }
    INFO(group.valid << " and " << group.column);
    CHECK(passed);
    CHECK((all || complete));
    ++agree;
  }
  return agree;
}

auto slashes(const std::string& text) { return std::count(text.begin(), text.end(), '/'); }

struct Outcome {
  int code;
  std::string text;
};
Outcome call(std::string arguments, const TemporaryDir& dir) {
  const std::string log = (dir / "log").string();
  if (arguments.find("--out") == std::string::npos) arguments += " --out " + dir.path().string();
  const int status = std::system((std::string(PSWEEP_WAVES) + ' ' + arguments + " > " + log + " 2>&1").c_str());
  std::ifstream in(log);
  std::ostringstream text;
  text << in.rdbuf();
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text.str()};
}

}  // namespace

TEST_CASE("waves: every configuration, every stage") {
  REQUIRE(engines().size() >= 5);
  scene::StimulusMaker random(engines()[0].config, test_seed());
  for (const Engine& engine : engines()) {
    const golden::Config& config = engine.config;
    const Cell cell{random.below(config.planes), random.below(config.plane_cols), random.below(config.plane_rows)};
    INFO(engine.name << ", plane " << cell.plane << ", cell " << cell.column << ',' << cell.row);
    const TemporaryDir dir;
    const Capture c = take(engine, cell, dir);
    const FstReader waves(c.fst);

    // Trimmed: from the first sample of the window to the word in the map, and little more.
    const uint64_t way = c.here[kMapWrite] - c.entered[kControlOut];
    CHECK(way > static_cast<uint64_t>(config.window - 1) * static_cast<uint64_t>(config.plane_cols));
    CHECK(c.first < c.entered[kControlOut]);
    CHECK(c.last > c.here[kMapWrite]);
    CHECK(c.last - c.first <= way + 36);
    CHECK(waves.start() == c.first * kPicosecondsPerClock);
    CHECK(waves.end() / kPicosecondsPerClock == c.last);
    CHECK(!std::ifstream(c.fst + ".full"));

    const std::vector<TableRow> rows = compare_cell(c, c.stimulus);
    INFO((differences(rows) ? table_text(c, rows) : std::string()));
    CHECK(rows.size() == 50);
    CHECK(differences(rows) == 0);
    CHECK(slashes(window_text(c, c.stimulus)) == 2);  // in the headings

    for (const Layout& layout : read_layouts(PSWEEP_LAYOUTS, engine, cell)) {
      const std::string file = (dir / (layout.stage + ".gtkw")).string();
      write_save_file(c, layout, file);
      const SaveFile save = parse(file);
      INFO(layout.stage);
      CHECK(save.signals.size() >= 40);
      CHECK(missing(save, waves).empty());
      REQUIRE(save.markers.size() == kPlaces);
      CHECK(wrong_at(save.markers, c, waves) == 0);
      int timed = 0;
      for (const LayoutGroup& group : layout.groups) timed += group.timed;
      CHECK(groups_in_step(save, c, waves) == timed);
      CHECK(save.begin >= waves.start());
      CHECK(save.begin < save.markers.back());
      // The diagonal: the cell is at each stage for one clock, later from stage to stage.
      uint64_t before = 0;
      for (const LayoutGroup& group : layout.groups) {
        if (!group.timed) continue;
        const Signal& here = waves.get("psweep.cell." + group.module + '.' + group.name + ".here");
        const Values values(waves, {here.handle});
        uint64_t clocks = 0, clock = 0;
        for (uint64_t n = c.first; n <= c.last; ++n)
          if (values.at_clock(here.handle, n)) ++clocks, clock = n;
        INFO(group.module << ' ' << group.name);
        CHECK(clocks == 1);
        CHECK(clock >= before);
        before = clock;
      }
    }
  }
}

TEST_CASE("waves: first and last cells, sub-pixel planes, samples outside") {
  for (const char* name : {"tiny", "odd_4"}) {
    const Engine& engine = engine_of(name);
    const golden::Config& config = engine.config;
    for (const Cell& cell : {Cell{0, 0, 0}, Cell{config.planes - 1, config.plane_cols - 1, config.plane_rows - 1},
                             Cell{config.planes / 2, 0, config.plane_rows - 1}}) {
      // Of the large one the last cell: its plane is not the last lane's, so a lane rests.
      if (config.lanes > 1 && cell.plane + 1 < config.planes) continue;
      const TemporaryDir dir;
      const Capture c = take(engine, cell, dir, PSWEEP_LAYOUTS, scene::Geometry::kSkewed);
      const std::vector<TableRow> rows = compare_cell(c, c.stimulus);
      INFO((differences(rows) ? table_text(c, rows) : std::string()));
      CHECK(differences(rows) == 0);
      const std::vector<uint64_t> markers = [&] {
        std::vector<uint64_t> times;
        for (const uint64_t clock : c.here) times.push_back(clock * kPicosecondsPerClock);
        return times;
      }();
      CHECK(wrong_at(markers, c, FstReader(c.fst)) == 0);
    }
  }
}

TEST_CASE("waves: what is wrong is told") {
  const Engine& engine = engine_of("tiny");
  const Cell cell{6, 8, 6};
  const TemporaryDir dir;
  const Capture c = take(engine, cell, dir);
  const FstReader waves(c.fst);

  SECTION("a value") {
    // One pixel of the last sample's quad is another one in the model.
    scene::Stimulus other = c.stimulus;
    const golden::Sample at = golden::left_sample(engine.config, other.job, other.table[6], 8 + 4, 6 + 4);
    other.left.at(at.xi + 1, at.yi) ^= 64;
    const std::vector<TableRow> rows = compare_cell(c, other);
    const auto first = std::find_if(rows.begin(), rows.end(), [](const TableRow& r) { return !r.equal(); });
    REQUIRE(first != rows.end());
    CHECK(first->stage == "storage");
    CHECK(first->what == "left p10");
    CHECK(table_text(c, rows).find("<-- differs") != std::string::npos);
    CHECK(slashes(window_text(c, other)) > 2);
  }
  SECTION("clocks") {
    for (int shift : {-1, 1}) {
      std::vector<uint64_t> markers;
      for (const uint64_t clock : c.here)
        markers.push_back((clock + static_cast<uint64_t>(shift)) * kPicosecondsPerClock);
      CHECK(wrong_at(markers, c, waves) > 5);
      Capture late = c;
      for (uint64_t& clock : late.here) clock += static_cast<uint64_t>(shift);
      bool told = false;
      try {
        told = differences(compare_cell(late, c.stimulus)) > 0;
      } catch (const WaveError&) {
        told = true;
      }
      CHECK(told);
    }
  }
  SECTION("a signal of a save file") {
    const std::string file = (dir / "s.gtkw").string();
    write_save_file(c, read_layouts(PSWEEP_LAYOUTS, engine, cell)[4], file);
    std::ifstream in(file);
    std::ostringstream text;
    text << in.rdbuf();
    std::string changed = text.str();
    const size_t at = changed.find("s9_n_dx");
    REQUIRE(at != std::string::npos);
    changed[at + 1] = '7';
    std::istringstream renamed(changed);
    CHECK(missing(parse(renamed), waves).size() == 1);
  }
  SECTION("layouts") {
    const struct {
      const char *stage, *from, *to, *message;
    } faults[] = {
        {"similarity", "  s9_cell", "  s9_sell", "no signal s9_sell in psweep.g_similarity_n1"},
        {"updating", "group m 4+lanes", "group m 5+lanes", "the cell is handed on at clock"},
        {"storage", "  load_data hex", "  load_data hax", "storage.waves:7: unknown word 'hax'"},
        {"interpolation", "valid bit=4", "valid bit=5", "valid has only 5 bits"},
        {"control", "module u_control", "module u_kontrol", "u_kontrol"},
        {"psweep", "+mncc_bits", "+mncc_bytes", "'mncc_bytes' is neither a number nor a key"},
    };
    for (const auto& fault : faults) {
      const TemporaryDir layouts;
      for (const std::string& stage : stages()) {
        std::ifstream in(std::string(PSWEEP_LAYOUTS) + '/' + stage + ".waves");
        std::ostringstream text;
        text << in.rdbuf();
        std::string changed = text.str();
        if (stage == fault.stage) {
          const size_t at = changed.find(fault.from);
          REQUIRE(at != std::string::npos);
          changed.replace(at, std::string(fault.from).size(), fault.to);
        }
        std::ofstream(layouts / (stage + ".waves")) << changed;
      }
      INFO(fault.stage << ": " << fault.to);
      std::string message;
      try {
        take(engine, cell, layouts, layouts.path().string());
      } catch (const WaveError& e) {
        message = e.what();
      }
      INFO(message);
      CHECK(message.find(fault.message) != std::string::npos);
    }
  }
}

TEST_CASE("waves: the program") {
  const TemporaryDir dir;
  const Outcome good = call("--stage storage --plane 3 --cell 15,0 --window", dir);
  INFO(good.text);
  CHECK(good.code == 0);
  CHECK(good.text.find("tiny, plane 3, cell 15,0: 50 of 50 values equal") != std::string::npos);
  CHECK(std::ifstream(dir / "tiny_storage_p3_c15_0.fst"));
  CHECK(std::ifstream(dir / "tiny_storage_p3_c15_0.gtkw"));
  // Differences: exit code 1.
  const Outcome other = call("--plane 3 --cell 15,0 --model-seed 7", dir);
  INFO(other.text);
  CHECK(other.code == 1);
  CHECK(other.text.find("<-- differs") != std::string::npos);
  CHECK(other.text.find("values differ from the model") != std::string::npos);
  const struct {
    const char *arguments, *message;
  } bad[] = {
      {"--config huge", "unknown configuration with waves 'huge'; there are: "},
      {"--config tile", "unknown configuration with waves 'tile'"},
      {"--stage divider", "unknown stage 'divider'; there are: control address_generator"},
      {"--plane 12 --cell 35,3", "plane 12: tiny has planes 0 to 11"},
      {"--plane -1", "plane -1: tiny has planes 0 to 11"},
      {"--plane 1 --cell 35,3", "column 35: tiny has columns 0 to 15"},
      {"--cell 3,12", "row 12: tiny has rows 0 to 11"},
      {"--cell 3", "cell '3' is not COLUMN,ROW"},
      {"--cell 3,4,5", "cell '3,4,5' is not COLUMN,ROW"},
      {"--plane x", "--plane"},
      {"--colour red", "not expected"},
      {"--out /nowhere/at/all", "cannot be written"},
  };
  for (const auto& b : bad) {
    const Outcome o = call(b.arguments, dir);
    INFO(b.arguments << '\n' << o.text);
    CHECK(o.code == 1);
    CHECK(o.text.find(b.message) != std::string::npos);
  }
}
