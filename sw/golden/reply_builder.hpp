// SPDX-License-Identifier: Apache-2.0
// Model of entity reply_builder: where in a reply it is, and which byte is due there.
#pragma once
#include <array>
#include <cstdint>

#include "golden/message_rules.hpp"

namespace psweep::golden {

class ReplyBuilder {
 public:
  struct Inputs {
    Step step = Step::kIdle;
    int clocks = 0;  // in Step::kFetch
    bool is_map = false, is_icmp = false, session_io = false, peer_end = false;
    bool only_header = false, of_list = false, long_list = false;  // with Step::kDecide
    int result = 0, kind = 2;
    uint8_t type = 0;
    bool reply_last = false, reply_zeros = false;
    uint8_t frame = 0, memory = 0, bits = 0, info = 0;  // bytes that may be due
    std::array<uint32_t, net::kStatusWords> status{};
    uint16_t chunk = 0;
    uint32_t counter = 0;
    bool counter_valid = true;
    bool cell_valid = false, cell_last = false;
    uint8_t cell = 0;
    bool ready = false;  // of packet_tx
  };

  explicit ReplyBuilder(int row_slots) : status_end_(kHeader + net::kStatusWords + (row_slots + 31) / 32 - 1) {}

  int word() const { return word_; }
  int place() const { return byte_; }
  bool in_list(const Inputs& in) const { return list_ && word_ >= kHeader && !in.is_map; }
  bool in_bitmap(const Inputs& in) const { return word_ >= kBitmap && !in_list(in) && !in.is_map; }
  bool in_status(const Inputs& in) const { return word_ >= kHeader && !list_ && !in.is_map; }
  bool at_end() const { return word_ == end_ && byte_ == 3; }
  bool body_cells(const Inputs& in) const { return in.is_map && !in.is_icmp && word_ == kHeader - 1 && byte_ == 3; }
  bool reply_end(const Inputs& in) const { return at_end() && (in.is_icmp ? !in.reply_last : !in.is_map); }
  // The byte that was asked for, in clock n of Step::kFetch, is there.
  bool fetched(const Inputs& in) const {
    if (in_bitmap(in)) return in.clocks == 9;
    return in.clocks >= 3 && (!in_list(in) || !counters(in) || in.counter_valid);
  }

  uint8_t data(const Inputs& in) const {
    if (in.step == Step::kCells) return in.cell;
    if (in.is_map && word_ % 4 == 3 && byte_ >= 2) return byte_of(in.chunk, byte_);
    if (word_ < kHeader) return header(in);
    if (in_list(in)) return counters(in) ? byte_of(in.counter, byte_) : in.info;
    if (in_bitmap(in)) return in.bits;
    return byte_of(in.status[static_cast<size_t>(word_ - kHeader)], byte_);
  }
  bool valid(const Inputs& in) const { return in.step == Step::kCells ? in.cell_valid : in.step == Step::kShow; }
  bool last(const Inputs& in) const { return in.step == Step::kCells ? in.cell_last : at_end() && !in.is_map; }

  void clock(const Inputs& in) {
    if (in.step == Step::kIdle) {
      list_ = false;
      set(0, 0);
      end_ = status_end_;
    } else if (in.step == Step::kDecide) {
      if (in.of_list) list_ = in.long_list;
      if (in.of_list) end_ = kHeader + (counters(in) ? net::kCounterWords : net::kInfoWords) - 1;
      if (in.only_header) end_ = kHeader - 1;
    } else if (in.peer_end && in.kind == 3) {
      set(2, 3);  // the zero of the header
    } else if (in.step == Step::kShow && in.ready) {
      if (!in.is_icmp) {
        set(word_ + (byte_ == 3 ? 1 : 0), (byte_ + 1) % 4);
      } else if (in.reply_last) {
        end_ = 1;
        set(1, 3);
      } else if (!at_end() && in.reply_zeros) {
        set(2, 3);
      } else {
        set(0, 0);
      }
    }
  }

 private:
  static constexpr int kHeader = net::kHeaderBytes / 4;
  static constexpr int kBitmap = kHeader + net::kStatusWords;

  static bool counters(const Inputs& in) { return in.type & 4; }
  static uint8_t byte_of(uint32_t word, int n) { return static_cast<uint8_t>(word >> (24 - 8 * n)); }
  // The request's own bytes, but for four; OPEN's token, and all of a map packet, are those of the session's memory.
  uint8_t header(const Inputs& in) const {
    if (word_ == 0 && byte_ == 2) return net::kVersion;
    if (word_ == 0 && byte_ == 3) return in.type | net::kReply;
    if (word_ == 2 && byte_ == 2) return static_cast<uint8_t>(in.result);
    if (word_ == 2 && byte_ == 3) return 0;
    return in.is_map || (in.session_io && word_ == 1) ? in.memory : in.frame;
  }
  void set(int word, int byte) {
    word_ = word;
    byte_ = byte;
  }

  int status_end_;
  int word_ = 0, byte_ = 0, end_ = 0;
  bool list_ = false;
};

}  // namespace psweep::golden
