// SPDX-License-Identifier: Apache-2.0
// SessionWatch: ends the session of a host that has been silent for so many seconds of wall time, though the chip's own
// timer counts simulated ones (psweep-sim --session-wall). It reads the token from the frames at the chip's pins, and
// says CLOSE in the host's name, once a second until the chip's session is over; past the faults and the cable.
//   For the chip it is a CLOSE like any other: its counter `timeouts` stays.
//   The host hears nothing of it: answer() names the frames that are kept from it.
// Uses desk.on_wire. Wall time is told by the caller, in seconds, never backwards.
#pragma once
#include <optional>

#include "contract/frames.hpp"
#include "desk/desk.hpp"

namespace psweep::chip {

class SessionWatch {
 public:
  // chip: its address behind the straps. seconds <= 0: does nothing.
  SessionWatch(Desk& desk, const net::Address& chip, double seconds) : desk_(desk), chip_(chip), seconds_(seconds) {
    if (seconds_ <= 0) return;
    desk_.on_wire = [this](bool from_chip, const net::Bytes& frame) { see(from_chip, frame); };
  }
  ~SessionWatch() {
    if (seconds_ > 0) desk_.on_wire = nullptr;
  }
  SessionWatch(const SessionWatch&) = delete;
  SessionWatch& operator=(const SessionWatch&) = delete;

  // Call it often.
  void look(double wall) {
    wall_ = wall;
    if (!owner_) return;
    if (!desk_.chip().session()) {
      if (asked_ > 0) ++ended_;
      owner_.reset();
      asked_ = 0;
      return;
    }
    if (wall_ < heard_ + seconds_ || wall_ < next_) return;
    next_ = wall_ + 1;
    ++asked_;
    net::Header h;
    h.type = net::kClose;
    h.token = token_;
    h.sequence = kSequence;
    h.index = kIndex;
    net::Bytes frame = net::make_udp(*owner_, chip_, net::encode(h));
    net::append_fcs(frame);
    desk_.send_raw(std::move(frame));
  }
  // An answer to a CLOSE of this class.
  static bool answer(const net::Bytes& frame) {
    const auto p = net::parse_udp(frame);
    const auto h = p ? net::decode(p->payload) : std::nullopt;
    return h && h->type == (net::kClose | net::kReply) && h->sequence == kSequence && h->index == kIndex;
  }
  uint64_t ended() const { return ended_; }  // sessions

 private:
  // A host's CLOSE has index 0.
  static constexpr uint16_t kSequence = 0x5053, kIndex = 0xffff;

  void see(bool from_chip, const net::Bytes& frame) {
    const auto p = net::parse_udp(frame);
    if (!p || (from_chip ? p->from : p->to).port != chip_.port) return;
    const auto h = net::decode(p->payload);
    if (!h) return;
    if (from_chip) {
      // A new session, or one that has moved to another address.
      if (h->type != (net::kOpen | net::kReply) || h->flags != net::kOk) return;
      owner_ = p->to;
      token_ = h->token;
      heard_ = wall_;
      asked_ = 0;
      next_ = 0;
    } else if (owner_ && h->token == token_ && p->from == *owner_ && h->index != kIndex) {
      heard_ = wall_;
      next_ = 0;
    }
  }

  Desk& desk_;
  const net::Address chip_;
  const double seconds_;
  double wall_ = 0, heard_ = 0, next_ = 0;
  std::optional<net::Address> owner_;
  uint32_t token_ = 0;
  uint64_t asked_ = 0, ended_ = 0;
};

}  // namespace psweep::chip
