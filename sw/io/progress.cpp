// SPDX-License-Identifier: Apache-2.0
#include "io/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace psweep {

std::string progress_line(const std::string& label, size_t done, size_t total, double seconds) {
  constexpr int kCells = 30;
  const double share = total ? std::min(1.0, static_cast<double>(done) / static_cast<double>(total)) : 0;
  const int filled = static_cast<int>(share * kCells);
  char text[64];
  if (share > 0) {
    const int left = static_cast<int>(seconds / share * (1 - share) + 0.5);
    std::snprintf(text, sizeof text, "] %3d %%  %d:%02d left", static_cast<int>(share * 100), left / 60, left % 60);
  } else {
    std::snprintf(text, sizeof text, "]   0 %%  -:-- left");
  }
  return label + " [" + std::string(filled, '#') + std::string(kCells - filled, '.') + text;
}

Progress::Progress(std::string label, bool quiet)
    : label_(std::move(label)),
      enabled_(!quiet && isatty(2)),
      start_(std::chrono::steady_clock::now()),
      last_(start_) {}

Progress::~Progress() {
  if (drawn_) std::fputs("\r\033[K", stderr);
}

void Progress::update(size_t done, size_t total) {
  if (!enabled_) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  const std::chrono::duration<double> used = now - start_, since = now - last_;
  if (used.count() < 1 || since.count() < 0.2) return;
  last_ = now;
  drawn_ = true;
  std::fprintf(stderr, "\r%s\033[K", progress_line(label_, done, total, used.count()).c_str());
  std::fflush(stderr);
}

}  // namespace psweep
