// SPDX-License-Identifier: Apache-2.0
// VerilatedChip<Dut>: ChipModel over the Verilated class of one configuration of psweep_top. Included by the generated
// file of each configuration alone.
//   A rising edge of clk costs two evaluations, one of an MII clock only one: it is lowered together with clk, of which
//   there is at least one edge in between (clk >= 30 MHz). An input that changes together with its clock is taken
//   with its new value, as if it had been there before.
#pragma once
#include <verilated.h>

#include <algorithm>
#include <memory>
#include <string>

#include "contract/registers.hpp"
#include "desk/chip_model.hpp"
#include "simulator/coverage.hpp"
#include "simulator/wave.hpp"

namespace psweep::chip {

template <class Dut>
class VerilatedChip : public ChipModel {
 public:
  VerilatedChip() {
    // Random start contents, always the same: what depends on them differs from the model.
    context_.randReset(2);
    context_.randSeed(1);
    context_.timeunit(-12);
    context_.timeprecision(-12);
    simulator::Wave<Dut>::prepare(context_);
    dut_ = std::make_unique<Dut>(&context_);
    dut_->clk = 0;
    dut_->mii_rx_clk = 0;
    dut_->mii_tx_clk = 0;
    dut_->arst_n = 0;
    dut_->mii_rxd = 0;
    dut_->mii_rx_dv = 0;
    dut_->mii_rx_er = 0;
    dut_->mii_crs = 0;
    dut_->mii_col = 0;
    dut_->eval();
  }
  ~VerilatedChip() override {
    close_wave();
    simulator::save_coverage(context_);
    dut_->final();
  }

  void set_pins(const StaticPins& pins) override {
    dut_->phy_full_duplex = pins.full_duplex;
    dut_->phy_speed_100 = pins.speed_100;
    dut_->straps = pins.straps;
  }
  void set_reset(bool active) override { dut_->arst_n = !active; }
  void set_medium(bool carrier, bool collision) override {
    dut_->mii_crs = carrier;
    dut_->mii_col = collision;
  }

  void clk_edges(int64_t count, Time first, Time period) override {
    for (int64_t i = 0; i < count; ++i) {
      const Time at = first + i * period;
      dut_->clk = 0;
      dut_->mii_rx_clk = 0;
      dut_->mii_tx_clk = 0;
      evaluate(at - period / 2);
      // What the edge will take.
      busy_clocks_ += dut_->led_busy && dut_->arst_n;
      if (dut_->dbg_cfg_tvalid && dut_->arst_n && dut_->dbg_cfg_tdata >> 32 == golden::kRegCommand &&
          (dut_->dbg_cfg_tdata & golden::kCommandStart) != 0)
        ++launches_;
      dut_->clk = 1;
      evaluate(at);
    }
  }
  void rx_edge(const MiiSample& pins, Time at) override {
    dut_->mii_rxd = pins.data;
    dut_->mii_rx_dv = pins.valid;
    dut_->mii_rx_er = pins.error;
    dut_->mii_rx_clk = 1;
    evaluate(at);
  }
  MiiSample tx_edge(Time at) override {
    const MiiSample shown{dut_->mii_txd, dut_->mii_tx_en != 0, false};
    dut_->mii_tx_clk = 1;
    evaluate(at);
    return shown;
  }

  bool session() const override { return dut_->led_session != 0; }
  bool busy() const override { return dut_->led_busy != 0; }
  unsigned clock_missing() const override { return dut_->clock_missing; }
  int64_t launches() const override { return launches_; }
  int64_t busy_clocks() const override { return busy_clocks_; }

  void open_wave(const std::string& file) override { wave_.open(*dut_, file); }
  void close_wave() override { wave_.close(); }

 private:
  void evaluate(Time at) {
    dut_->eval();
    if (!wave_.is_open()) return;
    // The middle of a period of clk may lie before an MII edge that was simulated already.
    dumped_ = std::max(at / 1000, dumped_ + 1);
    wave_.dump(static_cast<uint64_t>(dumped_));
  }
  VerilatedContext context_;
  std::unique_ptr<Dut> dut_;
  simulator::Wave<Dut> wave_;
  int64_t dumped_ = -1;  // picoseconds
  int64_t launches_ = 0, busy_clocks_ = 0;
};

}  // namespace psweep::chip
