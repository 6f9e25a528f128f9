// SPDX-License-Identifier: Apache-2.0
// psweep report: one HTML page with all pictures inside. If the runs hold a fixed and an rtl one, it compares their
// files byte for byte and says the result.
#include <cstdio>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "app/options.hpp"
#include "app/run_record.hpp"
#include "core/error.hpp"
#include "io/output_dir.hpp"
#include "io/pfm.hpp"
#include "io/picture.hpp"
#include "io/ply.hpp"
#include "io/text_file.hpp"

namespace psweep {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

struct Run {
  fs::path dir;
  RunRecord record;
  std::string engine() const { return record.json.value("engine", "?"); }
  bool cleaned() const {
    const ordered_json cleanup = record.json.value("cleanup", ordered_json::object());
    return cleanup.value("uniqueness", false) || cleanup.value("speckle", false);
  }
  std::string name() const { return engine() + (cleaned() ? ", cleaned up" : ""); }
};

std::string base64(const std::string& bytes) {
  static const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    unsigned v = 0;
    for (size_t k = 0; k < 3; ++k) v = v << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k) out += i + k <= bytes.size() ? kDigits[v >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

std::string escape(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else if (c == '"') {
      out += "&quot;";
    } else {
      out += c;
    }
  }
  return out;
}

std::string figure(const std::string& png, const std::string& caption) {
  return "<figure><img alt=\"" + escape(caption) + "\" src=\"data:image/png;base64," + base64(png) + "\"><figcaption>" +
         escape(caption) + "</figcaption></figure>\n";
}

std::string encode(const cv::Mat& picture) {
  std::vector<uint8_t> bytes;
  cv::imencode(".png", picture, bytes);
  return {bytes.begin(), bytes.end()};
}

std::string text(double value, const char* format) {
  char out[64];
  std::snprintf(out, sizeof out, format, value);
  return out;
}

// A number of report.json, or a dash.
std::string value(const Run& run, const std::string& pointer, const char* format, double factor = 1) {
  const ordered_json::json_pointer at("/" + pointer);
  if (!run.record.json.contains(at) || !run.record.json.at(at).is_number()) return "&ndash;";
  return text(run.record.json.at(at).get<double>() * factor, format);
}

// Names of the files that differ between two runs; empty: identical.
std::vector<std::string> differences(const Run& a, const Run& b, int& compared) {
  std::vector<std::string> out;
  for (const auto& name : output_names()) {
    const bool in_a = fs::exists(a.dir / name), in_b = fs::exists(b.dir / name);
    if (name == "report.json" || (!in_a && !in_b)) continue;
    ++compared;
    if (in_a != in_b || read_file(a.dir / name) != read_file(b.dir / name)) out.push_back(name);
  }
  return out;
}

struct Row {
  const char* label;
  const char* pointer;
  const char* format;
  double factor;
  const char* paper_rocky;  // Table 1 of the paper, psweep; nullptr: the paper has no such line
  const char* paper_flat;
};

const Row kMetrics[] = {
    {"M1: RMS error of the depths within 2 cm, mm", "metrics/M1_mm", "%.2f", 1, "7.50", "7.86"},
    {"M2.a: depths off by more than 2 cm, %", "metrics/M2a_percent", "%.2f", 1, "2.54", "3.94"},
    {"M2.b: RMS error of those, mm", "metrics/M2b_mm", "%.1f", 1, "102", "124"},
    {"M3: coverage, %", "metrics/M3_percent", "%.2f", 1, "98.57", "84.44"},
    {"M4: mean hole size, px", "metrics/M4_px", "%.1f", 1, "88", "102"},
    {"Consolidated RMS error, mm", "metrics/rms_mm", "%.2f", 1, "17.9", "25.9"},
    {"Pixels evaluated", "metrics/evaluated", "%.0f", 1, nullptr, nullptr},
    {"Matched, %", "metrics/matched_percent", "%.2f", 1, nullptr, nullptr},
    {"Bad (> 1 px) of the matched, %", "metrics/bad1_percent", "%.2f", 1, nullptr, nullptr},
    {"Bad (> 1 px) or unmatched, %", "metrics/bad1_all_percent", "%.2f", 1, nullptr, nullptr},
};
const Row kRunRows[] = {
    {"Planes", "planes", "%.0f", 1, "301", "301"},
    {"Window", "window", "%.0f", 1, "13", "13"},
    {"Cells with a depth", "cells/with_depth", "%.0f", 1, nullptr, nullptr},
    {"Wall time of the engine here, s", "seconds", "%.2f", 1, nullptr, nullptr},
    {"Tiles", "tiles/count", "%.0f", 1, nullptr, nullptr},
    {"Clocks in all, millions", "rtl/clocks_in_all", "%.3f", 1e-6, nullptr, nullptr},
    {"Time at 166 MHz, s", "rtl/seconds_at_166_MHz", "%.3f", 1, nullptr, nullptr},
    {"Time at 300 MHz, s", "rtl/seconds_at_300_MHz", "%.3f", 1, nullptr, nullptr},
    {"Simulation speed, million clocks/s", "rtl/simulated_clocks_per_second", "%.2f", 1e-6, nullptr, nullptr},
};

// Table with a column per run; the paper's columns only where some row has them and metrics in metres are shown.
template <size_t N>
std::string table(const Row (&rows)[N], const std::vector<Run>& runs, bool paper) {
  std::string out = "<table><tr><th></th>";
  for (const auto& run : runs) out += "<th>" + escape(run.name()) + "</th>";
  if (paper) out += "<th class=\"paper\">paper, rocky</th><th class=\"paper\">paper, flat</th>";
  out += "</tr>\n";
  for (const auto& row : rows) {
    std::string cells;
    bool any = false;
    for (const auto& run : runs) {
      const std::string v = value(run, row.pointer, row.format, row.factor);
      any = any || v != "&ndash;";
      cells += "<td>" + v + "</td>";
    }
    if (!any) continue;
    out += "<tr><th>" + escape(row.label) + "</th>" + cells;
    if (paper) {
      for (const char* v : {row.paper_rocky, row.paper_flat}) {
        out += "<td class=\"paper\">" + std::string(v ? v : "") + "</td>";
      }
    }
    out += "</tr>\n";
  }
  return out + "</table>\n";
}

constexpr const char* kStyle = R"(
body { font: 15px/1.5 system-ui, sans-serif; color: #24292f; background: #f6f7f8; margin: 0; }
main { max-width: 1240px; margin: 0 auto; padding: 24px; }
h1 { font-size: 26px; margin: 8px 0 4px; } h2 { font-size: 18px; margin: 32px 0 8px; }
p { margin: 4px 0 12px; max-width: 80ch; }
.row { display: grid; grid-template-columns: repeat(auto-fit, minmax(260px, 1fr)); gap: 16px; align-items: start; }
figure { margin: 0; background: #fff; border: 1px solid #d8dde3; border-radius: 8px; padding: 10px; }
figure img { width: 100%; height: auto; display: block; }
figcaption { font-size: 13px; color: #57606a; margin-top: 8px; }
table { border-collapse: collapse; background: #fff; border: 1px solid #d8dde3; }
th, td { padding: 6px 14px; text-align: right; border-bottom: 1px solid #e6e9ed; font-variant-numeric: tabular-nums; }
th { font-weight: 600; } tr th:first-child { text-align: left; font-weight: 400; }
.paper { color: #6e7781; background: #fafbfc; }
.verdict { padding: 10px 14px; border-radius: 8px; border: 1px solid; max-width: none; font-weight: 600; }
.same { background: #e6f6ea; border-color: #9bd3a9; } .differ { background: #fdeaea; border-color: #e39a9a; }
)";

}  // namespace

void report_command(const ReportOptions& o) {
  std::vector<Run> runs;
  for (const auto& dir : o.runs) {
    if (!fs::is_directory(dir))
      throw InputError(dir + ": not a directory, expected an output directory of psweep depth");
    runs.push_back({dir, read_record(fs::path(dir) / "report.json")});
  }
  const Run& first = runs.front();
  const double fb = first.record.rig.cyclopean().fx * first.record.rig.baseline;
  std::ostringstream page;
  page << "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" << escape(o.title)
       << "</title><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><style>" << kStyle
       << "</style></head><body><main>\n<h1>" << escape(o.title) << "</h1>\n";
  if (!o.reference.empty()) page << "<p>" << escape(o.reference) << "</p>\n";

  const Run *fixed = nullptr, *rtl = nullptr;
  for (const auto& run : runs) {
    if (run.engine() == "rtl" && !rtl) rtl = &run;
  }
  for (const auto& run : runs) {
    if (rtl && run.engine() == "fixed" && run.cleaned() == rtl->cleaned() && !fixed) fixed = &run;
  }
  if (fixed && rtl) {
    int compared = 0;
    const auto differ = differences(*fixed, *rtl, compared);
    if (compared == 0) throw InputError(rtl->dir.string() + ": no files to compare with " + fixed->dir.string());
    if (differ.empty()) {
      page << "<p class=\"verdict same\">The simulated hardware and the bit-true model wrote the same bytes in all "
           << compared << " files.</p>\n";
    } else {
      page << "<p class=\"verdict differ\">Hardware and bit-true model differ in:";
      for (const auto& name : differ) page << " " << name;
      page << "</p>\n";
    }
  }

  page << "<div class=\"row\">\n";
  if (!o.input.empty()) page << figure(read_file(o.input), "input: left image");
  if (!o.truth.empty()) {
    page << figure(encode(depth_picture(read_pfm(o.truth), first.record.spacing, first.record.metric, fb)),
                   "ground truth");
  }
  page << "</div>\n<h2>Depth</h2>\n<div class=\"row\">\n";
  for (const auto& run : runs) page << figure(read_file(run.dir / "depth.png"), run.name());
  page << "</div>\n";
  bool errors = false;
  for (const auto& run : runs) errors = errors || fs::exists(run.dir / "error.png");
  if (errors) {
    page << "<h2>Error against ground truth</h2>\n<p>Blue: no depth found. Light grey: not evaluated (no truth, or the "
            "window leaves an image).</p>\n<div "
            "class=\"row\">\n";
    for (const auto& run : runs) {
      if (fs::exists(run.dir / "error.png")) page << figure(read_file(run.dir / "error.png"), run.name());
    }
    page << "</div>\n";
  }
  page << "<h2>Point cloud</h2>\n<div class=\"row\">\n";
  const Run& shown = runs.back();  // the others look alike
  const auto cloud = read_ply(shown.dir / "cloud.ply");
  page << figure(encode(cloud_picture(cloud, shown.record.spacing, 1100, 620)),
                 shown.name() + ": cloud.ply, " + std::to_string(cloud.size()) +
                     " points seen from above and the left, tinted by depth");
  page << "</div>\n";
  bool metric = false;
  bool any = false;
  for (const auto& run : runs) {
    any = any || run.record.json.contains("metrics");
    metric = metric || run.record.json.contains(ordered_json::json_pointer("/metrics/M1_mm"));
  }
  if (any) {
    page << "<h2>Accuracy</h2>\n";
    if (metric) {
      page << "<p>The paper's figures are Table 1 of Lentaris et al., ACM TECS 18(2):16, 2019, for 1120x1120 images, a "
              "focal "
              "length of 1200 px and 301 planes, on its own scenes.";
      const double fx = first.record.rig.cyclopean().fx;
      if (fx < 1100) {
        page << " This run has " << text(fx, "%.0f") << " px: the same error in pixels is " << text(1200 / fx, "%.1f")
             << " times as many millimetres, so only a run at full size compares like with like.";
      }
      page << "</p>\n";
    }
    page << table(kMetrics, runs, metric);
  }
  page << "<h2>Run</h2>\n" << table(kRunRows, runs, false);
  if (rtl) {
    page
        << "<p>Clocks include image load, map unload, registers and plane table. Times are clocks divided by the clock "
           "rate, not measured on a device.</p>\n";
  }
  page << "</main></body></html>\n";
  replace_file(o.output, page.str());
  std::printf("written: %s\n", o.output.c_str());
}

}  // namespace psweep
