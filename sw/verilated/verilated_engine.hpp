// SPDX-License-Identifier: Apache-2.0
// VerilatedEngine<Dut>: EngineModel over the Verilated class of one configuration of psweep. Included by the generated
// file of each configuration alone.
#pragma once
#include <verilated.h>

#include <algorithm>
#include <atomic>
#include <string>

#include "contract/registers.hpp"
#include "simulator/coverage.hpp"
#include "simulator/engine_driver.hpp"
#include "verilated/engine_model.hpp"

extern __thread bool psweep_inputs_changed;  // scripts/cmake/inputs_changed.cpp

namespace psweep::rtl {

// BothEdges: the model takes every change of clk for a clock (RtlModel.cmake), and a clock is one evaluation.
template <class Dut, bool BothEdges>
class VerilatedEngine : public EngineModel {
 public:
  explicit VerilatedEngine(const golden::Config& config) : config_(config) {
    // Random start contents, always the same: a result that depends on them cannot equal the model's.
    context_.randReset(2);
    context_.randSeed(1);
    dut_ = std::make_unique<Dut>(&context_);
    reset();
  }
  ~VerilatedEngine() override {
    simulator::save_coverage(context_);
    dut_->final();
  }

  void set_table(const std::vector<golden::PlaneEntry>& table) override {
    table_ = table;
    table_written_ = false;
  }
  void count_clocks_in(std::atomic<uint64_t>* counter) override { counter_ = counter; }

  TileOutput run(const golden::TileJob& job, const golden::Pixels& left, const golden::Pixels& right) override {
    const uint64_t first_clock = clock_;
    // Far more than any formula: a hanging engine must end, a slow one is for the tests to find.
    deadline_ = clock_ + 100000 + 8 * table_.size() +
                4 * (uint64_t(job.win_cols) * job.win_rows + uint64_t(job.tile_cols) * job.tile_rows) +
                2 * uint64_t(job.planes) * (uint64_t(golden::sweep_cols(config_, job)) + 64) *
                    (uint64_t(golden::sweep_rows(config_, job)) + 8);
    try {
      simulator::EngineDriver<Dut> driver(*dut_, config_);
      driver.rest();
      auto clock = [this] {
        low();
        high();
      };
      driver.write({{golden::kRegCommand, golden::kCommandClear}}, clock);
      driver.write(simulator::tile_words(job, table_written_ ? nullptr : &table_), clock);
      table_written_ = true;
      TileOutput out;
      out.cells.reserve(size_t(job.tile_cols) * job.tile_rows);
      driver.send(left, right, [&] {
        low();
        const bool taken = dut_->s_pix_tready;
        collect(out);
        high();
        check_deadline();
        return taken;
      });
      finish(out);
      out.clocks = dut_->tile_clocks;
      out.all_clocks = clock_ - first_clock;
      out.errors = dut_->errors;
      out.window_errors = dut_->window_errors;
      publish();
      if (out.errors & ~unsigned{golden::kErrorWindow} || out.cells.size() != size_t(job.tile_cols) * job.tile_rows)
        throw EngineError("rtl engine: tile failed, errors: " + golden::error_names(out.errors) + "; " +
                          std::to_string(out.cells.size()) + " of " +
                          std::to_string(size_t(job.tile_cols) * job.tile_rows) + " cells came out");
      return out;
    } catch (...) {
      publish();
      reset();
      throw;
    }
  }

 private:
  void reset() {
    dut_->rst = 1;
    simulator::EngineDriver<Dut>(*dut_, config_).rest();
    for (int i = 0; i < 4; ++i) {
      low();
      high();
    }
    dut_->rst = 0;
    table_written_ = false;
    published_ = clock_;  // a reset is no work
  }
  // One clock is low(), which settles everything before the edge, and high(), the edge. No output that is looked at
  // between them depends on an input without a register, so low() is not needed for its own sake.
  void low() {
    if constexpr (!BothEdges) {
      dut_->clk = 0;
      dut_->eval();
    }
  }
  void high() {
    dut_->clk = !dut_->clk;
    dut_->eval();
    if ((++clock_ & 0xFFF) == 0) publish();
  }
  void publish() {
    if (counter_) *counter_ += clock_ - published_;
    published_ = clock_;
  }
  void check_deadline() const {
    if (clock_ > deadline_)
      throw EngineError("rtl engine: hangs in state " + std::to_string(int(dut_->state)) +
                        ", errors: " + golden::error_names(dut_->errors));
  }
  void finish(TileOutput& out) {
    struct Quiet {
      ~Quiet() { psweep_inputs_changed = true; }
    } quiet;
    for (;;) {
      low();
      if (!dut_->busy) return;
      collect(out);
      high();
      check_deadline();
      psweep_inputs_changed = false;  // nothing comes in any more
    }
  }
  void collect(TileOutput& out) {
    if (dut_->m_map_tvalid) out.cells.push_back(golden::unpack_cell(config_, dut_->m_map_tdata));
  }

  golden::Config config_;
  VerilatedContext context_;
  std::unique_ptr<Dut> dut_;
  std::vector<golden::PlaneEntry> table_;
  bool table_written_ = false;
  uint64_t clock_ = 0, deadline_ = 0, published_ = 0;
  std::atomic<uint64_t>* counter_ = nullptr;
};

}  // namespace psweep::rtl
