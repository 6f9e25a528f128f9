// SPDX-License-Identifier: Apache-2.0
// Bit-true model of entity packet_rx: a frame and the MAC's verdict -> pulses of the counters, and the message if it is
// one. Standards: RFC 826 (ARP), 791 (IPv4), 792 (ICMP), 768 (UDP), 1071 (sums). Events: docs/protocol.md, counters
// 0..15.
#pragma once
#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <optional>

#include "net/frames.hpp"

namespace psweep::golden {

enum class MessageKind { kArp = 0, kIcmp = 1, kUdp = 2 };

// Frames wait in a ring of such pieces, 4 * G_SLOTS of them.
constexpr size_t kGranule = 512;

struct Message {
  MessageKind kind{};
  int length = 0;  // ICMP: from frame byte 34 to the end of the IP packet; UDP: payload; ARP: 0
};

struct Received {
  uint16_t events = 0;
  std::optional<Message> message;
};

// Bits of the MAC's verdict in the order in which they count, and their counters.
struct VerdictBit {
  int bit, counter;
};
constexpr VerdictBit kVerdictOrder[] = {{5, net::kRxOverflow}, {4, net::kRxError}, {3, net::kRxLong},
                                        {2, net::kRxShort},    {1, net::kRxAlign}, {0, net::kRxFcs}};

// Frame with its FCS, as mac_rx delivers it; own.port is G_UDP_PORT; room: at the first byte of each kGranule bytes of
// the frame, one more granule was free.
// Exact also for good verdicts on fewer than 64 bytes (which mac_rx never gives), but not on more than 1518.
class PacketRx {
 public:
  PacketRx(const net::Address& own, const net::Bytes& frame) : own_(own), f_(frame) {}

  Received receive(uint8_t verdict, bool room) const {
    Received r;
    for (const VerdictBit v : kVerdictOrder)
      if (verdict >> v.bit & 1) return counted(v.counter);
    if (!for_us()) return counted(net::kRxFiltered);
    const Received good = arp() ? judge_arp() : judge_ip();
    if (good.message && !room) return counted(net::kRxNoSlot);
    return good;
  }

 private:
  static Received counted(int counter) {
    Received r;
    r.events = static_cast<uint16_t>(1 << counter);
    return r;
  }
  static Received accepted(MessageKind kind, size_t length) {
    Received r;
    r.message = Message{kind, static_cast<int>(length)};
    r.events = static_cast<uint16_t>(1 << net::kRxFrames | 1 << (net::kArp + static_cast<int>(kind)));
    return r;
  }

  // Bytes that are not there are not wrong: a frame too short for its length field is refused for that.
  bool is(size_t at, uint32_t value, uint8_t mask = 0xff) const {
    return at >= f_.size() || (f_[at] & mask) == (value & mask);
  }
  bool are(size_t at, std::initializer_list<uint32_t> values) const {
    return std::all_of(values.begin(), values.end(), [&](uint32_t v) { return is(at++, v); });
  }
  bool is_own_ip(size_t at) const { return are(at, {own_.ip >> 24, own_.ip >> 16, own_.ip >> 8, own_.ip}); }

  bool for_us() const {
    bool mine = true, all = true;
    for (size_t i = 0; i < 6; ++i) {
      mine = mine && is(i, own_.mac[i]);
      all = all && is(i, 0xff);
    }
    return mine || all;
  }
  bool arp() const { return f_.size() > 13 && (f_[13] & 2); }

  Received judge_arp() const {
    if (!are(12, {0x08, 0x06}) || !are(14, {0, 1, 8, 0, 6, 4, 0, 1}) || !is_own_ip(38)) return counted(net::kRxOther);
    if (f_.size() < 46) return counted(net::kIpHeader);  // no mac_rx lets that pass
    return accepted(MessageKind::kArp, 0);
  }

  Received judge_ip() const {
    if (!are(12, {0x08, 0x00})) return counted(net::kRxOther);
    if (f_.size() < 46 || !is(14, 0x45)) return counted(net::kIpHeader);
    const size_t total = net::get16(f_, 16);
    if (total < 28 || 14 + total + 4 > f_.size() || !is_own_ip(30)) return counted(net::kIpHeader);
    if (net::ones_sum(f_.data() + 14, 20) != 0xffff) return counted(net::kIpHeader);
    if ((net::get16(f_, 20) & 0x3fff) != 0) return counted(net::kIpFragment);
    const uint8_t protocol = f_[23];
    const size_t length = total - 20;
    const uint8_t* content = f_.data() + 34;
    if (protocol == net::kProtocolIcmp) {
      if (!are(34, {8, 0})) return counted(net::kRxOther);
      if (net::ones_sum(content, length) != 0xffff) return counted(net::kChecksum);
      return accepted(MessageKind::kIcmp, length);
    }
    if (protocol != net::kProtocolUdp || net::get16(f_, 36) != own_.port) return counted(net::kRxOther);
    if (net::get16(f_, 38) != length) return counted(net::kChecksum);
    const uint32_t pseudo = net::pseudo_header_sum(net::get32(f_, 26), net::get32(f_, 30), protocol, length);
    if (net::get16(f_, 40) != 0 && net::ones_sum(content, length, pseudo) != 0xffff) return counted(net::kChecksum);
    return accepted(MessageKind::kUdp, length - 8);
  }

  net::Address own_;
  const net::Bytes& f_;
};

}  // namespace psweep::golden
