// SPDX-License-Identifier: Apache-2.0
// Model of entity reply_limiter: three buckets of answers. Each has its turn in every third clock, in which an answer
// is taken or refused; a millisecond refills each bucket by one in its next turn.
#pragma once
#include <array>
#include <cstddef>

#include "contract/protocol.hpp"

namespace psweep::golden {

class ReplyLimiter {
 public:
  enum class Outcome { kWaits, kGranted, kRefused };

  // What a request for this bucket gets in this clock.
  Outcome ask(bool request, int bucket) const {
    if (!request || bucket != turn_) return Outcome::kWaits;
    return left_[static_cast<size_t>(bucket)] > 0 ? Outcome::kGranted : Outcome::kRefused;
  }
  void clock(bool request, int bucket, bool tick) {
    int& left = left_[static_cast<size_t>(turn_)];
    const bool taken = ask(request, bucket) == Outcome::kGranted;
    const bool refilled = since_tick_ < 3;
    if (taken && !refilled) --left;
    if (!taken && refilled && left < net::kBucketAnswers) ++left;
    since_tick_ = tick ? 0 : since_tick_ + 1;
    turn_ = (turn_ + 1) % 3;
  }
  int left(int bucket) const { return left_[static_cast<size_t>(bucket)]; }

 private:
  std::array<int, 3> left_{net::kBucketAnswers, net::kBucketAnswers, net::kBucketAnswers};
  int turn_ = 0;
  int since_tick_ = 3;  // clocks
};

}  // namespace psweep::golden
