// SPDX-License-Identifier: Apache-2.0
#include "desk/mii_link.hpp"

#include <algorithm>

namespace psweep::chip {

namespace {
constexpr int kForever = 1 << 20;
void count_up(int& n) { n = std::min(n + 1, kForever); }
}  // namespace

void MiiLink::start_if_allowed() {
  if (queue_.empty()) return;
  if (since_own_ < settings_.gap) return;
  if (settings_.half_duplex && (carrier_at_station_ || since_heard_ < settings_.gap)) return;
  state_ = State::kSending;
  position_ = 0;
  collided_ = false;
  if (on_begin) on_begin(false);
}

// What the station puts on the medium in this nibble time.
MiiSample MiiLink::station() {
  if (state_ == State::kBackoff && --wait_ <= 0) state_ = State::kIdle;
  if (state_ == State::kIdle) start_if_allowed();
  if (state_ == State::kJamming) {
    if (--jam_ == 0) after_collision();
    return {static_cast<uint8_t>(random_() & 15), true, false};
  }
  if (state_ != State::kSending) {
    count_up(since_own_);
    return {};
  }
  const net::Bytes& frame = queue_.front();
  const size_t at = position_++;
  MiiSample out{5, true, false};
  if (at == kPreamble) {
    out.data = 13;
  } else if (at > kPreamble) {
    const size_t nibble = at - kPreamble - 1;
    out.data = static_cast<uint8_t>(frame[nibble / 2] >> 4 * (nibble % 2) & 15);
  }
  if (settings_.half_duplex && carrier_at_station_) collided_ = true;
  // The preamble is sent to its end, so that the jam is long enough to be heard (clause 4.2.3.2.4).
  if (collided_ && at >= kPreamble) {
    state_ = State::kJamming;
    jam_ = kJam;
    if (at >= kSlot) {
      ++counters_.late;
      attempts_ = kAttempts + 1;
    } else {
      ++counters_.collisions;
      ++attempts_;
    }
  } else if (at == kPreamble + 2 * frame.size()) {
    ++counters_.sent;
    counters_.sent_bytes += frame.size();
    if (on_end) on_end(false, true, frame);
    queue_.pop_front();
    attempts_ = 0;
    state_ = State::kIdle;
    since_own_ = 0;
  }
  return out;
}

void MiiLink::after_collision() {
  since_own_ = 0;
  if (on_end) on_end(false, false, {});
  if (attempts_ >= kAttempts) {
    if (attempts_ == kAttempts) ++counters_.excessive;
    queue_.pop_front();
    attempts_ = 0;
    state_ = State::kIdle;
    return;
  }
  const uint32_t range = 1u << std::min(attempts_, 10);
  wait_ = 1 + kSlot * static_cast<int>(random_() % range);
  state_ = State::kBackoff;
}

MiiSample MiiLink::rx_clock() {
  to_chip_.push_back(station());
  const auto delay = static_cast<size_t>(settings_.half_duplex ? settings_.delay : 0);
  at_chip_ = {};
  while (to_chip_.size() > delay) {
    at_chip_ = to_chip_.front();
    to_chip_.pop_front();
  }
  if (settings_.half_duplex && collision()) {
    chip_collided_ = true;
    return {static_cast<uint8_t>(random_() & 15), true, false};
  }
  if (settings_.echo >= 0 && !at_chip_.valid && echo_.size() > static_cast<size_t>(settings_.echo)) {
    const MiiSample own = echo_.front();
    echo_.pop_front();
    return own;
  }
  // Most PHYs do not loop the chip's own frame back.
  return at_chip_;
}

void MiiLink::tx_clock(const MiiSample& from_chip) {
  if (from_chip.valid && !chip_sends_) {
    chip_collided_ = false;
    chip_backs_off_ = false;
  }
  if (!from_chip.valid && chip_sends_) {
    // A frame that collided comes again, up to 16 times: the wire is quiet, but the chip is not.
    chip_backs_off_ = chip_collided_;
    chip_idle_ = 0;
  }
  chip_sends_ = from_chip.valid;
  if (!chip_sends_ && chip_backs_off_) {
    ++chip_idle_;
    if (chip_idle_ > 1024 * kSlot + 4 * kSlot) chip_backs_off_ = false;  // it has given up
  }
  if (settings_.echo >= 0) {
    echo_.push_back(from_chip);
    while (echo_.size() > static_cast<size_t>(settings_.echo) + 2) echo_.pop_front();
  }
  heard_.push_back(from_chip);
  const auto delay = static_cast<size_t>(settings_.half_duplex ? settings_.delay : 0);
  while (heard_.size() > delay) {
    hear(heard_.front());
    heard_.pop_front();
  }
}

void MiiLink::hear(const MiiSample& nibble) {
  carrier_at_station_ = nibble.valid;
  if (settings_.half_duplex && nibble.valid && state_ != State::kIdle && state_ != State::kBackoff)
    reception_collided_ = true;
  if (!nibble.valid) {
    if (receiving_) end_of_reception();
    count_up(since_heard_);
    count_up(chip_gap_);
    return;
  }
  if (!receiving_) {
    receiving_ = true;
    if (on_begin) on_begin(true);
    broken_ = false;
    reception_collided_ = settings_.half_duplex && (state_ == State::kSending || state_ == State::kJamming);
    preamble_ = 0;
    nibbles_ = 0;
    bytes_.clear();
    const bool close_to_own = settings_.half_duplex && since_own_ + 2 * settings_.delay < 23;
    if ((chip_gap_ < 24 || close_to_own) && !reception_collided_) ++counters_.gap;
  }
  if (preamble_ >= 0) {
    if (nibble.data == 5) {
      ++preamble_;
    } else {
      if (nibble.data != 13 || preamble_ != kPreamble) broken_ = true;
      preamble_ = -1;
    }
    return;
  }
  if (nibbles_++ % 2 == 0) {
    bytes_.push_back(nibble.data);
  } else {
    bytes_.back() = static_cast<uint8_t>(bytes_.back() | nibble.data << 4);
  }
}

void MiiLink::end_of_reception() {
  receiving_ = false;
  since_heard_ = 0;
  chip_gap_ = 0;
  bool good = false;
  if (reception_collided_) {
    ++counters_.fragments;
  } else if (broken_ || preamble_ >= 0 || nibbles_ % 2 != 0) {
    ++counters_.malformed;
  } else if (bytes_.size() < 64) {
    ++counters_.short_frames;
  } else if (bytes_.size() > 1518) {
    ++counters_.long_frames;
  } else if (!net::fcs_good(bytes_)) {
    ++counters_.fcs;
  } else {
    good = true;
    ++counters_.received;
    counters_.received_bytes += bytes_.size();
  }
  if (on_end) on_end(true, good, bytes_);
}

bool MiiLink::quiet() const {
  auto on_the_way = [](const std::deque<MiiSample>& line) {
    return std::any_of(line.begin(), line.end(), [](const MiiSample& s) { return s.valid; });
  };
  return queue_.empty() && state_ == State::kIdle && !chip_sends_ && !receiving_ && !chip_backs_off_ &&
         !on_the_way(to_chip_) && !on_the_way(heard_);
}

}  // namespace psweep::chip
