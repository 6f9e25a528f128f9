// SPDX-License-Identifier: Apache-2.0
// report.json: what a run was and what it gave. `eval` and `report` take rig, planes and window from it.
#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/planes.hpp"
#include "core/rig.hpp"

namespace psweep {

struct RunRecord {
  Rig rig;
  PlaneSpacing spacing;
  int window = 13;
  bool metric = true;
  nlohmann::ordered_json json;  // everything; the members above are also in it, under "rig", "planes", ..
};

// Puts the members into the JSON and writes it, replacing an older file in one step.
void write_record(const std::filesystem::path& path, RunRecord record);
// Errors: InputError naming file and field.
RunRecord read_record(const std::filesystem::path& path);

// Every file that a run can write.
const std::vector<std::string>& output_names();

}  // namespace psweep
