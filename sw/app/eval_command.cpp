// SPDX-License-Identifier: Apache-2.0
// psweep eval: metres against metres in the cyclopean eye (paper, section 3.2), or disparities of the left image
// against a Middlebury ground truth. With an output directory as DEPTH, report.json and error.png are updated.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "app/disparity_metrics.hpp"
#include "app/options.hpp"
#include "app/run_record.hpp"
#include "core/error.hpp"
#include "eval/metrics.hpp"
#include "io/calibration.hpp"
#include "io/image_io.hpp"
#include "io/output_dir.hpp"
#include "io/pfm.hpp"
#include "io/picture.hpp"
#include "io/reprojection.hpp"
#include "io/text_file.hpp"

namespace psweep {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

void check_size(const std::string& name, int width, int height, const std::string& other, int w, int h) {
  if (width != w || height != h) {
    throw InputError(name + ": the image is " + std::to_string(width) + "x" + std::to_string(height) + ", but " +
                     other + " is " + std::to_string(w) + "x" + std::to_string(h));
  }
}

// Nearest of 1, 2, 5, 10, ..
double round_scale(double v) {
  const double decade = std::pow(10, std::floor(std::log10(v)));
  const double lead = v / decade;
  return decade * (lead < 1.5 ? 1 : lead < 3.5 ? 2 : lead < 7.5 ? 5 : 10);
}

bool is_pfm(const fs::path& path) { return read_file(path).compare(0, 2, "Pf") == 0; }

}  // namespace

void eval_command(const EvalOptions& o) {
  const bool directory = fs::is_directory(o.depth);
  const bool disparity_truth = !is_pfm(o.truth);
  if (disparity_truth && !o.scale) {
    throw InputError("--scale: found nothing, expected the grey values per pixel of disparity of " + o.truth);
  }
  if (!disparity_truth && (o.scale || !o.mask.empty())) {
    throw InputError("--scale, --mask: only for a disparity truth, but " + o.truth + " is a PFM file in metres");
  }
  RunRecord record;
  if (directory) {
    if (!o.calibration.empty() || o.planes || o.zmin || o.zmax || o.window) {
      throw InputError("--calib, --planes, --zmin, --zmax, --window: not with a directory, its report.json has them");
    }
    record = read_record(fs::path(o.depth) / "report.json");
  } else {
    if (o.calibration.empty()) throw InputError("--calib: found nothing, expected the calibration of " + o.depth);
    Calibration calibration = read_calibration(o.calibration, Rectify::kNo);
    const FloatImage depth = read_pfm(o.depth);
    adopt_size(calibration, o.depth, depth.width, depth.height);
    record.rig = calibration.rig;
    if (calibration.search) record.spacing = planes_for(calibration.rig, *calibration.search);
    if (o.planes) record.spacing.planes = *o.planes;
    if (o.zmin) record.spacing.zmin = *o.zmin;
    if (o.zmax) record.spacing.zmax = *o.zmax;
    if (o.window) record.window = *o.window;
  }
  const fs::path map_file = directory ? fs::path(o.depth) / "depth.pfm" : fs::path(o.depth);
  const FloatImage depth = read_pfm(map_file);
  check_size(map_file.string(), depth.width, depth.height, "its calibration", record.rig.width, record.rig.height);

  ordered_json metrics;
  cv::Mat picture;
  if (disparity_truth) {
    const Gray grey = read_gray(o.truth);
    check_size(o.truth, grey.width, grey.height, map_file.string(), depth.width, depth.height);
    const Gray mask = o.mask.empty() ? Gray() : read_gray(o.mask);
    if (!mask.empty()) check_size(o.mask, mask.width, mask.height, o.truth, grey.width, grey.height);
    const FloatImage truth = truth_from_png(grey, *o.scale);
    const FloatImage disparity =
        directory ? read_pfm(fs::path(o.depth) / "disparity.pfm") : left_disparity(record.rig, depth);
    const DisparityMetrics m = evaluate_disparity(disparity, truth, mask);
    if (m.evaluated == 0) throw InputError(o.truth + ": no pixel with a truth" + (mask.empty() ? "" : " in " + o.mask));
    metrics = {{"truth", o.truth},
               {"mask", o.mask},
               {"evaluated", m.evaluated},
               {"matched_percent", m.matched_percent},
               {"bad1_percent", m.bad1_percent},
               {"bad2_percent", m.bad2_percent},
               {"bad1_all_percent", m.bad1_all_percent},
               {"mean_px", m.mean_px}};
    picture = error_picture(disparity, truth, 1, 4, "px");
  } else {
    FloatImage truth = read_pfm(o.truth);
    check_size(o.truth, truth.width, truth.height, map_file.string(), depth.width, depth.height);
    if (!record.metric) {
      throw InputError(map_file.string() + ": depths are relative (--disparity-range), but " + o.truth +
                       " is in metres");
    }
    const Metrics m = evaluate(depth, truth, record.rig, record.spacing, record.window);
    metrics = {{"truth", o.truth},
               {"evaluated", m.evaluated},
               {"reconstructed", m.reconstructed},
               {"M1_mm", m.M1_mm},
               {"M2a_percent", m.M2a_percent},
               {"M2b_mm", m.M2b_mm},
               {"M3_percent", m.M3_percent},
               {"M4_px", m.M4_px},
               {"rms_mm", m.rms_mm},
               {"holes", m.holes}};
    // Errors grow with 1 / (f b): 20 mm is full scale on the rover's rig at full size, others get their share.
    const double full = 20 * 1200 * 0.2 / (record.rig.cyclopean().fx * record.rig.baseline);
    const auto evaluated = evaluated_cells(truth, record.rig, record.spacing, record.window);
    for (size_t i = 0; i < truth.data.size(); ++i) {
      if (!evaluated.data[i]) truth.data[i] = std::numeric_limits<float>::infinity();
    }
    picture = error_picture(depth, truth, 1000, round_scale(full), "mm");
  }

  if (directory) {
    record.json["metrics"] = metrics;
    write_png(fs::path(o.depth) / "error.png", picture);
    write_record(fs::path(o.depth) / "report.json", record);
  }
  if (o.json) {
    std::printf("%s\n", metrics.dump(2).c_str());
  } else {
    for (const auto& [name, value] : metrics.items()) {
      if (value.is_number()) std::printf("%-18s %.10g\n", name.c_str(), value.get<double>());
    }
  }
}

}  // namespace psweep
