// SPDX-License-Identifier: Apache-2.0
// psweep_bench [name=value ...]: seconds per frame of the bit-true model, for every instruction set of this machine (or
// the one in the environment variable PSWEEP_SIMD). Names: size planes threads band_rows window interp_frac mncc_bits
// row_offset (pixels) focal_percent (right camera's longer focal length) runs; without any, the paper's rig and the
// default format. Images: noise smoothed over 5 pixels, the right one shifted by the disparity of a middle plane.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
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
  auto argument = [&](const char* name, int otherwise) {
    int value = otherwise;
    for (int i = 1; i < argc; ++i) {
      const size_t length = std::strlen(name);
      if (std::strncmp(argv[i], name, length) == 0 && argv[i][length] == '=') value = std::atoi(argv[i] + length + 1);
    }
    return value;
  };
  const int size = argument("size", 1120);
  psweep::SweepSetup setup;
  setup.rig.width = setup.rig.height = size;
  const double scale = size / 1120.0;
  setup.rig.left = setup.rig.right = {1200 * scale, 1200 * scale, (size - 1) / 2.0, (size - 1) / 2.0};
  setup.rig.baseline = 0.2;
  setup.rig.right.cy += argument("row_offset", 0) + (argument("row_offset", 0) != 0 ? 0.3 : 0.0);
  setup.rig.right.fx *= 1 + argument("focal_percent", 0) / 100.0;
  setup.spacing = {argument("planes", 301), 1.0, 4.0};
  setup.format.window = argument("window", setup.format.window);
  setup.format.interp_frac = argument("interp_frac", setup.format.interp_frac);
  setup.format.mncc_bits = argument("mncc_bits", setup.format.mncc_bits);
  setup.format.planes = 1024;
  setup.threshold = psweep::threshold_for(setup.format, 0.85);
  const psweep::Gray left = noise(size, 0), right = noise(size, static_cast<int>(60 * scale));
  const bool one = std::getenv("PSWEEP_SIMD") != nullptr;
  for (const auto level : one ? std::vector<psweep::SimdLevel>{psweep::best_simd_level()} : psweep::simd_levels()) {
    psweep::FastOptions options;
    options.level = level;
    options.threads = argument("threads", 1);
    options.band_rows = argument("band_rows", 0);
    double seconds = 1e9;
    psweep::Image<psweep::golden::MapCell> map;
    for (int run = 0; run < argument("runs", 1); ++run) {
      const auto start = std::chrono::steady_clock::now();
      map = psweep::run_fixed(left, right, setup, options);
      seconds = std::min(seconds, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
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
