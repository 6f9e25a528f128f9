// SPDX-License-Identifier: Apache-2.0
// Deterministic randomness of the scene generator: integer hashes, a counter-based generator, and lattice noise.
// Only integer operations and + - * / on IEEE numbers, so values are the same everywhere.
#pragma once
#include <cstdint>

namespace psweep::scene {

// Finaliser of a 32-bit hash (xor-shift-multiply; full avalanche).
inline uint32_t mix(uint32_t h) {
  h ^= h >> 16;
  h *= 0x7feb352du;
  h ^= h >> 15;
  h *= 0x846ca68bu;
  h ^= h >> 16;
  return h;
}
inline uint32_t hash3(uint32_t seed, int x, int y, int z) {
  return mix(seed + static_cast<uint32_t>(x) * 0x9e3779b1u + static_cast<uint32_t>(y) * 0x85ebca77u +
             static_cast<uint32_t>(z) * 0xc2b2ae3du);
}

inline int floor_int(double x) {
  const int i = static_cast<int>(x);
  return i - (x < i);
}

// Sequence of uniform numbers (splitmix64).
class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed) {}
  uint32_t bits() {
    state_ += 0x9e3779b97f4a7c15u;
    uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return static_cast<uint32_t>((z ^ (z >> 31)) >> 32);
  }
  double uniform() { return bits() * (1.0 / 4294967296.0); }  // 0 <= u < 1
  double uniform(double lo, double hi) { return lo + (hi - lo) * uniform(); }

 private:
  uint64_t state_;
};

// Smooth lattice noise, mean 0, within -1 .. 1, standard deviation about 0.32 (2-D) and 0.27 (3-D); features of one
// unit.
inline float fade(float t) { return t * t * (3.0f - 2.0f * t); }
inline float corner(uint32_t h) { return static_cast<float>(static_cast<int32_t>(h)) * (1.0f / 2147483648.0f); }
inline float lerp(float a, float b, float t) { return a + (b - a) * t; }

inline float noise2(uint32_t seed, double x, double y) {
  const int xi = floor_int(x), yi = floor_int(y);
  const float u = fade(static_cast<float>(x - xi)), v = fade(static_cast<float>(y - yi));
  const float a = lerp(corner(hash3(seed, xi, yi, 0)), corner(hash3(seed, xi + 1, yi, 0)), u);
  const float b = lerp(corner(hash3(seed, xi, yi + 1, 0)), corner(hash3(seed, xi + 1, yi + 1, 0)), u);
  return lerp(a, b, v);
}

inline float noise3(uint32_t seed, double x, double y, double z) {
  const int xi = floor_int(x), yi = floor_int(y), zi = floor_int(z);
  const float u = fade(static_cast<float>(x - xi)), v = fade(static_cast<float>(y - yi));
  float layer[2];
  for (int k = 0; k < 2; ++k) {
    const float a = lerp(corner(hash3(seed, xi, yi, zi + k)), corner(hash3(seed, xi + 1, yi, zi + k)), u);
    const float b = lerp(corner(hash3(seed, xi, yi + 1, zi + k)), corner(hash3(seed, xi + 1, yi + 1, zi + k)), u);
    layer[k] = lerp(a, b, v);
  }
  return lerp(layer[0], layer[1], fade(static_cast<float>(z - zi)));
}

// Near-Gaussian number, mean 0, standard deviation 1, from one position: sum of eight 16-bit uniforms.
inline float gaussian(uint32_t seed, int x, int y) {
  int32_t sum = 0;
  for (int k = 0; k < 4; ++k) {
    const uint32_t h = hash3(seed, x, y, k);
    sum += static_cast<int32_t>(h & 0xffff) + static_cast<int32_t>(h >> 16);
  }
  // 8 uniforms on 0 .. 65535: mean 8 * 32767.5, variance 8 * 65536^2 / 12
  return (static_cast<float>(sum) - 262140.0f) * (1.0f / 53510.0f);
}

}  // namespace psweep::scene
