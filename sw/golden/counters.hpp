// SPDX-License-Identifier: Apache-2.0
// Model of entity counters: one 32-bit counter per event, wrapping. Pulses of one event that come faster than the
// scanner (4 clocks a counter) count as one: the model refuses them.
#pragma once
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

namespace psweep::golden {

class Counters {
 public:
  explicit Counters(int count)
      : values_(static_cast<size_t>(count), 0), previous_(static_cast<size_t>(count), 0), spacing_(4 * count) {}

  uint64_t spacing() const { return static_cast<uint64_t>(spacing_); }  // least clocks between pulses of one event
  uint64_t counted_after() const { return spacing() + 15; }             // clocks at most

  void pulse(int event, uint64_t clock) {
    const auto n = static_cast<size_t>(event);
    if (previous_[n] != 0 && clock + 1 - previous_[n] < spacing()) throw std::logic_error("counters: pulses too close");
    previous_[n] = clock + 1;
    count(event);
  }
  // So many pulses, far enough apart.
  void count(int event, uint32_t pulses = 1) { values_[static_cast<size_t>(event)] += pulses; }
  uint32_t value(int event) const { return values_[static_cast<size_t>(event)]; }

 private:
  std::vector<uint32_t> values_;
  std::vector<uint64_t> previous_;
  int spacing_;
};

}  // namespace psweep::golden
