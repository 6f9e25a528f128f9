// SPDX-License-Identifier: Apache-2.0
// Measures accuracy on synthetic terrain and prints Markdown tables (docs/accuracy.md quotes them).
//   psweep_accuracy [--size N] [--threads N] [--seeds 1,2,3] [--kind rocky|flat] [--save DIR] EXPERIMENT ...
// Experiments: float, fixed, formats, mncc, rules, cleanup. --save writes pairs, depth and error maps as PNG files into
// DIR.
//   psweep_accuracy --scene DIR [--window M] [--threads N] --csv ENGINE:MNCC:INTERP:FRAC:WEIGHT ...
// One scene that 'psweep render' wrote, as comma-separated values (make dse): every format against float and truth.
// ENGINE: float (numbers do not matter), mncc (float but for MNCC and FRAC, figure 8 of the paper), fixed (bit-true).
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "eval/cleanup.hpp"
#include "eval/metrics.hpp"
#include "fast/fast.hpp"
#include "io/image_io.hpp"
#include "io/pfm.hpp"
#include "io/picture.hpp"
#include "plan/planner.hpp"
#include "reference/reference.hpp"
#include "scene/scene.hpp"

namespace psweep {
namespace {

constexpr int kWindow = 13;
constexpr double kThreshold = 0.85;

struct Options {
  int size = 1120, threads = 2;
  std::vector<uint64_t> seeds{1, 2, 3};
  int window = kWindow;
  bool csv = false;
  std::string save, kind, scene;  // empty: save nothing, both kinds, render
  std::vector<std::string> experiments;
  bool wants(const std::string& name) const {
    for (const auto& e : experiments) {
      if (e == name) return true;
    }
    return false;
  }
};

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

class Bench {
 public:
  Bench(const Options& options, SceneKind kind, uint64_t seed) : options_(options) {
    name_ = std::string(kind == SceneKind::kRocky ? "rocky" : "flat") + " " + std::to_string(seed);
    const double start = seconds();
    scene_ = render(kind, seed, options.size, options.threads);
    std::fprintf(stderr, "%s: rendered in %.1f s\n", name_.c_str(), seconds() - start);
    if (!options.save.empty()) {
      write_png(stem() + "_left.png", scene_.left);
      write_png(stem() + "_right.png", scene_.right);
      write_png(stem() + "_truth.png", depth_picture(scene_.truth, spacing_));
    }
    selected_ = evaluated_cells(scene_.truth, scene_.rig, spacing_, kWindow);
    plain_ = run("float", [&] { return floating({}); });
    report("float", plain_, false);
    if (!options.save.empty()) {
      write_png(stem() + "_float.png", depth_picture(plain_.depth, spacing_));
      write_png(stem() + "_error.png", error_picture(plain_.depth, scene_.truth, 1000, 20, "mm"));
    }
  }

  void experiments() {
    if (options_.wants("cleanup")) {
      cleaned("float + uniqueness", plain_, true, false);
      cleaned("float + speckle", plain_, false, true);
      cleaned("float + both", plain_, true, true);
    }
    if (options_.wants("mncc")) {
      for (const int bits : {8, 10, 12, 13, 14, 16}) {
        FloatOptions o;
        o.mncc_bits = bits;
        const std::string name = "float, MNCC " + std::to_string(bits) + " bits";
        report(name, run(name, [&] { return floating(o); }), true);
      }
    }
    if (options_.wants("rules")) {
      FloatOptions o;
      o.rule = WinnerRule::kBestLocal;
      report("float, best local maximum", run("rules", [&] { return floating(o); }), true);
    }
    if (options_.wants("fixed")) fixed(8, golden::Config{}.interp_frac, golden::Config{}.mncc_bits, true);
    if (options_.wants("formats")) {
      for (const int interp : {0, 2, 4, 6}) {
        for (const int mncc : {13, 14}) fixed(8, interp, mncc, false);
      }
      for (const int weight : {6, 10, 12}) {
        for (const int interp : {2, 4, 6}) fixed(weight, interp, 13, false);
      }
    }
    std::fflush(stdout);
  }

 private:
  std::string stem() const {
    std::string file = name_;
    file[file.find(' ')] = '_';
    return options_.save + "/" + file;
  }

  DepthResult floating(const FloatOptions& o) const {
    return run_float(scene_.left, scene_.right, scene_.rig, spacing_, kWindow, kThreshold, o, options_.threads);
  }

  void fixed(int weight, int interp, int mncc, bool with_cleanup) {
    SweepSetup setup;
    setup.rig = scene_.rig;
    setup.spacing = spacing_;
    setup.format.weight_bits = weight;
    setup.format.interp_frac = interp;
    setup.format.mncc_bits = mncc;
    setup.format.window = kWindow;
    setup.threshold = threshold_for(setup.format, kThreshold);
    const std::string name =
        "fixed 8." + std::to_string(interp) + ", MNCC " + std::to_string(mncc) + ", weight " + std::to_string(weight);
    FastOptions o;
    o.threads = options_.threads;
    const DepthResult r = run(name, [&] { return to_result(setup, run_fixed(scene_.left, scene_.right, setup, o)); });
    report(name, r, true);
    if (with_cleanup) cleaned(name + " + both", r, true, true);
  }

  DepthResult run(const std::string& what, const std::function<DepthResult()>& engine) const {
    const double start = seconds();
    DepthResult r = engine();
    std::fprintf(stderr, "%s: %s in %.1f s\n", name_.c_str(), what.c_str(), seconds() - start);
    return r;
  }

  void cleaned(const std::string& what, DepthResult r, bool uniqueness, bool speckle) const {
    CleanupOptions o;
    o.uniqueness = uniqueness;
    o.speckle = speckle;
    clean_up(r, scene_.rig, o);
    report(what, r, false);
  }

  void report(const std::string& what, const DepthResult& r, bool against_float) const {
    const Metrics m = evaluate(r.depth, scene_.truth, scene_.rig, spacing_, kWindow);
    std::printf("| %s | %s | %.2f | %.2f | %.1f | %.2f | %.1f | %.2f |", name_.c_str(), what.c_str(), m.M1_mm,
                m.M2a_percent, m.M2b_mm, m.M3_percent, m.M4_px, m.rms_mm);
    if (against_float) {
      const Comparison c = compare(plain_.depth, r.depth, selected_);
      std::printf(" %.2f | %.4f | %.2f | %.3f |", c.within_quarter_mm, c.off_2cm, c.same_holes, c.same_coverage);
    } else {
      std::printf(" | | | |");
    }
    std::printf("\n");
    std::fflush(stdout);
  }

  const Options& options_;
  std::string name_;
  Scene scene_;
  PlaneSpacing spacing_;
  Image<uint8_t> selected_;
  DepthResult plain_;
};

Options parse(int argc, char** argv) {
  Options o;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto value = [&]() -> std::string {
      if (++i == argc) throw InputError(word + ": expected a value");
      return argv[i];
    };
    if (word == "--csv") {
      o.csv = true;
    } else if (word == "--scene") {
      o.scene = value();
    } else if (word == "--window") {
      o.window = std::atoi(value().c_str());
    } else if (word == "--size") {
      o.size = std::atoi(value().c_str());
    } else if (word == "--threads") {
      o.threads = std::atoi(value().c_str());
    } else if (word == "--save") {
      o.save = value();
    } else if (word == "--kind") {
      o.kind = value();
    } else if (word == "--seeds") {
      o.seeds.clear();
      const std::string list = value();
      for (size_t at = 0; at < list.size(); at = std::min(list.find(',', at), list.size() - 1) + 1) {
        o.seeds.push_back(std::strtoull(list.c_str() + at, nullptr, 10));
      }
    } else {
      o.experiments.push_back(word);
    }
  }
  return o;
}

// Fields of ENGINE:MNCC:INTERP:FRAC:WEIGHT.
struct Format {
  std::string engine;
  golden::Config config;
};

Format parse_format(const std::string& text) {
  std::istringstream in(text);
  Format f;
  std::getline(in, f.engine, ':');
  char colon[3] = {};
  in >> f.config.mncc_bits >> colon[0] >> f.config.interp_frac >> colon[1] >> f.config.frac_bits >> colon[2] >>
      f.config.weight_bits;
  const bool known = f.engine == "float" || f.engine == "mncc" || f.engine == "fixed";
  if (!in || !in.eof() || !known || std::string(colon, 3) != ":::") {
    throw InputError("'" + text + "': expected float|mncc|fixed:MNCC:INTERP:FRAC:WEIGHT");
  }
  return f;
}

void print_csv(const Options& options) {
  if (options.experiments.empty()) throw InputError("--csv: expected formats");
  const Gray left = read_gray(options.scene + "/left.png"), right = read_gray(options.scene + "/right.png");
  const FloatImage truth = read_pfm(options.scene + "/truth.pfm");
  const Rig rig = rover_rig(left.width);
  const PlaneSpacing spacing;
  const Image<uint8_t> selected = evaluated_cells(truth, rig, spacing, options.window);
  const auto floating = [&](const FloatOptions& o) {
    return run_float(left, right, rig, spacing, options.window, kThreshold, o, options.threads);
  };
  const DepthResult plain = floating({});
  std::printf(
      "size,window,engine,mncc,interp,frac,weight,M1_mm,M2a_percent,M2b_mm,M3_percent,M4_px,rms_mm,cells,both,"
      "over_quarter_mm_percent,over_1mm_percent,over_5mm_percent,over_2cm_percent,float_holes,holes_gained,"
      "holes_lost\n");
  for (const auto& text : options.experiments) {
    const Format f = parse_format(text);
    DepthResult r = plain;
    if (f.engine == "mncc") {
      FloatOptions o;
      o.mncc_bits = f.config.mncc_bits;
      o.frac_bits = f.config.frac_bits;
      r = floating(o);
    } else if (f.engine == "fixed") {
      SweepSetup setup{rig, spacing, f.config, 0};
      setup.format.window = options.window;
      setup.threshold = threshold_for(setup.format, kThreshold);
      FastOptions o;
      o.threads = options.threads;
      r = to_result(setup, run_fixed(left, right, setup, o));
    }
    const Metrics m = evaluate(r.depth, truth, rig, spacing, options.window);
    const Comparison c = compare(plain.depth, r.depth, selected);
    std::printf("%d,%d,%s,%d,%d,%d,%d,%.4f,%.4f,%.3f,%.4f,%.3f,%.4f,%zu,%zu,%.6f,%.6f,%.6f,%.6f,%zu,%zu,%zu\n",
                rig.width, options.window, f.engine.c_str(), f.config.mncc_bits, f.config.interp_frac,
                f.config.frac_bits, f.config.weight_bits, m.M1_mm, m.M2a_percent, m.M2b_mm, m.M3_percent, m.M4_px,
                m.rms_mm, c.cells, c.both, 100 - c.within_quarter_mm, c.off_1mm, c.off_5mm, c.off_2cm,
                c.reference_holes, c.holes_gained, c.holes_lost);
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace psweep

int main(int argc, char** argv) {
  try {
    const psweep::Options options = psweep::parse(argc, argv);
    if (options.csv) {
      psweep::print_csv(options);
      return 0;
    }
    std::printf(
        "| scene | engine | M1 mm | M2.a %% | M2.b mm | M3 %% | M4 px | RMS mm | <= 0.25 mm of float %% | "
        "> 2 cm %% | float's holes kept %% | hole or depth as float %% |\n");
    std::printf("|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (const auto kind : {psweep::SceneKind::kRocky, psweep::SceneKind::kFlat}) {
      if (options.kind == (kind == psweep::SceneKind::kRocky ? "flat" : "rocky")) continue;
      for (const uint64_t seed : options.seeds) psweep::Bench(options, kind, seed).experiments();
    }
  } catch (const psweep::InputError& e) {
    std::fprintf(stderr, "psweep_accuracy: %s\n", e.what());
    return 2;
  }
  return 0;
}
