// SPDX-License-Identifier: Apache-2.0
// MiiLink: the far end of the wire at frame level: a station that speaks MII nibbles to the chip's pins (IEEE 802.3
// clauses 4, 7 and 22), and takes the chip's nibbles apart again.
//   To the chip: frames with FCS, sent as they are (so wrong ones are possible), each behind 15 nibbles of preamble
//   and the SFD, at least `gap` nibbles after the one before. From the chip: preamble of exactly 15 nibbles, SFD, bytes
//   low nibble first, FCS, gap of at least 24 nibbles; whatever differs is counted.
//   Half duplex: one medium with `delay` nibbles of propagation each way. The station defers to the carrier, jams 32
//   bits at a collision, backs off by 0 .. 2^min(n,10)-1 slots of 512 bit times, gives up after 16 attempts, and
//   counts a collision after 512 bit times as late (such a frame is lost). While both send, the chip receives noise; a
//   PHY may loop the chip's own frames back. What the station has sent of a frame that collides arrives as a fragment.
// Everything is counted in nibble times, so 10 and 100 Mbit/s are alike.
#pragma once
#include <deque>
#include <functional>
#include <random>

#include "contract/frames.hpp"
#include "desk/chip_model.hpp"

namespace psweep::chip {

struct LinkSettings {
  bool half_duplex = false;
  int delay = 0;  // nibbles each way; only half duplex notices
  int gap = 24;   // nibbles; the standard's minimum
  int echo = -1;  // the PHY loops the chip's frames back, so many nibbles later (10BASE-T, half duplex); negative: not
  uint32_t seed = 1;
};

struct LinkCounters {
  uint64_t sent = 0, received = 0;                   // whole frames
  uint64_t sent_bytes = 0, received_bytes = 0;       // of them, FCS included
  uint64_t fcs = 0;                                  // from the chip: FCS wrong
  uint64_t short_frames = 0;                         // from the chip: less than 64 bytes
  uint64_t long_frames = 0;                          // from the chip: more than 1518 bytes
  uint64_t malformed = 0;                            // from the chip: preamble, SFD or odd number of nibbles
  uint64_t gap = 0;                                  // from the chip: less than 24 nibbles after a frame of either side
  uint64_t fragments = 0;                            // from the chip: cut off by a collision
  uint64_t collisions = 0, late = 0, excessive = 0;  // of the station's own frames
  uint64_t violations() const { return fcs + short_frames + long_frames + malformed + gap; }
};

class MiiLink {
 public:
  explicit MiiLink(const LinkSettings& settings) : settings_(settings), random_(settings.seed) {}

  void send(net::Bytes frame_with_fcs) { queue_.push_back(std::move(frame_with_fcs)); }
  size_t queued() const { return queue_.size(); }
  // Nothing on the wire, nothing to send, and no frame of either side waits for its next attempt.
  bool quiet() const;
  void set_half_duplex(bool on) { settings_.half_duplex = on; }
  const LinkCounters& counters() const { return counters_; }

  // A transmission begins: the chip's or the station's.
  std::function<void(bool from_chip)> on_begin;
  // It is over. `good`: whole, and for the chip's frames everything right. `frame` has its FCS; empty if not whole.
  std::function<void(bool from_chip, bool good, const net::Bytes& frame)> on_end;

  MiiSample rx_clock();                       // one nibble time of the station: what the chip's receive pins show
  void tx_clock(const MiiSample& from_chip);  // one nibble time of the chip
  bool carrier() const { return chip_sends_ || at_chip_.valid; }
  bool collision() const { return chip_sends_ && at_chip_.valid; }

 private:
  enum class State { kIdle, kSending, kJamming, kBackoff };
  static constexpr int kPreamble = 15, kSlot = 128, kJam = 8, kAttempts = 16;

  MiiSample station();
  void start_if_allowed();
  void after_collision();
  void hear(const MiiSample& nibble);
  void end_of_reception();

  LinkSettings settings_;
  LinkCounters counters_;
  std::mt19937 random_;
  std::deque<net::Bytes> queue_;

  // the station's sender
  State state_ = State::kIdle;
  size_t position_ = 0;  // nibble of the frame, preamble included
  int jam_ = 0, attempts_ = 0, wait_ = 0;
  int since_own_ = 1 << 20, since_heard_ = 1 << 20;  // nibble times since the end of the latest transmission
  bool collided_ = false;

  // the medium
  std::deque<MiiSample> to_chip_, heard_;
  std::deque<MiiSample> echo_;
  MiiSample at_chip_;
  bool chip_sends_ = false, chip_collided_ = false, chip_backs_off_ = false;
  int chip_idle_ = 1 << 20;

  // the station's receiver
  bool receiving_ = false, carrier_at_station_ = false, broken_ = false, reception_collided_ = false;
  int preamble_ = 0;
  size_t nibbles_ = 0;
  net::Bytes bytes_;
  int chip_gap_ = 1 << 20;  // nibble times between the chip's frames
};

}  // namespace psweep::chip
