// SPDX-License-Identifier: Apache-2.0
// Model of entity message_rules: what becomes of a message (docs/protocol.md). Two questions, one about the header and
// one about each word of the arguments, and the numbers that the order goes by.
#pragma once
#include <cstdint>

#include "contract/protocol.hpp"

namespace psweep::golden {

// Steps of the responder, with even parity (C_ST_* of link_pkg).
enum class Step : uint8_t {
  kIdle = 0x00,
  kHeader = 0x03,
  kDecide = 0x05,
  kLimit = 0x06,
  kWords = 0x09,
  kDivide = 0x0a,
  kCheck = 0x0c,
  kRows = 0x0f,
  kWait = 0x11,
  kPeer = 0x12,
  kFetch = 0x14,
  kShow = 0x17,
  kCells = 0x18,
  kDone = 0x1b,
  kAbort = 0x1d,
};

class MessageRules {
 public:
  struct Message {
    uint8_t type = 0;
    bool magic = true, version = true, peer = true, token = true, nonce = true;
    // Its length: a header, a word of arguments, whole words; as START, WRITE, a list have to be.
    bool header = true, word = true, whole = true, start = true, write = true, list = true;
    uint16_t number = 0, index = 0;
  };
  struct Chip {
    bool session = false, rows = false, staged = false, running = false, engine_idle = true;
    bool map = false, map_complete = false;
    uint16_t map_tile = 0xffff;
  };
  struct Decision {
    Step next = Step::kWait;
    net::Code code = net::kOk;
    bool bad = false, foreign = false, answer = false;  // counted
    bool alive = false;                                 // the session's host was heard
    bool admitted = false;                              // a message of the session, as far as the header tells
    bool only_header = false, list = false;             // the reply
    bool release = false, new_table = false;
  };

  // The header. Until it is decided on, code() is net::kOk.
  Decision header(const Message& m, const Chip& c) const {
    Decision d;
    const bool authentic = c.session && m.version && m.token && m.peer;
    d.alive = authentic;
    d.only_header = !authentic;
    d.next = authentic ? Step::kWait : Step::kLimit;
    if (!m.magic || !m.header) return drop(d, true);
    if (m.type & net::kReply) {
      d.answer = true;
      return drop(d, false);
    }
    if (m.type == net::kOpen) {
      d.only_header = true;
      d.next = Step::kLimit;
      return m.version && m.word ? d : bad(d);
    }
    if (!m.version || m.type == 0 || m.type > net::kSet) return bad(d);
    if (m.type == net::kInfo || m.type == net::kCounters) {
      d.list = true;
      d.only_header = !m.list;
      return m.list ? d : bad(d);
    }
    if (!c.session) return refuse(d, m.type == net::kClose ? net::kOk : net::kNoSession);
    if (!authentic) {
      d.foreign = true;
      return refuse(d, net::kBusy);
    }
    d.admitted = true;
    return order(m, c, d);
  }

  struct Word {
    Step next = Step::kWords;
    net::Code code = net::kOk;
    bool bad = false, foreign = false, open_new = false, open_again = false;
  };
  // Word `count` of the arguments; last: of a TABLE.
  Word argument(const Message& m, const Chip& c, int count, uint32_t value, bool last) const {
    Word w;
    w.code = code_;
    w.next = Step::kWait;
    switch (m.type) {
      case net::kOpen:
        w.open_new = !c.session;
        w.open_again = c.session && m.nonce && (m.peer || m.token);
        if (w.open_new) w.next = Step::kAbort;
        w.foreign = !w.open_new && !w.open_again;
        if (w.foreign) w.code = net::kBusy;
        break;
      case net::kRead:
        break;
      case net::kSet:
        w.bad = index_ != 0 || value > net::kDuplexFull;
        break;
      case net::kTable:
        w.next = last ? Step::kWait : Step::kWords;
        break;
      default:
        start(w, count, value);
    }
    if (w.bad) w.code = net::kBadMessage;
    return w;
  }

  // What they leave behind.
  void decided(const Message& m, const Decision& d) {
    code_ = d.code;
    index_ = m.index;
    if (d.new_table) {
      table_ = m.number;
      table_words_ = 0;
    }
  }
  void taken(const Message& m, const Word& w, int count, uint32_t value) {
    code_ = w.code;
    if (m.type == net::kTable) {
      if (index_ == table_words_ && table_words_ < kMostWords) ++table_words_;
      ++index_;
    } else if (m.type == net::kSet && !w.bad) {
      duplex_ = static_cast<uint8_t>(value);
    } else if (m.type == net::kStart && count == 1) {
      pixels_ = value & 0xffffff;
    } else if (m.type == net::kStart && count == 2) {
      chunks_ = static_cast<uint16_t>(value);
    }
  }
  void divided(bool fits) {
    if (fits) ++tile_;
    if (!fits) code_ = net::kBadMessage;
  }
  void checked(bool fresh, bool repeated) {
    if (!fresh && !repeated) code_ = net::kNotReady;
  }
  void idle() { code_ = net::kOk; }
  void abort() {
    tile_ = 0xffff;
    table_ = table_words_ = 0;
    duplex_ = 0;
  }

  net::Code code() const { return code_; }
  uint16_t tile() const { return tile_; }
  uint16_t table() const { return table_; }
  uint16_t table_words() const { return table_words_; }
  uint16_t index() const { return index_; }
  uint32_t pixels() const { return pixels_; }
  uint16_t chunks() const { return chunks_; }
  uint8_t duplex() const { return duplex_; }

 private:
  static constexpr uint16_t kMostWords = 8192;  // eight for each of 1024 planes

  static Decision drop(Decision d, bool is_bad) {
    d.alive = false;
    d.next = Step::kDone;
    return is_bad ? bad(d) : d;
  }
  static Decision bad(Decision d) {
    d.bad = true;
    d.code = net::kBadMessage;
    return d;
  }
  static Decision refuse(Decision d, net::Code code) {
    d.code = code;
    return d;
  }
  static Decision step(Decision d, Step next) {
    d.next = next;
    return d;
  }

  Decision order(const Message& m, const Chip& c, Decision d) const {
    const auto after = [&](uint16_t known) { return m.number == static_cast<uint16_t>(known + 1); };
    const bool idle_chip = !c.rows && !c.staged && !c.running && c.engine_idle;
    switch (m.type) {
      case net::kClose:
        return step(d, Step::kAbort);
      case net::kRead:
      case net::kSet:
        return m.word ? step(d, Step::kWords) : bad(d);
      case net::kTable:
        if (!m.word || !m.whole) return bad(d);
        d.new_table = after(table_) && m.index == 0;
        if (!d.new_table && (m.number != table_ || table_ == 0 || m.index > table_words_))
          return refuse(d, net::kOrder);
        if (idle_chip) return step(d, Step::kWords);
        d.new_table = false;
        return refuse(d, net::kNotReady);
      case net::kStart:
        if (!m.start) return bad(d);
        if (m.number == tile_) return d;  // again
        if (!after(tile_)) return refuse(d, net::kOrder);
        return c.rows || c.staged ? refuse(d, net::kNotReady) : step(d, Step::kWords);
      case net::kWrite:
        if (!m.write) return bad(d);
        if (m.number != tile_) return refuse(d, net::kOrder);
        return c.rows ? step(d, Step::kCheck) : d;  // all of them have come
      case net::kRelease:
        if (m.number != c.map_tile) return refuse(d, net::kOrder);
        if (c.map && !c.map_complete) return refuse(d, net::kNotReady);
        d.release = true;
        return d;
      default:
        return d;
    }
  }

  // Table, pixels, chunks, then registers of the engine, the fifth of which is PLANES.
  void start(Word& w, int count, uint32_t value) const {
    w.next = Step::kWait;
    if (count == 0 && value >> 16 != table_) {
      w.code = net::kOrder;
    } else if ((count == 1 && (value == 0 || value >> 24)) || (count == 2 && (value == 0 || value >> 16))) {
      w.bad = true;
    } else if (count == 7 && (value & 0x7ff) > table_words_ / 8u) {
      w.code = net::kOrder;
    } else {
      w.next = count == 2 + net::kJobWords ? Step::kDivide : Step::kWords;
    }
  }

  net::Code code_ = net::kOk;
  uint16_t tile_ = 0xffff, table_ = 0, table_words_ = 0, index_ = 0, chunks_ = 0;
  uint32_t pixels_ = 0;
  uint8_t duplex_ = 0;
};

}  // namespace psweep::golden
