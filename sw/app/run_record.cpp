// SPDX-License-Identifier: Apache-2.0
#include "app/run_record.hpp"

#include "core/error.hpp"
#include "io/output_dir.hpp"
#include "io/text_file.hpp"

namespace psweep {
namespace {

using nlohmann::ordered_json;

ordered_json camera_json(const Camera& c) { return {{"fx", c.fx}, {"fy", c.fy}, {"cx", c.cx}, {"cy", c.cy}}; }

double number(const std::string& file, const ordered_json& in, const std::string& pointer) {
  const ordered_json::json_pointer at("/" + pointer);
  if (!in.contains(at) || !in.at(at).is_number()) {
    throw InputError(file + ": field '" + pointer + "': found " + (in.contains(at) ? in.at(at).dump() : "nothing") +
                     ", expected a number");
  }
  return in.at(at).get<double>();
}

}  // namespace

void write_record(const std::filesystem::path& path, RunRecord record) {
  ordered_json& j = record.json;
  j["rig"] = {{"width", record.rig.width},
              {"height", record.rig.height},
              {"baseline", record.rig.baseline},
              {"left", camera_json(record.rig.left)},
              {"right", camera_json(record.rig.right)}};
  j["planes"] = record.spacing.planes;
  j["zmin"] = record.spacing.zmin;
  j["zmax"] = record.spacing.zmax;
  j["window"] = record.window;
  j["metric"] = record.metric;
  replace_file(path, j.dump(2) + "\n");
}

RunRecord read_record(const std::filesystem::path& path) {
  RunRecord out;
  const std::string text = read_file(path), file = path.string();
  try {
    out.json = ordered_json::parse(text);
  } catch (const ordered_json::exception& e) {
    throw InputError(file + ": not JSON: " + e.what());
  }
  const auto camera = [&](const std::string& at) {
    return Camera{number(file, out.json, at + "/fx"), number(file, out.json, at + "/fy"),
                  number(file, out.json, at + "/cx"), number(file, out.json, at + "/cy")};
  };
  out.rig.left = camera("rig/left");
  out.rig.right = camera("rig/right");
  out.rig.baseline = number(file, out.json, "rig/baseline");
  out.rig.width = static_cast<int>(number(file, out.json, "rig/width"));
  out.rig.height = static_cast<int>(number(file, out.json, "rig/height"));
  out.spacing.planes = static_cast<int>(number(file, out.json, "planes"));
  out.spacing.zmin = number(file, out.json, "zmin");
  out.spacing.zmax = number(file, out.json, "zmax");
  out.window = static_cast<int>(number(file, out.json, "window"));
  out.metric = out.json.value("metric", true);
  return out;
}

const std::vector<std::string>& output_names() {
  static const std::vector<std::string> names = {
      "depth.pfm",           "mncc.pfm",  "disparity.pfm", "mask.png",           "depth.png",
      "error.png",           "cloud.ply", "report.json",   "rectified_left.png", "rectified_right.png",
      "rectified_calib.yaml"};
  return names;
}

}  // namespace psweep
