// SPDX-License-Identifier: Apache-2.0
// Faults: what a bad wire does to frames, seeded. Each rate is the probability per frame and direction.
//   loss           the frame disappears
//   duplicate      it comes twice
//   reorder        it comes after the one behind it (after 300 us, if none comes)
//   delay          it comes 0 .. 3 ms later, and others overtake it
//   corrupt        1 .. 4 bits are flipped on the wire; the FCS catches it
//   corrupt_fcs    one bit behind the Ethernet header of an IPv4 packet is flipped and the FCS made right again, as a
//                  faulty switch does; the checksums of IPv4, UDP and ICMP have to catch it. One bit, because a sum of
//                  16-bit words cannot see all errors of two; and not ARP, which has no checksum.
// The order of the draws is fixed: same seed and same frames, same faults.
#pragma once
#include <algorithm>
#include <random>
#include <vector>

#include "contract/frames.hpp"
#include "desk/chip_model.hpp"

namespace psweep::chip {

struct FaultRates {
  double loss = 0, duplicate = 0, reorder = 0, delay = 0, corrupt = 0, corrupt_fcs = 0;
  bool any() const { return loss + duplicate + reorder + delay + corrupt + corrupt_fcs > 0; }
};

struct FaultCounters {
  uint64_t lost = 0, duplicated = 0, reordered = 0, delayed = 0, corrupted = 0, corrupted_fcs = 0;
};

// A frame on its way: with FCS, not to be handed on before `due`.
struct Flying {
  Time due = 0;
  net::Bytes frame;
};

class Faults {
 public:
  static constexpr Time kReorderWait = 300 * kMicrosecond, kLongestDelay = 3 * kMillisecond;

  Faults(const FaultRates& rates, uint32_t seed) : rates_(rates), random_(seed) {}
  void set_rates(const FaultRates& rates) { rates_ = rates; }
  const FaultCounters& counters() const { return counters_; }

  // Takes a frame without FCS at time `now`.
  void put(net::Bytes frame, Time now) {
    net::append_fcs(frame);
    if (!rates_.any()) {
      flying_.push_back({now, std::move(frame)});
      release_held(now);
      return;
    }
    // All draws for every frame, so that one rate does not shift the others' faults.
    const bool lose = draw(rates_.loss), twice = draw(rates_.duplicate), behind = draw(rates_.reorder),
               late = draw(rates_.delay), flip = draw(rates_.corrupt), flip_fcs = draw(rates_.corrupt_fcs);
    const Time wait = static_cast<Time>(uniform() * kLongestDelay);
    if (lose) {
      ++counters_.lost;
      return;
    }
    if (flip_fcs && corrupt_with_good_fcs(frame)) ++counters_.corrupted_fcs;
    if (flip) {
      const int bits = 1 + static_cast<int>(below(4));
      for (int i = 0; i < bits; ++i) flip_bit(frame, below(static_cast<uint32_t>(frame.size() * 8)));
      if (!net::fcs_good(frame)) ++counters_.corrupted;  // two flips may cancel
    }
    if (twice) {
      ++counters_.duplicated;
      flying_.push_back({now, frame});
    }
    if (behind && held_.frame.empty()) {
      ++counters_.reordered;
      held_ = {now + kReorderWait, std::move(frame)};
      return;
    }
    if (late) {
      ++counters_.delayed;
      flying_.push_back({now + wait, std::move(frame)});
    } else {
      flying_.push_back({now, std::move(frame)});
    }
    release_held(now);
  }

  bool empty() const { return flying_.empty() && held_.frame.empty(); }

  // The next frame that is due, in the order of put().
  bool take(Time now, net::Bytes& frame) {
    if (!held_.frame.empty() && held_.due <= now) release_held(now);
    for (auto f = flying_.begin(); f != flying_.end(); ++f) {
      if (f->due > now) continue;
      frame = std::move(f->frame);
      flying_.erase(f);
      return true;
    }
    return false;
  }

 private:
  // Not the standard's distributions: they differ from library to library.
  double uniform() { return static_cast<uint32_t>(random_()) / 4294967296.0; }
  bool draw(double probability) { return uniform() < probability; }
  uint32_t below(uint32_t n) { return static_cast<uint32_t>(random_()) % n; }
  static void flip_bit(net::Bytes& frame, size_t bit) { frame[bit / 8] ^= static_cast<uint8_t>(1 << bit % 8); }

  bool corrupt_with_good_fcs(net::Bytes& frame) {
    if (net::get16(frame, 12) != 0x0800) return false;
    const size_t length = std::min<size_t>(net::get16(frame, 16), frame.size() - 18);
    if (length < 20) return false;
    frame.resize(frame.size() - 4);
    flip_bit(frame, 14 * 8 + below(static_cast<uint32_t>(length * 8)));
    net::append_fcs(frame);
    return true;
  }
  void release_held(Time now) {
    if (held_.frame.empty()) return;
    flying_.push_back({now, std::move(held_.frame)});
    held_ = {};
  }

  FaultRates rates_;
  std::mt19937 random_;
  std::vector<Flying> flying_;
  Flying held_;
  FaultCounters counters_;
};

}  // namespace psweep::chip
