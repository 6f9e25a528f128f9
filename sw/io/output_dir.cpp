// SPDX-License-Identifier: Apache-2.0
#include "io/output_dir.hpp"

#include <unistd.h>

#include "core/error.hpp"
#include "io/text_file.hpp"

namespace psweep {
namespace fs = std::filesystem;

OutputDir::OutputDir(fs::path target) : target_(std::move(target)) {
  if (!target_.empty() && !target_.has_filename()) target_ = target_.parent_path();  // "dir/" is "dir"
  if (target_.empty()) throw InputError("-o: empty name, expected a directory");
  std::error_code error;
  if (fs::exists(target_, error) && !fs::is_directory(target_, error)) {
    throw InputError(target_.string() + ": exists and is not a directory; choose another output directory");
  }
  if (fs::is_directory(target_, error) && access(target_.c_str(), W_OK) != 0) {
    throw InputError(target_.string() + ": cannot write into this directory");
  }
  partial_ = target_;
  partial_ += ".partial-" + std::to_string(getpid());
  make_partial();  // finds out whether it can be
  fs::remove(partial_, error);
  made_ = false;
}

void OutputDir::make_partial() {
  std::error_code error;
  fs::remove_all(partial_, error);
  if (!target_.parent_path().empty()) fs::create_directories(target_.parent_path(), error);
  if (!fs::create_directory(partial_, error)) {
    throw InputError(target_.string() + ": cannot create the output directory: " + error.message());
  }
  made_ = true;
}

fs::path OutputDir::file(const std::string& name) {
  if (!made_) make_partial();
  return partial_ / name;
}

OutputDir::~OutputDir() {
  std::error_code ignored;
  if (made_) fs::remove_all(partial_, ignored);
}

void OutputDir::commit(const std::vector<std::string>& stale) {
  if (!made_) make_partial();  // a run without files
  std::error_code error;
  if (!fs::exists(target_)) {
    fs::rename(partial_, target_, error);
    if (error) throw InputError(target_.string() + ": cannot rename the finished output: " + error.message());
    made_ = false;
    return;
  }
  for (const auto& name : stale) {
    if (!fs::exists(partial_ / name)) fs::remove(target_ / name, error);
  }
  for (const auto& entry : fs::directory_iterator(partial_)) {
    fs::rename(entry.path(), target_ / entry.path().filename(), error);
    if (error) throw InputError((target_ / entry.path().filename()).string() + ": cannot write: " + error.message());
  }
}

void replace_file(const fs::path& path, const std::string& bytes) {
  fs::path partial = path;
  partial += ".partial-" + std::to_string(getpid());
  std::error_code error;
  try {
    write_file(partial, bytes);
  } catch (...) {
    fs::remove(partial, error);
    throw;
  }
  fs::rename(partial, path, error);
  if (error) {
    const std::string why = error.message();
    fs::remove(partial, error);
    throw InputError(path.string() + ": cannot write: " + why);
  }
}

}  // namespace psweep
