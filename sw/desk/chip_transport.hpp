// SPDX-License-Identifier: Apache-2.0
// ChipTransport: the host library's Transport over a Station, so that its client talks to the simulated chip in the
// same process, in simulated time: nothing elapses but while receive() waits.
#pragma once
#include <string>

#include "desk/addresses.hpp"
#include "desk/station.hpp"
#include "net/transport.hpp"

namespace psweep::chip {

class ChipTransport : public net::Transport {
 public:
  explicit ChipTransport(Station& station, const net::Address& chip) : station_(station), chip_(chip) {}
  void send(const net::Bytes& payload) override { station_.send_udp(payload); }
  std::optional<net::Bytes> receive(double timeout_s) override { return station_.receive_udp(to_time(timeout_s)); }
  double now() override { return static_cast<double>(station_.desk().now()) / kSecond; }
  std::string peer() const override { return ip_text(chip_.ip) + ":" + std::to_string(chip_.port); }
  std::string complaint() const override { return station_.chip_mac() ? "" : "nobody answers ARP"; }

 protected:
  // Rounded up: a client that waits for the rest of a time has to see it pass.
  static Time to_time(double seconds) { return seconds <= 0 ? 0 : static_cast<Time>(seconds * kSecond) + kNanosecond; }

 private:
  Station& station_;
  net::Address chip_;
};

}  // namespace psweep::chip
