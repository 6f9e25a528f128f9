// SPDX-License-Identifier: Apache-2.0
// Bit-true model of entity packet_rx: a frame and the MAC's verdict -> pulses of the counters, and the message if it is
// one. Standards: RFC 826 (ARP), 791 (IPv4), 792 (ICMP), 768 (UDP), 1071 (sums), 1122 (sources, broadcasts), 5227 (ARP
// probes). Events: docs/protocol.md, counters 0..15, then those below.
#pragma once
#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <optional>

#include "contract/frames.hpp"

namespace psweep::golden {

// kClosed: UDP to another port. For packet_tx it is the answer to that: ICMP port unreachable.
enum class MessageKind { kArp = 0, kIcmp = 1, kUdp = 2, kClosed = 3 };

// Bits of the events behind the counters 0..15.
constexpr int kEventBadSource = 16, kEventFragment = 17, kEventResynchronised = 18;  // the last one: not of a frame
constexpr int kReceiveEvents = 19;

// Frames wait in a ring of such pieces, 4 * G_SLOTS of them.
constexpr size_t kGranule = 512;

struct Message {
  MessageKind kind{};
  int length = 0;  // ICMP: from frame byte 34 to the end of the IP packet; UDP, closed: payload; ARP: 0
};

struct Received {
  uint32_t events = 0;
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

  Received receive(uint8_t verdict, bool room, bool half_duplex = false) const {
    for (const VerdictBit v : kVerdictOrder) {
      if (!(verdict >> v.bit & 1)) continue;
      // A short frame with a wrong FCS is what a collision leaves behind.
      const bool fragment = v.counter == net::kRxShort && half_duplex && (verdict & 1);
      return counted(fragment ? kEventFragment : v.counter);
    }
    if (!for_us()) return counted(net::kRxFiltered);
    const Received good = arp() ? judge_arp() : judge_ip();
    if (good.message && !room) return counted(net::kRxNoSlot);
    return good;
  }

 private:
  static Received counted(int counter) {
    Received r;
    r.events = 1u << counter;
    return r;
  }
  static Received accepted(MessageKind kind, size_t length) {
    Received r;
    r.message = Message{kind, static_cast<int>(length)};
    const int counter = kind == MessageKind::kClosed ? net::kRxOther : net::kArp + static_cast<int>(kind);
    r.events = 1u << net::kRxFrames | 1u << counter;
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
    return mine || (all && arp());  // RFC 1122, 3.3.6: IP in a broadcast frame is for a broadcast address, or wrong
  }
  bool is_own_mac(size_t at) const {
    for (size_t i = 0; i < 6; ++i)
      if (f_[at + i] != own_.mac[i]) return false;
    return true;
  }
  // Of a frame that has all these bytes.
  bool bad_source() const {
    if ((f_[6] & 1) || is_own_mac(6)) return true;
    if (arp()) return (f_[22] & 1) || is_own_mac(22) || net::get32(f_, 28) == own_.ip;
    const uint8_t net = f_[26];
    return net == 0 || net == 127 || net >= 224 || net::get32(f_, 26) == own_.ip;
  }
  bool arp() const { return f_.size() > 13 && (f_[13] & 2); }

  Received judge_arp() const {
    if (!are(12, {0x08, 0x06}) || !are(14, {0, 1, 8, 0, 6, 4, 0, 1}) || !is_own_ip(38)) return counted(net::kRxOther);
    if (f_.size() < 46) return counted(net::kIpHeader);  // no mac_rx lets that pass
    if (bad_source()) return counted(kEventBadSource);
    return accepted(MessageKind::kArp, 0);
  }

  Received judge_ip() const {
    if (!are(12, {0x08, 0x00})) return counted(net::kRxOther);
    if (f_.size() < 46 || !is(14, 0x45)) return counted(net::kIpHeader);
    const size_t total = net::get16(f_, 16);
    if (total < 28 || 14 + total + 4 > f_.size() || !is_own_ip(30)) return counted(net::kIpHeader);
    if (net::ones_sum(f_.data() + 14, 20) != 0xffff) return counted(net::kIpHeader);
    if (bad_source()) return counted(kEventBadSource);
    if ((net::get16(f_, 20) & 0x3fff) != 0) return counted(net::kIpFragment);
    const uint8_t protocol = f_[23];
    const size_t length = total - 20;
    const uint8_t* content = f_.data() + 34;
    if (protocol == net::kProtocolIcmp) {
      if (!are(34, {8, 0})) return counted(net::kRxOther);
      if (net::ones_sum(content, length) != 0xffff) return counted(net::kChecksum);
      return accepted(MessageKind::kIcmp, length);
    }
    if (protocol != net::kProtocolUdp) return counted(net::kRxOther);
    if (net::get16(f_, 38) != length) return counted(net::kChecksum);
    const uint32_t pseudo = net::pseudo_header_sum(net::get32(f_, 26), net::get32(f_, 30), protocol, length);
    if (net::get16(f_, 40) != 0 && net::ones_sum(content, length, pseudo) != 0xffff) return counted(net::kChecksum);
    return accepted(net::get16(f_, 36) == own_.port ? MessageKind::kUdp : MessageKind::kClosed, length - 8);
  }

  net::Address own_;
  const net::Bytes& f_;
};

}  // namespace psweep::golden
