// SPDX-License-Identifier: Apache-2.0
#include "io/pfm.hpp"

#include <cmath>
#include <cstdlib>
#include <cstring>

#include "core/error.hpp"
#include "io/text_file.hpp"

namespace psweep {
namespace {

constexpr int kMaxSide = 65535;

uint32_t to_little(uint32_t v) {
#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
  return __builtin_bswap32(v);
#else
  return v;
#endif
}

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& field, const std::string& what) {
  throw InputError(path.string() + ": field '" + field + "': " + what);
}

// One white-space separated word of the header; the single blank after it is consumed too.
std::string word(const std::string& bytes, size_t& at) {
  while (at < bytes.size() && std::isspace(static_cast<unsigned char>(bytes[at]))) ++at;
  const size_t from = at;
  while (at < bytes.size() && !std::isspace(static_cast<unsigned char>(bytes[at])) && at - from < 64) ++at;
  return bytes.substr(from, at++ - from);
}

int side(const std::filesystem::path& path, const std::string& field, const std::string& text) {
  char* end = nullptr;
  const long value = std::strtol(text.c_str(), &end, 10);
  if (text.empty() || *end || value < 1 || value > kMaxSide) {
    fail(path, field, "found '" + text + "', expected an integer 1 .. " + std::to_string(kMaxSide));
  }
  return static_cast<int>(value);
}

}  // namespace

FloatImage read_pfm(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  size_t at = 0;
  const std::string magic = word(bytes, at);
  if (magic == "PF") fail(path, "magic", "found 'PF' (three channels), expected 'Pf' (one channel)");
  if (magic != "Pf") fail(path, "magic", "expected 'Pf'; this is not a PFM file");
  const int width = side(path, "width", word(bytes, at));
  const int height = side(path, "height", word(bytes, at));
  const std::string scale_text = word(bytes, at);
  char* end = nullptr;
  const double scale = std::strtod(scale_text.c_str(), &end);
  if (scale_text.empty() || *end || scale == 0 || !std::isfinite(scale)) {
    fail(path, "scale", "found '" + scale_text + "', expected a number other than 0");
  }
  const size_t need = static_cast<size_t>(width) * height * 4;
  const size_t have = bytes.size() > at ? bytes.size() - at : 0;
  if (have != need) {
    fail(path, "pixels",
         "found " + std::to_string(have) + " bytes, expected " + std::to_string(need) + " for " +
             std::to_string(width) + "x" + std::to_string(height));
  }
  FloatImage out(width, height);
  for (int y = height - 1; y >= 0; --y) {
    for (int x = 0; x < width; ++x, at += 4) {
      uint32_t v;
      std::memcpy(&v, bytes.data() + at, 4);
      v = to_little(v);
      if (scale > 0) v = __builtin_bswap32(v);
      std::memcpy(&out.at(x, y), &v, 4);
    }
  }
  return out;
}

void write_pfm(const std::filesystem::path& path, const FloatImage& image) {
  std::string bytes = "Pf\n" + std::to_string(image.width) + " " + std::to_string(image.height) + "\n-1.0\n";
  bytes.reserve(bytes.size() + image.data.size() * 4);
  for (int y = image.height - 1; y >= 0; --y) {
    for (int x = 0; x < image.width; ++x) {
      uint32_t v;
      std::memcpy(&v, &image.at(x, y), 4);
      v = to_little(v);
      bytes.append(reinterpret_cast<const char*>(&v), 4);
    }
  }
  write_file(path, bytes);
}

}  // namespace psweep
