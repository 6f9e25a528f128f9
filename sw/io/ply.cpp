// SPDX-License-Identifier: Apache-2.0
#include "io/ply.hpp"

#include <cstring>
#include <string>

#include "core/error.hpp"
#include "io/text_file.hpp"

namespace psweep {
namespace {

constexpr size_t kVertexBytes = 19;  // 3 floats, 3 bytes, 1 float

std::string header(size_t count) {
  return "ply\nformat binary_little_endian 1.0\n"
         "comment psweep: metres, cyclopean eye, X right, Y down, Z forward\n"
         "element vertex " +
         std::to_string(count) +
         "\nproperty float x\nproperty float y\nproperty float z\n"
         "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float confidence\nend_header\n";
}

uint32_t to_little(uint32_t v) {
#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
  return __builtin_bswap32(v);
#else
  return v;
#endif
}

void put_float(std::string& out, float value) {
  uint32_t v;
  std::memcpy(&v, &value, 4);
  v = to_little(v);
  out.append(reinterpret_cast<const char*>(&v), 4);
}

float get_float(const char* from) {
  uint32_t v;
  std::memcpy(&v, from, 4);
  v = to_little(v);
  float value;
  std::memcpy(&value, &v, 4);
  return value;
}

}  // namespace

void write_ply(const std::filesystem::path& path, const std::vector<CloudPoint>& points) {
  std::string bytes = header(points.size());
  bytes.reserve(bytes.size() + points.size() * kVertexBytes);
  for (const auto& p : points) {
    put_float(bytes, p.x);
    put_float(bytes, p.y);
    put_float(bytes, p.z);
    bytes.append(3, static_cast<char>(p.grey));
    put_float(bytes, p.confidence);
  }
  write_file(path, bytes);
}

std::vector<CloudPoint> read_ply(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  const std::string key = "element vertex ";
  const size_t at = bytes.find(key);
  const size_t count = at == std::string::npos ? 0 : std::strtoull(bytes.c_str() + at + key.size(), nullptr, 10);
  const std::string expected = header(count);
  if (bytes.compare(0, expected.size(), expected) != 0) {
    throw InputError(path.string() + ": field 'header': not a point cloud written by psweep");
  }
  if (bytes.size() - expected.size() != count * kVertexBytes) {
    throw InputError(path.string() + ": field 'element vertex': found " +
                     std::to_string(bytes.size() - expected.size()) + " bytes of vertices, expected " +
                     std::to_string(count * kVertexBytes));
  }
  std::vector<CloudPoint> points(count);
  const char* from = bytes.data() + expected.size();
  for (auto& p : points) {
    p.x = get_float(from);
    p.y = get_float(from + 4);
    p.z = get_float(from + 8);
    p.grey = static_cast<uint8_t>(from[12]);
    p.confidence = get_float(from + 15);
    from += kVertexBytes;
  }
  return points;
}

}  // namespace psweep
