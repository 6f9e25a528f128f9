// SPDX-License-Identifier: Apache-2.0
// Options of the subcommands as the user gave them; an empty optional takes its default from the calibration or the
// configuration. Ranges are checked by the parser (main.cpp), combinations by the commands.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/calibration.hpp"

namespace psweep {

struct DepthOptions {
  std::string left, right, output;
  std::string calibration;      // file, or
  std::string disparity_range;  // "LO:HI"
  Rectify rectify = Rectify::kAuto;
  std::string engine = "fixed";
  std::optional<int> planes, window, interp_bits, mncc_bits, frac_bits, weight_bits;
  std::optional<double> zmin, zmax;
  double threshold = 0.85;
  std::string tile;           // "WxH" or empty
  std::string configuration;  // name or empty
  int threads = 0;            // 0: one per core
  bool cleanup = false, no_uniqueness = false, no_speckle = false;
  int in_flight = 2;         // udp: tiles
  double link_timeout = 10;  // udp: seconds
  bool quiet = false;
};

struct InfoOptions {
  std::string target;  // udp://HOST[:PORT]
  double link_timeout = 10;
  bool json = false;
};

struct BenchLinkOptions {
  std::string target;
  double seconds = 2;  // of each of the four measurements
  double link_timeout = 10;
  bool json = false;
};

struct RenderOptions {
  std::string kind = "rocky", output;
  uint64_t seed = 1;
  int size = 1120;
  int threads = 0;
  bool quiet = false;
};

struct EvalOptions {
  std::string depth, truth;  // depth: output directory of `depth`, or depth.pfm, or disparity.pfm
  std::string calibration, mask;
  std::optional<double> scale;  // disparity truth: grey values per pixel
  std::optional<int> planes, window;
  std::optional<double> zmin, zmax;
  bool json = false;
};

struct ReportOptions {
  std::vector<std::string> runs;  // output directories of `depth`
  std::string output, title = "psweep", input, truth, reference;
};

// Each throws InputError (exit code 2); what they print goes to stdout.
void depth_command(const DepthOptions& options);
void render_command(const RenderOptions& options);
void eval_command(const EvalOptions& options);
void report_command(const ReportOptions& options);
void info_command(const InfoOptions& options);
void bench_link_command(const BenchLinkOptions& options);

}  // namespace psweep
