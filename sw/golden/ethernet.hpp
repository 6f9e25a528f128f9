// SPDX-License-Identifier: Apache-2.0
// Numbers of IEEE 802.3 that both MAC models use, and the frame check sequence by the text of 3.2.9: polynomial
// division of the bits in the order of transmission, with the first 32 complemented. Bit by bit and not reflected, so
// that it shares nothing with the RTL's nibble steps.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace psweep::golden {

constexpr int kMinFrameWithFcs = 64, kMaxFrameWithFcs = 1518;  // bytes
constexpr int kPreambleNibbles = 15;                           // 5; then one D
constexpr int kGapNibbles = 24;                                // inter-frame gap, 96 bit times
constexpr int kGapFirstPart = 16;                              // carrier restarts the gap in its first two thirds
constexpr int kJamNibbles = 8;
constexpr int kSlotNibbles = 128;  // 512 bit times; collisions from here on are late
constexpr int kAttempts = 16;
constexpr int kBackoffLimit = 10;

// The four bytes in the order of transmission.
inline std::vector<uint8_t> frame_check_sequence(const uint8_t* data, size_t size) {
  constexpr uint32_t kGenerator = 0x04c11db7;  // x^26 + x^23 + ... + 1
  uint32_t remainder = 0;
  size_t bits = 0;
  const auto feed = [&](uint32_t bit) {
    const uint32_t top = remainder >> 31;
    remainder = remainder << 1 | (bit ^ (bits < 32 ? 1 : 0));
    if (top) remainder ^= kGenerator;
    ++bits;
  };
  for (size_t i = 0; i < size; ++i)
    for (int k = 0; k < 8; ++k) feed(data[i] >> k & 1u);
  for (int k = 0; k < 32; ++k) feed(0);  // times x^32
  // The highest power goes first; the bits of a byte go lowest first.
  std::vector<uint8_t> fcs(4);
  for (unsigned k = 0; k < 32; ++k) {
    const uint32_t bit = ~remainder >> (31 - k) & 1u;
    fcs[k / 8] = static_cast<uint8_t>(fcs[k / 8] | bit << k % 8);
  }
  return fcs;
}

}  // namespace psweep::golden
