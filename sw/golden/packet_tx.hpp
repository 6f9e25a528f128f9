// SPDX-License-Identifier: Apache-2.0
// Bit-true model of entity packet_tx: kind, addresses and payload -> the frame in the slot, without padding and FCS.
// Written byte by byte from RFC 826 (ARP), 791 (IPv4), 792 (ICMP), 768 (UDP), and not with contract/frames.hpp: that
// one is the second opinion.
#pragma once
#include <cstdint>

#include "golden/packet_rx.hpp"

namespace psweep::golden {

// Bytes of a peer as the entity stores them: MAC, IP, UDP port.
inline net::Bytes peer_bytes(const net::Address& peer) {
  net::Bytes b(peer.mac.begin(), peer.mac.end());
  net::append32(b, peer.ip);
  net::append16(b, peer.port);
  return b;
}

// own.port is G_UDP_PORT. payload: ICMP: from frame byte 38 on, UDP: from 42 on; 1 .. 1472 bytes; ARP: none. kClosed:
// ICMP port unreachable, whose payload is four zeros and the beginning of the packet that it is about.
inline net::Bytes transmit(MessageKind kind, const net::Address& own, const net::Address& peer,
                           const net::Bytes& payload) {
  net::Bytes f(42, 0);
  auto copy = [&f](size_t at, const net::Bytes& from, size_t first, size_t count) {
    for (size_t i = 0; i < count; ++i) f[at + i] = from[first + i];
  };
  // Ones' complement of the sum over bytes first .. behind - 1 and `start`.
  auto checksum = [&f](size_t first, size_t behind, uint32_t start) {
    uint32_t sum = start;
    for (size_t i = first; i < behind; ++i) {
      sum += i % 2 ? f[i] : uint32_t{f[i]} << 8;
      if (sum > 0xffff) sum -= 0xffff;
    }
    return 0xffff - sum;
  };
  const net::Bytes here = peer_bytes(own), there = peer_bytes(peer);
  copy(0, there, 0, 6);
  copy(6, here, 0, 6);
  net::put16(f, 12, kind == MessageKind::kArp ? 0x0806 : 0x0800);
  if (kind == MessageKind::kArp) {
    net::put32(f, 14, 0x00010800);
    net::put32(f, 18, 0x06040002);
    copy(22, here, 0, 10);
    copy(32, there, 0, 10);
    return f;
  }
  const bool udp = kind == MessageKind::kUdp;
  f.resize(udp ? 42 : 38);
  f.insert(f.end(), payload.begin(), payload.end());
  const uint32_t total = static_cast<uint32_t>(f.size() - 14);
  net::put16(f, 14, 0x4500);
  net::put16(f, 16, total);
  net::put16(f, 20, 0x4000);
  net::put16(f, 22, udp ? 0x4011 : 0x4001);
  copy(26, here, 6, 4);
  copy(30, there, 6, 4);
  net::put16(f, 24, checksum(14, 34, 0));
  if (udp) {
    net::put16(f, 34, own.port);
    net::put16(f, 36, peer.port);
    net::put16(f, 38, total - 20);
    const uint32_t sum = checksum(26, f.size(), 17 + total - 20);
    net::put16(f, 40, sum == 0 ? 0xffff : sum);
  } else {
    if (kind == MessageKind::kClosed) net::put16(f, 34, 0x0303);
    net::put16(f, 36, checksum(34, f.size(), 0));
  }
  return f;
}

}  // namespace psweep::golden
