// SPDX-License-Identifier: Apache-2.0
// A half-duplex medium with MII at its stations, one step a nibble time.
//   MiiBus      what each station drives reaches the others `distance` steps later, and its own PHY's carrier `phy`
//   steps
//               later. Every step: all drive(), then step(), then crs(), col() and receive() of the step to come.
//                 crs: this or any other station is heard; col: both are
//                 receive: dv while others are heard; two at once, or one that is heard while this one sends: garbage
//   MiiStation  one more station on it, for the other end or as a nuisance
//                 obedient    : CSMA/CD of IEEE 802.3, 4.2.8 (deference, gap, jam, backoff; give-up after 16
//                 collisions) disobedient : sends at its time, whatever goes on, and to the end
//               send(frame) puts a frame (without FCS; padded here) into its queue; send_at(step, nibbles) sends any
//               nibbles (with preamble) not before this step. step() once a step, between MiiBus's step() and the next.
//               frames(): good frames received, without FCS; bad(): the number of others
#pragma once
#include <algorithm>
#include <cstdint>
#include <deque>
#include <random>
#include <vector>

#include "golden/mac_rx.hpp"
#include "golden/mac_tx.hpp"

namespace psweep::tb {

class MiiBus {
 public:
  explicit MiiBus(size_t stations, size_t distance = 4, size_t phy = 2)
      : distance_(distance), phy_(phy), now_(stations), past_(stations) {}

  size_t stations() const { return now_.size(); }
  uint64_t time() const { return time_; }
  void drive(size_t station, bool on, unsigned nibble) {
    now_[station] = {on, false, static_cast<uint8_t>(nibble & 15)};
  }
  void step() {
    for (size_t s = 0; s < now_.size(); ++s) {
      past_[s].push_front(now_[s]);
      if (past_[s].size() > std::max(distance_, phy_) + 1) past_[s].pop_back();
    }
    ++time_;
  }

  bool crs(size_t station) const { return own(station) || others(station) > 0; }
  bool col(size_t station) const { return own(station) && others(station) > 0; }
  golden::MiiSample receive(size_t station) const {
    golden::MiiSample out;
    int heard = own(station) ? 1 : 0;
    for (size_t s = 0; s < past_.size(); ++s) {
      const golden::MiiSample sample = s == station ? golden::MiiSample{} : at(s, distance_);
      if (!sample.dv) continue;
      ++heard;
      out.dv = true;
      out.nibble = static_cast<uint8_t>(out.nibble ^ sample.nibble);
    }
    if (out.dv && heard > 1) out.nibble = static_cast<uint8_t>((out.nibble + 7 * time_) & 15);
    return out;
  }

 private:
  golden::MiiSample at(size_t station, size_t delay) const {
    return delay < past_[station].size() ? past_[station][delay] : golden::MiiSample{};
  }
  bool own(size_t station) const { return at(station, phy_).dv; }
  int others(size_t station) const {
    int heard = 0;
    for (size_t s = 0; s < past_.size(); ++s) heard += s != station && at(s, distance_).dv;
    return heard;
  }

  size_t distance_, phy_;
  uint64_t time_ = 0;
  std::vector<golden::MiiSample> now_;
  std::vector<std::deque<golden::MiiSample>> past_;
};

class MiiStation {
 public:
  MiiStation(MiiBus& bus, size_t number, uint32_t seed, bool obedient = true)
      : bus_(bus), number_(number), random_(seed), obedient_(obedient) {}

  void send(const std::vector<uint8_t>& frame) { send_at(0, golden::transmit_nibbles(frame)); }
  void send_at(uint64_t time, std::vector<uint8_t> nibbles) { queue_.push_back({time, std::move(nibbles)}); }
  size_t queued() const { return queue_.size(); }
  bool idle() const { return queue_.empty() && state_ == State::kIdle; }

  uint64_t sent() const { return sent_; }
  uint64_t collisions() const { return collisions_; }
  uint64_t given_up() const { return given_up_; }
  std::deque<std::vector<uint8_t>>& frames() { return frames_; }
  uint64_t bad() const { return bad_; }

  void step() {
    listen();
    defer();
    if (state_ == State::kBackoff && --wait_ <= 0) state_ = State::kIdle;
    if (state_ == State::kIdle && !queue_.empty() && bus_.time() >= queue_.front().time &&
        (!obedient_ || gap_ >= golden::kGapNibbles)) {
      state_ = State::kSend;
      at_ = 0;
      hit_ = false;
    }
    if (state_ == State::kSend) {
      const std::vector<uint8_t>& nibbles = queue_.front().nibbles;
      hit_ |= obedient_ && bus_.col(number_);
      if (hit_ && at_ > golden::kPreambleNibbles) {
        state_ = State::kJam;
        wait_ = golden::kJamNibbles;
        ++collisions_;
      } else if (at_ < nibbles.size()) {
        bus_.drive(number_, true, nibbles[at_++]);
        return;
      } else {
        ++sent_;
        next();
      }
    }
    if (state_ == State::kJam) {
      if (wait_-- > 0) {
        bus_.drive(number_, true, 0xa);
        return;
      }
      if (++attempts_ == golden::kAttempts) {
        ++given_up_;
        next();
      } else {
        const int slots = std::uniform_int_distribution<>(0, golden::backoff_most(attempts_))(random_);
        wait_ = slots * golden::kSlotNibbles;
        state_ = State::kBackoff;
      }
    }
    bus_.drive(number_, false, 0);
  }

 private:
  enum class State { kIdle, kSend, kJam, kBackoff };
  struct Entry {
    uint64_t time;
    std::vector<uint8_t> nibbles;
  };

  void next() {
    queue_.pop_front();
    attempts_ = 0;
    state_ = State::kIdle;
  }
  void defer() {
    const bool busy = bus_.crs(number_) || state_ == State::kSend || state_ == State::kJam;
    if (gap_ >= golden::kGapNibbles ? busy : busy && gap_ < golden::kGapFirstPart) {
      gap_ = 0;
    } else {
      ++gap_;
    }
  }
  void listen() {
    const golden::MiiSample sample = bus_.receive(number_);
    if (sample.dv) {
      heard_.push_back(sample);
      return;
    }
    golden::ReceivedFrame frame;
    if (!heard_.empty() && golden::receive_frame(heard_, frame)) {
      if (frame.verdict == 0) {
        frame.bytes.resize(frame.bytes.size() - 4);
        frames_.push_back(std::move(frame.bytes));
      } else {
        ++bad_;
      }
    }
    heard_.clear();
  }

  MiiBus& bus_;
  size_t number_;
  std::mt19937 random_;
  bool obedient_;
  State state_ = State::kIdle;
  std::deque<Entry> queue_;
  size_t at_ = 0;
  int wait_ = 0, attempts_ = 0, gap_ = golden::kGapNibbles;
  bool hit_ = false;
  uint64_t sent_ = 0, collisions_ = 0, given_up_ = 0, bad_ = 0;
  std::vector<golden::MiiSample> heard_;
  std::deque<std::vector<uint8_t>> frames_;
};

}  // namespace psweep::tb
