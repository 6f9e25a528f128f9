// SPDX-License-Identifier: Apache-2.0
// Model of entity message_sequencer: the step that follows, and what is told of it in the same clock or in the next
// one.
#pragma once
#include <cstdint>

#include "golden/message_rules.hpp"

namespace psweep::golden {

class MessageSequencer {
 public:
  struct Inputs {
    bool expired = false, stuck = false, due = false, first = false, grant = false, refuse = false;
    uint8_t type = 0;
    bool ask_answer = false, word_full = false, header_end = false, rows_end = false, peer_end = false;
    Step head = Step::kWait, word = Step::kWait;
    bool head_alive = false, admitted = false, long_word = false, open_new = false, open_again = false;
    int result = 0;
    bool fetched = false, body_cells = false, reply_end = false, cells_end = false;
    bool message = false, sender_ready = false, byte_ready = false, chunk_new = false;
    int kind = 2;
  };
  // One clock after what causes them.
  struct Pulses {
    bool done = false, start = false, abort_frame = false, abort = false, check = false, commit = false;
    bool packet = false, session = false, timeout = false, limited = false, unreachable = false;
  };

  Step step() const { return step_; }
  int clocks() const { return clocks_; }
  bool session() const { return session_; }
  bool alive() const { return alive_; }
  bool is_map() const { return map_; }
  bool is_icmp() const { return icmp_; }
  bool session_io() const { return io_; }
  bool renewed() const { return renewed_; }
  const Pulses& pulses() const { return pulses_; }

  bool map_packet(const Inputs& in) const { return idle(in) == Idle::kPacket; }
  bool recover(const Inputs& in) const { return in.stuck && !alive_ && step_ != Step::kIdle; }
  bool checked() const { return (step_ == Step::kCheck && clocks_ == 3) || (step_ == Step::kDivide && clocks_ >= 32); }
  static bool is_open(const Inputs& in) { return in.kind == 2 && in.type == net::kOpen; }
  static int bucket(const Inputs& in) { return is_open(in) ? 1 : in.kind == 0 ? 0 : 2; }
  bool read_head(const Inputs& in) const {
    return step_ == Step::kDecide && in.type == net::kRead && in.admitted && in.long_word;
  }
  bool read_tail(const Inputs& in) const { return step_ == Step::kWords && in.word_full && in.type == net::kRead; }

  void clock(const Inputs& in) {
    const bool lost = recover(in);
    const bool opens = step_ == Step::kWords && in.word_full && (in.open_new || in.open_again);
    tell(in, lost);
    const bool alive = (step_ == Step::kIdle && !session_) || (step_ == Step::kDecide && in.head_alive) ||
                       (opens && !in.open_new) || step_ == Step::kAbort || lost;
    const Step next = lost ? Step::kAbort : follow(in);
    count(in);
    if (step_ == Step::kAbort) session_ = !renewed_;
    if (step_ == Step::kIdle) {
      map_ = io_ = map_packet(in);
      icmp_ = idle(in) == Idle::kMessage && in.kind % 2 == 1;
      silent_ = false;
      by_timer_ = idle(in) == Idle::kTimeout;
      renewed_ = true;
    }
    if (read_head(in) || opens) io_ = true;
    if (opens && in.open_new) renewed_ = false;
    if (step_ == Step::kDecide && in.admitted && in.type == net::kWrite) silent_ = !in.ask_answer;
    if (lost) {
      silent_ = renewed_ = true;
      by_timer_ = false;
    }
    alive_ = alive;
    step_ = next;
  }

 private:
  enum class Idle { kNone, kTimeout, kMessage, kPacket };

  Idle idle(const Inputs& in) const {
    if (step_ != Step::kIdle) return Idle::kNone;
    if (session_ && in.expired) return Idle::kTimeout;
    if (in.message && !(in.first && in.due)) return Idle::kMessage;
    return in.due && in.sender_ready ? Idle::kPacket : Idle::kNone;
  }

  Step follow(const Inputs& in) const {
    switch (step_) {
      case Step::kIdle:
        switch (idle(in)) {
          case Idle::kTimeout:
            return Step::kAbort;
          case Idle::kMessage:
            return in.kind == 2 ? Step::kHeader : Step::kLimit;
          case Idle::kPacket:
            return Step::kFetch;
          default:
            return step_;
        }
      case Step::kHeader:
        return in.header_end ? Step::kDecide : step_;
      case Step::kDecide:
        return in.head;
      case Step::kLimit:
        if (in.refuse) return Step::kDone;
        if (!in.grant) return step_;
        return is_open(in) && in.result == net::kOk ? Step::kWords : Step::kWait;
      case Step::kWords:
        return in.word_full ? in.word : step_;
      case Step::kDivide:
        return checked() ? Step::kWait : step_;
      case Step::kCheck:
        return !checked() ? step_ : in.chunk_new ? Step::kRows : Step::kWait;
      case Step::kRows:
        return in.rows_end ? Step::kWait : step_;
      case Step::kWait:
        return silent_ ? Step::kDone : in.sender_ready ? Step::kPeer : step_;
      case Step::kPeer:
        return !in.peer_end ? step_ : in.kind == 0 ? Step::kDone : Step::kFetch;
      case Step::kFetch:
        return in.fetched ? Step::kShow : step_;
      case Step::kShow:
        if (!in.byte_ready) return step_;
        return in.body_cells ? Step::kCells : in.reply_end ? Step::kDone : Step::kFetch;
      case Step::kCells:
        return in.cells_end ? Step::kIdle : step_;
      case Step::kDone:
        return clocks_ == 3 ? Step::kIdle : step_;
      default:
        return by_timer_ ? Step::kIdle : Step::kWait;
    }
  }

  void count(const Inputs& in) {
    const bool counts =
        step_ == Step::kDivide || step_ == Step::kCheck || step_ == Step::kFetch || step_ == Step::kDone;
    if (step_ == Step::kIdle || in.peer_end || (step_ == Step::kCheck && clocks_ == 3) ||
        (step_ == Step::kFetch && in.fetched))
      clocks_ = 0;
    else if (step_ == Step::kWords && in.word_full && in.word == Step::kDivide)
      clocks_ = 8;  // bits 23 to 0
    else if (counts)
      clocks_ = (clocks_ + 1) & 63;
  }

  void tell(const Inputs& in, bool lost) {
    pulses_ = {};
    pulses_.packet = map_packet(in);
    pulses_.start = pulses_.packet || in.peer_end;
    pulses_.done = step_ == Step::kDone && clocks_ == 0 && in.message && !map_;
    pulses_.abort_frame = lost;
    pulses_.abort = step_ == Step::kAbort;
    pulses_.check = step_ == Step::kDecide && in.head == Step::kCheck;
    pulses_.commit = in.rows_end;
    pulses_.session = step_ == Step::kAbort && !renewed_;
    pulses_.timeout = idle(in) == Idle::kTimeout;
    pulses_.limited = in.refuse;
    pulses_.unreachable = in.peer_end && in.kind == 3;
  }

  Step step_ = Step::kIdle;
  int clocks_ = 0;
  bool session_ = false, alive_ = false, map_ = false, icmp_ = false, io_ = false, renewed_ = true, silent_ = false,
       by_timer_ = false;
  Pulses pulses_;
};

}  // namespace psweep::golden
