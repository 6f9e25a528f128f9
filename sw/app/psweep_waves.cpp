// SPDX-License-Identifier: Apache-2.0
// psweep-waves: one cell on its way through the engine, as waves and as a table (docs/waves.md).
// Exit codes: 0 all values of the cell are the model's; 1 some are not, or the request is wrong.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>

#include "waves/table.hpp"

namespace psweep::waves {
namespace {

struct Options {
  std::string config = "tiny", stage = "psweep", cell, out = ".", layouts = PSWEEP_LAYOUTS, texture = "stereo",
              geometry = "inside";
  std::optional<int> plane;
  uint32_t seed = 1;
  std::optional<uint32_t> model_seed;
  bool window = false, list = false, no_table = false;
};

int index_of(const std::vector<std::string>& names, const std::string& name, const char* what) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<int>(found - names.begin());
  std::string all;
  for (const std::string& n : names) all += ' ' + n;
  throw WaveError(std::string("unknown ") + what + " '" + name + "'; there are:" + all);
}

const Engine& engine_of(const std::string& name) {
  std::vector<std::string> names;
  for (const Engine& e : engines()) names.push_back(e.name);
  return engines()[static_cast<size_t>(index_of(names, name, "configuration with waves"))];
}

int run(const Options& o) {
  if (o.list) {
    for (const Engine& e : engines())
      std::printf("%-10s %dx%d cells, %d planes, %d lane(s): %s\n", e.name.c_str(), e.config.plane_cols,
                  e.config.plane_rows, e.config.planes, e.config.lanes, e.description.c_str());
    return 0;
  }
  const Engine& engine = engine_of(o.config);
  const int stage = index_of(stages(), o.stage, "stage");
  const golden::Config& config = engine.config;
  const auto texture = static_cast<scene::Texture>(
      index_of({"stereo", "random", "constant", "saturated", "faint"}, o.texture, "texture"));
  const auto geometry =
      static_cast<scene::Geometry>(index_of({"inside", "border", "skewed", "lost"}, o.geometry, "geometry"));
  auto stimulus_of = [&](uint32_t seed) {
    return scene::StimulusMaker(config, seed)
        .make(texture, geometry, config.plane_cols, config.plane_rows, config.planes);
  };
  const scene::Stimulus stimulus = stimulus_of(o.seed), model = stimulus_of(o.model_seed.value_or(o.seed));
  Cell cell{o.plane.value_or(config.planes / 2), config.plane_cols / 2, config.plane_rows / 2};
  char rest = 0;
  if (!o.cell.empty() && std::sscanf(o.cell.c_str(), "%d,%d%c", &cell.column, &cell.row, &rest) != 2)
    throw WaveError("cell '" + o.cell + "' is not COLUMN,ROW");
  check_cell(engine, stimulus, cell);

  const std::string base = o.out + '/' + engine.name + '_' + o.stage + "_p" + std::to_string(cell.plane) + "_c" +
                           std::to_string(cell.column) + '_' + std::to_string(cell.row);
  const std::vector<Layout> layouts = read_layouts(o.layouts, engine, cell);
  const Capture c = capture(engine, stimulus, cell, layouts, base + ".fst");
  write_save_file(c, layouts[static_cast<size_t>(stage)], base + ".gtkw");
  const std::vector<TableRow> rows = compare_cell(c, model);
  std::printf("%s: %s, seed %u\n", engine.name.c_str(), stimulus.name.c_str(), o.seed);
  if (!o.no_table) std::fputs(table_text(c, rows).c_str(), stdout);
  if (o.window) std::fputs(window_text(c, model).c_str(), stdout);
  for (int place = 0; place < kPlaces; ++place)
    std::printf("marker %c: clock %llu, %s\n", 'A' + place,
                static_cast<unsigned long long>(c.here[static_cast<size_t>(place)]), place_name(place));
  std::printf("%s.fst: clocks %llu to %llu\nlook at it: gtkwave %s.gtkw\n", base.c_str(),
              static_cast<unsigned long long>(c.first), static_cast<unsigned long long>(c.last), base.c_str());
  if (const size_t wrong = differences(rows)) {
    std::fprintf(stderr, "psweep-waves: %zu values differ from the model\n", wrong);
    return 1;
  }
  return 0;
}

int main_function(int argc, char** argv) {
  Options o;
  CLI::App app{"psweep-waves: one cell on its way through the engine, as waves (FST, GTKWave) and as a table"};
  app.add_option("--config", o.config, "Which engine (--list)")->capture_default_str();
  app.add_flag("--list", o.list, "Lists the engines with waves and ends");
  app.add_option("--stage", o.stage, "Entity whose signals are shown; psweep: what all of them hand on")
      ->capture_default_str();
  app.add_option("--plane", o.plane, "Plane, from 0; default: the middle one");
  app.add_option("--cell", o.cell, "COLUMN,ROW of the cell, from 0; default: the middle one");
  app.add_option("--out", o.out, "Folder of the files")->capture_default_str();
  app.add_option("--texture", o.texture, "Images: stereo, random, constant, saturated, faint")->capture_default_str();
  app.add_option("--geometry", o.geometry, "Planes: inside, border, skewed (sub-pixel, unequal steps), lost")
      ->capture_default_str();
  app.add_option("--seed", o.seed, "Of the images")->capture_default_str();
  app.add_option("--model-seed", o.model_seed, "Other images for the model: what differences look like");
  app.add_flag("--window", o.window, "Also the samples of the cell's window");
  app.add_flag("--no-table", o.no_table, "Without the table (the values are compared all the same)");
  app.add_option("--layouts", o.layouts, "Folder of the layouts (<stage>.waves)")->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& e) {  // --help
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    std::fprintf(stderr, "psweep-waves: %s\nSee psweep-waves --help\n", e.what());
    return 1;
  }
  return run(o);
}

}  // namespace
}  // namespace psweep::waves

int main(int argc, char** argv) {
  try {
    return psweep::waves::main_function(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "psweep-waves: %s\n", e.what());
    return 1;
  }
}
