// SPDX-License-Identifier: Apache-2.0
// Model of entity session_memory: 64 bytes at the places that they have in a frame, the comparison with a message that
// passes, the token that is never the same, and the sender's addresses on their way to packet_tx.
#pragma once
#include <array>
#include <cstdint>

#include "golden/message_rules.hpp"

namespace psweep::golden {

class SessionMemory {
 public:
  struct Inputs {
    Step step = Step::kIdle;
    int kind = 2;                                           // 0 ARP, 1 ICMP, 2 UDP, 3 UDP to a closed port
    bool read = false, session_io = false, renewed = true;  // READ, not OPEN; bytes are kept; the token stays
    bool tick = false;
    uint16_t address = 0;  // of the byte to come
    bool valid = false;    // a byte passes
    int place = 0;         // where, modulo 64
    uint8_t data = 0;
  };

  uint8_t byte() const { return byte_; }
  bool peer_ok() const { return peer_ok_; }
  bool token_ok() const { return token_ok_; }
  bool nonce_ok(const Inputs& in) const { return nonce_ok_ && in.data == byte_; }

  static bool peer_write(const Inputs& in) { return in.valid && in.step == Step::kPeer && peer_index(in) >= 0; }
  // 0-5 MAC, 6-9 IP, 10-11 port; -1: none of them.
  static int peer_index(const Inputs& in) {
    const int p = in.place;
    if (in.kind == 0) return p >= 22 && p < 32 ? p - 22 : -1;
    return p >= 6 && p < 12 ? p - 6 : p >= 26 && p < 30 ? p - 20 : p == 34 || p == 35 ? p - 24 : -1;
  }

  void clock(const Inputs& in) {
    Inputs udp = in;
    udp.kind = 2;
    const bool of_token = in.place >= 46 && in.place < 50;
    if (in.valid && in.data != byte_) {
      if (peer_index(udp) >= 0) peer_ok_ = false;
      if (of_token) token_ok_ = false;
      if (in.step == Step::kWords) nonce_ok_ = false;
    }
    if (in.step == Step::kIdle) peer_ok_ = token_ok_ = nonce_ok_ = true;

    byte_ = bytes_[in.address & 63];
    const bool of_header = in.place >= 42 && in.place < 58;
    if (in.valid && in.step == Step::kPeer && in.session_io && (!of_header || !in.renewed || in.read)) {
      uint8_t value = in.data;
      if (of_token && !in.read) value = static_cast<uint8_t>(lfsr_ | (in.place == 49));  // a token is odd
      bytes_[static_cast<size_t>(in.place)] = value;
    }

    const bool mixed = in.valid && in.step == Step::kWords;
    for (int i = 0; i < 8; ++i) lfsr_ = lfsr_ << 1 | ((lfsr_ >> 31 ^ lfsr_ >> 30 ^ lfsr_ >> 29 ^ lfsr_ >> 9) & 1);
    if (mixed) lfsr_ ^= in.data;
    if (!mixed && in.tick) lfsr_ ^= 1;
  }

 private:
  std::array<uint8_t, 64> bytes_{};
  uint32_t lfsr_ = 0x5eed1234;
  uint8_t byte_ = 0;
  bool peer_ok_ = true, token_ok_ = true, nonce_ok_ = true;
};

}  // namespace psweep::golden
