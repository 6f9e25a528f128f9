// SPDX-License-Identifier: Apache-2.0
// psweep_bench [size] [planes] [threads] [band_rows]: seconds per frame of the bit-true model on the paper's rig, for
// every instruction set of this machine. Images: noise smoothed over 5 pixels, the right one shifted by 60 (arithmetic
// takes the same time whatever the content, but for the parabola's branch).
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "fast/fast.hpp"

namespace {

psweep::Gray noise(int size, int shift) {
  psweep::Gray rough(size, size), smooth(size, size);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      uint32_t h = static_cast<uint32_t>(x + shift) * 2654435761u ^ static_cast<uint32_t>(y) * 2246822519u;
      h = (h ^ (h >> 15)) * 2654435761u;
      rough.at(x, y) = static_cast<uint8_t>(h >> 24);
    }
  }
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      int sum = 0;
      for (int i = 0; i < 5; ++i) sum += rough.at(std::min(x + i, size - 1), y);
      smooth.at(x, y) = static_cast<uint8_t>(sum / 5);
    }
  }
  return smooth;
}

}  // namespace

int main(int argc, char** argv) try {
  auto argument = [&](int i, int otherwise) { return argc > i ? std::atoi(argv[i]) : otherwise; };
  const int size = argument(1, 1120);
  psweep::SweepSetup setup;
  setup.rig.width = setup.rig.height = size;
  const double scale = size / 1120.0;
  setup.rig.left = setup.rig.right = {1200 * scale, 1200 * scale, (size - 1) / 2.0, (size - 1) / 2.0};
  setup.rig.baseline = 0.2;
  setup.spacing = {argument(2, 301), 1.0, 4.0};
  setup.format.planes = 1024;
  setup.threshold = psweep::threshold_for(setup.format, 0.85);
  const psweep::Gray left = noise(size, 0), right = noise(size, static_cast<int>(60 * scale));
  for (const auto level : psweep::simd_levels()) {
    psweep::FastOptions options;
    options.level = level;
    options.threads = argument(3, 1);
    options.band_rows = argument(4, 0);
    const auto start = std::chrono::steady_clock::now();
    const auto map = psweep::run_fixed(left, right, setup, options);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    uint64_t sum = 0;
    for (const auto& cell : map.data) sum = sum * 31 + cell.plane * 7u + cell.frac * 5u + cell.v * 3u + cell.mask;
    std::printf("%-7s %dx%dx%d, %d thread(s): %.3f s, map %016llx\n", psweep::simd_name(level), size, size,
                setup.spacing.planes, options.threads, seconds, static_cast<unsigned long long>(sum));
  }
  return 0;
} catch (const std::exception& e) {
  std::fprintf(stderr, "psweep_bench: %s\n", e.what());
  return 2;
}
