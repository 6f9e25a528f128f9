// SPDX-License-Identifier: Apache-2.0
// Model of entity delay_line: words leave unchanged after so many enabled clocks. It has no reset: until then its
// output means nothing.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

namespace psweep::golden {

class DelayLine {
 public:
  explicit DelayLine(size_t delay) : delay_(delay) {}
  void clock(bool enabled, uint32_t word) {
    if (!enabled) return;
    way_.push_back(word);
    if (way_.size() > delay_) way_.pop_front();
  }
  std::optional<uint32_t> out() const {
    if (way_.size() < delay_) return std::nullopt;
    return way_.front();
  }

 private:
  size_t delay_;
  std::deque<uint32_t> way_;  // oldest first
};

}  // namespace psweep::golden
