// SPDX-License-Identifier: Apache-2.0
// Bit-true model of entity mac_rx: what one stretch of rx_dv comes out as when the reader never pauses.
//   In  : MII samples, one a clock, any number of frames
//   Out : per frame with an SFD: the bytes delivered (FCS included, at most 1518) and the verdict
#pragma once
#include "golden/ethernet.hpp"

namespace psweep::golden {

struct MiiSample {
  bool dv = false, er = false;
  uint8_t nibble = 0;
};

enum Verdict : uint8_t {
  kBadFcs = 1,
  kOddNibble = 2,
  kTooShort = 4,
  kTooLong = 8,
  kReceiveError = 16,
  kBeatLost = 32,  // never by the model: only a reader that pauses causes it
};

struct ReceivedFrame {
  std::vector<uint8_t> bytes;
  uint8_t verdict = 0;
};

// `samples`: one stretch of dv = 1. False: no SFD in it.
inline bool receive_frame(const std::vector<MiiSample>& samples, ReceivedFrame& frame) {
  size_t at = 1;
  while (at < samples.size() && !(samples[at - 1].nibble == 0x5 && samples[at].nibble == 0xd)) ++at;
  if (at >= samples.size()) return false;
  const size_t first = at + 1, nibbles = samples.size() - first, count = nibbles / 2;

  std::vector<uint8_t> all(count);
  for (size_t i = 0; i < count; ++i)
    all[i] = static_cast<uint8_t>(samples[first + 2 * i].nibble | samples[first + 2 * i + 1].nibble << 4);
  const bool good =
      count >= 4 && std::vector<uint8_t>(all.end() - 4, all.end()) == frame_check_sequence(all.data(), count - 4);
  bool error = false;
  for (const MiiSample& s : samples) error |= s.er;

  frame.verdict = 0;
  if (!good) frame.verdict |= kBadFcs;
  if (!good && nibbles % 2) frame.verdict |= kOddNibble;
  if (count < kMinFrameWithFcs) frame.verdict |= kTooShort;
  if (count > kMaxFrameWithFcs) frame.verdict |= kTooLong;
  if (error) frame.verdict |= kReceiveError;
  frame.bytes = all;
  if (count > kMaxFrameWithFcs) frame.bytes.resize(kMaxFrameWithFcs);
  return true;
}

inline std::vector<ReceivedFrame> receive(const std::vector<MiiSample>& samples) {
  std::vector<ReceivedFrame> frames;
  std::vector<MiiSample> stretch;
  const auto end = [&] {
    ReceivedFrame frame;
    if (receive_frame(stretch, frame)) frames.push_back(frame);
    stretch.clear();
  };
  for (const MiiSample& s : samples) {
    if (s.dv) {
      stretch.push_back(s);
    } else {
      end();
    }
  }
  end();
  return frames;
}

}  // namespace psweep::golden
