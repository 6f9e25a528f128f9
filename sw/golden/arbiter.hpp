// SPDX-License-Identifier: Apache-2.0
// Model of entity arbiter, i.e. of the chip behind its UDP port: responder, row buffer, scheduler, engine, map buffer
// and counters put together. The host's tests run against it, and the RTL's are compared with it.
//
//   Arbiter chip(config);
//   chip.step(t);                                  // time goes on: engine, silence timer
//   for (const Bytes& reply : chip.message(payload, peer)) ..      // none or one
//   while (auto packet = chip.map_packet()) ..     // to chip.map_peer(); call it when the transmitter is free
//
// Bytes are exact (responder.hpp), time is not (tile_run.hpp). When nothing moves any more (next_event()), the status
// block is exact, but for tile_clocks of a tile that had to wait (clocks_exact()).
#pragma once
#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "contract/protocol.hpp"
#include "golden/control.hpp"
#include "golden/counters.hpp"
#include "golden/map_buffer.hpp"
#include "golden/responder.hpp"
#include "golden/row_buffer.hpp"
#include "golden/scheduler.hpp"
#include "golden/tile_run.hpp"

namespace psweep::golden {

class Arbiter {
 public:
  using Bytes = net::Bytes;
  using Bucket = Responder::Bucket;
  // What the engine computes; the default is the bit-true model. Tests put a memory of results in front of it.
  using Compute = TileRun::Compute;

  explicit Arbiter(const net::ArbiterConfig& config)
      : config_(config),
        rows_(config.engine.pix_bits, config.chunk_pairs(), config.slots()),
        map_(config.cell_bits(), config.chunk_cells(), config.largest_map(), config.depth()),
        control_(config.engine),
        counters_(net::kCounterWords),
        run_(config, rows_, map_, scheduler_, control_, counters_),
        responder_(config, {rows_, map_, scheduler_, control_, counters_, run_}) {
    power_on();
  }
  Arbiter(const Arbiter&) = delete;
  Arbiter& operator=(const Arbiter&) = delete;

  const net::ArbiterConfig& config() const { return config_; }
  void set_compute(Compute compute) { run_.set_compute(std::move(compute)); }
  // Seconds from the last pixel to the first cell; negative: the engine's clocks at clk_khz.
  void set_sweep_time(double seconds) { run_.set_sweep_time(seconds); }
  void set_mac(uint64_t mac) { responder_.set_mac(mac); }
  void set_pins(bool full_duplex, bool speed_100) { responder_.set_pins(full_duplex, speed_100); }
  void count(net::Counter counter) { counters_.count(counter); }  // for the parts in front of this one: MAC and stack

  // Answers to whoever asks: responder.hpp.
  bool allow(Bucket bucket) { return responder_.allow(bucket); }
  int left(Bucket bucket) const { return responder_.left(bucket); }
  // When the chip's milliseconds begin, in seconds of step()'s time, modulo a millisecond.
  void set_tick_phase(double seconds) { responder_.set_tick_phase(seconds, now_); }

  // Reset of the whole chip. Tokens go on, since the real ones depend on the time.
  void power_on() {
    responder_.power_on(now_);
    counters_ = Counters(net::kCounterWords);
    scheduler_ = Scheduler();
    control_ = Control(config_.engine);
    run_.power_on();
  }

  // Engine and timers go on to this time, in seconds. Never backwards.
  void step(double time) {
    while (responder_.session_open() && now_ < time) {
      const double deadline = responder_.deadline(), until = std::min(time, deadline);
      run_.advance(until, now_);
      now_ = until;
      if (deadline <= time) responder_.time_out(now_);
    }
    now_ = std::max(now_, time);
    responder_.refill(now_);
  }

  std::vector<Bytes> message(const Bytes& m, uint32_t peer) { return responder_.message(m, peer, now_); }
  std::optional<Bytes> map_packet() { return responder_.map_packet(); }
  uint32_t map_peer() const { return responder_.peer(); }  // the session's
  std::optional<net::Code> latest_code() const { return responder_.latest_code(); }

  // When the engine goes on by itself, in seconds; nothing: not before another message.
  std::optional<double> next_event() const { return run_.next_event(); }
  bool sweeping() const { return run_.sweeping(); }
  bool clocks_exact() const { return run_.clocks_exact(); }
  // The status block as words, not the reply to anybody.
  std::vector<uint32_t> status() const {
    Bytes bytes;
    responder_.append_status(bytes);
    return net::words_of(bytes, 0);
  }

  bool session_open() const { return responder_.session_open(); }
  uint32_t token() const { return responder_.token(); }
  uint32_t counter(net::Counter c) const { return counters_.value(c); }
  bool full_duplex() const { return responder_.full_duplex(); }

 private:
  net::ArbiterConfig config_;
  RowBuffer rows_;
  MapBuffer map_;
  Scheduler scheduler_;
  Control control_;
  Counters counters_;
  TileRun run_;
  Responder responder_;
  double now_ = 0;
};

}  // namespace psweep::golden
