// SPDX-License-Identifier: Apache-2.0
// Station: a computer's network stack in miniature on the other end of a Desk's wire, for machines and tests without
// a TAP device: ARP request, ICMP echo, UDP to and from one address. Simulated time runs only while it waits.
//   Frames that are not for the station, or that any checksum rejects, are dropped and counted.
#pragma once
#include <deque>
#include <optional>

#include "contract/frames.hpp"
#include "desk/desk.hpp"

namespace psweep::chip {

class Station {
 public:
  // Takes over desk.on_frame.
  Station(Desk& desk, const net::Address& own, uint32_t chip_ip, uint16_t chip_port)
      : desk_(desk), own_(own), chip_ip_(chip_ip), chip_port_(chip_port) {
    desk_.on_frame = [this](const net::Bytes& frame) { take(frame); };
  }
  ~Station() { desk_.on_frame = nullptr; }
  Station(const Station&) = delete;
  Station& operator=(const Station&) = delete;

  Desk& desk() { return desk_; }
  const net::Address& own() const { return own_; }
  std::optional<net::Mac> chip_mac() const { return mac_; }

  // Asks again every 10 ms, as lost frames are possible. False if nobody answers.
  bool resolve(int attempts = 50) {
    for (int i = 0; i < attempts && !mac_; ++i) {
      desk_.send(net::make_arp_request(own_, chip_ip_));
      desk_.run_until([this] { return mac_.has_value(); }, desk_.now() + 10 * kMillisecond);
    }
    return mac_.has_value();
  }

  // Resolves the address first. False if that fails.
  bool send_udp(const net::Bytes& payload) {
    if (!resolve()) return false;
    desk_.send(net::make_udp(own_, chip_address(), payload));
    return true;
  }
  // The oldest payload that arrived; runs the simulation for up to `timeout` until there is one.
  std::optional<net::Bytes> receive_udp(Time timeout) {
    const bool there = desk_.run_until([this] { return !payloads_.empty(); }, desk_.now() + timeout);
    if (!there) return std::nullopt;
    net::Bytes payload = std::move(payloads_.front());
    payloads_.pop_front();
    return payload;
  }

  // One echo request with `size` bytes of data behind identifier and sequence number. The round trip, if the same
  // bytes come back.
  std::optional<Time> ping(size_t size, Time timeout = 50 * kMillisecond) {
    if (!resolve()) return std::nullopt;
    net::Bytes message;
    net::append16(message, 0x5053);
    net::append16(message, ++echo_sequence_);
    for (size_t i = 0; i < size; ++i) message.push_back(static_cast<uint8_t>(i * 37 + echo_sequence_));
    echo_ = message;
    echoed_ = false;
    const Time begin = desk_.now();
    desk_.send(net::make_icmp_echo(own_, chip_address(), 8, message));
    if (!desk_.run_until([this] { return echoed_; }, begin + timeout)) return std::nullopt;
    return desk_.now() - begin;
  }

  uint64_t dropped() const { return dropped_; }

 private:
  net::Address chip_address() const { return {*mac_, chip_ip_, chip_port_}; }
  void take(const net::Bytes& f) {
    if (!take_arp(f) && !take_echo(f) && !take_udp(f)) ++dropped_;
  }
  bool for_us(const net::Bytes& f) const {
    return f.size() >= 42 && std::equal(own_.mac.begin(), own_.mac.end(), f.begin());
  }
  bool take_arp(const net::Bytes& f) {
    if (!for_us(f) || net::get16(f, 12) != 0x0806 || net::get16(f, 20) != 2) return false;
    if (net::get32(f, 28) != chip_ip_ || net::get32(f, 38) != own_.ip) return false;
    net::Mac mac{};
    std::copy(f.begin() + 22, f.begin() + 28, mac.begin());
    mac_ = mac;
    return true;
  }
  bool take_echo(const net::Bytes& f) {
    if (!for_us(f) || net::get16(f, 12) != 0x0800 || f[23] != net::kProtocolIcmp || f[34] != 0) return false;
    const size_t length = net::get16(f, 16);
    if (length < 28 || 14 + length > f.size() || net::get32(f, 26) != chip_ip_ || net::get32(f, 30) != own_.ip)
      return false;
    if (net::ones_sum(f.data() + 14, 20) != 0xffff || net::ones_sum(f.data() + 34, length - 20) != 0xffff) return false;
    if (!std::equal(f.begin() + 38, f.begin() + static_cast<std::ptrdiff_t>(14 + length), echo_.begin(), echo_.end()))
      return false;
    echoed_ = true;
    return true;
  }
  bool take_udp(const net::Bytes& f) {
    if (!for_us(f)) return false;
    auto packet = net::parse_udp(f);
    if (!packet || packet->from.ip != chip_ip_ || packet->from.port != chip_port_ || packet->to.ip != own_.ip ||
        packet->to.port != own_.port)
      return false;
    payloads_.push_back(std::move(packet->payload));
    return true;
  }

  Desk& desk_;
  net::Address own_;
  uint32_t chip_ip_;
  uint16_t chip_port_;
  std::optional<net::Mac> mac_;
  std::deque<net::Bytes> payloads_;
  net::Bytes echo_;
  uint32_t echo_sequence_ = 0;
  bool echoed_ = false;
  uint64_t dropped_ = 0;
};

}  // namespace psweep::chip
