// SPDX-License-Identifier: Apache-2.0
// psweep depth: reads everything, checks everything, sweeps, writes everything (docs/file_formats.md lists the files).
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "app/engines.hpp"
#include "app/options.hpp"
#include "app/run_record.hpp"
#include "contract/registers.hpp"
#include "core/error.hpp"
#include "eval/cleanup.hpp"
#include "io/image_io.hpp"
#include "io/output_dir.hpp"
#include "io/pfm.hpp"
#include "io/picture.hpp"
#include "io/ply.hpp"
#include "io/progress.hpp"
#include "io/rectify.hpp"
#include "io/reprojection.hpp"
#include "io/text_file.hpp"

namespace psweep {
namespace {

using nlohmann::ordered_json;

DisparityRange parse_range(const std::string& text) {
  const size_t at = text.find(':');  // the parser has checked the form
  const DisparityRange range{std::atof(text.c_str()), std::atof(text.c_str() + at + 1)};
  if (!(range.lo < range.hi)) {
    throw InputError("--disparity-range: found '" + text + "', expected LO:HI, pixels, 0 < LO < HI");
  }
  return range;
}

// Planes by the user, else by the disparities that the calibration searches, else the rover's.
PlaneSpacing choose_planes(const DepthOptions& o, const Calibration& calibration, int most) {
  PlaneSpacing out;
  const double fb = calibration.rig.cyclopean().fx * calibration.rig.baseline;
  if (calibration.search) {
    DisparityRange range = *calibration.search;
    if (o.zmin) range.hi = fb / *o.zmin;
    if (o.zmax) range.lo = fb / *o.zmax;
    if (range.lo < range.hi) out = planes_for(calibration.rig, range);
  }
  if (o.zmin) out.zmin = *o.zmin;
  if (o.zmax) out.zmax = *o.zmax;
  if (o.planes) {
    out.planes = *o.planes;
  } else {
    out.planes = std::min(out.planes, most);
  }
  if (!(out.zmin < out.zmax)) {
    char text[120];
    std::snprintf(text, sizeof text, "--zmin, --zmax: found %g and %g, expected zmin < zmax", out.zmin, out.zmax);
    throw InputError(text);
  }
  return out;
}

golden::Config choose_format(const DepthOptions& o) {
  golden::Config format;
  format.planes = 1024;
  if (!o.configuration.empty()) format = configuration_named(o.configuration);
  auto set = [&](const std::optional<int>& value, int& field, const char* option) {
    if (!value) return;
    if (!o.configuration.empty() && *value != field) {
      throw InputError(std::string(option) + ": found " + std::to_string(*value) + ", but configuration '" +
                       o.configuration + "' has " + std::to_string(field));
    }
    field = *value;
  };
  set(o.window, format.window, "--window");
  set(o.interp_bits, format.interp_frac, "--interp-bits");
  set(o.mncc_bits, format.mncc_bits, "--mncc-bits");
  set(o.frac_bits, format.frac_bits, "--frac-bits");
  set(o.weight_bits, format.weight_bits, "--weight-bits");
  if (!o.configuration.empty() && o.planes && *o.planes > format.planes) {
    throw InputError("--planes: found " + std::to_string(*o.planes) + ", but configuration '" + o.configuration +
                     "' has room for " + std::to_string(format.planes));
  }
  return format;
}

ordered_json cell_counts(const DepthResult& result) {
  size_t found = 0;
  size_t bits[6] = {};
  for (const uint8_t m : result.mask.data) {
    found += m == 0;
    for (int b = 0; b < 6; ++b) bits[b] += (m >> b) & 1;
  }
  return {{"all", result.mask.data.size()},   {"with_depth", found},          {"outside", bits[0]},
          {"no_variance", bits[1]},           {"below_threshold", bits[2]},   {"not_local_maximum", bits[3]},
          {"removed_by_uniqueness", bits[4]}, {"removed_as_speckle", bits[5]}};
}

// {"upset": 2, "window": 1}
ordered_json repeated_by_error(const net::LinkFigures& f) {
  ordered_json counts = ordered_json::object();
  for (size_t bit = 0; bit < f.repeated_by_error.size(); ++bit)
    if (f.repeated_by_error[bit] > 0) counts[golden::error_names(1u << bit)] = f.repeated_by_error[bit];
  return counts;
}
// "upset 2, window 1"
std::string repeated_errors(const net::LinkFigures& f) {
  const ordered_json counts = repeated_by_error(f);
  std::string text;
  for (const auto& [name, count] : counts.items())
    text += (text.empty() ? "" : ", ") + name + " " + std::to_string(count.get<uint64_t>());
  return text.empty() ? "none" : text;
}

ordered_json link_report(const net::LinkRun& link) {
  const net::LinkFigures& f = link.figures;
  const net::LinkStatistics& s = link.statistics;
  const double hertz = 1e3 * link.chip.config.clk_khz;
  auto rate = [&](uint64_t bytes) { return f.seconds > 0 ? 8e-6 * static_cast<double>(bytes) / f.seconds : 0; };
  auto time = [&](uint64_t clocks) { return static_cast<double>(clocks) / hertz; };
  // Clocks by the chip's counters; null if it was silent at the end.
  auto counted = [&](uint64_t clocks) { return f.counters_after.empty() ? ordered_json() : ordered_json(clocks); };
  return {{"peer", link.peer},
          {"seconds", f.seconds},
          {"up_bytes", f.pixel_bytes},
          {"up_Mbit_per_s", rate(f.pixel_bytes)},
          {"down_bytes", f.cell_bytes},
          {"down_Mbit_per_s", rate(f.cell_bytes)},
          {"packets_sent", s.packets_sent},
          {"packets_received", s.packets_received},
          {"resent", s.resent},
          {"lost", s.lost},
          {"duplicates", s.duplicates},
          {"malformed", s.malformed},
          {"foreign", s.foreign},
          {"sessions", s.sessions},
          {"timeouts", s.timeouts},
          {"tiles_repeated", f.tiles_repeated},
          {"tiles_repeated_by_error", repeated_by_error(f)},
          {"tiles_unconfirmed", f.tiles_unconfirmed},
          {"counters_known", !f.counters_after.empty()},
          {"rtt_ms", 1e3 * s.rtt},
          {"rtt_min_ms", 1e3 * s.rtt_min},
          {"rtt_max_ms", 1e3 * s.rtt_max},
          {"clk_khz", link.chip.config.clk_khz},
          {"engine_clocks", f.engine_clocks},
          {"engine_clocks_by_formula", link.clocks_expected},
          {"engine_seconds", time(f.engine_clocks)},
          {"wait_rows_clocks", counted(f.wait_rows_clocks)},
          {"wait_map_clocks", counted(f.wait_map_clocks)}};
}

ordered_json rtl_report(const RtlFigures& rtl, double seconds) {
  const auto clocks = static_cast<double>(rtl.clocks_in_all);
  return {{"configuration", rtl.configuration},
          {"image_buffer", {rtl.generics.img_cols, rtl.generics.img_rows}},
          {"largest_tile", {rtl.generics.plane_cols, rtl.generics.plane_rows}},
          {"lanes", rtl.generics.lanes},
          {"rectified", rtl.generics.rectified},
          {"clocks", rtl.clocks},
          {"clocks_by_formula", rtl.clocks_expected},
          {"clocks_in_all", rtl.clocks_in_all},
          {"seconds_at_166_MHz", clocks / 166e6},
          {"seconds_at_300_MHz", clocks / 300e6},
          {"simulated_clocks_per_second", seconds > 0 ? clocks / seconds : 0}};
}

void check_options(const DepthOptions& o) {
  if (o.calibration.empty() && o.disparity_range.empty()) {
    throw InputError("--calib: found nothing, expected a calibration file (or --disparity-range LO:HI)");
  }
  if (!o.cleanup && (o.no_uniqueness || o.no_speckle)) {
    throw InputError("--no-uniqueness, --no-speckle: need --cleanup");
  }
  if (o.engine == "float" && (o.interp_bits || o.weight_bits || !o.tile.empty())) {
    throw InputError("--interp-bits, --weight-bits, --tile: not with --engine float, which neither rounds nor tiles");
  }
  if (o.engine == "float" && o.frac_bits && !o.mncc_bits) {
    throw InputError("--frac-bits: with --engine float only together with --mncc-bits");
  }
}

struct Input {
  Gray left, right;
  Calibration calibration;
};

Input read_input(const DepthOptions& o) {
  Input in;
  in.left = read_gray(o.left);
  in.right = read_gray(o.right);
  if (in.left.width != in.right.width || in.left.height != in.right.height) {
    throw InputError(o.right + ": the image is " + std::to_string(in.right.width) + "x" +
                     std::to_string(in.right.height) + ", but " + o.left + " is " + std::to_string(in.left.width) +
                     "x" + std::to_string(in.left.height));
  }
  if (o.calibration.empty()) {
    const DisparityRange range = parse_range(o.disparity_range);
    in.calibration = disparity_range_calibration(range.lo, range.hi, in.left.width, in.left.height);
  } else {
    in.calibration = read_calibration(o.calibration, o.rectify);
  }
  adopt_size(in.calibration, o.left, in.left.width, in.left.height);
  return in;
}

void rectify(Input& in) {
  RectifiedPair pair = rectify_pair(in.calibration, in.left, in.right);
  in.left = std::move(pair.left);
  in.right = std::move(pair.right);
  in.calibration.rig = pair.rig;
}

SweepSetup make_setup(const DepthOptions& o, const Input& in) {
  SweepSetup setup;
  setup.rig = in.calibration.rig;
  setup.format = choose_format(o);
  setup.spacing = choose_planes(o, in.calibration, setup.format.planes);
  setup.format.planes = setup.spacing.planes;
  setup.threshold = threshold_for(setup.format, o.threshold);
  if (in.left.width < setup.format.window || in.left.height < setup.format.window) {
    throw InputError(o.left + ": the image is " + std::to_string(in.left.width) + "x" + std::to_string(in.left.height) +
                     ", expected at least --window = " + std::to_string(setup.format.window) + " both ways");
  }
  return setup;
}

EngineRun sweep(const DepthOptions& o, const SweepSetup& setup, const Input& in) {
  Progress bar(o.engine, o.quiet);
  EngineRequest request{o.engine,  setup,       o.threshold,   {}, o.tile, o.configuration,
                        o.threads, o.in_flight, o.link_timeout};
  if (o.mncc_bits) request.rounding.mncc_bits = *o.mncc_bits;
  if (o.frac_bits) request.rounding.frac_bits = *o.frac_bits;
  return run_engine(request, {in.left, in.right}, [&](uint64_t done, uint64_t total) { bar.update(done, total); });
}

void clean(const DepthOptions& o, const SweepSetup& setup, DepthResult& result) {
  CleanupOptions cleanup;
  cleanup.uniqueness = !o.no_uniqueness;
  cleanup.speckle = !o.no_speckle;
  cleanup.uniqueness_m = 0.02 * setup.spacing.zmin;  // the rover's 2 cm at 1 m, in any unit of depth
  clean_up(result, setup.rig, cleanup);
}

void write_images(OutputDir& out, const SweepSetup& setup, const Input& in, const DepthResult& result) {
  if (in.calibration.raw) {
    write_png(out.file("rectified_left.png"), in.left);
    write_png(out.file("rectified_right.png"), in.right);
    write_calibration(out.file("rectified_calib.yaml"), in.calibration.rig);
  }
  const double fb = setup.rig.cyclopean().fx * setup.rig.baseline;
  write_pfm(out.file("depth.pfm"), result.depth);
  write_pfm(out.file("mncc.pfm"), result.mncc);
  write_pfm(out.file("disparity.pfm"), left_disparity(setup.rig, result.depth));
  write_png(out.file("mask.png"), result.mask);
  write_png(out.file("depth.png"), depth_picture(result.depth, setup.spacing, in.calibration.metric, fb));
  write_ply(out.file("cloud.ply"), point_cloud(setup.rig, result.depth, result.mncc, in.left));
}

// report.json, but for the seconds in all.
RunRecord make_record(const DepthOptions& o, const SweepSetup& setup, const Input& in, const EngineRun& run) {
  RunRecord record;
  record.rig = setup.rig;
  record.spacing = setup.spacing;
  record.window = setup.format.window;
  record.metric = in.calibration.metric;
  ordered_json& j = record.json;
  j["psweep"] = PSWEEP_VERSION;
  j["engine"] = o.engine;
  j["left"] = o.left;
  j["right"] = o.right;
  j["calibration"] = {{"kind", to_string(in.calibration.kind)}, {"file", o.calibration}};
  j["threshold"] = o.threshold;
  if (o.engine != "float") {
    const golden::Config& f = setup.format;
    j["format"] = {{"pixel_bits", f.pix_bits}, {"interp_bits", f.interp_frac}, {"weight_bits", f.weight_bits},
                   {"mncc_bits", f.mncc_bits}, {"frac_bits", f.frac_bits},     {"threshold", setup.threshold}};
    j["tiles"] = {{"count", run.tiles}, {"largest_cols", run.largest_cols}, {"largest_rows", run.largest_rows}};
  }
  j["cleanup"] = {{"uniqueness", o.cleanup && !o.no_uniqueness}, {"speckle", o.cleanup && !o.no_speckle}};
  j["cells"] = cell_counts(run.result);
  j["seconds"] = run.seconds;
  j["seconds_in_all"] = nullptr;
  if (run.rtl) j["rtl"] = rtl_report(*run.rtl, run.seconds);
  if (run.link) j["link"] = link_report(*run.link);
  return record;
}

void print_link(const net::LinkRun& link, int tiles) {
  const net::LinkFigures& f = link.figures;
  const net::LinkStatistics& s = link.statistics;
  const double mhz = 1e-3 * link.chip.config.clk_khz;
  std::printf(
      "link %s: %d tiles, %.2f s; %.2f Mbit/s up, %.2f Mbit/s down; lost %llu, resent %llu; %.3f M engine "
      "clocks = %.3f s at %.0f MHz\n",
      link.peer.c_str(), tiles, f.seconds, 8e-6 * static_cast<double>(f.pixel_bytes) / f.seconds,
      8e-6 * static_cast<double>(f.cell_bytes) / f.seconds, static_cast<unsigned long long>(s.lost),
      static_cast<unsigned long long>(s.resent), 1e-6 * static_cast<double>(f.engine_clocks),
      1e-6 * static_cast<double>(f.engine_clocks) / mhz, mhz);
  if (f.tiles_repeated > 0) {
    std::printf("tiles that failed and were sent again: %llu (engine error bits: %s)\n",
                static_cast<unsigned long long>(f.tiles_repeated), repeated_errors(f).c_str());
  }
  if (f.tiles_unconfirmed > 0) {
    std::printf("the chip fell silent when every cell had arrived: it did not say that the last tile had no error\n");
  } else if (f.counters_after.empty()) {
    std::printf("the chip fell silent when every cell had arrived: its counters at the end are not known\n");
  }
}

void print_summary(const DepthOptions& o, const SweepSetup& setup, const EngineRun& run) {
  const std::vector<uint8_t>& mask = run.result.mask.data;
  const auto found = static_cast<double>(std::count(mask.begin(), mask.end(), 0));
  std::printf("%s: %dx%d, %d planes %g .. %g m, window %d: %.2f %% of the cells have a depth, %.2f s\n",
              o.engine.c_str(), setup.rig.width, setup.rig.height, setup.spacing.planes, setup.spacing.zmin,
              setup.spacing.zmax, setup.format.window, 100.0 * found / static_cast<double>(mask.size()), run.seconds);
  if (run.rtl) {
    const auto clocks = static_cast<double>(run.rtl->clocks_in_all);
    std::printf("configuration %s: %d tiles, %.3f M clocks = %.3f s at 166 MHz, %.3f s at 300 MHz\n",
                run.rtl->configuration.c_str(), run.tiles, clocks / 1e6, clocks / 166e6, clocks / 300e6);
  }
  if (run.link) print_link(*run.link, run.tiles);
}

}  // namespace

void depth_command(const DepthOptions& o) {
  const auto start = std::chrono::steady_clock::now();
  check_options(o);
  Input in = read_input(o);
  OutputDir out(o.output);
  if (in.calibration.raw) rectify(in);
  const SweepSetup setup = make_setup(o, in);
  EngineRun run = sweep(o, setup, in);
  if (o.cleanup) clean(o, setup, run.result);
  write_images(out, setup, in, run.result);
  RunRecord record = make_record(o, setup, in, run);
  record.json["seconds_in_all"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  write_record(out.file("report.json"), record);
  out.commit(output_names());
  if (o.quiet) return;
  print_summary(o, setup, run);
  std::printf("written: %s\n", out.target().c_str());
}

}  // namespace psweep
