// SPDX-License-Identifier: Apache-2.0
// EngineBench<Dut>: entity psweep between stream agents, every stage compared with the bit-true model while it runs.
//   The dbg_* ports of each stage feed one scoreboard each; expectations are made plane by plane when the first sample
//   of a plane appears, so tiles of any size fit into memory. Cells (m_map) are compared with their tlast.
//   run(stimulus)   one good tile from registers to the last cell; checks clocks, counters and window errors
//   The parts of run() are public for tests of everything that is not a good tile.
#pragma once
#include <algorithm>
#include <deque>
#include <sstream>
#include <string>

#include "contract/registers.hpp"
#include "golden/control.hpp"
#include "golden/psweep.hpp"
#include "scene/stimulus.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/stream.hpp"

namespace psweep::tb {

// Probability of an idle clock (or of tready low) per stream.
struct Stalls {
  double cfg = 0, pix = 0, map = 0;
  bool none() const { return cfg == 0 && pix == 0 && map == 0; }
};

template <class Dut>
class EngineBench : public Agent {
 public:
  EngineBench(const golden::Config& config, uint32_t seed, Stalls stalls = {}, uint64_t timeout = 1000000)
      : sim(timeout, seed),
        dut(sim.dut()),
        config_(config),
        cfg_ports_(stream_ports(&dut.s_cfg_tvalid, &dut.s_cfg_tready, &dut.s_cfg_tdata)),
        pix_ports_(stream_ports(&dut.s_pix_tvalid, &dut.s_pix_tready, &dut.s_pix_tdata, &dut.s_pix_tlast)),
        map_ports_(stream_ports(&dut.m_map_tvalid, &dut.m_map_tready, &dut.m_map_tdata, &dut.m_map_tlast)),
        cfg(sim, cfg_ports_, 48, seed + 1, stalls.cfg),
        pix(sim, pix_ports_, 2 * config.pix_bits, seed + 2, stalls.pix),
        map(sim, map_ports_, seed + 3, stalls.map, [this](const Beat& b) { take_cell(b); }),
        stalls_(stalls) {
    for (int n = 0; n < config.lanes; ++n) {
      Lane& l = lanes_.emplace_back(config.lanes > 1 ? " of lane " + std::to_string(n) : std::string());
      boards_.insert(boards_.end(), {&l.position, &l.fraction, &l.flags, &l.quad_left, &l.quad_right, &l.interpolation,
                                     &l.similarity});
    }
    boards_.insert(boards_.end(), {&map_address_, &map_word_, &cell_});
    sim.add(cfg);
    sim.add(pix);
    sim.add(map);
    sim.add(*this);
    sim.reset();
  }

  const golden::Config& config() const { return config_; }

  // Stimuli
  // ------------------------------------------------------------------------------------------------------------
  void write(uint16_t address, uint32_t value) { cfg.push(golden::RegisterWrite{address, value}.word()); }
  void command(uint32_t bits) { write(golden::kRegCommand, bits); }
  void write_table(const std::vector<golden::PlaneEntry>& table) {
    for (const auto& w : golden::table_writes(table)) write(w.address, w.value);
  }
  void write_job(const golden::TileJob& job) {
    for (const auto& w : golden::job_writes(job)) write(w.address, w.value);
  }
  // Packet of the first `count` pixels (all by default), tlast on the last of them unless `last` is false.
  void send_pixels(const scene::Stimulus& s, size_t count = ~size_t{0}, bool last = true) {
    count = std::min(count, s.left.data.size());
    for (size_t i = 0; i < count; ++i)
      pix.push(golden::pixel_beat(config_, s.left, s.right, i), last && i + 1 == count);
  }
  void flush_cfg() {
    sim.run_until([&] { return cfg.done(); });
    sim.run(2);  // a register lies in front of what it changes
  }
  void run_until_state(golden::State state) {
    wait([&] { return dut.state == static_cast<int>(state); });
  }

  // A good tile from registers to the last cell.
  void run(const scene::Stimulus& s) {
    INFO(s.name << ", tile " << tiles_ << ", stalls " << stalls_.cfg << ' ' << stalls_.pix << ' ' << stalls_.map);
    sim.run(2);  // counters of what went before come to rest
    const unsigned done = dut.tiles_done, count_before = dut.error_count, lost_before = dut.window_errors;
    write_table(s.table);
    write_job(s.job);
    flush_cfg();
    expect(s);
    send_pixels(s);
    command(golden::kCommandStart);
    finish();
    {
      INFO(report());
      CHECK(ok());
    }
    CHECK(clocks_ == dut.tile_clocks);
    if (stalls_.pix == 0 && stalls_.map == 0) CHECK(clocks_ == golden::engine_clocks(config_, s.job));
    CHECK(dut.tiles_done == std::min(done + 1, 65535u));
    CHECK(dut.window_errors == std::min<uint64_t>(lost_before + expected_lost_, 65535));
    CHECK(dut.error_count == count_before + (expected_lost_ > 0));
    if (expected_lost_ > 0) CHECK((dut.errors & golden::kErrorWindow) != 0);
    CHECK(map.protocol_errors() == 0);
  }

  // Expectations
  // -------------------------------------------------------------------------------------------------------
  void expect(const scene::Stimulus& s) {
    stimulus_ = s;
    next_plane_ = 0;
    expected_lost_ = 0;
    cells_.assign(static_cast<size_t>(s.job.tile_cols) * s.job.tile_rows, {});
    pending_ = true;
    most_planes_ = std::max(most_planes_, s.job.planes);
    ++tiles_;
  }
  // The tile in work will not be finished (reset, abort): from interrupt() to forget() nothing is looked at.
  void interrupt() {
    muted_ = true;
    map.set_watching(false);
  }
  void forget() {
    pending_ = false;
    sim.run(3);  // strobes on their way out of the pipeline
    for (Scoreboard* board : boards_) board->forget_expectations();
    muted_ = false;
    map.set_watching(true);
  }
  // Until the last cell is out and the engine idle.
  void finish() {
    wait([&] { return !pending_ && !dut.busy && cfg.done() && pix.done(); });
    sim.run(2);
  }
  template <class Done>
  void wait(Done&& done) {
    try {
      sim.run_until(done);
    } catch (const Timeout& e) {
      FAIL(e.what() << ", state " << int(dut.state) << ", errors " << golden::error_names(dut.errors) << '\n'
                    << report());
    }
  }
  bool ok() const {
    for (const Scoreboard* board : boards_)
      if (!resting(board) && !board->ok()) return false;
    return true;
  }
  uint64_t mismatches() const {
    uint64_t n = 0;
    for (const Scoreboard* board : boards_) n += board->errors();
    return n;
  }
  std::string report() const {
    std::ostringstream text;
    for (const Scoreboard* board : boards_)
      if (!resting(board)) text << board->report();
    return text.str();
  }
  const std::vector<golden::Cell>& expected_cells() const { return cells_; }  // of the latest tile
  uint64_t clocks() const { return clocks_; }  // start command to last map beat, as the bench saw it

  void sample() override {
    const uint64_t now = sim.cycle();
    const bool starts = dut.s_cfg_tvalid && (dut.s_cfg_tdata >> 32) == golden::kRegCommand &&
                        (dut.s_cfg_tdata & 3) == golden::kCommandStart && !dut.busy;
    if (starts) start_clock_ = now;
    if (muted_) return;
    const int p = config_.pix_bits, w = config_.weight_bits, s = config_.sample_bits(), m = config_.mncc_bits;
    for (int n = 0; n < config_.lanes; ++n) {
      Lane& lane = lanes_[static_cast<size_t>(n)];
      if (dut.dbg_sample_valid >> n & 1) {
        if (n == 0 && lane.position.outstanding() == 0) expect_set();
        lane.position.observe(pack({at(dut.dbg_xi_left, n, 13), at(dut.dbg_yi_left, n, 13), at(dut.dbg_xi_right, n, 13),
                                    at(dut.dbg_yi_right, n, 13)}),
                              now);
        lane.fraction.observe(pack({at(dut.dbg_fx_left, n, w), at(dut.dbg_fy_left, n, w), at(dut.dbg_fx_right, n, w),
                                    at(dut.dbg_fy_right, n, w)}),
                              now);
        lane.flags.observe(pack({at(dut.dbg_usable_x & dut.dbg_usable_y, n, 1), at(dut.dbg_window_error, n, 1)}), now);
      }
      if (dut.dbg_quad_valid >> n & 1) {
        lane.quad_left.observe(pack({at(dut.dbg_p00_left, n, p), at(dut.dbg_p10_left, n, p), at(dut.dbg_p01_left, n, p),
                                     at(dut.dbg_p11_left, n, p)}),
                               now);
        lane.quad_right.observe(pack({at(dut.dbg_p00_right, n, p), at(dut.dbg_p10_right, n, p),
                                      at(dut.dbg_p01_right, n, p), at(dut.dbg_p11_right, n, p)}),
                                now);
      }
      if (dut.dbg_interp_valid >> n & 1)
        lane.interpolation.observe(pack({at(dut.dbg_l, n, s), at(dut.dbg_r, n, s)}), now);
      if (dut.dbg_sim_valid >> n & 1)
        lane.similarity.observe(pack({at(dut.dbg_sim_last, n, 1), at(dut.dbg_sim_inside, n, 1),
                                      at(dut.dbg_sim_textured, n, 1), at(dut.dbg_sim_v, n, m)}),
                                now);
    }
    if (dut.dbg_map_we) {
      map_address_.observe(dut.dbg_map_addr, now);
      map_word_.observe(pack({{dut.dbg_map_best, config_.mncc_bits},
                              {dut.dbg_map_prev, config_.mncc_bits},
                              {dut.dbg_map_plane, config_.plane_bits()},
                              {dut.dbg_map_frac, config_.frac_bits},
                              {dut.dbg_map_local_max, 1},
                              {dut.dbg_map_prev_valid, 1}}),
                        now);
    }
  }

  Sim<Dut> sim;
  Dut& dut;

 private:
  // What the stages of one lane show.
  struct Lane {
    explicit Lane(const std::string& name)
        : position("position" + name),
          fraction("fraction" + name),
          flags("flags" + name),
          quad_left("storage left" + name),
          quad_right("storage right" + name),
          interpolation("interpolation" + name),
          similarity("similarity" + name) {}
    Scoreboard position, fraction, flags, quad_left, quad_right, interpolation, similarity;
  };
  struct Field {
    uint64_t value;
    int bits;
  };
  static uint64_t pack(std::initializer_list<Field> fields) {
    uint64_t word = 0;
    for (const Field& f : fields) word = word << f.bits | (f.value & ((uint64_t{1} << f.bits) - 1));
    return word;
  }
  // Of a lane without a plane so far, in tiles of few planes; it must not have shown anything either.
  bool resting(const Scoreboard* board) const {
    const auto lane = static_cast<size_t>(std::find(boards_.begin(), boards_.end(), board) - boards_.begin()) / 7;
    return lane > 0 && lane < lanes_.size() && static_cast<int>(lane) >= most_planes_ && board->untouched();
  }
  static uint64_t u(int v) { return static_cast<uint64_t>(v); }
  // Field of lane n in a bundle.
  template <class Port>
  static Field at(const Port& bundle, int n, int bits) {
    return {static_cast<uint64_t>(bundle) >> n * bits, bits};
  }

  // The planes that the lanes sweep next.
  void expect_set() {
    for (int n = 0; n < config_.lanes && next_plane_ < stimulus_.job.planes; ++n) {  // else the boards say "unexpected"
      const int k = next_plane_++;
      expect_plane(lanes_[static_cast<size_t>(n)], k, n + 1 == config_.lanes || k + 1 == stimulus_.job.planes);
    }
  }
  // Into the map goes what the last plane of a set leaves.
  void expect_plane(Lane& lane, int k, bool last_of_set) {
    const int tile = tiles_ - 1;
    const golden::TileJob& t = stimulus_.job;
    const golden::PlaneTrace trace =
        golden::sweep_plane(config_, t, stimulus_.table[static_cast<size_t>(k)], stimulus_.left, stimulus_.right);
    const int cols = golden::sweep_cols(config_, t), p = config_.pix_bits, w = config_.weight_bits;
    for (size_t at = 0; at < trace.left.size(); ++at) {
      const Place place{tile, k, static_cast<int>(at) % cols, static_cast<int>(at) / cols};
      const golden::Sample &l = trace.left[at], &r = trace.right[at];
      lane.position.expect(pack({{u(l.xi), 13}, {u(l.yi), 13}, {u(r.xi), 13}, {u(r.yi), 13}}), place);
      lane.fraction.expect(pack({{u(l.fx), w}, {u(l.fy), w}, {u(r.fx), w}, {u(r.fy), w}}), place);
      const golden::SampleFlags f = trace.flags[at];
      lane.flags.expect(pack({{f.usable, 1}, {f.window_error, 1}}), place);
      expected_lost_ += f.window_error;
      auto quad = [&](const golden::Pixels& image, const golden::Sample& s) {
        if (!f.usable) return uint64_t{0};
        const golden::Quad q = golden::fetch(config_, image, s);
        return pack({{u(q.p00), p}, {u(q.p10), p}, {u(q.p01), p}, {u(q.p11), p}});
      };
      const uint64_t mask = f.usable ? ~uint64_t{0} : 0;  // pixels of other samples mean nothing
      lane.quad_left.expect(quad(stimulus_.left, l), place, mask);
      lane.quad_right.expect(quad(stimulus_.right, r), place, mask);
      lane.interpolation.expect(
          pack({{u(trace.l[at]), config_.sample_bits()}, {u(trace.r[at]), config_.sample_bits()}}), place);
    }
    for (size_t i = 0; i < cells_.size(); ++i) {
      const Place place{tile, k, static_cast<int>(i) % t.tile_cols, static_cast<int>(i) / t.tile_cols};
      const golden::Similarity& s = trace.similarity[i];
      lane.similarity.expect(
          pack({{i + 1 == cells_.size(), 1}, {s.valid, 1}, {s.textured, 1}, {u(s.v), config_.mncc_bits}}), place);
      cells_[i] = golden::update(config_, cells_[i], k, s);
      if (!last_of_set) continue;
      const golden::Cell& c = cells_[i];
      map_address_.expect(i, place);
      map_word_.expect(pack({{u(c.best), config_.mncc_bits},
                             {u(c.prev), config_.mncc_bits},
                             {u(c.plane), config_.plane_bits()},
                             {u(c.frac), config_.frac_bits},
                             {c.local_max, 1},
                             {c.prev_valid, 1}}),
                       place);
    }
    if (next_plane_ == t.planes) {
      for (size_t i = 0; i < cells_.size(); ++i)
        cell_.expect(
            cell_word(golden::pack_cell(config_, golden::unload(cells_[i], t.threshold)), i + 1 == cells_.size()),
            {tile, -1, static_cast<int>(i) % t.tile_cols, static_cast<int>(i) / t.tile_cols});
    }
  }
  static uint64_t cell_word(uint64_t data, bool last) { return data << 1 | uint64_t{last}; }
  void take_cell(const Beat& beat) {
    if (muted_) return;
    cell_.observe(cell_word(beat.data, beat.last), beat.clock);
    if (!beat.last) return;
    clocks_ = beat.clock - start_clock_;
    pending_ = false;
  }
  golden::Config config_;
  StreamPorts<CData, CData, QData, CData> cfg_ports_;
  decltype(stream_ports(&std::declval<Dut&>().s_pix_tvalid, &std::declval<Dut&>().s_pix_tready,
                        &std::declval<Dut&>().s_pix_tdata, &std::declval<Dut&>().s_pix_tlast)) pix_ports_;
  decltype(stream_ports(&std::declval<Dut&>().m_map_tvalid, &std::declval<Dut&>().m_map_tready,
                        &std::declval<Dut&>().m_map_tdata, &std::declval<Dut&>().m_map_tlast)) map_ports_;

 public:
  StreamDriver<Dut, decltype(cfg_ports_)> cfg;
  StreamDriver<Dut, decltype(pix_ports_)> pix;
  StreamMonitor<Dut, decltype(map_ports_)> map;

 private:
  Stalls stalls_;
  std::deque<Lane> lanes_;  // stay where they are
  Scoreboard map_address_{"map address"}, map_word_{"map word"}, cell_{"cell"};
  std::vector<Scoreboard*> boards_;
  scene::Stimulus stimulus_;
  std::vector<golden::Cell> cells_;
  int next_plane_ = 0, tiles_ = 0, most_planes_ = 0;
  bool pending_ = false, muted_ = false;
  uint64_t expected_lost_ = 0, start_clock_ = 0, clocks_ = 0;
};

}  // namespace psweep::tb
