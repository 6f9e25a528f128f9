// SPDX-License-Identifier: Apache-2.0
// ChipRecorder: a ChipModel that passes everything on to another one and writes it into a recording, in the order in
// which it happens; times are not recorded, since the chip knows only edges. Outputs are compared at the edges of
// mii_tx_clk, mii_txd while mii_tx_en is high.
#pragma once
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "desk/chip_model.hpp"
#include "replay/recording.hpp"

namespace psweep::chip {

class ChipRecorder : public ChipModel {
 public:
  ChipRecorder(std::unique_ptr<ChipModel> chip, const std::string& file, const std::vector<std::string>& generics)
      : chip_(std::move(chip)), to_(file, "psweep_top", generics) {
    for (const char* clock : {"clk", "mii_rx_clk", "mii_tx_clk"}) to_.clock(clock);
    arst_n_ = to_.in("arst_n", 1);
    rxd_ = to_.in("mii_rxd", 4);
    rx_dv_ = to_.in("mii_rx_dv", 1);
    rx_er_ = to_.in("mii_rx_er", 1);
    crs_ = to_.in("mii_crs", 1);
    col_ = to_.in("mii_col", 1);
    full_duplex_ = to_.in("phy_full_duplex", 1);
    speed_100_ = to_.in("phy_speed_100", 1);
    straps_ = to_.in("straps", 8);
    txd_ = to_.out("mii_txd", 4);
    tx_en_ = to_.out("mii_tx_en", 1);
    session_ = to_.out("led_session", 1);
    busy_ = to_.out("led_busy", 1);
    missing_ = to_.out("clock_missing", 2);
  }
  ~ChipRecorder() override { to_.close(); }

  void set_pins(const StaticPins& pins) override {
    to_.set(full_duplex_, pins.full_duplex);
    to_.set(speed_100_, pins.speed_100);
    to_.set(straps_, pins.straps);
    step("000");
    chip_->set_pins(pins);
  }
  void set_reset(bool active) override {
    to_.set(arst_n_, !active);
    awake_ = 0;
    reset_ = active;
    step("000");
    chip_->set_reset(active);
  }
  void set_medium(bool carrier, bool collision) override {
    to_.set(crs_, carrier);
    to_.set(col_, collision);
    step("000");
    chip_->set_medium(carrier, collision);
  }
  void clk_edges(int64_t count, Time first, Time period) override {
    if (count > 0) step("100", static_cast<uint64_t>(count));
    chip_->clk_edges(count, first, period);
  }
  void rx_edge(const MiiSample& pins, Time at) override {
    to_.set(rxd_, pins.data);
    to_.set(rx_dv_, pins.valid);
    to_.set(rx_er_, pins.error);
    step("010");
    chip_->rx_edge(pins, at);
  }
  MiiSample tx_edge(Time at) override {
    const bool session = chip_->session(), busy = chip_->busy();
    const unsigned missing = chip_->clock_missing();
    const MiiSample shown = chip_->tx_edge(at);
    // Four edges after a reset everything has passed through the synchronisers.
    const uint64_t defined = awake_ > 4 ? ~uint64_t{0} : 0;
    to_.expect(txd_, shown.data, shown.valid ? defined : 0);
    to_.expect(tx_en_, shown.valid, defined);
    to_.expect(session_, session, defined);
    to_.expect(busy_, busy, defined);
    to_.expect(missing_, missing, defined);
    to_.step("001");
    awake_ = reset_ ? 0 : awake_ + 1;
    return shown;
  }

  bool session() const override { return chip_->session(); }
  bool busy() const override { return chip_->busy(); }
  unsigned clock_missing() const override { return chip_->clock_missing(); }
  int64_t launches() const override { return chip_->launches(); }
  int64_t busy_clocks() const override { return chip_->busy_clocks(); }
  void open_wave(const std::string& file) override { chip_->open_wave(file); }
  void close_wave() override { chip_->close_wave(); }

 private:
  // Of another clock than mii_tx_clk, or of none.
  void step(const char* rising, uint64_t count = 1) {
    for (const int port : {txd_, tx_en_, session_, busy_, missing_}) to_.expect(port, 0, 0);
    to_.step(rising, count);
  }

  std::unique_ptr<ChipModel> chip_;
  replay::Recording to_;
  int arst_n_, rxd_, rx_dv_, rx_er_, crs_, col_, full_duplex_, speed_100_, straps_, txd_, tx_en_, session_, busy_,
      missing_;
  int awake_ = 0;  // edges of mii_tx_clk since the reset
  bool reset_ = true;
};

}  // namespace psweep::chip
