// SPDX-License-Identifier: Apache-2.0
// OutputDir: all files of a run or none. They are written into a temporary sibling of the target ("DIR.partial-PID"),
// which commit() renames; without commit() (an exception) it is removed and the target stays as it was. The sibling is
// made by the first call of file(), so a long computation that is interrupted before leaves nothing behind.
// Into a target that exists already, commit() renames file by file and removes `stale` names that this run did not
// write, so that files of two runs never stand side by side.
// Errors: InputError in the constructor if the target is a file, or its parent is missing or not writable: before any
// long computation.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace psweep {

class OutputDir {
 public:
  explicit OutputDir(std::filesystem::path target);
  ~OutputDir();
  OutputDir(const OutputDir&) = delete;
  OutputDir& operator=(const OutputDir&) = delete;

  std::filesystem::path file(const std::string& name);  // where to write this file
  const std::filesystem::path& target() const { return target_; }
  void commit(const std::vector<std::string>& stale = {});

 private:
  void make_partial();
  std::filesystem::path target_, partial_;
  bool made_ = false;
};

// One file, likewise: written beside the target, then renamed over it.
void replace_file(const std::filesystem::path& path, const std::string& bytes);

}  // namespace psweep
