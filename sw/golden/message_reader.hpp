// SPDX-License-Identifier: Apache-2.0
// Model of entity message_reader: which byte of the frame is asked for, which one passes, and what of the message is
// known by then.
#pragma once
#include <cstdint>

#include "golden/message_rules.hpp"

namespace psweep::golden {

class MessageReader {
 public:
  struct Inputs {
    Step step = Step::kIdle;
    bool map_packet = false;  // begins
    bool session_io = false;  // bytes of OPEN or READ are kept
    bool words_end = false, reply_step = false, recover = false;
    int kind = 2, length = 0;  // of packet_rx
    uint8_t data = 0;          // byte that was asked for a clock ago
    bool bit = false;          // of the bitmap
  };

  explicit MessageReader(int write_bytes) : write_bytes_(write_bytes) {}

  int address() const { return address_; }
  bool valid() const { return valid_; }
  int place() const { return place_; }
  uint32_t word() const { return word_; }
  uint32_t word_next(const Inputs& in) const { return word_ << 8 | in.data; }
  bool word_full() const { return valid_ && place_ % 4 == 1; }
  int words() const { return words_; }
  uint8_t type() const { return type_; }
  bool magic() const { return magic_; }
  bool version() const { return version_; }
  bool ask_answer() const { return ask_answer_; }

  bool at_last() const { return address_ == end_; }
  bool header_end(const Inputs& in) const { return valid_ && in.step == Step::kHeader && place_ == kArguments - 1; }
  bool rows_end(const Inputs& in) const { return valid_ && in.step == Step::kRows && at_last(); }
  // Behind the port and, if the header is kept, behind it; of OPEN behind its nonce.
  bool peer_end(const Inputs& in) const {
    const bool open = in.session_io && !(type_ & 8);
    return valid_ && in.step == Step::kPeer && (place_ == 61 || (place_ == 57 && !open));
  }

  // Bytes of the message.
  bool long_as(int bytes) const { return end_ >= kMessage + bytes; }
  bool long_header() const { return long_as(16); }
  bool long_word() const { return long_as(20); }
  bool long_start() const { return long_as(16 + net::kStartBytes); }
  bool long_write() const { return end_ == kArguments + write_bytes_; }
  bool long_list() const {
    return long_as(net::kCountersRequestBytes) || ((type_ & 1) && long_as(net::kInfoRequestBytes));
  }
  bool whole_words() const { return end_ % 4 == 2; }
  bool reply_last() const { return ((address_ + 2) & 2047) == end_; }
  bool reply_zeros(const Inputs& in) const { return in.kind >= 2 && address_ < 13; }

  void clock(const Inputs& in) {
    const bool reads =
        in.step == Step::kHeader || in.step == Step::kWords || in.step == Step::kRows || in.step == Step::kPeer;
    const bool over = header_end(in) || rows_end(in) || peer_end(in) || (in.words_end && in.step == Step::kWords);
    header(in);
    if (in.step == Step::kIdle) words_ = 0;
    if (in.step == Step::kWords && word_full() && words_ < 31) ++words_;
    if (valid_)
      word_ = word_next(in);
    else if (in.step == Step::kFetch)
      word_ = (word_ & ~255u) | ((word_ << 1 | (in.bit ? 1u : 0u)) & 255);

    int next = address_ + (reads || in.reply_step ? 1 : 0);
    if (in.step == Step::kIdle) {
      next = in.map_packet ? kMessage : kSender;
      end_ = in.length + kMessage;
    } else if (in.step == Step::kDecide) {
      next = kArguments;
    } else if (in.step == Step::kWait) {
      next = kSender;
    } else if (peer_end(in)) {
      next = in.kind == 1 ? 38 : in.kind == 3 ? 10 : kMessage;
      if (in.kind == 1) end_ = in.length + 34;
      if (in.kind == 3) end_ = 42;
    }
    end_ &= 2047;
    place_ = address_ & 63;
    address_ = next & 2047;
    valid_ = reads && !over && !in.recover;
  }

 private:
  static constexpr int kSender = 6, kMessage = 42, kArguments = kMessage + 16;

  void header(const Inputs& in) {
    if (in.map_packet) type_ = net::kMap;
    if (in.map_packet || in.step != Step::kHeader || !valid_) return;
    if (place_ == kMessage + 3) {
      type_ = in.data;
      magic_ = word_next(in) >> 16 == net::kMagic;
      version_ = (word_next(in) >> 8 & 255) == net::kVersion;
    } else if (place_ == kMessage + 10) {
      ask_answer_ = in.data & net::kFlagAnswer;
    }
  }

  int write_bytes_;
  int address_ = 0, place_ = 0, words_ = 0, end_ = 0;
  bool valid_ = false, magic_ = false, version_ = false, ask_answer_ = false;
  uint32_t word_ = 0;
  uint8_t type_ = 0;
};

}  // namespace psweep::golden
