// SPDX-License-Identifier: Apache-2.0
#include "io/text_file.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "core/error.hpp"

namespace psweep {

std::string read_file(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    throw InputError(path.string() + ": is a directory, expected a file");
  }
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  if (in) text << in.rdbuf();
  if (!in || in.bad()) {
    throw InputError(path.string() + ": cannot read: " + (errno ? std::strerror(errno) : "input error"));
  }
  return text.str();
}

void write_file(const std::filesystem::path& path, const std::string& bytes) {
  errno = 0;
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();  // before the check: a full disk may show only here
  if (!out) throw InputError(path.string() + ": cannot write: " + (errno ? std::strerror(errno) : "output error"));
}

}  // namespace psweep
