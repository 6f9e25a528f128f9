// SPDX-License-Identifier: Apache-2.0
// Image<T>: row-major picture without padding, (0,0) top left, integer coordinates at pixel centres.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace psweep {

template <class T>
struct Image {
  int width = 0;
  int height = 0;
  std::vector<T> data;  // width * height values, row by row

  Image() = default;
  Image(int w, int h, T fill = T{}) : width(w), height(h), data(static_cast<size_t>(w) * h, fill) {}
  T& at(int x, int y) { return data[static_cast<size_t>(y) * width + x]; }
  const T& at(int x, int y) const { return data[static_cast<size_t>(y) * width + x]; }
  T* row(int y) { return data.data() + static_cast<size_t>(y) * width; }
  const T* row(int y) const { return data.data() + static_cast<size_t>(y) * width; }
  bool empty() const { return data.empty(); }
};

using Gray = Image<uint8_t>;
using FloatImage = Image<float>;

}  // namespace psweep
