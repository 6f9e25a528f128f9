// SPDX-License-Identifier: Apache-2.0
// ModelChip: the model of the chip (golden/arbiter.hpp) at the pins of ChipModel. Frames take their time on the wire,
// the chip's own work takes none but for the engine. So tools of the host are tried at the wire's speed without the
// RTL, and many times faster.
#pragma once
#include <algorithm>
#include <vector>

#include "chip/echo_chip.hpp"
#include "golden/arbiter.hpp"

namespace psweep::chip {

class ModelChip : public EchoChip {
 public:
  ModelChip(const net::ArbiterConfig& config, const net::Address& own) : EchoChip(own), arbiter_(config) {}
  void set_pins(const StaticPins& pins) override {
    EchoChip::set_pins(pins);
    arbiter_.set_pins(pins.full_duplex, pins.speed_100);
  }
  bool session() const override { return arbiter_.session_open(); }
  bool busy() const override { return arbiter_.next_event().has_value(); }
  golden::Arbiter& arbiter() { return arbiter_; }

 protected:
  std::optional<net::Bytes> reply(const net::UdpPacket& udp) override {
    step();
    const auto at = std::find(peers_.begin(), peers_.end(), udp.from);
    const auto peer = static_cast<uint32_t>(at - peers_.begin());
    if (at == peers_.end()) peers_.push_back(udp.from);
    auto replies = arbiter_.message(udp.payload, peer);
    if (replies.empty()) return std::nullopt;
    return std::move(replies.front());
  }
  std::optional<net::Bytes> unasked() override {
    step();
    const auto packet = arbiter_.map_packet();
    if (!packet) return std::nullopt;
    return net::make_udp(own(), peers_.at(arbiter_.map_peer()), *packet);
  }

 private:
  void step() { arbiter_.step(static_cast<double>(now()) / kSecond); }

  golden::Arbiter arbiter_;
  std::vector<net::Address> peers_;  // their places are their numbers
};

}  // namespace psweep::chip
