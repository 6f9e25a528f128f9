// SPDX-License-Identifier: Apache-2.0
// One tile through a Verilated engine, without stalls, and the clocks at which the debug ports show what is asked for.
// Always the same tile in the same clocks, so a first run can find what a second one dumps. Included by the generated
// file of each configuration alone.
#pragma once
#include <verilated.h>

#include <memory>

#include "contract/registers.hpp"
#include "golden/control.hpp"
#include "simulator/engine_driver.hpp"
#include "simulator/wave.hpp"
#include "waves/engines.hpp"
#include "waves/fst.hpp"

namespace psweep::waves {

template <class Dut>
class TracedEngine {
 public:
  TracedEngine(const golden::Config& config, const Run& run) : config_(config), run_(run) {
    context_.randReset(2);
    context_.randSeed(1);
    dut_ = std::make_unique<Dut>(&context_);
    if (!run.fst.empty()) wave_.open(*dut_, run.fst);
    dut_->clk = 1;
    simulator::EngineDriver<Dut>(*dut_, config).rest();
  }
  ~TracedEngine() {
    wave_.close();
    dut_->final();
  }

  RunLog run() {
    const scene::Stimulus& s = *run_.stimulus;
    dut_->rst = 1;
    for (int i = 0; i < 4; ++i) tick();
    dut_->rst = 0;
    simulator::EngineDriver<Dut> driver(*dut_, config_);
    driver.write(simulator::tile_words(s.job, &s.table), [this] { tick(); });
    const uint64_t deadline = clock_ + 1000 + 2 * golden::engine_clocks(config_, s.job);
    driver.send(s.left, s.right, [&] {
      if (clock_ >= deadline) throw WaveError("the engine does not take its pixels");
      return tick();
    });
    // With waves the map is of no interest any more.
    while (dut_->busy && clock_ < deadline && !(wave_.is_open() && clock_ > run_.last)) tick();
    if (dut_->busy && clock_ >= deadline) throw WaveError("the engine does not finish its tile");
    log_.last_clock = clock_;
    return log_;
  }

 private:
  // One clock with the inputs as they are: they come right behind the rising edge. Whether a pixel was taken.
  bool tick() {
    dut_->eval();
    dump(clock_ * kPicosecondsPerClock);
    look();
    const bool taken = dut_->s_pix_tvalid && dut_->s_pix_tready;
    dut_->clk = 0;
    dut_->eval();
    dump(clock_ * kPicosecondsPerClock + kPicosecondsPerClock / 2);
    dut_->clk = 1;
    dut_->eval();
    ++clock_;
    return taken;
  }
  void dump(uint64_t time) {
    if (clock_ >= run_.first && clock_ <= run_.last) wave_.dump(time);
  }
  void look() {
    if (dut_->rst) return;
    const int lane = run_.lane;
    const bool valid[kTaps] = {(dut_->dbg_sample_valid >> lane & 1) != 0, (dut_->dbg_quad_valid >> lane & 1) != 0,
                               (dut_->dbg_interp_valid >> lane & 1) != 0, (dut_->dbg_sim_valid >> lane & 1) != 0,
                               dut_->dbg_map_we != 0};
    for (int tap = 0; tap < kTaps; ++tap) {
      if (!valid[tap]) continue;
      const uint64_t beat = beats_[tap]++;
      if (clock_ < run_.first) ++log_.before[tap];
      auto& found = log_.clocks[tap];
      const auto& wanted = run_.wanted[tap];
      if (found.size() < wanted.size() && wanted[found.size()] == beat) found.push_back(clock_);
    }
    if (dut_->m_map_tvalid) log_.cells.push_back(golden::unpack_cell(config_, dut_->m_map_tdata));
  }

  golden::Config config_;
  const Run& run_;
  VerilatedContext context_;
  std::unique_ptr<Dut> dut_;
  simulator::Wave<Dut> wave_;
  uint64_t clock_ = 0, beats_[kTaps] = {};
  RunLog log_;
};

}  // namespace psweep::waves
