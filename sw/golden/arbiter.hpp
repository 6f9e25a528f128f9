// SPDX-License-Identifier: Apache-2.0
// Model of the chip behind its UDP port, message by message (docs/protocol.md): session, order rules, row buffer, plane
// table, engine, map buffer, status block, capabilities, counters. Golden model of rtl/responder.vhd and of the buffers
// and scheduler it commands; the host's tests run against it.
//
//   Arbiter chip(config);
//   chip.step(t);                                  // time goes on: engine, silence timer
//   for (const Bytes& reply : chip.message(payload, peer)) ..      // none or one
//   while (auto packet = chip.map_packet()) ..     // to chip.map_peer(); call it when the transmitter is free
//
// Bytes are exact. Time is not: the engine works in whole chunks and tiles, at clk_khz, one pixel, sample or cell a
// clock, and map cells come all at once as far as there is room. When nothing moves any more (next_event()), the status
// block is exact, but for tile_clocks of a tile that had to wait (clocks_exact()). Tokens are those of
// the chip only in being new. A peer is a number that stands for MAC address, IP address and UDP port together.
// Answers to ARP, ping and closed ports are not made here, but they take from the same buckets: allow().
// No I/O, no errors: every payload is legal input.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "contract/protocol.hpp"
#include "contract/registers.hpp"
#include "golden/control.hpp"
#include "golden/psweep.hpp"

namespace psweep::golden {

// Inverse of job_writes(): values of the registers net::kJobRegisters, in their order. Of a bound the engine keeps 13
// bits, of a step along a row 21 (table_entry()); sizes and threshold must fit.
inline TileJob job_from_words(const std::array<uint32_t, net::kJobWords>& w) {
  auto s = [&w](size_t i) { return static_cast<int32_t>(w[i]); };
  TileJob t;
  t.tile_cols = s(0), t.tile_rows = s(1), t.win_cols = s(2), t.win_rows = s(3), t.planes = s(4), t.threshold = s(5);
  t.tx_left = s(6), t.ty_left = s(7), t.tx_right = s(8), t.ty_right = s(9);
  auto bound = [&w](size_t i) { return static_cast<int32_t>(w[i] << 19) >> 19; };
  t.left = {bound(10), bound(11), bound(12), bound(13)};
  t.right = {bound(14), bound(15), bound(16), bound(17)};
  return t;
}
inline PlaneEntry table_entry(const uint32_t* w) {
  auto s = [w](int i) { return static_cast<int32_t>(w[i]); };
  const uint32_t step = (1u << 21) - 1;
  return {s(0), s(1), s(2), s(3), w[4] & step, w[5], w[6] & step, w[7]};
}

class Arbiter {
 public:
  using Bytes = net::Bytes;
  // What the engine computes; the default is the bit-true model. Tests put a memory of results in front of it.
  using Compute =
      std::function<TileResult(const TileJob&, const std::vector<PlaneEntry>&, const Pixels&, const Pixels&)>;

  explicit Arbiter(const net::ArbiterConfig& config) : config_(config) {
    compute_ = [this](const TileJob& t, const std::vector<PlaneEntry>& table, const Pixels& l, const Pixels& r) {
      return run_tile(config_.engine, t, table, l, r);
    };
    token_ = 0x5eed1234;
    power_on();
  }
  Arbiter(const Arbiter&) = delete;
  Arbiter& operator=(const Arbiter&) = delete;

  const net::ArbiterConfig& config() const { return config_; }
  void set_compute(Compute compute) { compute_ = std::move(compute); }
  // Seconds from the last pixel to the first cell; negative: the engine's clocks at clk_khz.
  void set_sweep_time(double seconds) { sweep_seconds_ = seconds; }
  void set_mac(uint64_t mac) { mac_ = mac; }
  void set_pins(bool full_duplex, bool speed_100) {
    pin_full_ = full_duplex;
    pin_100_ = speed_100;
  }
  void count(net::Counter counter) { ++counters_[counter]; }  // for the parts in front of this one: MAC and stack

  // Answers to whoever asks: at most net::kBucketAnswers at once of each kind, one more each millisecond.
  enum class Bucket { kArp, kOpen, kOther };
  // Takes one answer from the bucket; if there is none, counts it as limited: the chip is silent.
  bool allow(Bucket bucket) {
    int& left = buckets_[static_cast<size_t>(bucket)];
    if (left == 0) {
      ++counters_[net::kLimited];
      return false;
    }
    --left;
    return true;
  }
  int left(Bucket bucket) const { return buckets_[static_cast<size_t>(bucket)]; }
  // When the chip's milliseconds begin, in seconds of step()'s time, modulo a millisecond.
  void set_tick_phase(double seconds) {
    tick_phase_ = seconds;
    ticks_ = tick_at(now_);
  }

  // Reset of the whole chip. Tokens go on, since the real ones depend on the time.
  void power_on() {
    counters_ = {};
    buckets_.fill(net::kBucketAnswers);
    open_ = false;
    tile_clocks_ = 0;
    clocks_exact_ = shown_exact_ = true;
    run_tile_ = failed_tile_ = 0;
    forget();
  }

  // Engine and timers go on to this time, in seconds. Never backwards.
  void step(double time) {
    while (open_ && now_ < time) {
      const double deadline = heard_ + config_.session_ms * 1e-3;
      const double until = std::min(time, deadline);
      advance(until);
      now_ = until;
      if (deadline <= time) {
        ++counters_[net::kTimeouts];
        close();
      }
    }
    now_ = std::max(now_, time);
    const int64_t tick = tick_at(now_);
    for (int& left : buckets_) left = static_cast<int>(std::min<int64_t>(net::kBucketAnswers, left + tick - ticks_));
    ticks_ = tick;
  }

  // The replies to one UDP payload: none or one. latest_code(): how it was taken, also of a message without a reply;
  // nothing: it was none, or an answer, or an OPEN that found its bucket empty.
  std::vector<Bytes> message(const Bytes& m, uint32_t peer) {
    latest_code_.reset();
    if (m.size() < net::kHeaderBytes || net::get16(m, 0) != net::kMagic) {
      ++counters_[net::kBadMessages];
      return {};
    }
    net::Header h;
    h.type = m[3];
    h.token = net::get32(m, 4);
    h.sequence = static_cast<uint16_t>(net::get16(m, 8));
    h.flags = m[10];
    h.tile = static_cast<uint16_t>(net::get16(m, 12));
    h.index = static_cast<uint16_t>(net::get16(m, 14));
    if ((h.type & net::kReply) != 0) {
      ++counters_[net::kAnswers];
      return {};
    }
    const bool version_ok = m[2] == net::kVersion;
    const bool authentic = open_ && version_ok && h.token == token_ && peer == peer_;
    if (authentic) heard_ = now_;
    const bool opens = version_ok && h.type == net::kOpen && m.size() >= net::kHeaderBytes + 4;
    if (opens && !allow(Bucket::kOpen)) return {};
    bool silent = false;
    const net::Code code = opens ? open(m, h, peer) : obey(m, h, authentic, silent);
    latest_code_ = code;
    advance(now_);  // what became possible at once
    if (!opens && (!authentic || h.type == net::kOpen)) {
      if (!allow(h.type == net::kOpen ? Bucket::kOpen : Bucket::kOther)) return {};
    }
    if (silent) return {};
    net::Header reply = h;
    reply.type = h.type | net::kReply;
    reply.flags = code;
    if (opens && code == net::kOk) reply.token = token_;
    Bytes out = net::encode(reply);
    if (h.type == net::kInfo) {
      if (code == net::kOk) append_info(out);
    } else if (h.type == net::kCounters) {
      if (code == net::kOk)
        for (const uint32_t v : counters_) net::append32(out, v);
    } else if (authentic && h.type != net::kOpen) {
      append_status(out);
    }
    return {out};
  }

  // The next packet of the READ in force, if its chunk is there.
  std::optional<Bytes> map_packet() {
    if (read_left_ == 0 || !map_busy_ || read_tile_ != map_tile_ || !chunk_there(read_next_)) return std::nullopt;
    net::Header h;
    h.type = net::kMap;
    h.token = token_;
    h.sequence = read_sequence_;
    h.tile = read_tile_;
    h.index = read_next_;
    Bytes out = net::encode(h);
    const size_t per = config_.chunk_cells();
    const size_t first = read_next_ * per, last = std::min(first + per, map_.size());
    for (size_t i = first; i < last; ++i) {
      const uint64_t word = net::pack_wire_cell(config_.engine, map_[i]);
      for (int b = config_.cell_bytes() - 1; b >= 0; --b) out.push_back(static_cast<uint8_t>(word >> 8 * b));
    }
    ++read_next_;
    --read_left_;
    ++counters_[net::kMapPackets];
    return out;
  }
  uint32_t map_peer() const { return peer_; }  // the session's
  std::optional<net::Code> latest_code() const { return latest_code_; }

  // When the engine goes on by itself, in seconds; nothing: not before another message.
  std::optional<double> next_event() const {
    if (stage_ == Stage::kLoad || stage_ == Stage::kDrain) {
      if (!next_chunk_there()) return std::nullopt;
      return engine_time_ + next_pairs() * clock();
    }
    if (stage_ == Stage::kSweep) return engine_time_ + sweep_time();
    return std::nullopt;
  }
  bool sweeping() const { return stage_ == Stage::kSweep; }
  bool clocks_exact() const { return shown_exact_; }
  // The status block as words, not the reply to anybody.
  std::vector<uint32_t> status() const {
    Bytes bytes;
    append_status(bytes);
    return net::words_of(bytes, 0);
  }

  bool session_open() const { return open_; }
  uint32_t token() const { return token_; }
  uint32_t counter(net::Counter c) const { return counters_[c]; }
  bool full_duplex() const { return duplex_ == net::kDuplexFull || (duplex_ == net::kDuplexByPin && pin_full_); }

 private:
  enum class Stage { kIdle, kLoad, kDrain, kSweep, kUnload };

  // An OPEN of full length.
  net::Code open(const Bytes& m, const net::Header& h, uint32_t peer) {
    const uint32_t nonce = net::get32(m, net::kHeaderBytes);
    if (!open_) {
      forget();
      open_ = true;
      nonce_ = nonce;
      next_token(nonce);
      ++counters_[net::kSessions];
    } else if (nonce != nonce_ || (peer != peer_ && h.token != token_)) {
      ++counters_[net::kForeign];
      return net::kBusy;
    }
    peer_ = peer;
    heard_ = now_;
    return net::kOk;
  }

  // Header good; decides and does.
  net::Code obey(const Bytes& m, const net::Header& h, bool authentic, bool& silent) {
    const size_t body = m.size() - net::kHeaderBytes;
    auto bad = [this] {
      ++counters_[net::kBadMessages];
      return net::kBadMessage;
    };
    if (m[2] != net::kVersion || h.type == 0 || h.type == net::kOpen || h.type > net::kSet) return bad();
    if (h.type == net::kInfo) return m.size() < net::kInfoRequestBytes ? bad() : net::kOk;
    if (h.type == net::kCounters) return m.size() < net::kCountersRequestBytes ? bad() : net::kOk;
    // Here a WRITE is answered even without its flag: who sends it must learn that nobody listens.
    if (!open_) return h.type == net::kClose ? net::kOk : net::kNoSession;
    if (!authentic) {
      ++counters_[net::kForeign];
      return net::kBusy;
    }
    switch (h.type) {
      case net::kClose:
        close();
        return net::kOk;
      case net::kTable:
        return table(m, h, body);
      case net::kStart:
        return body < size_t{net::kStartBytes} ? bad() : start(m, h);
      case net::kWrite:
        silent = (h.flags & net::kFlagAnswer) == 0;
        return body != size_t(config_.chunk_pairs()) * config_.pair_bytes() ? bad() : write(m, h);
      case net::kRead:
        if (body < 4) return bad();
        read_sequence_ = h.sequence;
        read_tile_ = h.tile;
        read_next_ = h.index;
        read_left_ = static_cast<uint16_t>(net::get16(m, net::kHeaderBytes));
        if (h.tile == map_tile_ && map_busy_) {
          keep_ = std::max(keep_, static_cast<uint16_t>(net::get16(m, net::kHeaderBytes + 2)));
        }
        return net::kOk;
      case net::kRelease:
        if (h.tile != map_tile_) return net::kOrder;
        if (map_busy_ && !map_complete()) return net::kNotReady;
        map_busy_ = false;
        map_.clear();
        map_count_ = 0;
        return net::kOk;
      case net::kSet: {
        if (body < 4 || h.index != 0 || net::get32(m, net::kHeaderBytes) > net::kDuplexFull) return bad();
        duplex_ = static_cast<uint8_t>(net::get32(m, net::kHeaderBytes));
        return net::kOk;
      }
      default:
        return net::kOk;  // STATUS
    }
  }

  net::Code table(const Bytes& m, const net::Header& h, size_t body) {
    if (body < 4 || body % 4 != 0 || body / 4 > size_t{364}) {
      ++counters_[net::kBadMessages];
      return net::kBadMessage;
    }
    const bool next = h.tile == static_cast<uint16_t>(table_id_ + 1) && h.index == 0;
    if (!next && (h.tile != table_id_ || table_id_ == 0 || h.index > table_words_.size())) return net::kOrder;
    if (row_busy_ || stage_ != Stage::kIdle) return net::kNotReady;
    if (next) {
      ++table_id_;
      table_words_.clear();
    }
    // Words beyond the engine's table are errors there, one each, but are counted as written, up to 8192.
    const size_t most = size_t{8} * config_.engine.planes;
    for (size_t i = 0; i < body / 4; ++i) {
      const uint32_t value = net::get32(m, net::kHeaderBytes + 4 * i);
      const size_t at = h.index + i;
      if (at >= most) error(kErrorAddress);
      if (at < table_words_.size()) {
        table_words_[at] = value;
      } else if (table_words_.size() < 8192) {
        table_words_.push_back(value);
      }
    }
    return net::kOk;
  }

  net::Code start(const Bytes& m, const net::Header& h) {
    if (h.tile == last_tile_) return net::kOk;
    if (h.tile != static_cast<uint16_t>(last_tile_ + 1)) return net::kOrder;
    if (row_busy_) return net::kNotReady;
    const size_t at = net::kHeaderBytes;
    if (net::get16(m, at) != table_id_) return net::kOrder;
    const uint32_t pixels = net::get32(m, at + 4), chunks = net::get32(m, at + 8);
    if (pixels == 0 || pixels >> 24 != 0 || chunks == 0 || chunks >> 16 != 0) {
      ++counters_[net::kBadMessages];
      return net::kBadMessage;
    }
    std::array<uint32_t, net::kJobWords> words{};
    for (size_t i = 0; i < words.size(); ++i) words[i] = net::get32(m, at + 12 + 4 * i);
    if ((words[4] & 0x7ff) > table_words_.size() / 8) return net::kOrder;
    if (chunks != (pixels + config_.chunk_pairs() - 1) / config_.chunk_pairs()) {
      ++counters_[net::kBadMessages];
      return net::kBadMessage;
    }
    staged_job_ = job_from_words(words);
    ++last_tile_;
    row_busy_ = true;
    staged_ = true;
    pixels_ = pixels;
    chunks_ = chunks;
    base_ = received_ = 0;
    there_.assign(chunks, false);
    pairs_.clear();
    return net::kOk;
  }

  net::Code write(const Bytes& m, const net::Header& h) {
    if (h.tile != last_tile_) return net::kOrder;
    if (!row_busy_) return net::kOk;  // consumed
    if (h.index < base_ || (h.index < chunks_ && there_[h.index])) {
      ++counters_[net::kChunksRepeated];
      return net::kOk;
    }
    if (h.index >= chunks_ || h.index - base_ >= static_cast<uint32_t>(config_.slots())) {
      ++counters_[net::kChunksRefused];
      return net::kNotReady;
    }
    const size_t width = config_.pair_bytes(), first = size_t{h.index} * config_.chunk_pairs();
    const auto pairs = static_cast<size_t>(config_.chunk_pairs());
    pairs_.resize(std::max(pairs_.size(), first + pairs));
    for (size_t i = 0; i < pairs; ++i) {
      uint32_t value = 0;
      for (size_t b = 0; b < width; ++b) value = value << 8 | m[net::kHeaderBytes + i * width + b];
      pairs_[first + i] = value;
    }
    there_[h.index] = true;
    ++received_;
    return net::kOk;
  }

  // Everything that became possible up to this time.
  void advance(double time) {
    for (;;) {
      if (stage_ == Stage::kIdle) {
        if (!staged_ || received_ < std::min<uint32_t>(chunks_, config_.slots())) break;
        staged_ = false;
        run_tile_ = last_tile_;
        job_ = staged_job_;
        engine_time_ = std::max(engine_time_, now_);
        stage_ = Stage::kLoad;
        if (job_fits()) {
          clocks_exact_ = true;
        } else {
          drop(kErrorConfig);
        }
      } else if (stage_ == Stage::kLoad || stage_ == Stage::kDrain) {
        if (base_ < needed_chunks()) {
          if (!next_chunk_there()) {
            if (engine_time_ < time && stage_ == Stage::kLoad) clocks_exact_ = false;
            engine_time_ = std::max(engine_time_, time);
            break;
          }
          const double then = engine_time_ + next_pairs() * clock();
          if (then > time) break;
          engine_time_ = then;
          ++base_;
          const uint64_t loaded = uint64_t{base_} * static_cast<uint32_t>(config_.chunk_pairs());
          if (stage_ == Stage::kLoad && pixels_ > load_clocks(job_) && loaded >= load_clocks(job_)) drop(kErrorLong);
        } else {
          row_busy_ = false;
          if (stage_ == Stage::kLoad && pixels_ < load_clocks(job_)) drop(kErrorShort);
          if (stage_ == Stage::kDrain) {
            failed_ = true;
            failed_tile_ = run_tile_;
            ++counters_[net::kTilesFailed];
            stage_ = Stage::kIdle;
          } else {
            compute();
            stage_ = Stage::kSweep;
          }
        }
      } else if (stage_ == Stage::kSweep) {
        if (engine_time_ + sweep_time() > time) break;
        engine_time_ += sweep_time();
        stage_ = Stage::kUnload;
      } else {
        if (!map_started_) {
          if (map_busy_) {
            wait_for_map(time);
            break;
          }
          map_started_ = map_busy_ = true;
          map_tile_ = run_tile_;
          map_ = result_.cells;
          map_count_ = 0;
          keep_ = 0;
        }
        map_count_ = std::max(map_count_, std::min(map_.size(), whole() ? map_.size() : kept_cells() + depth()));
        if (map_count_ < map_.size()) {
          wait_for_map(time);
          break;
        }
        // The row buffer's first pair comes 3 clocks after the start; the engine could take it after one.
        tile_clocks_ = static_cast<uint32_t>(engine_clocks(config_.engine, job_) + net::kFirstPairClocks);
        shown_exact_ = clocks_exact_;
        tiles_done_ = std::min(tiles_done_ + 1, 0xffffu);
        stage_ = Stage::kIdle;
        map_started_ = false;
      }
    }
    if (stage_ == Stage::kIdle) {
      if (row_busy_) wait(net::kEngineWaitRows, rows_wait_, time - engine_time_);
      engine_time_ = std::max(engine_time_, time);
    }
  }
  void wait_for_map(double time) {
    if (engine_time_ < time) clocks_exact_ = false;
    wait(net::kEngineWaitMap, map_wait_, time - engine_time_);
    engine_time_ = std::max(engine_time_, time);
  }

  double clock() const { return 1e-3 / config_.clk_khz; }
  double sweep_time() const {
    if (sweep_seconds_ >= 0) return sweep_seconds_;
    return static_cast<double>(sweep_clocks(config_.engine, job_) + fill_clocks(config_.engine)) * clock();
  }
  uint32_t needed_chunks() const { return (pixels_ + config_.chunk_pairs() - 1) / config_.chunk_pairs(); }
  bool next_chunk_there() const { return base_ >= needed_chunks() || (base_ < chunks_ && there_[base_]); }
  uint32_t next_pairs() const {
    const auto per = static_cast<uint32_t>(config_.chunk_pairs());
    return base_ < needed_chunks() ? std::min(per, pixels_ - base_ * per) : 0;
  }

  bool job_fits() const {
    const Config& c = config_.engine;
    auto in = [](int v, int hi) { return v >= 1 && v <= hi; };
    return in(job_.tile_cols, c.plane_cols) && in(job_.tile_rows, c.plane_rows) && in(job_.win_cols, c.img_cols) &&
           in(job_.win_rows, c.img_rows) && in(job_.planes, c.planes) && job_.threshold >= 0 &&
           job_.threshold < 1 << c.mncc_bits;
  }

  void compute() {
    Pixels left(job_.win_cols, job_.win_rows), right(job_.win_cols, job_.win_rows);
    const int bits = config_.engine.pix_bits;
    const uint32_t mask = (1u << bits) - 1;
    for (size_t i = 0; i < left.data.size(); ++i) {
      left.data[i] = static_cast<uint16_t>(pairs_[i] >> bits & mask);
      right.data[i] = static_cast<uint16_t>(pairs_[i] & mask);
    }
    std::vector<PlaneEntry> entries(job_.planes);
    for (size_t k = 0; k < entries.size(); ++k) entries[k] = table_entry(&table_words_[8 * k]);
    result_ = compute_(job_, entries, left, right);
    if (result_.window_errors != 0) {
      window_errors_ = static_cast<uint32_t>(std::min<uint64_t>(window_errors_ + result_.window_errors, 0xffff));
      error(kErrorWindow);
    }
  }

  void error(ErrorBit bit) {
    errors_ |= bit;
    error_count_ = std::min(error_count_ + 1, 0xffffu);
  }
  // The engine takes the rest of the tile's pixels and does nothing with them; tile_clocks stays.
  void drop(ErrorBit bit) {
    error(bit);
    tiles_dropped_ = std::min(tiles_dropped_ + 1, 0xffffu);
    stage_ = Stage::kDrain;
  }

  void wait(net::Counter counter, double& rest, double seconds) {
    if (seconds <= 0) return;
    rest += seconds * config_.clk_khz * 1e3 / 256;
    const auto whole = static_cast<uint64_t>(rest);
    counters_[counter] += static_cast<uint32_t>(whole);
    rest -= static_cast<double>(whole);
  }

  void close() {
    const bool dropped = stage_ != Stage::kIdle && stage_ != Stage::kDrain;
    forget();
    tiles_dropped_ = dropped ? 1 : 0;  // abort and clear in one command: the drop counts
    open_ = false;
  }
  // What st_abort of the RTL does; the engine's errors and counters are cleared with it, but tile_clocks and the
  // numbers of the tiles launched and failed stay.
  void forget() {
    errors_ = error_count_ = tiles_done_ = tiles_dropped_ = window_errors_ = 0;
    stage_ = Stage::kIdle;
    staged_ = row_busy_ = map_busy_ = map_started_ = failed_ = false;
    map_.clear();
    map_count_ = 0;
    base_ = received_ = chunks_ = pixels_ = 0;
    last_tile_ = map_tile_ = 0xffff;
    table_id_ = 0;
    table_words_.clear();
    read_left_ = 0;
    keep_ = 0;
    duplex_ = net::kDuplexByPin;
    engine_time_ = now_;
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

  size_t chunk_cells() const { return static_cast<size_t>(config_.chunk_cells()); }
  size_t largest() const { return static_cast<size_t>(config_.engine.plane_cols) * config_.engine.plane_rows; }
  size_t depth() const {
    const size_t asked = static_cast<size_t>(std::max(0, config_.map_depth));
    if (asked == 0 || asked >= largest()) return largest();
    return std::max<size_t>(2, (asked + chunk_cells() - 1) / chunk_cells()) * chunk_cells();
  }
  bool whole() const { return depth() >= largest(); }
  size_t kept_cells() const { return keep_ * chunk_cells(); }
  bool map_complete() const { return map_busy_ && !map_started_; }
  bool chunk_there(uint16_t c) const {
    const size_t first = c * chunk_cells(), end = first + chunk_cells();
    if ((!whole() && c < keep_) || first >= map_count_) return false;
    return end <= map_count_ || map_complete();
  }

  void append_status(Bytes& out) const {
    using namespace net;
    const State states[] = {State::kIdle, State::kLoad, State::kDrain, State::kSweep, State::kUnload};
    const auto state = static_cast<uint32_t>(states[static_cast<size_t>(stage_)]);
    auto flag = [](bool on, StatusFlag bit) { return on ? static_cast<uint32_t>(bit) : 0; };
    const uint32_t flags = flag(open_, kFlagSession) | flag(row_busy_, kFlagRows) |
                           flag(stage_ != Stage::kIdle, kFlagEngine) | flag(map_busy_, kFlagMap) |
                           flag(map_complete(), kFlagMapComplete) | flag(failed_, kFlagFailed) |
                           flag(full_duplex(), kFlagFullDuplex) | flag(pin_100_, kFlagSpeed100) | state << 8;
    append16(out, last_tile_);
    append16(out, flags);
    append16(out, run_tile_);
    append16(out, map_tile_);
    append16(out, base_);
    append16(out, received_);
    append16(out, table_id_);
    append16(out, static_cast<uint32_t>(table_words_.size()));
    append32(out, static_cast<uint32_t>(map_count_));
    append16(out, errors_);
    append16(out, error_count_);
    append16(out, tiles_done_);
    append16(out, tiles_dropped_);
    append32(out, tile_clocks_);
    append16(out, window_errors_);
    append16(out, failed_tile_);
    const uint32_t slots = static_cast<uint32_t>(config_.slots());
    for (uint32_t first = 0; first < slots; first += 32) {
      uint32_t word = 0;
      for (uint32_t i = first; i < first + 32; ++i) {
        const uint32_t c = base_ + i;
        word = word << 1 | (i < slots && row_busy_ && c < chunks_ && there_[c] ? 1u : 0u);
      }
      append32(out, word);
    }
  }

  void append_info(Bytes& out) const {
    const Config& c = config_.engine;
    uint32_t w[net::kInfoWords] = {};
    auto u = [](auto v) { return static_cast<uint32_t>(v); };
    for (const auto& field : kEngineFields) w[field.info] = u(c.*field.value);
    for (const auto& field : kChipFields) w[field.info] = u(config_.*field.value);
    w[0] = uint32_t{net::kVersion} << 16 | net::kInfoWords;  // of the fields without a word
    w[13] = u(config_.cell_bits());
    w[14] = u(mac_ >> 32), w[15] = u(mac_);
    w[18] = u(config_.pair_bytes()), w[19] = u(config_.chunk_pairs()), w[20] = u(config_.slots());
    w[21] = u(config_.cell_bytes()), w[22] = u(config_.chunk_cells()), w[23] = u(depth());
    w[26] = net::kCounterWords;
    for (const uint32_t v : w) net::append32(out, v);
  }

  net::ArbiterConfig config_;
  Compute compute_;
  double sweep_seconds_ = -1;
  uint64_t mac_ = 0x020000000001;
  bool pin_full_ = true, pin_100_ = true;
  std::array<uint32_t, net::kCounterWords> counters_{};
  double now_ = 0, heard_ = 0, engine_time_ = 0;
  double rows_wait_ = 0, map_wait_ = 0;  // parts of 256 clocks
  // Session
  bool open_ = false;
  uint32_t token_ = 0, nonce_ = 0, peer_ = 0;
  std::array<int, 3> buckets_{};
  double tick_phase_ = 0;
  int64_t ticks_ = 0;
  uint8_t duplex_ = 0;
  uint16_t last_tile_ = 0, map_tile_ = 0, table_id_ = 0;
  std::vector<uint32_t> table_words_;
  // Row buffer
  bool row_busy_ = false, staged_ = false;
  TileJob staged_job_;
  uint32_t pixels_ = 0, chunks_ = 0, base_ = 0, received_ = 0;
  std::vector<bool> there_;
  std::vector<uint32_t> pairs_;
  // Engine
  Stage stage_ = Stage::kIdle;
  TileJob job_;
  TileResult result_;
  uint16_t run_tile_ = 0, failed_tile_ = 0;
  bool failed_ = false;
  unsigned errors_ = 0, error_count_ = 0, tiles_done_ = 0, tiles_dropped_ = 0, window_errors_ = 0;
  uint32_t tile_clocks_ = 0;
  bool clocks_exact_ = true;  // of the tile in the engine
  bool shown_exact_ = true;   // of tile_clocks_
  // Map buffer; cells map_[0 .. map_count_-1] have arrived
  bool map_busy_ = false, map_started_ = false;  // started: and not complete
  std::vector<MapCell> map_;
  size_t map_count_ = 0;
  uint16_t keep_ = 0;  // the largest one of a READ for this map
  // The READ in force
  uint16_t read_tile_ = 0, read_next_ = 0, read_left_ = 0, read_sequence_ = 0;
  std::optional<net::Code> latest_code_;
};

}  // namespace psweep::golden
