// SPDX-License-Identifier: Apache-2.0
// Bit-true model of entity mac_tx as far as it is determined by the frame: the nibbles of an undisturbed transmission
// and of one that is cut short by a collision. When a frame goes out again is random; the model gives the range.
#pragma once
#include <algorithm>

#include "golden/ethernet.hpp"

namespace psweep::golden {

// `frame` without FCS.
inline std::vector<uint8_t> transmit_nibbles(std::vector<uint8_t> frame) {
  if (frame.size() < static_cast<size_t>(kMinFrameWithFcs) - 4) frame.resize(kMinFrameWithFcs - 4, 0);
  for (const uint8_t byte : frame_check_sequence(frame.data(), frame.size())) frame.push_back(byte);
  std::vector<uint8_t> nibbles(kPreambleNibbles, 0x5);
  nibbles.push_back(0xd);
  for (const uint8_t byte : frame) {
    nibbles.push_back(byte & 15);
    nibbles.push_back(byte >> 4);
  }
  return nibbles;
}

// A collision that the MAC notices in nibble `seen` of the transmission: preamble and SFD are completed, then comes the
// jam.
inline std::vector<uint8_t> jammed_nibbles(const std::vector<uint8_t>& frame, size_t seen) {
  std::vector<uint8_t> nibbles = transmit_nibbles(frame);
  nibbles.resize(std::max<size_t>(seen + 1, kPreambleNibbles + 1));
  nibbles.insert(nibbles.end(), kJamNibbles, 0x5);
  return nibbles;
}

// Backoff after collision n (1 ..) of a frame: 0 .. this many slots.
inline int backoff_most(int collision) { return (1 << std::min(collision, kBackoffLimit)) - 1; }

}  // namespace psweep::golden
