// SPDX-License-Identifier: Apache-2.0
// Whole files in one go. Errors: InputError that names the file and says why (missing, a directory, not readable,
// disk full).
#pragma once
#include <filesystem>
#include <string>

namespace psweep {

std::string read_file(const std::filesystem::path& path);
void write_file(const std::filesystem::path& path, const std::string& bytes);

}  // namespace psweep
