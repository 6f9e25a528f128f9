// SPDX-License-Identifier: Apache-2.0
// The worked example of docs/registers.md: one tile as words on the engine's streams is what planner and bit-true model
// make of the pair that the page describes.
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>

#include "contract/registers.hpp"
#include "golden/psweep.hpp"
#include "plan/planner.hpp"
#include "support/catch.hpp"

using namespace psweep;

namespace {

constexpr int kCols = 10, kRows = 7;

// Format of rtl/configs/engine/tiny.json, three planes.
SweepSetup example_setup() {
  SweepSetup s;
  s.rig.width = kCols;
  s.rig.height = kRows;
  s.rig.left = s.rig.right = {10.0, 10.0, (kCols - 1) / 2.0, (kRows - 1) / 2.0};
  s.rig.baseline = 0.2;
  s.spacing = {3, 1.0, 4.0};
  s.format.img_cols = 36;
  s.format.img_rows = 26;
  s.format.plane_cols = 16;
  s.format.plane_rows = 12;
  s.format.planes = 12;
  s.format.window = 5;
  s.threshold = threshold_for(s.format, 0.85);
  return s;
}

// The right image is the left one, one pixel further.
Gray example_image(int shift) {
  Gray image(kCols, kRows);
  for (int y = 0; y < kRows; ++y)
    for (int x = 0; x < kCols; ++x)
      image.at(x, y) = static_cast<uint8_t>((37 * (x + shift) * (x + shift) + 53 * (x + shift) * y + 91 * y) % 256);
  return image;
}

std::string hex(uint64_t word, int digits) {
  char text[20];
  std::snprintf(text, sizeof text, "%0*llX", digits, static_cast<unsigned long long>(word));
  return text;
}

// Six words a line.
std::string block(const std::string& stream, const std::vector<std::string>& words) {
  std::string text = stream + "\n";
  for (size_t i = 0; i < words.size(); ++i)
    text += (i % 6 == 0 ? "    " : " ") + words[i] + (i % 6 == 5 || i + 1 == words.size() ? "\n" : "");
  return text;
}

std::string config_words(const std::vector<golden::RegisterWrite>& writes) {
  std::vector<std::string> words;
  for (const auto& w : writes) words.push_back(hex(w.address, 4) + ":" + hex(w.value, 8));
  return block("s_cfg", words);
}

}  // namespace

TEST_CASE("registers: the worked example of the page is what the planner and the model say") {
  const SweepSetup setup = example_setup();
  const Gray left = example_image(0), right = example_image(1);
  const Plan plan = plan_tiles(setup, setup.format.plane_cols, setup.format.plane_rows);
  REQUIRE(plan.tiles.size() == 1);
  const PlacedTile& tile = plan.tiles[0];
  const auto& job = tile.job;
  const auto left_window = cut_window(left, tile.left_x, tile.left_y, job.win_cols, job.win_rows);
  const auto right_window = cut_window(right, tile.right_x, tile.right_y, job.win_cols, job.win_rows);
  const auto result = golden::run_tile(setup.format, job, plan.table, left_window, right_window);
  REQUIRE(result.window_errors == 0);

  std::vector<std::string> pixels, cells;
  for (int y = 0; y < job.win_rows; ++y)
    for (int x = 0; x < job.win_cols; ++x)
      pixels.push_back(hex(static_cast<uint64_t>(right_window.at(x, y)) << 8 | left_window.at(x, y), 4));
  int found = 0;
  for (const auto& cell : result.cells) {
    cells.push_back(hex(golden::pack_cell(setup.format, cell), 8));
    found += cell.mask == 0 && cell.plane == 1;
  }
  CHECK(found > 0);
  const std::string expected = "```\n" + config_words(golden::table_writes(plan.table)) +
                               config_words(golden::job_writes(job)) +
                               config_words({{golden::kRegCommand, golden::kCommandStart}}) + block("s_pix", pixels) +
                               block("m_map", cells) + "```\n";

  const std::string path = PSWEEP_SOURCE_DIR "/docs/registers.md";
  std::ifstream file(path);
  REQUIRE(file.good());
  std::stringstream page;
  page << file.rdbuf();
  INFO("docs/registers.md has to contain\n" << expected);
  CHECK(page.str().find(expected) != std::string::npos);
}
