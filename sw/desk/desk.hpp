// SPDX-License-Identifier: Apache-2.0
// Desk: the chip, its clocks, the wire with its faults, and simulated time.
//   Three clocks of any frequencies and phases: clk, and the PHY's receive and transmit clocks (25 or 2.5 MHz, which
//   may differ by some ppm). The model is evaluated once per edge that matters, edges of clk in bunches between those
//   of MII. Frames go in and out without FCS.
//
//     Desk desk(chip.make(), settings);      // power-on reset included
//     desk.on_frame = [](const Bytes& frame) { .. };
//     desk.send(frame);
//     desk.run_until([&] { return answered; }, desk.now() + 10 * kMillisecond);
#pragma once
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "desk/faults.hpp"
#include "desk/mii_link.hpp"
#include "desk/pcap.hpp"

namespace psweep::chip {

struct DeskSettings {
  double clk_mhz = 166;
  bool speed_100 = true;
  double rx_ppm = 0, tx_ppm = 0;  // deviation of the PHY's clocks
  // Phases of the first edges as shares of a period; the values keep edges apart without meaning anything else.
  double clk_phase = 0.13, rx_phase = 0.37, tx_phase = 0.71;
  bool mii_clocks = true;    // they run from power-on
  bool half_duplex = false;  // pin and medium
  int echo = -1;             // half duplex: nibble times after which the PHY loops the chip's frames back; -1: never
  int medium_delay = 10;     // nibble times each way, half duplex: 40 of the 128 of a slot would be the longest
  uint8_t straps = 0;
  uint32_t seed = 1;
  FaultRates faults;
};

// A stretch of simulation as waves.
struct WaveWindow {
  std::string file;
  int64_t frame = 0;  // opens when this frame begins, counted from 1 over both directions; 0: not by frame
  int64_t tile = -1;  // opens when the engine begins this tile since power-on, from 0; -1: not by tile
  int64_t clocks = 40000;
};

class Desk {
 public:
  Desk(std::unique_ptr<ChipModel> chip, const DeskSettings& settings);

  std::function<void(const net::Bytes& frame)> on_frame;  // from the chip, behind the faults, whole and without FCS
  // Every good frame at the chip's pins as it ends, without FCS: no faults and no cable in between.
  std::function<void(bool from_chip, const net::Bytes& frame)> on_wire;

  void send(net::Bytes frame) { to_chip_.put(std::move(frame), now_); }
  // Straight to the pins, no faults, FCS as it is.
  void send_raw(net::Bytes frame_with_fcs) { link_.send(std::move(frame_with_fcs)); }
  size_t waiting() const { return link_.queued(); }

  void run_for(Time duration) { run_to(now_ + duration); }
  // Until done() or the time; done() is asked after every microsecond. True if done.
  template <class Done>
  bool run_until(Done&& done, Time deadline) {
    while (!done()) {
      if (now_ >= deadline) return false;
      run_to(std::min(deadline, now_ + kMicrosecond));
    }
    return true;
  }
  // Active low reset of the chip; the wire goes on.
  void reset_chip(Time duration = 2 * kMicrosecond);
  // Cable out: frames vanish in both directions, and nothing is counted.
  void set_cable(bool plugged) { plugged_ = plugged; }
  // Both clocks of the PHY stand still, as some do without a link or in their reset; what is on the wire waits.
  void set_mii_clocks(bool running) { mii_clocks_ = running; }
  // One of them alone.
  void set_rx_clock(bool running) { rx_clock_ = running; }
  void set_tx_clock(bool running) { tx_clock_ = running; }
  // Pin arst_n alone goes low for a while; nothing else knows.
  void pulse_reset(Time duration) {
    chip_->set_reset(true);
    run_for(duration);
    chip_->set_reset(false);
  }
  // Pin crs stays high, whatever is on the wire.
  void hold_carrier(bool held) { held_ = held; }
  void set_faults(const FaultRates& rates) {
    to_chip_.set_rates(rates);
    from_chip_.set_rates(rates);
  }

  Time now() const { return now_; }
  int64_t clocks() const { return clocks_; }
  int64_t released() const { return released_; }  // clocks() when the latest reset ended
  double clk_mhz() const { return settings_.clk_mhz; }
  // Nothing happens until somebody sends: wire and engine are at rest, no session, no frame held back by faults.
  bool idle() const;
  const ChipModel& chip() const { return *chip_; }
  const LinkCounters& link() const { return link_.counters(); }
  const FaultCounters& faults_to_chip() const { return to_chip_.counters(); }
  const FaultCounters& faults_from_chip() const { return from_chip_.counters(); }

  // Frames that were whole at the chip's pins, in the order they began, stamped with that time.
  void record(const std::string& pcap_file) { pcap_ = std::make_unique<PcapWriter>(pcap_file); }
  uint64_t recorded() const { return pcap_ ? pcap_->frames() : frames_recorded_; }
  void watch(const WaveWindow& window) { wave_ = window; }
  bool wave_written() const { return wave_done_; }
  // Ends recording and waves, not the simulation; throws if one could not be written.
  void finish();

 private:
  struct Recorded {
    Time begun;
    bool from_chip, over, good;
    net::Bytes frame;
  };

  void run_to(Time end);
  void clk_before(Time end);
  void rx_edge();
  void tx_edge();
  void frame_begins(bool from_chip);
  void frame_ends(bool from_chip, bool good, const net::Bytes& frame);
  void open_wave();

  std::unique_ptr<ChipModel> chip_;
  DeskSettings settings_;
  MiiLink link_;
  Faults to_chip_, from_chip_;
  Time now_ = 0;
  Time clk_period_, rx_period_, tx_period_;
  Time next_clk_, next_rx_, next_tx_;
  Time active_ = 0;  // when something happened last
  int64_t clocks_ = 0, released_ = 0;
  bool plugged_ = true, in_reset_ = false, tx_unknown_ = true, mii_clocks_, rx_clock_ = true, tx_clock_ = true;
  bool held_ = false;
  bool carrier_ = false, collision_ = false;

  std::unique_ptr<PcapWriter> pcap_;
  std::deque<Recorded> recorded_;
  uint64_t frames_recorded_ = 0;
  int64_t frames_begun_ = 0;
  std::optional<WaveWindow> wave_;
  bool wave_open_ = false, wave_done_ = false;
  int64_t wave_end_ = 0;
};

}  // namespace psweep::chip
