// SPDX-License-Identifier: Apache-2.0
// The command line from outside: a process per call, its exit code, its messages, its files.
// PSWEEP_BINARY: path of the program under test.
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <string>

#include "io/calibration.hpp"
#include "io/image_io.hpp"
#include "io/pfm.hpp"
#include "io/ply.hpp"
#include "io/text_file.hpp"
#include "model/udp_chip.hpp"
#include "support/catch.hpp"
#include "support/temporary_dir.hpp"
#include "verilated/rtl_engine.hpp"

using namespace psweep;
namespace fs = std::filesystem;
#ifdef PSWEEP_CATCH2_V3
using Catch::Approx;  // version 2 has it in the global namespace
#endif

namespace {

struct Outcome {
  int code = -1;
  std::string out, err;
};

// Runs psweep with these arguments (shell words) inside `dir`.
Outcome psweep_run(const TemporaryDir& dir, const std::string& arguments) {
  const std::string command =
      "cd '" + dir.path().string() + "' && '" PSWEEP_BINARY "' " + arguments + " >.stdout 2>.stderr </dev/null";
  const int status = std::system(command.c_str());
  Outcome o;
  o.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  o.out = read_file(dir / ".stdout");
  o.err = read_file(dir / ".stderr");
  return o;
}

// Comparing inside CHECK would print both files.
bool same_bytes(const fs::path& a, const fs::path& b) { return read_file(a) == read_file(b); }

std::set<std::string> names(const fs::path& dir) {
  std::set<std::string> out;
  for (const auto& entry : fs::directory_iterator(dir)) out.insert(entry.path().filename().string());
  return out;
}

// A rig small enough for many runs: 96x72, disparities 24 .. 6 px.
Rig small_rig() {
  Rig rig;
  rig.width = 96;
  rig.height = 72;
  rig.left = rig.right = {120, 120, 47.5, 35.5};
  rig.baseline = 0.2;
  return rig;
}

// Fronto-parallel wall with random texture at depth z, seen by the small rig: a pure shift, so truth is known exactly.
// Shift in whole pixels per image, i.e. total disparity even.
struct Wall {
  Gray left{96, 72}, right{96, 72};
  double z;
  explicit Wall(int total_disparity) : z(120 * 0.2 / total_disparity) {
    uint32_t state = test_seed() * 2654435761u + 1;
    Gray wall(96 + 64, 72);
    for (auto& p : wall.data) {
      state = state * 1664525u + 1013904223u;
      p = static_cast<uint8_t>(state >> 24);
    }
    const int half = total_disparity / 2;
    for (int y = 0; y < 72; ++y) {
      for (int x = 0; x < 96; ++x) {
        left.at(x, y) = wall.at(x + 32 - half, y);
        right.at(x, y) = wall.at(x + 32 + half, y);
      }
    }
  }
};

void write_wall(const TemporaryDir& dir, int total_disparity = 12) {
  const Wall wall(total_disparity);
  write_png(dir / "left.png", wall.left);
  write_png(dir / "right.png", wall.right);
  write_calibration(dir / "calib.yaml", small_rig());
}

const char* const kInput = "depth left.png right.png --calib calib.yaml --planes 31 --window 5 ";

const std::set<std::string> kFiles = {"depth.pfm", "mncc.pfm",  "disparity.pfm", "mask.png",
                                      "depth.png", "cloud.ply", "report.json"};

}  // namespace

TEST_CASE("psweep depth writes every file, and the depth of a wall", "[cli]") {
  const TemporaryDir dir;
  const int disparity = GENERATE(8, 12, 20);
  const std::string engine = GENERATE(as<std::string>{}, "fixed", "float");
  write_wall(dir, disparity);
  const Outcome o = psweep_run(dir, kInput + std::string("-o out --engine ") + engine);
  INFO(o.out << o.err);
  REQUIRE(o.code == 0);
  CHECK(o.err.empty());  // no terminal: no progress bar
  CHECK(names(dir / "out") == kFiles);

  const FloatImage depth = read_pfm(dir / "out/depth.pfm"), mncc = read_pfm(dir / "out/mncc.pfm");
  const FloatImage shift = read_pfm(dir / "out/disparity.pfm");
  const cv::Mat mask = cv::imread((dir / "out/mask.png").string(), cv::IMREAD_UNCHANGED);
  REQUIRE(mask.type() == CV_8UC1);
  const double z = 120 * 0.2 / disparity;
  int found = 0, wrong = 0, matched = 0;
  for (int y = 0; y < 72; ++y) {
    for (int x = 0; x < 96; ++x) {
      CHECK((mask.at<uint8_t>(y, x) == 0) == std::isfinite(depth.at(x, y)));
      if (std::isfinite(shift.at(x, y))) {
        ++matched;
        wrong += std::abs(shift.at(x, y) - static_cast<float>(disparity)) > 0.25f;
      }
      if (!std::isfinite(depth.at(x, y))) continue;
      ++found;
      wrong += std::abs(depth.at(x, y) - z) > 0.02 * z;
      wrong += mncc.at(x, y) < 0.85f;
    }
  }
  CHECK(found > 3000);
  CHECK(matched > 3000);
  CHECK(wrong <= found / 50);
  CHECK(read_ply(dir / "out/cloud.ply").size() == static_cast<size_t>(found));
  const auto report = nlohmann::json::parse(read_file(dir / "out/report.json"));
  CHECK(report["engine"] == engine);
  CHECK(report["planes"] == 31);
  CHECK(report["window"] == 5);
  CHECK(report["cells"]["with_depth"] == found);
  CHECK(report["seconds"] >= 0);
  if (engine == "fixed") {
    CHECK(report["format"]["mncc_bits"] == 13);
    CHECK(report["tiles"]["count"] >= 1);
  }
}

TEST_CASE("results do not depend on threads, tiles or the run", "[cli]") {
  const TemporaryDir dir;
  write_wall(dir);
  const std::string engine = GENERATE(as<std::string>{}, "fixed", "float");
  const std::string base = kInput + std::string("--cleanup --engine ") + engine;
  for (const auto& [out, options] :
       std::vector<std::pair<std::string, std::string>>{{"a", " --threads 1"},
                                                        {"b", " --threads 2"},
                                                        {"c", " --threads 5"},
                                                        {"d", engine == "fixed" ? " --tile 17x9" : " --threads 3"}}) {
    const Outcome o = psweep_run(dir, base + options + " -q -o " + out);
    INFO(o.err);
    REQUIRE(o.code == 0);
    CHECK(o.out.empty());
    int compared = 0;
    for (const auto& name : kFiles) {
      if (name == "report.json") continue;
      INFO(name << " " << options);
      CHECK(same_bytes(dir / (out + "/" + name), dir / ("a/" + name)));
      ++compared;
    }
    CHECK(compared == 6);
  }
}

TEST_CASE("options change what they say", "[cli]") {
  const TemporaryDir dir;
  write_wall(dir, 10);  // between two planes, so that nothing is exact
  REQUIRE(psweep_run(dir, kInput + std::string("-o a")).code == 0);
  for (const char* options : {"--interp-bits 0", "--mncc-bits 8", "--frac-bits 3", "--weight-bits 2", "--window 7",
                              "--threshold 0.9999", "--zmin 1.1", "--zmax 3.5", "--planes 41"}) {
    std::string line = kInput;
    const std::string option = std::string(options).substr(0, std::string(options).find(' '));
    const size_t given = line.find(option + " ");  // no option twice
    if (given != std::string::npos) line.erase(given, line.find(' ', given + option.size() + 1) - given);
    const Outcome o = psweep_run(dir, line + " " + options + " -o b");
    INFO(options << ": " << o.err);
    REQUIRE(o.code == 0);
    CHECK_FALSE(same_bytes(dir / "b/depth.pfm", dir / "a/depth.pfm"));
  }
}

TEST_CASE("the float engine rounds the correlation and the parabola when told so", "[cli]") {
  const TemporaryDir dir;
  write_wall(dir, 10);
  const std::string base = kInput + std::string("--engine float ");
  int run = 0;
  for (const char* options : {"", "--mncc-bits 13", "--mncc-bits 13 --frac-bits 2", "--mncc-bits 6"}) {
    INFO(options);
    REQUIRE(psweep_run(dir, base + options + " -o r" + std::to_string(run)).code == 0);
    for (int other = 0; other < run; ++other) {
      CHECK_FALSE(same_bytes(dir / ("r" + std::to_string(other)) / "depth.pfm",
                             dir / ("r" + std::to_string(run)) / "depth.pfm"));
    }
    ++run;
  }
  // Two bits of the parabola: positions lie at plane - 1/2 + (k + 1/2) / 4.
  const FloatImage depth = read_pfm(dir / "r2/depth.pfm");
  int found = 0, off = 0;
  for (const float z : depth.data) {
    if (!std::isfinite(z)) continue;
    const double steps = (30 * std::log(static_cast<double>(z)) / std::log(4.0) + 0.5) * 4 - 0.5;
    ++found;
    off += std::abs(steps - std::round(steps)) > 0.01;
  }
  CHECK(found > 3000);
  CHECK(off == 0);
}

TEST_CASE("each part of the clean-up has its switch", "[cli]") {
  const TemporaryDir dir;
  write_wall(dir, 12);
  // A patch of the right image from elsewhere: false matches, which both parts have to find.
  cv::Mat right = cv::imread((dir / "right.png").string(), cv::IMREAD_UNCHANGED);
  cv::Mat patch = right(cv::Rect(60, 10, 14, 14)).clone();
  patch.copyTo(right(cv::Rect(30, 30, 14, 14)));
  cv::Mat left = cv::imread((dir / "left.png").string(), cv::IMREAD_UNCHANGED);
  patch.copyTo(left(cv::Rect(50, 30, 14, 14)));  // the same texture 20 px apart: a nearer square before the wall
  REQUIRE(cv::imwrite((dir / "left.png").string(), left));
  REQUIRE(cv::imwrite((dir / "right.png").string(), right));
  struct Case {
    const char* options;
    bool uniqueness, speckle;
  };
  for (const Case& c :
       {Case{"", false, false}, Case{"--cleanup", true, true}, Case{"--cleanup --no-speckle", true, false},
        Case{"--cleanup --no-uniqueness", false, true}, Case{"--cleanup --no-uniqueness --no-speckle", false, false}}) {
    INFO(c.options);
    REQUIRE(psweep_run(dir, kInput + std::string("--threshold 0.3 -o out ") + c.options).code == 0);
    const auto report = nlohmann::json::parse(read_file(dir / "out/report.json"));
    CHECK(report["cleanup"]["uniqueness"] == c.uniqueness);
    CHECK(report["cleanup"]["speckle"] == c.speckle);
    const cv::Mat mask = cv::imread((dir / "out/mask.png").string(), cv::IMREAD_UNCHANGED);
    const FloatImage depth = read_pfm(dir / "out/depth.pfm");
    int bits[2] = {};
    for (int y = 0; y < 72; ++y) {
      for (int x = 0; x < 96; ++x) {
        bits[0] += (mask.at<uint8_t>(y, x) & 16) != 0;
        bits[1] += (mask.at<uint8_t>(y, x) & 32) != 0;
        if (mask.at<uint8_t>(y, x) & 48) CHECK_FALSE(std::isfinite(depth.at(x, y)));
      }
    }
    CHECK((bits[0] > 0) == c.uniqueness);
    CHECK((bits[1] > 0) == c.speckle);
    CHECK(report["cells"]["removed_by_uniqueness"] == bits[0]);
    CHECK(report["cells"]["removed_as_speckle"] == bits[1]);
  }
}

TEST_CASE("an existing output directory is replaced file by file", "[cli]") {
  const TemporaryDir dir;
  write_wall(dir);
  fs::create_directory(dir / "out");
  write_file(dir / "out/error.png", "of an older run");
  write_file(dir / "out/notes.txt", "mine");
  REQUIRE(psweep_run(dir, kInput + std::string("-o out")).code == 0);
  CHECK_FALSE(fs::exists(dir / "out/error.png"));
  CHECK(read_file(dir / "out/notes.txt") == "mine");
  // A failing run leaves it alone.
  fs::copy_file(dir / "out/depth.pfm", dir / "kept.pfm");
  write_file(dir / "right.png", "damaged");
  CHECK(psweep_run(dir, kInput + std::string("-o out")).code == 2);
  CHECK(same_bytes(dir / "out/depth.pfm", dir / "kept.pfm"));
}

TEST_CASE("bad input: exit code 2, file and field named, no output", "[cli][error]") {
  const TemporaryDir dir;
  write_wall(dir);
  write_file(dir / "text.png", "hello");
  const std::string png = read_file(dir / "left.png");
  write_file(dir / "cut.png", png.substr(0, png.size() / 2));
  REQUIRE(cv::imwrite((dir / "deep.png").string(), cv::Mat(72, 96, CV_16UC1, cv::Scalar(9))));
  REQUIRE(cv::imwrite((dir / "small.png").string(), cv::Mat(50, 96, CV_8UC1, cv::Scalar(9))));
  REQUIRE(cv::imwrite((dir / "tiny.png").string(), cv::Mat(4, 4, CV_8UC1, cv::Scalar(9))));
  Rig other = small_rig();
  other.width = 97;
  write_calibration(dir / "other.yaml", other);
  write_file(dir / "field.yaml", "left: { fx: a, fy: 1, cx: 1, cy: 1 }\n");
  write_file(dir / "file", "");
  struct Case {
    std::string arguments, message;
  };
  const std::string pair = "depth left.png right.png -o out ", good = pair + "--calib calib.yaml ";
  const std::vector<Case> cases = {
      {"", "subcommand is required"},
      {"deepth left.png", "unknown command 'deepth', expected depth, render, eval, report, info or bench-link"},
      {"depth left.png -o out --calib calib.yaml", "RIGHT is required"},
      {"depth left.png right.png --calib calib.yaml", "--output is required"},
      {pair, "--calib: found nothing"},
      {"depth none.png right.png --calib calib.yaml -o out", "none.png: cannot read"},
      {"depth left.png text.png --calib calib.yaml -o out", "text.png: not an image"},
      {"depth left.png cut.png --calib calib.yaml -o out", "cut.png: not an image, truncated"},
      {"depth deep.png right.png --calib calib.yaml -o out", "deep.png: 16-bit image"},
      {"depth left.png small.png --calib calib.yaml -o out", "small.png: the image is 96x50, but left.png is 96x72"},
      {"depth tiny.png tiny.png --disparity-range 1:3 -o out",
       "tiny.png: the image is 4x4, expected at least --window"},
      {pair + "--calib none.yaml", "none.yaml: cannot read"},
      {pair + "--calib other.yaml",
       "left.png: the image is 96x72, but other.yaml (fields 'width', 'height') says 97x72"},
      {pair + "--calib field.yaml", "field.yaml: field 'left.fx': found 'a', expected a number > 0"},
      {pair + "--calib left.png", "left.png: not a text file"},
      {good + "--planes 2", "--planes"},
      {good + "--planes 1025", "--planes"},
      {good + "--planes many", "--planes"},
      {good + "--zmin -1", "--zmin"},
      {good + "--zmin 5", "--zmin, --zmax: found 5 and 4, expected zmin < zmax"},
      {good + "--zmax nan", "--zmax"},
      {good + "--window 4", "--window: found '4', expected an odd number 3 .. 21"},
      {good + "--window 23", "--window"},
      {good + "--threshold 1.5", "--threshold"},
      {good + "--tile 0x8", "--tile: found '0x8', expected WxH"},
      {good + "--tile 8", "--tile"},
      {good + "--tile 8x-8", "--tile"},
      {good + "--interp-bits 9", "--interp-bits"},
      {good + "--mncc-bits 3", "--mncc-bits"},
      {good + "--frac-bits 13", "--frac-bits"},
      {good + "--weight-bits 0", "--weight-bits"},
      {good + "--threads -1", "--threads"},
      {good + "--engine gpu", "--engine"},
      {good + "--engine float --tile 8x8", "--interp-bits, --weight-bits, --tile: not with --engine float"},
      {good + "--engine float --frac-bits 8", "--frac-bits: with --engine float only together with --mncc-bits"},
      {good + "--no-speckle", "--no-uniqueness, --no-speckle: need --cleanup"},
      {good + "--config no_such_configuration", "--config"},
      {good + "--disparity-range 2:9", "--disparity-range"},
      {pair + "--disparity-range 9:2", "--disparity-range: found '9:2'"},
      {pair + "--disparity-range 0:9", "--disparity-range: found '0:9'"},
      {"depth left.png right.png --calib calib.yaml -o file", "file: exists and is not a directory"},
      {"depth left.png right.png --calib calib.yaml -o file/out", "file/out: cannot create the output directory"},
      {"render --kind lunar -o out", "--kind"},
      {"render --size 10 -o out", "--size"},
      {"render --seed x -o out", "--seed"},
      {"report out -o page.html", "out: not a directory"},
      {"eval out truth.pfm", "truth.pfm: cannot read"},
  };
  const auto before = names(dir.path());
  for (const auto& c : cases) {
    const Outcome o = psweep_run(dir, c.arguments);
    INFO("psweep " << c.arguments << "\n" << o.err);
    CHECK(o.code == 2);
    CHECK_THAT(o.err, contains(c.message));
    CHECK(o.err.compare(0, 8, "psweep: ") == 0);
    auto after = names(dir.path());
    after.erase(".stdout");
    after.erase(".stderr");
    CHECK(after == before);
  }
  CHECK(cases.size() > 40);
}

TEST_CASE("command line: --engine rtl without a fitting configuration says how to build one", "[cli][error]") {
  const TemporaryDir dir;
  write_wall(dir);
  const Outcome o = psweep_run(dir, "depth left.png right.png --calib calib.yaml -o out --engine rtl --window 21");
  INFO(o.err);
  CHECK(o.code == 2);
  if (rtl::configurations().empty()) {
    CHECK_THAT(o.err, contains("--engine: found 'rtl', but this psweep was built without RTL"));
  } else {
    CHECK_THAT(o.err, contains("make config NAME="));
    CHECK_THAT(o.err, contains("WINDOW=21"));
  }
  CHECK_FALSE(fs::exists(dir / "out"));
}

// Says so if this build has no simulated engines.
bool without_rtl() {
  if (!rtl::configurations().empty()) return false;
  std::printf("SKIPPED: built without RTL\n");
  SUCCEED();
  return true;
}

TEST_CASE("command line: --engine rtl writes the bytes of --engine fixed", "[cli][rtl]") {
  if (without_rtl()) return;
  const TemporaryDir dir;
  write_wall(dir);
  // Window and formats of the configuration, its own tiles and smaller ones, with clean-up and without. The number of
  // planes is odd, so that the middle one is the wall.
  for (const char* options : {"--config tiny --planes 11", "--config tiny --planes 7 --tile 9x5 --cleanup",
                              "--config odd --planes 19 --threads 1", "--config odd --planes 19 --threads 3",
                              "--config rectified --planes 19", "--config rectified_2 --planes 19"}) {
    const std::string base = "depth left.png right.png --calib calib.yaml " + std::string(options);
    const Outcome fixed = psweep_run(dir, base + " --engine fixed -o fixed");
    const Outcome rtl = psweep_run(dir, base + " --engine rtl -o rtl");
    INFO(options << fixed.err << rtl.err);
    REQUIRE(fixed.code == 0);
    REQUIRE(rtl.code == 0);
    int compared = 0;
    for (const auto& name : kFiles) {
      if (name == "report.json") continue;
      INFO(name);
      CHECK(same_bytes(dir / "fixed" / name, dir / "rtl" / name));
      ++compared;
    }
    CHECK(compared == 6);
    const auto report = nlohmann::json::parse(read_file(dir / "rtl/report.json"));
    CHECK(report["cells"]["with_depth"] > 1000);
    CHECK(report["rtl"]["clocks"] > 10000);
    CHECK(report["rtl"]["clocks_in_all"] > report["rtl"]["clocks"]);
    CHECK_FALSE(nlohmann::json::parse(read_file(dir / "fixed/report.json")).contains("rtl"));
    const Outcome page = psweep_run(dir, "report fixed rtl -o page.html");
    REQUIRE(page.code == 0);
    CHECK(read_file(dir / "page.html").find("wrote the same bytes in all 6 files") != std::string::npos);
  }
}

TEST_CASE("an RTL configuration's limits are told", "[cli][rtl][error]") {
  if (without_rtl()) return;
  const TemporaryDir dir;
  write_wall(dir);
  struct Case {
    const char *options, *message;
  };
  const std::string base = "depth left.png right.png --calib calib.yaml -o out --engine rtl --config tiny ";
  for (const Case& c : {Case{"--planes 13", "--planes: found 13, but configuration 'tiny' has room for 12"},
                        Case{"--window 7", "--window: found 7, but configuration 'tiny' has 5"},
                        Case{"--mncc-bits 9", "--mncc-bits: found 9, but configuration 'tiny' has 13"},
                        Case{"--tile 17x12", "make config NAME="},
                        Case{"--zmin 0.3", "configuration 'tiny' cannot serve this request"}}) {
    const Outcome o = psweep_run(dir, base + c.options);
    INFO(c.options << "\n" << o.err);
    CHECK(o.code == 2);
    CHECK_THAT(o.err, contains(c.message));
    CHECK_FALSE(fs::exists(dir / "out"));
  }
}

TEST_CASE("help and version", "[cli]") {
  const TemporaryDir dir;
  for (const char* arguments : {"--help", "depth --help", "render --help", "eval --help", "report --help"}) {
    const Outcome o = psweep_run(dir, arguments);
    INFO(arguments);
    CHECK(o.code == 0);
    CHECK(o.err.empty());
    CHECK(o.out.size() > 300);
  }
  CHECK_THAT(psweep_run(dir, "depth --help").out, contains("Examples:\n  psweep depth"));
  CHECK_THAT(psweep_run(dir, "--version").out, contains("psweep "));
}

TEST_CASE("every kind of calibration gives the same depths", "[cli]") {
  const TemporaryDir dir;
  write_wall(dir);
  REQUIRE(psweep_run(dir, kInput + std::string("-o yaml")).code == 0);
  write_file(dir / "p.yaml",
             "P1: [120,0,47.5,0, 0,120,35.5,0, 0,0,1,0]\nP2: [120,0,47.5,-24, 0,120,35.5,0, 0,0,1,0]\n");
  write_file(dir / "q.yaml", "Q: [[1,0,0,-47.5],[0,1,0,-35.5],[0,0,0,120],[0,0,5,0]]\n");
  write_file(dir / "calib.txt",
             "cam0=[120 0 47.5; 0 120 35.5; 0 0 1]\ncam1=[120 0 47.5; 0 120 35.5; 0 0 1]\ndoffs=0\nbaseline=200\n"
             "width=96\nheight=72\nndisp=24\n");
  for (const char* name : {"p.yaml", "q.yaml", "calib.txt"}) {
    const Outcome o = psweep_run(dir, "depth left.png right.png --planes 31 --window 5 --zmin 1 --zmax 4 --calib " +
                                          std::string(name) + " -o out");
    INFO(name << o.err);
    REQUIRE(o.code == 0);
    CHECK(same_bytes(dir / "out/depth.pfm", dir / "yaml/depth.pfm"));
  }
}

TEST_CASE("calib.txt sets the range of the planes", "[cli]") {
  const TemporaryDir dir;
  write_wall(dir);
  write_file(dir / "calib.txt",
             "cam0=[120 0 47.5; 0 120 35.5; 0 0 1]\ncam1=[120 0 47.5; 0 120 35.5; 0 0 1]\ndoffs=0\nbaseline=200\n"
             "width=96\nheight=72\nndisp=24\n");
  REQUIRE(psweep_run(dir, "depth left.png right.png --window 5 --calib calib.txt -o out").code == 0);
  const auto report = nlohmann::json::parse(read_file(dir / "out/report.json"));
  CHECK(report["zmin"].get<double>() == Approx(120 * 0.2 / 24));
  CHECK(report["zmax"].get<double>() == Approx(120 * 0.2 / 2.4));
  CHECK(report["planes"].get<int>() > 50);
}

TEST_CASE("raw pairs are rectified and written out", "[cli][rectify]") {
  const TemporaryDir dir;
  write_wall(dir);
  write_file(dir / "raw.yaml",
             "K1: [120,0,47.5,0,120,35.5,0,0,1]\nK2: [120,0,47.5,0,120,35.5,0,0,1]\nD1: [0,0,0,0]\nD2: [0,0,0,0]\n"
             "R: [1,0,0,0,1,0,0,0,1]\nT: [-200,0,0]\nunit: mm\n");
  const Outcome o = psweep_run(dir, "depth left.png right.png --calib raw.yaml --planes 31 --window 5 -o out");
  INFO(o.err);
  REQUIRE(o.code == 0);
  auto expected = kFiles;
  expected.insert({"rectified_left.png", "rectified_right.png", "rectified_calib.yaml"});
  CHECK(names(dir / "out") == expected);
  // The rectified pair with its calibration gives the same again.
  const Outcome again = psweep_run(dir,
                                   "depth out/rectified_left.png out/rectified_right.png --calib "
                                   "out/rectified_calib.yaml --planes 31 --window 5 -o again");
  INFO(again.err);
  REQUIRE(again.code == 0);
  CHECK(same_bytes(dir / "out/depth.pfm", dir / "again/depth.pfm"));
  const FloatImage depth = read_pfm(dir / "again/depth.pfm");
  int near = 0, found = 0;
  for (const float z : depth.data) {
    if (!std::isfinite(z)) continue;
    ++found;
    near += std::abs(z - 2.0f) < 0.05f;
  }
  CHECK(found > 2000);
  CHECK(near > found * 95 / 100);
}

TEST_CASE("psweep eval against a disparity truth", "[cli][eval]") {
  const TemporaryDir dir;
  write_wall(dir, 12);
  REQUIRE(psweep_run(dir, kInput + std::string("-o out")).code == 0);
  // Truth: 12 px everywhere but unknown in the upper rows, and wrong by 3 px in the right half; mask: without
  // column 40.
  Gray truth(96, 72, 12 * 8), mask(96, 72, 255);
  for (int y = 0; y < 72; ++y) {
    for (int x = 48; x < 96; ++x) truth.at(x, y) = 15 * 8;
    mask.at(40, y) = 128;
  }
  for (int y = 0; y < 20; ++y) std::fill(truth.row(y), truth.row(y) + 96, uint8_t{0});
  write_png(dir / "truth.png", truth);
  write_png(dir / "mask.png", mask);
  const Outcome o = psweep_run(dir, "eval out truth.png --scale 8 --mask mask.png --json");
  INFO(o.err);
  REQUIRE(o.code == 0);
  const auto m = nlohmann::json::parse(o.out);
  // Counted here again, from the map itself.
  const FloatImage shift = read_pfm(dir / "out/disparity.pfm");
  int matched = 0, bad = 0;
  for (int y = 20; y < 72; ++y) {
    for (int x = 0; x < 96; ++x) {
      if (x == 40 || !std::isfinite(shift.at(x, y))) continue;
      ++matched;
      bad += std::abs(shift.at(x, y) - (x < 48 ? 12.0f : 15.0f)) > 1;
    }
  }
  CHECK(m["evaluated"] == 95 * 52);
  CHECK(m["matched_percent"].get<double>() == Approx(100.0 * matched / (95 * 52)));
  CHECK(m["bad1_percent"].get<double>() == Approx(100.0 * bad / matched));
  CHECK(bad > matched / 4);
  CHECK(bad < matched * 3 / 4);
  const auto report = nlohmann::json::parse(read_file(dir / "out/report.json"));
  CHECK(report["metrics"] == m);
  CHECK(fs::exists(dir / "out/error.png"));

  struct Case {
    std::string arguments, message;
  };
  write_file(dir / "small.png", "");
  REQUIRE(cv::imwrite((dir / "small.png").string(), cv::Mat(50, 96, CV_8UC1, cv::Scalar(9))));
  for (const Case& c : std::vector<Case>{
           {"eval out truth.png", "--scale: found nothing"},
           {"eval out small.png --scale 8", "small.png: the image is 96x50"},
           {"eval out truth.png --scale 8 --mask small.png", "small.png: the image is 96x50"},
           {"eval out truth.png --scale 0", "--scale"},
           {"eval out/depth.pfm truth.png --scale 8", "--calib: found nothing"},
           {"eval out truth.png --scale 8 --calib calib.yaml", "--calib, --planes, --zmin, --zmax, --window: not with"},
           {"eval none truth.png --scale 8 --calib calib.yaml", "none: cannot read"}}) {
    const Outcome bad_case = psweep_run(dir, c.arguments);
    INFO(c.arguments << "\n" << bad_case.err);
    CHECK(bad_case.code == 2);
    CHECK_THAT(bad_case.err, contains(c.message));
  }
}

TEST_CASE("render, depth, eval, report: end to end", "[cli]") {
  const TemporaryDir dir;
  const std::string kind = GENERATE(as<std::string>{}, "rocky", "flat");
  REQUIRE(psweep_run(dir, "render --kind " + kind + " --seed 5 --size 160 -o scene").code == 0);
  CHECK(names(dir / "scene") == std::set<std::string>{"left.png", "right.png", "calib.yaml", "truth.pfm", "truth.png"});
  REQUIRE(psweep_run(dir, "render --kind " + kind + " --seed 5 --size 160 -o again").code == 0);
  REQUIRE(psweep_run(dir, "render --kind " + kind + " --seed 6 --size 160 -o other").code == 0);
  for (const char* name : {"left.png", "right.png", "calib.yaml", "truth.pfm"}) {
    CHECK(same_bytes(dir / "scene" / name, dir / "again" / name));
  }
  CHECK_FALSE(same_bytes(dir / "scene/left.png", dir / "other/left.png"));

  for (const char* engine : {"float", "fixed"}) {
    const Outcome o =
        psweep_run(dir, "depth scene/left.png scene/right.png --calib scene/calib.yaml --planes 61 --cleanup -o " +
                            std::string(engine) + " --engine " + engine);
    INFO(o.err);
    REQUIRE(o.code == 0);
    const Outcome e = psweep_run(dir, std::string("eval ") + engine + " scene/truth.pfm --json");
    INFO(e.err);
    REQUIRE(e.code == 0);
    const auto m = nlohmann::json::parse(e.out);
    for (const char* name : {"M1_mm", "M2a_percent", "M2b_mm", "M3_percent", "M4_px", "rms_mm"}) {
      REQUIRE(m.contains(name));
      CHECK(std::isfinite(m[name].get<double>()));
    }
    CHECK(m["M1_mm"] > 0);
    CHECK(m["M1_mm"] < 15);  // a seventh of the resolution: errors a few times those of the full one
    CHECK(m["M3_percent"] > 80);
    CHECK(m["M3_percent"] <= 100);
    const auto report = nlohmann::json::parse(read_file(dir / (engine + std::string("/report.json"))));
    CHECK(report["metrics"]["M1_mm"] == m["M1_mm"]);
    CHECK(fs::exists(dir / (engine + std::string("/error.png"))));
    // The single file with its calibration gives the same.
    const Outcome file = psweep_run(
        dir, std::string("eval ") + engine + "/depth.pfm scene/truth.pfm --calib scene/calib.yaml --planes 61 --json");
    REQUIRE(file.code == 0);
    CHECK(nlohmann::json::parse(file.out)["M1_mm"] == m["M1_mm"]);
  }
  const Outcome page =
      psweep_run(dir, "report float fixed -o page.html --input scene/left.png --truth scene/truth.pfm");
  INFO(page.err);
  REQUIRE(page.code == 0);
  const std::string html = read_file(dir / "page.html");
  CHECK(html.find("RMS error of the depths within 2 cm") != std::string::npos);
  CHECK(html.find("</html>") != std::string::npos);
  CHECK(html.find("src=\"data:image/png;base64,") != std::string::npos);
}

namespace {

// A chip large enough for the wall, in a process of its own address: 127.0.0.1 and a free port.
net::ArbiterConfig wall_chip() {
  net::ArbiterConfig c;
  c.engine.img_cols = 80;
  c.engine.img_rows = 60;
  c.engine.plane_cols = 50;
  c.engine.plane_rows = 40;
  c.engine.planes = 32;
  c.engine.window = 5;
  c.session_ms = 1500;
  return c;
}

}  // namespace

TEST_CASE("psweep depth over UDP writes what the fixed engine writes", "[cli][net]") {
  const TemporaryDir dir;
  write_wall(dir, 10);
  REQUIRE(psweep_run(dir, kInput + std::string("-q -o fixed")).code == 0);
  net::ArbiterConfig c = wall_chip();
  std::string options;
  int drop_every = 0;
  SECTION("two tiles in flight") {}
  SECTION("one tile in flight") { options = " --in-flight 1"; }
  SECTION("small tiles") { options = " --tile 30x20"; }
  SECTION("small buffers") {
    c.row_slots = 3;
    c.map_depth = 800;
  }
  SECTION("with losses") { drop_every = 11; }
  UdpChip chip(c);
  chip.drop_every = drop_every;
  const Outcome o = psweep_run(dir, kInput + std::string("-o udp --engine ") + chip.url() + options);
  INFO(o.out << o.err);
  REQUIRE(o.code == 0);
  CHECK_THAT(o.out, contains("Mbit/s up") && contains("engine clocks"));
  CHECK(names(dir / "udp") == kFiles);
  int compared = 0;
  for (const auto& name : kFiles) {
    if (name == "report.json") continue;
    INFO(name);
    CHECK(same_bytes(dir / "udp" / name, dir / "fixed" / name));
    ++compared;
  }
  CHECK(compared == 6);
  const auto report = nlohmann::json::parse(read_file(dir / "udp/report.json"));
  const auto& link = report["link"];
  CHECK(report["tiles"]["count"] >= 2);
  CHECK(link["engine_clocks"] == link["engine_clocks_by_formula"]);
  CHECK(link["engine_clocks"] > 0);
  CHECK(link["up_Mbit_per_s"] > 0);
  CHECK(link["down_Mbit_per_s"] > 0);
  CHECK(link["sessions"] == 1);
  CHECK(link["malformed"] == 0);
  CHECK(link["tiles_repeated"] == 0);
  CHECK(link["tiles_repeated_by_error"].empty());
  CHECK(link["tiles_unconfirmed"] == 0);
  CHECK(link["counters_known"] == true);
  if (drop_every) CHECK(link["resent"] > 0);
}

TEST_CASE("psweep depth over UDP: a tile that fails is sent again and told", "[cli][net]") {
  const TemporaryDir dir;
  write_wall(dir, 10);
  REQUIRE(psweep_run(dir, kInput + std::string("-q -o fixed")).code == 0);
  UdpChip chip(wall_chip());
  chip.fail_tiles = 2;
  const Outcome o = psweep_run(dir, kInput + std::string("-o udp --engine ") + chip.url());
  INFO(o.out << o.err);
  REQUIRE(o.code == 0);
  CHECK_THAT(o.out, contains("tiles that failed and were sent again: 2 (engine error bits: window 2)"));
  CHECK(same_bytes(dir / "udp/depth.pfm", dir / "fixed/depth.pfm"));
  const auto link = nlohmann::json::parse(read_file(dir / "udp/report.json"))["link"];
  CHECK(link["tiles_repeated"] == 2);
  CHECK(link["tiles_repeated_by_error"]["window"] == 2);
  CHECK(link["sessions"] == 3);
}

TEST_CASE("psweep depth over UDP: a lost goodbye does not cost the map", "[cli][net]") {
  const TemporaryDir dir;
  write_wall(dir, 10);
  REQUIRE(psweep_run(dir, kInput + std::string("-q -o fixed")).code == 0);
  UdpChip chip(wall_chip());
  chip.deaf_to_close = true;
  const Outcome o = psweep_run(dir, kInput + std::string("-o udp --engine ") + chip.url());
  INFO(o.out << o.err);
  REQUIRE(o.code == 0);
  CHECK_THAT(o.out, contains("its counters at the end are not known"));
  CHECK(same_bytes(dir / "udp/depth.pfm", dir / "fixed/depth.pfm"));
  const auto link = nlohmann::json::parse(read_file(dir / "udp/report.json"))["link"];
  CHECK(link["counters_known"] == false);
  CHECK(link["wait_rows_clocks"].is_null());
}

TEST_CASE("psweep info and bench-link", "[cli][net]") {
  const TemporaryDir dir;
  UdpChip chip(wall_chip());
  const Outcome info = psweep_run(dir, "info " + chip.url());
  INFO(info.out << info.err);
  REQUIRE(info.code == 0);
  CHECK_THAT(info.out, contains("plane_cols             50") && contains("engine_wait_rows") && contains("session"));
  const Outcome parsed = psweep_run(dir, "info --json " + chip.url());
  REQUIRE(parsed.code == 0);
  const auto j = nlohmann::json::parse(parsed.out);
  CHECK(j["capabilities"]["planes"] == 32);
  CHECK(j["capabilities"]["mac"] == "02:00:00:00:00:01");
  CHECK(j["state"]["session"] == false);
  CHECK(j["counters"]["sessions"] == 0);
  CHECK(j["counters"].size() == net::kCounterWords);
  CHECK(j["counters"].contains("tiles_failed"));

  const Outcome bench = psweep_run(dir, "bench-link --seconds 0.3 --json " + chip.url());
  INFO(bench.err);
  REQUIRE(bench.code == 0);
  const auto b = nlohmann::json::parse(bench.out);
  for (const char* name : {"up_Mbit_per_s", "down_Mbit_per_s", "both_up_Mbit_per_s", "both_down_Mbit_per_s"}) {
    INFO(name);
    CHECK(b[name] > 0);
  }
  CHECK(b["latency_us"]["questions"] > 0);
  CHECK(b["latency_us"]["median"] <= b["latency_us"]["max"]);
  const Outcome table = psweep_run(dir, "bench-link --seconds 0.1 " + chip.url());
  REQUIRE(table.code == 0);
  CHECK_THAT(table.out, contains("both at once") && contains("latency"));
}

TEST_CASE("a chip that cannot serve the request, or none at all", "[cli][net]") {
  const TemporaryDir dir;
  write_wall(dir, 10);
  UdpChip chip(wall_chip());
  const std::string call = "depth left.png right.png --calib calib.yaml -o out --engine " + chip.url();
  struct Wrong {
    std::string options, message;
  };
  for (const auto& w :
       std::vector<Wrong>{{" --planes 31 --window 7", "--window: found 7, but the chip at"},
                          {" --planes 33 --window 5", "--planes: found 33, but the chip at"},
                          {" --planes 9 --window 5 --mncc-bits 9", "--mncc-bits: found 9, but the chip"},
                          {" --planes 9 --window 5 --tile 60x20", "exceeds plane_cols = 50"}}) {
    const Outcome o = psweep_run(dir, call + w.options);
    INFO(o.err);
    CHECK(o.code == 2);
    CHECK_THAT(o.err, contains(w.message));
    CHECK_FALSE(fs::exists(dir / "out"));
  }
  const std::string silent = "udp://127.0.0.1:" + std::to_string(chip.port());
  chip.stop();
  for (const std::string& command :
       {kInput + std::string("-o out --link-timeout 0.5 --engine "), std::string("info --link-timeout 0.5 "),
        std::string("bench-link --link-timeout 0.5 ")}) {
    const Outcome o = psweep_run(dir, command + silent);
    INFO(o.err);
    CHECK(o.code == 1);
    // How long is not compared: a busy machine may come back late.
    CHECK_THAT(o.err, contains(silent + ": no valid answer for "));
    CHECK_FALSE(fs::exists(dir / "out"));
  }
  CHECK(psweep_run(dir, "info http://127.0.0.1").code == 2);
  CHECK(psweep_run(dir, kInput + std::string("-o out --engine udp://")).code == 2);
}

TEST_CASE("a killed host: the next one waits for its session to end", "[cli][net]") {
  const TemporaryDir dir;
  write_wall(dir, 10);
  UdpChip chip(wall_chip());
  chip.sweep_seconds = 5;
  const int killed = std::system(("cd '" + dir.path().string() + "' && timeout -s KILL 1.5 '" PSWEEP_BINARY "' " +
                                  kInput + "-q -o killed --engine " + chip.url() + " 2>.stderr")
                                     .c_str());
  CHECK(killed != 0);
  chip.sweep_seconds = -1;
  const Outcome o = psweep_run(dir, kInput + std::string("-q -o out --engine ") + chip.url());
  INFO(o.err);
  CHECK(o.code == 0);
  const auto counters = nlohmann::json::parse(psweep_run(dir, "info --json " + chip.url()).out)["counters"];
  CHECK(counters["sessions"] == 2);
  CHECK(counters["timeouts"] == 1);
}
