// SPDX-License-Identifier: Apache-2.0
// Progress bar with time left on stderr. Silent if stderr is no terminal, if told so, and for the first second (so
// short runs print nothing). Thread-safe; calls with any order of `done` are fine.
#pragma once
#include <chrono>
#include <cstddef>
#include <mutex>
#include <string>

namespace psweep {

class Progress {
 public:
  Progress(std::string label, bool quiet);
  ~Progress();  // erases the bar
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void update(size_t done, size_t total);

 private:
  std::string label_;
  bool enabled_;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point start_, last_;
  std::mutex mutex_;
};

// "[#####.....]  52 %  0:41 left": exposed for its test. `seconds` is the time used so far.
std::string progress_line(const std::string& label, size_t done, size_t total, double seconds);

}  // namespace psweep
