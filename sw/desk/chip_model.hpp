// SPDX-License-Identifier: Apache-2.0
// ChipModel: the pins of entity psweep_top (docs/interfaces.md) as a class, so that link, faults, TAP and tests do not
// know which model they drive: a Verilated configuration (verilated_chip.hpp) or a stand-in (echo_chip.hpp).
//   Times are femtoseconds of simulated time. Pins are sampled as a PHY and the chip do it: inputs are set before the
//   rising edge that takes them, outputs are read before the rising edge that changes them.
//   Falling edges mean nothing to the chip; a model may make them at any time.
#pragma once
#include <cstdint>
#include <string>

namespace psweep::chip {

using Time = int64_t;  // femtoseconds; 2.5 hours fit
constexpr Time kNanosecond = 1'000'000, kMicrosecond = 1'000 * kNanosecond, kMillisecond = 1'000 * kMicrosecond,
               kSecond = 1'000 * kMillisecond;

struct MiiSample {
  uint8_t data = 0;  // 4 bits
  bool valid = false;
  bool error = false;  // receive only
};

// Pins that change rarely.
struct StaticPins {
  bool full_duplex = true;
  bool speed_100 = true;
  uint8_t straps = 0;
};

class ChipModel {
 public:
  ChipModel() = default;
  ChipModel(const ChipModel&) = delete;
  ChipModel& operator=(const ChipModel&) = delete;
  virtual ~ChipModel() = default;

  virtual void set_pins(const StaticPins& pins) = 0;
  virtual void set_reset(bool active) = 0;                    // pin arst_n
  virtual void set_medium(bool carrier, bool collision) = 0;  // pins crs and col, asynchronous

  // `count` rising edges of clk, the first at `first`, then every `period`.
  virtual void clk_edges(int64_t count, Time first, Time period) = 0;
  // One rising edge of the receive clock that takes `pins`.
  virtual void rx_edge(const MiiSample& pins, Time at) = 0;
  // One rising edge of the transmit clock; what the pins showed before it.
  virtual MiiSample tx_edge(Time at) = 0;

  virtual bool session() const = 0;                     // led_session
  virtual bool busy() const = 0;                        // led_busy
  virtual unsigned clock_missing() const { return 0; }  // bit 0 receive clock, 1 transmit clock
  // Since power-on: tiles launched (start commands on dbg_cfg), clocks with led_busy.
  virtual int64_t launches() const = 0;
  virtual int64_t busy_clocks() const = 0;

  // Waves from now on. Throws WaveError if the model was built without.
  virtual void open_wave(const std::string& file) = 0;
  virtual void close_wave() = 0;
};

}  // namespace psweep::chip
