// SPDX-License-Identifier: Apache-2.0
// TileRun: the engine between row buffer, scheduler and map buffer, in time. It works in whole chunks and tiles, one
// pixel, sample or cell a clock; map cells come all at once as far as there is room. What it computes is the bit-true
// model's (psweep.hpp); its errors are control's.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "contract/protocol.hpp"
#include "golden/control.hpp"
#include "golden/counters.hpp"
#include "golden/map_buffer.hpp"
#include "golden/psweep.hpp"
#include "golden/row_buffer.hpp"
#include "golden/scheduler.hpp"

namespace psweep::golden {

class TileRun {
 public:
  using Compute =
      std::function<TileResult(const TileJob&, const std::vector<PlaneEntry>&, const Pixels&, const Pixels&)>;

  TileRun(const net::ArbiterConfig& config, RowBuffer& rows, MapBuffer& map, Scheduler& scheduler, Control& control,
          Counters& counters)
      : config_(config), rows_(rows), map_(map), scheduler_(scheduler), control_(control), counters_(counters) {}
  TileRun(const TileRun&) = delete;
  TileRun& operator=(const TileRun&) = delete;

  void set_compute(Compute compute) { compute_ = std::move(compute); }
  // Seconds from the last pixel to the first cell; negative: the engine's clocks at clk_khz.
  void set_sweep_time(double seconds) { sweep_seconds_ = seconds; }

  // A START was taken: its tile is launched as soon as its rows allow it and the engine is free.
  void stage(uint16_t tile) {
    staged_ = true;
    staged_tile_ = tile;
  }
  // Everything that became possible up to this time, in seconds.
  void advance(double time, double now) {
    while (step(time, now)) {
    }
    if (stage_ == Stage::kIdle) {
      if (rows_.open()) wait(net::kEngineWaitRows, rows_wait_, time - engine_time_);
      engine_time_ = std::max(engine_time_, time);
    }
  }
  // Abort: what is in work is gone. Whether that was a tile which nothing had dropped yet.
  bool stop(double now) {
    const bool dropped = stage_ != Stage::kIdle && stage_ != Stage::kDrain;
    stage_ = Stage::kIdle;
    staged_ = unloading_ = false;
    engine_time_ = now;
    return dropped;
  }
  void power_on() { clocks_exact_ = shown_exact_ = true; }

  // When the engine goes on by itself, in seconds; nothing: not before another message.
  std::optional<double> next_event() const {
    if (stage_ == Stage::kLoad || stage_ == Stage::kDrain) {
      if (!next_chunk_there()) return std::nullopt;
      return engine_time_ + next_pairs() * clock();
    }
    if (stage_ == Stage::kSweep) return engine_time_ + sweep_time();
    return std::nullopt;
  }
  bool idle() const { return stage_ == Stage::kIdle; }
  bool sweeping() const { return stage_ == Stage::kSweep; }
  uint16_t map_tile() const { return map_tile_; }  // of the latest map that came out
  void forget_map_tile() { map_tile_ = 0xffff; }
  State state() const {
    const State states[] = {State::kIdle, State::kLoad, State::kDrain, State::kSweep, State::kUnload};
    return states[static_cast<size_t>(stage_)];
  }
  // Whether tile_clocks is that of a tile that never had to wait.
  bool clocks_exact() const { return shown_exact_; }

 private:
  enum class Stage { kIdle, kLoad, kDrain, kSweep, kUnload };

  // One thing that happens; false if nothing does by that time.
  bool step(double time, double now) {
    switch (stage_) {
      case Stage::kIdle:
        return launch(now);
      case Stage::kLoad:
      case Stage::kDrain:
        return rows_.open() ? take_chunk(time) : rows_end();
      case Stage::kSweep:
        if (engine_time_ + sweep_time() > time) return false;
        engine_time_ += sweep_time();
        stage_ = Stage::kUnload;
        return true;
      default:
        return unload(time);
    }
  }
  bool launch(double now) {
    if (!staged_ || !rows_.complete()) return false;
    staged_ = false;
    std::array<uint32_t, net::kJobWords> words{};
    const std::vector<RegisterWrite> writes = scheduler_.launch();
    for (size_t i = 0; i < words.size(); ++i) words[i] = writes[i].value;
    job_ = job_from_words(words);
    scheduler_.started(staged_tile_);
    scheduler_.clock(true, false);
    engine_time_ = std::max(engine_time_, now);
    stage_ = Stage::kLoad;
    clocks_exact_ = true;
    if (!control_.takes(job_)) drop(kErrorConfig);
    return true;
  }
  bool take_chunk(double time) {
    if (!next_chunk_there()) {
      if (engine_time_ < time && stage_ == Stage::kLoad) clocks_exact_ = false;
      engine_time_ = std::max(engine_time_, time);
      return false;
    }
    const double then = engine_time_ + next_pairs() * clock();
    if (then > time) return false;
    engine_time_ = then;
    rows_.consume();
    const uint64_t loaded = uint64_t(rows_.base()) * static_cast<uint32_t>(config_.chunk_pairs());
    if (stage_ == Stage::kLoad && rows_.pixels() > load_clocks(job_) && loaded >= load_clocks(job_)) drop(kErrorLong);
    return true;
  }
  bool rows_end() {
    if (stage_ == Stage::kLoad && rows_.pixels() < load_clocks(job_)) drop(kErrorShort);
    if (stage_ == Stage::kDrain) {
      scheduler_.clock(false, false);
      if (scheduler_.tile_failed()) counters_.count(net::kTilesFailed);
      rows_.fail(rows_.open());
      map_.fail();
      stage_ = Stage::kIdle;
    } else {
      compute();
      stage_ = Stage::kSweep;
    }
    return true;
  }
  bool unload(double time) {
    if (!unloading_) {
      if (map_.busy()) return wait_for_map(time);
      unloading_ = true;
      map_tile_ = scheduler_.run_tile();
      next_cell_ = 0;
    }
    const std::vector<MapCell>& cells = result_.cells;
    for (; next_cell_ < cells.size() && map_.takes(); ++next_cell_)
      map_.put(net::pack_wire_cell(config_.engine, cells[next_cell_]), next_cell_ + 1 == cells.size());
    if (next_cell_ < cells.size()) return wait_for_map(time);
    // The row buffer's first pair comes 3 clocks after the start; the engine could take it after one.
    control_.done(static_cast<uint32_t>(engine_clocks(config_.engine, job_) + net::kFirstPairClocks));
    scheduler_.clock(true, true);
    shown_exact_ = clocks_exact_;
    stage_ = Stage::kIdle;
    unloading_ = false;
    return true;
  }
  bool wait_for_map(double time) {
    if (engine_time_ < time) clocks_exact_ = false;
    wait(net::kEngineWaitMap, map_wait_, time - engine_time_);
    engine_time_ = std::max(engine_time_, time);
    return false;
  }
  void compute() {
    Pixels left(job_.win_cols, job_.win_rows), right(job_.win_cols, job_.win_rows);
    for (size_t i = 0; i < left.data.size(); ++i)
      unpack_beat(config_.engine, rows_.beat(static_cast<uint32_t>(i)), left.data[i], right.data[i]);
    const std::vector<PlaneEntry> table = control_.table(job_.planes);
    result_ = compute_ ? compute_(job_, table, left, right) : run_tile(config_.engine, job_, table, left, right);
    control_.lost_samples(result_.window_errors);
  }
  // The engine takes the rest of the tile's pixels and does nothing with them; tile_clocks stays.
  void drop(ErrorBit bit) {
    control_.drop(bit);
    stage_ = Stage::kDrain;
  }
  void wait(net::Counter counter, double& rest, double seconds) {
    if (seconds <= 0) return;
    rest += seconds * config_.clk_khz * 1e3 / 256;
    const auto whole = static_cast<uint64_t>(rest);
    counters_.count(counter, static_cast<uint32_t>(whole));
    rest -= static_cast<double>(whole);
  }

  double clock() const { return 1e-3 / config_.clk_khz; }
  double sweep_time() const {
    if (sweep_seconds_ >= 0) return sweep_seconds_;
    return static_cast<double>(sweep_clocks(config_.engine, job_) + fill_clocks(config_.engine)) * clock();
  }
  bool next_chunk_there() const { return !rows_.open() || rows_.bit(0); }
  uint32_t next_pairs() const {
    const auto per = static_cast<uint32_t>(config_.chunk_pairs());
    return rows_.open() ? std::min(per, rows_.pixels() - static_cast<uint32_t>(rows_.base()) * per) : 0;
  }

  net::ArbiterConfig config_;
  RowBuffer& rows_;
  MapBuffer& map_;
  Scheduler& scheduler_;
  Control& control_;
  Counters& counters_;
  Compute compute_;
  double sweep_seconds_ = -1;
  double engine_time_ = 0;
  double rows_wait_ = 0, map_wait_ = 0;  // parts of 256 clocks
  Stage stage_ = Stage::kIdle;
  bool staged_ = false, unloading_ = false;
  uint16_t staged_tile_ = 0, map_tile_ = 0xffff;
  TileJob job_;
  TileResult result_;
  size_t next_cell_ = 0;
  bool clocks_exact_ = true;  // of the tile in the engine
  bool shown_exact_ = true;   // of tile_clocks
};

}  // namespace psweep::golden
