// SPDX-License-Identifier: Apache-2.0
// Ethernet frames of the kinds the chip knows, as bytes: ARP (RFC 826), IPv4 (RFC 791), ICMP echo (RFC 792), UDP
// (RFC 768). Frames are without preamble and, unless append_fcs() was called, without FCS and padding.
// No I/O here. Parsers return nothing for what they do not take; they never read beyond the bytes they are given.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "contract/protocol.hpp"

namespace psweep::net {

using Mac = std::array<uint8_t, 6>;
constexpr Mac kBroadcast = {0xff, 0xff, 0xff, 0xff, 0xff, 0xff};
constexpr size_t kMinFrame = 60, kMaxFrame = 1514;  // without FCS
constexpr size_t kMaxUdpPayload = 1472;
constexpr uint8_t kProtocolIcmp = 1, kProtocolUdp = 17;

struct Address {
  Mac mac{};
  uint32_t ip = 0;
  uint16_t port = 0;  // UDP only
};
inline bool operator==(const Address& a, const Address& b) {
  return a.mac == b.mac && a.ip == b.ip && a.port == b.port;
}

// Of a chip without straps.
inline Address address_of(const ChipFields& c) {
  Address a;
  for (int i = 0; i < 3; ++i) {
    a.mac[i] = static_cast<uint8_t>(c.mac_hi >> (16 - 8 * i));
    a.mac[3 + i] = static_cast<uint8_t>(c.mac_lo >> (16 - 8 * i));
  }
  a.ip = static_cast<uint32_t>(c.ip_hi) << 16 | static_cast<uint32_t>(c.ip_lo);
  a.port = static_cast<uint16_t>(c.udp_port);
  return a;
}

// Frame check sequence as a number; it is sent least significant byte first (IEEE 802.3, 3.2.9).
inline uint32_t crc32(const uint8_t* data, size_t size) {
  uint32_t crc = 0xffffffff;
  for (size_t i = 0; i < size; ++i) {
    crc ^= data[i];
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc;
}

// Pads to 60 bytes and appends the FCS.
inline void append_fcs(Bytes& frame) {
  if (frame.size() < kMinFrame) frame.resize(kMinFrame, 0);
  const uint32_t fcs = crc32(frame.data(), frame.size());
  for (int i = 0; i < 4; ++i) frame.push_back(static_cast<uint8_t>(fcs >> 8 * i));
}
inline bool fcs_good(const Bytes& frame_with_fcs) {
  if (frame_with_fcs.size() < 5) return false;
  const size_t n = frame_with_fcs.size() - 4;
  const uint32_t fcs = crc32(frame_with_fcs.data(), n);
  for (size_t i = 0; i < 4; ++i)
    if (frame_with_fcs[n + i] != static_cast<uint8_t>(fcs >> 8 * i)) return false;
  return true;
}

// Ones'-complement sum of big-endian 16-bit words, folded; an odd last byte counts as the upper half (RFC 1071).
// `start` continues a sum. The checksum field is its complement.
inline uint32_t ones_sum(const uint8_t* data, size_t size, uint32_t start = 0) {
  uint64_t sum = start;
  for (size_t i = 0; i < size; ++i) sum += i % 2 ? data[i] : static_cast<uint64_t>(data[i]) << 8;
  while (sum >> 16) sum = (sum & 0xffff) + (sum >> 16);
  return static_cast<uint32_t>(sum);
}
inline uint16_t internet_checksum(const uint8_t* data, size_t size, uint32_t start = 0) {
  return static_cast<uint16_t>(~ones_sum(data, size, start));
}

inline void append_bytes(Bytes& b, const uint8_t* data, size_t size) { b.insert(b.end(), data, data + size); }
inline Bytes ethernet_header(const Mac& to, const Mac& from, uint16_t type) {
  Bytes b;
  append_bytes(b, to.data(), 6);
  append_bytes(b, from.data(), 6);
  append16(b, type);
  return b;
}

// IPv4 as the chip sends it: id 0, do not fragment, TTL 64.
inline Bytes make_ip(const Address& from, const Address& to, uint8_t protocol, const Bytes& content) {
  Bytes b = ethernet_header(to.mac, from.mac, 0x0800);
  append16(b, 0x4500);
  append16(b, static_cast<uint32_t>(20 + content.size()));
  append32(b, 0x00004000);
  append16(b, uint32_t{64} << 8 | protocol);
  append16(b, 0);
  append32(b, from.ip);
  append32(b, to.ip);
  put16(b, 24, internet_checksum(b.data() + 14, 20));
  append_bytes(b, content.data(), content.size());
  return b;
}

inline uint32_t pseudo_header_sum(uint32_t from_ip, uint32_t to_ip, uint8_t protocol, size_t length) {
  Bytes p;
  append32(p, from_ip);
  append32(p, to_ip);
  append16(p, protocol);
  append16(p, static_cast<uint32_t>(length));
  return ones_sum(p.data(), p.size());
}

inline Bytes make_udp(const Address& from, const Address& to, const Bytes& payload) {
  Bytes u;
  append16(u, from.port);
  append16(u, to.port);
  append16(u, static_cast<uint32_t>(8 + payload.size()));
  append16(u, 0);
  append_bytes(u, payload.data(), payload.size());
  const uint16_t sum = internet_checksum(u.data(), u.size(), pseudo_header_sum(from.ip, to.ip, kProtocolUdp, u.size()));
  put16(u, 6, sum == 0 ? 0xffff : sum);  // 0 would mean: none
  return make_ip(from, to, kProtocolUdp, u);
}

// `message`: identifier, sequence number and data, i.e. all behind the checksum. type 8 request, 0 reply.
inline Bytes make_icmp_echo(const Address& from, const Address& to, uint8_t type, const Bytes& message) {
  Bytes m;
  append16(m, uint32_t{type} << 8);
  append16(m, 0);
  append_bytes(m, message.data(), message.size());
  put16(m, 2, internet_checksum(m.data(), m.size()));
  return make_ip(from, to, kProtocolIcmp, m);
}

// operation 1 request (to broadcast, target MAC 0), 2 reply.
inline Bytes make_arp(uint16_t operation, const Address& from, const Address& to) {
  Bytes b = ethernet_header(operation == 1 ? kBroadcast : to.mac, from.mac, 0x0806);
  append16(b, 1);
  append16(b, 0x0800);
  append16(b, 0x0604);
  append16(b, operation);
  append_bytes(b, from.mac.data(), 6);
  append32(b, from.ip);
  const Mac target = operation == 1 ? Mac{} : to.mac;
  append_bytes(b, target.data(), 6);
  append32(b, to.ip);
  return b;
}
inline Bytes make_arp_request(const Address& from, uint32_t target_ip) {
  Address to;
  to.ip = target_ip;
  return make_arp(1, from, to);
}
inline Bytes make_arp_reply(const Address& from, const Address& to) { return make_arp(2, from, to); }

struct UdpPacket {
  Address from, to;
  Bytes payload;
};

// A UDP packet without IP options, not fragmented, with good checksums and lengths (padding behind it is dropped).
inline std::optional<UdpPacket> parse_udp(const Bytes& f) {
  if (f.size() < 42 || get16(f, 12) != 0x0800 || f[14] != 0x45 || f[23] != kProtocolUdp) return std::nullopt;
  if ((get16(f, 20) & 0x3fff) != 0) return std::nullopt;
  const size_t ip_length = get16(f, 16);
  if (ip_length < 28 || 14 + ip_length > f.size() || get16(f, 38) != ip_length - 20) return std::nullopt;
  if (ones_sum(f.data() + 14, 20) != 0xffff) return std::nullopt;
  const uint32_t from_ip = get32(f, 26), to_ip = get32(f, 30);
  if (get16(f, 40) != 0 && ones_sum(f.data() + 34, ip_length - 20,
                                    pseudo_header_sum(from_ip, to_ip, kProtocolUdp, ip_length - 20)) != 0xffff) {
    return std::nullopt;
  }
  UdpPacket p;
  for (size_t i = 0; i < 6; ++i) {
    p.to.mac[i] = f[i];
    p.from.mac[i] = f[6 + i];
  }
  p.from.ip = from_ip;
  p.to.ip = to_ip;
  p.from.port = static_cast<uint16_t>(get16(f, 34));
  p.to.port = static_cast<uint16_t>(get16(f, 36));
  p.payload.assign(f.begin() + 42, f.begin() + static_cast<std::ptrdiff_t>(14 + ip_length));
  return p;
}

}  // namespace psweep::net
