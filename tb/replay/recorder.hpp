// SPDX-License-Identifier: Apache-2.0
// Recorder: a ChipModel that passes everything on to another one and writes it down, for tb/replay/psweep_replay.vhd
// to do the same to the original VHDL. One event per line in the order of events; times are not recorded, since the
// chip knows only edges.
#pragma once
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "chip/chip_model.hpp"

namespace psweep::chip {

class Recorder : public ChipModel {
 public:
  // Throws std::runtime_error if the file cannot be written.
  Recorder(std::unique_ptr<ChipModel> chip, const std::string& file) : chip_(std::move(chip)), out_(file) {
    if (!out_) throw std::runtime_error(file + ": cannot be written");
  }

  void set_pins(const StaticPins& pins) override {
    flush();
    out_ << "p " << pins.full_duplex << ' ' << pins.speed_100 << ' ' << int{pins.straps} << '\n';
    chip_->set_pins(pins);
  }
  void set_reset(bool active) override {
    flush();
    out_ << "x " << !active << '\n';
    chip_->set_reset(active);
  }
  void set_medium(bool carrier, bool collision) override {
    flush();
    out_ << "m " << carrier << ' ' << collision << '\n';
    chip_->set_medium(carrier, collision);
  }
  void clk_edges(int64_t count, Time first, Time period) override {
    clocks_ += count;
    chip_->clk_edges(count, first, period);
  }
  void rx_edge(const MiiSample& pins, Time at) override {
    flush();
    out_ << "r " << int{pins.data} << ' ' << pins.valid << ' ' << pins.error << '\n';
    chip_->rx_edge(pins, at);
  }
  MiiSample tx_edge(Time at) override {
    flush();
    const bool s = chip_->session(), b = chip_->busy();
    const MiiSample shown = chip_->tx_edge(at);
    out_ << "t " << int{shown.data} << ' ' << shown.valid << ' ' << s << ' ' << b << '\n';
    return shown;
  }

  bool session() const override { return chip_->session(); }
  bool busy() const override { return chip_->busy(); }
  int64_t launches() const override { return chip_->launches(); }
  int64_t busy_clocks() const override { return chip_->busy_clocks(); }
  void open_wave(const std::string& file) override { chip_->open_wave(file); }
  void close_wave() override { chip_->close_wave(); }

 private:
  void flush() {
    if (clocks_ > 0) out_ << "c " << clocks_ << '\n';
    clocks_ = 0;
  }

  std::unique_ptr<ChipModel> chip_;
  std::ofstream out_;
  int64_t clocks_ = 0;
};

}  // namespace psweep::chip
