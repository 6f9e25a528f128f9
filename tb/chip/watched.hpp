// SPDX-License-Identifier: Apache-2.0
// Watched: a ChipTransport that notes, to a microsecond of simulated time, when the engine began and ended its work.
#pragma once
#include <algorithm>
#include <cstdint>

#include "desk/chip_transport.hpp"

namespace psweep::chip {

class Watched : public ChipTransport {
 public:
  Watched(Station& station, const net::Address& chip) : ChipTransport(station, chip), desk_(station.desk()) {}
  std::optional<net::Bytes> receive(double timeout_s) override {
    const Time end = desk_.now() + to_time(timeout_s);
    for (;;) {
      look();
      const Time left = end - desk_.now();
      if (left <= 0) return ChipTransport::receive(0);
      auto packet = ChipTransport::receive(static_cast<double>(std::min(left, kMicrosecond)) / kSecond);
      if (packet) {
        look();
        return packet;
      }
    }
  }
  Time first_launch = -1, last_busy = -1;      // times ..
  int64_t launch_clock = -1, busy_clock = -1;  // .. and clocks; negative: not yet

 private:
  void look() {
    if (first_launch < 0 && desk_.chip().launches() > 0) {
      first_launch = desk_.now();
      launch_clock = desk_.clocks();
    }
    if (desk_.chip().busy_clocks() != busy_) {
      last_busy = desk_.now();
      busy_clock = desk_.clocks();
    }
    busy_ = desk_.chip().busy_clocks();
  }
  Desk& desk_;
  int64_t busy_ = 0;
};

}  // namespace psweep::chip
