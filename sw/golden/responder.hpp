// SPDX-License-Identifier: Apache-2.0
// Model of entity responder, message by message (docs/protocol.md): session, order rules, answers, map packets. What it
// commands are the models of row buffer, map buffer, scheduler, control and counters; the engine in time is TileRun.
// Bytes are exact. Tokens are those of the chip only in being new. A peer is a number that stands for MAC address, IP
// address and UDP port together. Answers to ARP, ping and closed ports are not made here, but they take from the same
// buckets: allow(). No I/O, no errors: every payload is legal input.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "contract/protocol.hpp"
#include "contract/registers.hpp"
#include "golden/control.hpp"
#include "golden/counters.hpp"
#include "golden/info_rom.hpp"
#include "golden/map_buffer.hpp"
#include "golden/row_buffer.hpp"
#include "golden/scheduler.hpp"
#include "golden/tile_run.hpp"

namespace psweep::golden {

class Responder {
 public:
  using Bytes = net::Bytes;
  // Answers to whoever asks: at most net::kBucketAnswers at once of each kind, one more each millisecond.
  enum class Bucket { kArp, kOpen, kOther };
  struct Parts {
    RowBuffer& rows;
    MapBuffer& map;
    Scheduler& scheduler;
    Control& control;
    Counters& counters;
    TileRun& run;
  };

  Responder(const net::ArbiterConfig& config, const Parts& parts) : config_(config), parts_(parts) {}

  void set_mac(uint64_t mac) { mac_ = mac; }
  void set_pins(bool full_duplex, bool speed_100) {
    pin_full_ = full_duplex;
    pin_100_ = speed_100;
  }

  // Takes one answer from the bucket; if there is none, counts it as limited: the chip is silent.
  bool allow(Bucket bucket) {
    int& left = buckets_[static_cast<size_t>(bucket)];
    if (left == 0) {
      parts_.counters.count(net::kLimited);
      return false;
    }
    --left;
    return true;
  }
  int left(Bucket bucket) const { return buckets_[static_cast<size_t>(bucket)]; }
  // When the milliseconds begin, in seconds, modulo a millisecond.
  void set_tick_phase(double seconds, double now) {
    tick_phase_ = seconds;
    ticks_ = tick_at(now);
  }
  void refill(double now) {
    const int64_t tick = tick_at(now);
    for (int& left : buckets_) left = static_cast<int>(std::min<int64_t>(net::kBucketAnswers, left + tick - ticks_));
    ticks_ = tick;
  }

  // Reset. Tokens go on, since the real ones depend on the time.
  void power_on(double now) {
    buckets_.fill(net::kBucketAnswers);
    open_ = false;
    forget(now);
  }
  // When the session ends unless something is heard, in seconds.
  double deadline() const { return heard_ + config_.session_ms * 1e-3; }
  void time_out(double now) {
    parts_.counters.count(net::kTimeouts);
    close(now);
  }

  // The replies to one UDP payload: none or one. latest_code(): how it was taken, also of a message without a reply;
  // nothing: it was none, or an answer, or an OPEN that found its bucket empty.
  std::vector<Bytes> message(const Bytes& m, uint32_t peer, double now) {
    latest_code_.reset();
    if (m.size() < net::kHeaderBytes || net::get16(m, 0) != net::kMagic) {
      parts_.counters.count(net::kBadMessages);
      return {};
    }
    const net::Header h = header_of(m);
    if ((h.type & net::kReply) != 0) {
      parts_.counters.count(net::kAnswers);
      return {};
    }
    const bool version_ok = m[2] == net::kVersion;
    const bool authentic = open_ && version_ok && h.token == token_ && peer == peer_;
    if (authentic) heard_ = now;
    const bool opens = version_ok && h.type == net::kOpen && m.size() >= net::kHeaderBytes + 4;
    if (opens && !allow(Bucket::kOpen)) return {};
    bool silent = false;
    const net::Code code = opens ? open(m, h, peer, now) : obey(m, h, authentic, silent, now);
    latest_code_ = code;
    parts_.run.advance(now, now);  // what became possible at once
    if (!opens && (!authentic || h.type == net::kOpen)) {
      if (!allow(h.type == net::kOpen ? Bucket::kOpen : Bucket::kOther)) return {};
    }
    if (silent) return {};
    return {reply(h, code, opens, authentic)};
  }

  // The next packet of the READ in force, if its chunk is there.
  std::optional<Bytes> map_packet() {
    const MapBuffer& map = parts_.map;
    if (read_left_ == 0 || !map.busy() || read_tile_ != parts_.run.map_tile() || !map.ready(read_next_))
      return std::nullopt;
    net::Header h;
    h.type = net::kMap;
    h.token = token_;
    h.sequence = read_sequence_;
    h.tile = read_tile_;
    h.index = read_next_;
    Bytes out = net::encode(h);
    const Bytes cells = map.bytes(read_next_);
    out.insert(out.end(), cells.begin(), cells.end());
    ++read_next_;
    --read_left_;
    parts_.counters.count(net::kMapPackets);
    return out;
  }

  std::optional<net::Code> latest_code() const { return latest_code_; }
  bool session_open() const { return open_; }
  uint32_t token() const { return token_; }
  uint32_t peer() const { return peer_; }  // of the session
  bool full_duplex() const { return duplex_ == net::kDuplexFull || (duplex_ == net::kDuplexByPin && pin_full_); }

  void append_status(Bytes& out) const {
    using namespace net;
    const auto& [rows, map, scheduler, control, counters, run] = parts_;
    auto flag = [](bool on, StatusFlag bit) { return on ? static_cast<uint32_t>(bit) : 0; };
    const uint32_t flags = flag(open_, kFlagSession) | flag(rows.open(), kFlagRows) | flag(!run.idle(), kFlagEngine) |
                           flag(map.busy(), kFlagMap) | flag(map.complete(), kFlagMapComplete) |
                           flag(scheduler.failed(), kFlagFailed) | flag(full_duplex(), kFlagFullDuplex) |
                           flag(pin_100_, kFlagSpeed100) | static_cast<uint32_t>(run.state()) << 8;
    append16(out, last_tile_);
    append16(out, flags);
    append16(out, scheduler.run_tile());
    append16(out, run.map_tile());
    append16(out, static_cast<uint32_t>(rows.base()));
    append16(out, static_cast<uint32_t>(rows.received()));
    append16(out, table_id_);
    append16(out, static_cast<uint32_t>(table_words_));
    append32(out, static_cast<uint32_t>(map.count()));
    append16(out, control.errors());
    append16(out, control.error_count());
    append16(out, control.tiles_done());
    append16(out, control.tiles_dropped());
    append32(out, control.tile_clocks());
    append16(out, control.window_errors());
    append16(out, scheduler.failed_tile());
    for (int first = 0; first < config_.slots(); first += 32) {
      uint32_t word = 0;
      for (int i = first; i < first + 32; ++i) word = word << 1 | (rows.bit(i) ? 1u : 0u);
      append32(out, word);
    }
  }

 private:
  static constexpr size_t kMostTableWords = 364;  // of one message
  static constexpr size_t kTableSpace = 8192;     // words that are counted

  static net::Header header_of(const Bytes& m) {
    net::Header h;
    h.type = m[3];
    h.token = net::get32(m, 4);
    h.sequence = static_cast<uint16_t>(net::get16(m, 8));
    h.flags = m[10];
    h.tile = static_cast<uint16_t>(net::get16(m, 12));
    h.index = static_cast<uint16_t>(net::get16(m, 14));
    return h;
  }
  net::Code bad() {
    parts_.counters.count(net::kBadMessages);
    return net::kBadMessage;
  }

  // An OPEN of full length.
  net::Code open(const Bytes& m, const net::Header& h, uint32_t peer, double now) {
    const uint32_t nonce = net::get32(m, net::kHeaderBytes);
    if (!open_) {
      forget(now);
      open_ = true;
      nonce_ = nonce;
      next_token(nonce);
      parts_.counters.count(net::kSessions);
    } else if (nonce != nonce_ || (peer != peer_ && h.token != token_)) {
      parts_.counters.count(net::kForeign);
      return net::kBusy;
    }
    peer_ = peer;
    heard_ = now;
    return net::kOk;
  }

  // Header good; decides and does.
  net::Code obey(const Bytes& m, const net::Header& h, bool authentic, bool& silent, double now) {
    const size_t body = m.size() - net::kHeaderBytes;
    if (m[2] != net::kVersion || h.type == 0 || h.type == net::kOpen || h.type > net::kSet) return bad();
    if (h.type == net::kInfo) return m.size() < net::kInfoRequestBytes ? bad() : net::kOk;
    if (h.type == net::kCounters) return m.size() < net::kCountersRequestBytes ? bad() : net::kOk;
    // Here a WRITE is answered even without its flag: who sends it must learn that nobody listens.
    if (!open_) return h.type == net::kClose ? net::kOk : net::kNoSession;
    if (!authentic) {
      parts_.counters.count(net::kForeign);
      return net::kBusy;
    }
    switch (h.type) {
      case net::kClose:
        close(now);
        return net::kOk;
      case net::kTable:
        return table(m, h, body);
      case net::kStart:
        return body < size_t{net::kStartBytes} ? bad() : start(m, h);
      case net::kWrite:
        silent = (h.flags & net::kFlagAnswer) == 0;
        return body != parts_.rows.chunk_bytes() ? bad() : write(m, h);
      case net::kRead:
        return body < 4 ? bad() : read(m, h);
      case net::kRelease:
        return release(h);
      case net::kSet:
        if (body < 4 || h.index != 0 || net::get32(m, net::kHeaderBytes) > net::kDuplexFull) return bad();
        duplex_ = static_cast<uint8_t>(net::get32(m, net::kHeaderBytes));
        return net::kOk;
      default:
        return net::kOk;  // STATUS
    }
  }

  net::Code table(const Bytes& m, const net::Header& h, size_t body) {
    if (body < 4 || body % 4 != 0 || body / 4 > kMostTableWords) return bad();
    const bool next = h.tile == static_cast<uint16_t>(table_id_ + 1) && h.index == 0;
    if (!next && (h.tile != table_id_ || table_id_ == 0 || h.index > table_words_)) return net::kOrder;
    if (parts_.rows.open() || !parts_.run.idle()) return net::kNotReady;
    if (next) {
      ++table_id_;
      table_words_ = 0;
    }
    // Words beyond the engine's table are errors there, but are counted as written.
    for (size_t i = 0; i < body / 4; ++i) {
      const size_t at = h.index + i;
      parts_.control.write_table(at, net::get32(m, net::kHeaderBytes + 4 * i));
      if (at == table_words_ && table_words_ < kTableSpace) ++table_words_;
    }
    return net::kOk;
  }

  net::Code start(const Bytes& m, const net::Header& h) {
    if (h.tile == last_tile_) return net::kOk;
    if (h.tile != static_cast<uint16_t>(last_tile_ + 1)) return net::kOrder;
    if (parts_.rows.open()) return net::kNotReady;
    const size_t at = net::kHeaderBytes;
    if (net::get16(m, at) != table_id_) return net::kOrder;
    const uint32_t pixels = net::get32(m, at + 4), chunks = net::get32(m, at + 8);
    if (pixels == 0 || pixels >> 24 != 0 || chunks == 0 || chunks >> 16 != 0) return bad();
    auto word = [&](int i) { return net::get32(m, at + 12 + 4 * static_cast<size_t>(i)); };
    if ((word(4) & 0x7ff) > table_words_ / 8) return net::kOrder;
    const auto per = static_cast<uint32_t>(config_.chunk_pairs());
    if (chunks != (pixels + per - 1) / per) return bad();
    for (int i = 0; i < net::kJobWords; ++i) parts_.scheduler.job(i, word(i));
    ++last_tile_;
    parts_.rows.open_tile(pixels, static_cast<int>(chunks));
    parts_.run.stage(last_tile_);
    return net::kOk;
  }

  net::Code write(const Bytes& m, const net::Header& h) {
    if (h.tile != last_tile_) return net::kOrder;
    if (!parts_.rows.open()) return net::kOk;  // consumed
    switch (parts_.rows.check(h.index)) {
      case RowBuffer::Answer::kRepeated:
        parts_.counters.count(net::kChunksRepeated);
        return net::kOk;
      case RowBuffer::Answer::kRefused:
        parts_.counters.count(net::kChunksRefused);
        return net::kNotReady;
      default:
        parts_.rows.store(h.index, Bytes(m.begin() + net::kHeaderBytes, m.end()));
        return net::kOk;
    }
  }

  net::Code read(const Bytes& m, const net::Header& h) {
    read_sequence_ = h.sequence;
    read_tile_ = h.tile;
    read_next_ = h.index;
    read_left_ = static_cast<uint16_t>(net::get16(m, net::kHeaderBytes));
    if (h.tile == parts_.run.map_tile()) parts_.map.keep(static_cast<int>(net::get16(m, net::kHeaderBytes + 2)));
    return net::kOk;
  }

  net::Code release(const net::Header& h) {
    if (h.tile != parts_.run.map_tile()) return net::kOrder;
    if (parts_.map.busy() && !parts_.map.complete()) return net::kNotReady;
    parts_.map.forget();
    return net::kOk;
  }

  void close(double now) {
    forget(now);
    open_ = false;
  }
  // What st_abort of the RTL does; the engine's errors and counters are cleared with it, but tile_clocks and the
  // numbers of the tiles launched and failed stay.
  void forget(double now) {
    parts_.control.stop(parts_.run.stop(now));
    parts_.run.forget_map_tile();
    parts_.scheduler.stop();
    parts_.rows.clear();
    parts_.map.forget();
    last_tile_ = 0xffff;
    table_id_ = 0;
    table_words_ = 0;
    read_left_ = 0;
    duplex_ = net::kDuplexByPin;
  }
  // 32-bit shift register of maximal period that goes on from the token, with the nonce mixed in; never 0.
  void next_token(uint32_t nonce) {
    for (int i = 31; i >= 0; --i) {
      const uint32_t mixed = token_ >> 31 ^ token_ >> 30 ^ token_ >> 29 ^ token_ >> 9 ^ nonce >> i;
      token_ = token_ << 1 | (mixed & 1);
    }
    token_ |= 1;
  }
  int64_t tick_at(double time) const { return static_cast<int64_t>(std::floor((time - tick_phase_) * 1e3)); }

  Bytes reply(const net::Header& h, net::Code code, bool opens, bool authentic) const {
    net::Header r = h;
    r.type = h.type | net::kReply;
    r.flags = code;
    if (opens && code == net::kOk) r.token = token_;
    Bytes out = net::encode(r);
    if (h.type == net::kInfo) {
      if (code == net::kOk) append_info(out);
    } else if (h.type == net::kCounters) {
      if (code == net::kOk)
        for (int i = 0; i < net::kCounterWords; ++i) net::append32(out, parts_.counters.value(i));
    } else if (authentic && h.type != net::kOpen) {
      append_status(out);
    }
    return out;
  }

  void append_info(Bytes& out) const {
    for (const uint32_t v : info_words(config_, config_.depth(), mac_)) net::append32(out, v);
  }

  net::ArbiterConfig config_;
  Parts parts_;
  uint64_t mac_ = 0x020000000001;
  bool pin_full_ = true, pin_100_ = true;
  bool open_ = false;
  uint32_t token_ = 0x5eed1234, nonce_ = 0, peer_ = 0;
  double heard_ = 0;
  std::array<int, 3> buckets_{};
  double tick_phase_ = 0;
  int64_t ticks_ = 0;
  uint8_t duplex_ = 0;
  uint16_t last_tile_ = 0xffff, table_id_ = 0;
  size_t table_words_ = 0;
  uint16_t read_tile_ = 0, read_next_ = 0, read_left_ = 0, read_sequence_ = 0;  // the READ in force
  std::optional<net::Code> latest_code_;
};

}  // namespace psweep::golden
