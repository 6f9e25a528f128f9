// SPDX-License-Identifier: Apache-2.0
// psweep: the command line (docs/command_line.md).
// Exit codes: 0 good; 2 wrong option or input, one line on stderr that names file and field; 1 everything else.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <string>

#include "app/options.hpp"
#include "core/error.hpp"
#include "io/image_io.hpp"
#include "net/client.hpp"
#include "net/udp_transport.hpp"

namespace psweep {
namespace {

template <class T>
void optional_option(CLI::App* app, const std::string& name, std::optional<T>& target, const std::string& help,
                     const CLI::Validator& check) {
  app->add_option(name, target, help)->check(check);
}

// "AxB" or "A:B" of two numbers.
CLI::Validator shape(const char separator, const std::string& form) {
  return CLI::Validator(
      [separator, form](std::string& text) {
        const size_t at = text.find(separator);
        auto number = [](const std::string& part) {
          char* end = nullptr;
          const double v = std::strtod(part.c_str(), &end);
          return !part.empty() && !*end && v > 0 && v <= 65535;
        };
        const bool good = at != std::string::npos && number(text.substr(0, at)) && number(text.substr(at + 1)) &&
                          text.find_first_not_of("0123456789.x:") == std::string::npos &&
                          (separator == ':' || text.find('.') == std::string::npos);
        return good ? std::string() : "found '" + text + "', expected " + form;
      },
      form);
}

const CLI::Validator kOddWindow(
    [](std::string& text) {
      char* end = nullptr;
      const long v = std::strtol(text.c_str(), &end, 10);
      const bool good = !text.empty() && !*end && v >= 3 && v <= 21 && v % 2 == 1;
      return good ? std::string() : "found '" + text + "', expected an odd number 3 .. 21";
    },
    "ODD 3..21");

// An engine of this program, or the address of a chip.
const CLI::Validator kEngine(
    [](std::string& text) {
      if (text == "float" || text == "fixed" || text == "rtl") return std::string();
      try {
        net::parse_endpoint("", text);
        return std::string();
      } catch (const InputError&) {
        return "found '" + text + "', expected float, fixed, rtl or udp://HOST[:PORT]";
      }
    },
    "{float,fixed,rtl,udp://HOST[:PORT]}");

const CLI::Validator kChip(
    [](std::string& text) {
      try {
        net::parse_endpoint("", text);
        return std::string();
      } catch (const InputError&) {
        return "found '" + text + "', expected udp://HOST[:PORT]";
      }
    },
    "udp://HOST[:PORT]");

const CLI::Validator kSeconds = CLI::Range(0.1, 3600.0);

const CLI::Validator kPositive = CLI::Range(1e-6, 1e9);

void add_depth(CLI::App& app, DepthOptions& o) {
  auto* c = app.add_subcommand("depth", "Depth map, point cloud and report from a stereo pair");
  c->add_option("LEFT", o.left, "Left image: 8-bit PNG, PGM, PPM or TIFF")->required();
  c->add_option("RIGHT", o.right, "Right image, same size")->required();
  auto* calib =
      c->add_option("--calib", o.calibration, "Calibration: psweep YAML, OpenCV P1/P2, Q or K D R T, calib.txt");
  c->add_option("--disparity-range", o.disparity_range,
                "Instead of --calib: rectified pair, search these disparities (pixels); depths are relative")
      ->check(shape(':', "LO:HI, pixels, 0 < LO < HI"))
      ->excludes(calib);
  c->add_option("--rectify", o.rectify, "Rectify first? auto decides by what the calibration holds")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, Rectify>{{"auto", Rectify::kAuto}, {"yes", Rectify::kYes}, {"no", Rectify::kNo}}));
  c->add_option("-o,--output", o.output, "Directory for the results")->required();
  c->add_option("--engine", o.engine,
                "float: reference; fixed: bit-true model; rtl: simulated hardware; udp: a chip on the network")
      ->check(kEngine)
      ->capture_default_str();
  c->add_option("--in-flight", o.in_flight, "udp: tiles in work at once; 2 sends one while another is swept")
      ->check(CLI::Range(1, 2))
      ->capture_default_str();
  c->add_option("--link-timeout", o.link_timeout, "udp: give up after so many seconds without any answer")
      ->check(kSeconds)
      ->capture_default_str();
  optional_option(c, "--planes", o.planes, "Number of planes (default 301, or from the disparity range)",
                  CLI::Range(3, 1024));
  optional_option(c, "--zmin", o.zmin, "Nearest plane, metres (default 1, or from the disparity range)", kPositive);
  optional_option(c, "--zmax", o.zmax, "Farthest plane, metres (default 4, or from the disparity range)", kPositive);
  optional_option(c, "--window", o.window, "Window side M in cells (default 13)", kOddWindow);
  c->add_option("--threshold", o.threshold, "Smallest accepted correlation")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  c->add_option("--tile", o.tile, "Largest tile; results do not depend on it")->check(shape('x', "WxH, cells"));
  optional_option(c, "--interp-bits", o.interp_bits, "Fraction bits of an interpolated pixel (default 2)",
                  CLI::Range(0, 8));
  optional_option(c, "--mncc-bits", o.mncc_bits, "Bits of the correlation (default 13)", CLI::Range(4, 16));
  optional_option(c, "--frac-bits", o.frac_bits, "Bits of the depth fraction (default 8)", CLI::Range(2, 12));
  optional_option(c, "--weight-bits", o.weight_bits, "Fraction bits of a sample position (default 8)",
                  CLI::Range(1, 12));
  c->add_option("--config", o.configuration, "Take window, formats and size limits of a built RTL configuration");
  c->add_option("--threads", o.threads, "Threads; 0: one per core. Results do not depend on it")
      ->check(CLI::Range(0, 256));
  c->add_flag("--cleanup", o.cleanup, "Remove doubtful depths: uniqueness test and speckle filter");
  c->add_flag("--no-uniqueness", o.no_uniqueness, "With --cleanup: no uniqueness test");
  c->add_flag("--no-speckle", o.no_speckle, "With --cleanup: no speckle filter");
  c->add_flag("-q,--quiet", o.quiet, "No progress bar, no summary");
  c->footer(
      "Examples:\n"
      "  psweep depth left.png right.png --calib calib.yaml -o out\n"
      "  psweep depth left.png right.png --calib calib.yaml -o out_rtl --engine rtl --config tile --planes 101\n"
      "  psweep depth left.png right.png --calib calib.yaml -o out_chip --engine udp://192.168.1.80\n"
      "  psweep depth im0.png im1.png --calib calib.txt -o out --cleanup\n"
      "  psweep depth im3.png im4.png --disparity-range 2:16 -o out\n");
  c->callback([&o] { depth_command(o); });
}

void add_render(CLI::App& app, RenderOptions& o) {
  auto* c = app.add_subcommand("render", "Synthetic Mars-like stereo pair with calibration and ground truth");
  c->add_option("--kind", o.kind, "Terrain")->check(CLI::IsMember({"rocky", "flat"}))->capture_default_str();
  c->add_option("--seed", o.seed, "Seed; the same seed gives the same bytes everywhere")->capture_default_str();
  c->add_option("--size", o.size, "Side of the images in pixels; the rig is scaled along")
      ->check(CLI::Range(64, 2240))
      ->capture_default_str();
  c->add_option("-o,--output", o.output, "Directory for the results")->required();
  c->add_option("--threads", o.threads, "Threads; 0: one per core. Results do not depend on it")
      ->check(CLI::Range(0, 256));
  c->add_flag("-q,--quiet", o.quiet, "No progress bar, no summary");
  c->footer("Example:\n  psweep render --kind rocky --seed 1 --size 1120 -o scene\n");
  c->callback([&o] { render_command(o); });
}

void add_eval(CLI::App& app, EvalOptions& o) {
  auto* c = app.add_subcommand("eval", "Accuracy of a depth or disparity map against ground truth");
  c->add_option("DEPTH", o.depth, "Output directory of `depth` (its report.json gets the metrics), or a PFM file")
      ->required();
  c->add_option("TRUTH", o.truth, "truth.pfm in metres (cyclopean eye), or a disparity PNG of the left image")
      ->required();
  c->add_option("--calib", o.calibration, "Calibration, if DEPTH is a single file");
  optional_option(c, "--scale", o.scale, "Disparity PNG: grey values per pixel of disparity (0 = unknown)", kPositive);
  c->add_option("--mask", o.mask, "Disparity PNG: evaluate only where this image is 255 (e.g. nonocc.png)");
  optional_option(c, "--planes", o.planes, "If DEPTH is a single file: planes (default 301)", CLI::Range(3, 1024));
  optional_option(c, "--zmin", o.zmin, "If DEPTH is a single file: nearest plane, metres (default 1)", kPositive);
  optional_option(c, "--zmax", o.zmax, "If DEPTH is a single file: farthest plane, metres (default 4)", kPositive);
  optional_option(c, "--window", o.window, "If DEPTH is a single file: window side (default 13)", kOddWindow);
  c->add_flag("--json", o.json, "Print JSON");
  c->footer(
      "Examples:\n"
      "  psweep eval out scene/truth.pfm\n"
      "  psweep eval out/depth.pfm scene/truth.pfm --calib scene/calib.yaml --json\n"
      "  psweep eval out_teddy groundtruth.png --scale 4 --mask nonocc.png\n");
  c->callback([&o] { eval_command(o); });
}

void add_report(CLI::App& app, ReportOptions& o) {
  auto* c = app.add_subcommand("report", "One-page HTML report of one or more output directories of `depth`");
  c->add_option("RUN", o.runs, "Output directories, one column each")->required();
  c->add_option("-o,--output", o.output, "HTML file; pictures are inside")->required();
  c->add_option("--title", o.title, "Heading")->capture_default_str();
  c->add_option("--input", o.input, "Picture of the input (left image)");
  c->add_option("--truth", o.truth, "truth.pfm, shown with the colours of the first run");
  c->add_option("--note", o.reference, "A sentence under the heading");
  c->footer(
      "Example:\n  psweep report out_float out_fixed out_rtl -o report.html --input scene/left.png --truth "
      "scene/truth.pfm\n");
  c->callback([&o] { report_command(o); });
}

void add_info(CLI::App& app, InfoOptions& o) {
  auto* c = app.add_subcommand("info", "Capabilities, state and counters of a chip on the network");
  c->add_option("CHIP", o.target, "udp://HOST[:PORT]")->required()->check(kChip);
  c->add_option("--link-timeout", o.link_timeout, "Give up after so many seconds without any answer")
      ->check(kSeconds)
      ->capture_default_str();
  c->add_flag("--json", o.json, "Print JSON");
  c->footer("Example:\n  psweep info udp://192.168.1.80\n");
  c->callback([&o] { info_command(o); });
}

void add_bench_link(CLI::App& app, BenchLinkOptions& o) {
  auto* c = app.add_subcommand("bench-link", "Goodput and latency of the link to a chip (which must be free)");
  c->add_option("CHIP", o.target, "udp://HOST[:PORT]")->required()->check(kChip);
  c->add_option("--seconds", o.seconds, "Length of each of the four measurements")
      ->check(kSeconds)
      ->capture_default_str();
  c->add_option("--link-timeout", o.link_timeout, "Give up after so many seconds without any answer")
      ->check(kSeconds)
      ->capture_default_str();
  c->add_flag("--json", o.json, "Print JSON");
  c->footer("Example:\n  psweep bench-link udp://192.168.1.80 --seconds 5\n");
  c->callback([&o] { bench_link_command(o); });
}

int run(int argc, char** argv) {
  silence_opencv();
  CLI::App app(
      "Plane-sweep stereo: depth maps by the float reference, the bit-true model, the simulated hardware or a chip.");
  app.set_version_flag("--version", std::string("psweep ") + PSWEEP_VERSION);
  app.require_subcommand(1);
  app.footer(
      "`psweep COMMAND --help` explains a command. Formats: docs/file_formats.md\n"
      "Exit codes: 0 good, 2 wrong option or input, 1 link or internal error.\n");
  DepthOptions depth;
  RenderOptions render;
  EvalOptions eval;
  ReportOptions report;
  InfoOptions info;
  BenchLinkOptions bench_link;
  add_depth(app, depth);

  add_render(app, render);
  add_eval(app, eval);
  add_report(app, report);
  add_info(app, info);
  add_bench_link(app, bench_link);
  try {
    // CLI11 itself would only say that a subcommand is missing.
    if (argc > 1 && argv[1][0] != '-' &&
        app.get_subcommands([&](CLI::App* c) { return c->get_name() == argv[1]; }).empty()) {
      throw InputError("unknown command '" + std::string(argv[1]) +
                       "', expected depth, render, eval, report, info or bench-link");
    }
    app.parse(argc, argv);
    return 0;
  } catch (const CLI::Success& e) {  // --help, --version
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    std::fprintf(stderr, "psweep: %s\nSee psweep %s--help\n", e.what(),
                 app.get_subcommands().empty() ? "" : (app.get_subcommands().front()->get_name() + " ").c_str());
    return 2;
  } catch (const InputError& e) {
    std::fprintf(stderr, "psweep: %s\n", e.what());
    return 2;
  } catch (const net::LinkError& e) {
    std::fprintf(stderr, "psweep: %s\n", e.what());
    return 1;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "psweep: out of memory\n");
    return 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "psweep: internal error: %s\n", e.what());
    return 1;
  }
}

}  // namespace
}  // namespace psweep

int main(int argc, char** argv) { return psweep::run(argc, argv); }
