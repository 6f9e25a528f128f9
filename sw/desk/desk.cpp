// SPDX-License-Identifier: Apache-2.0
#include "desk/desk.hpp"

#include <algorithm>
#include <cmath>

namespace psweep::chip {

namespace {

Time period_of(double mhz, double ppm = 0) { return std::llround(1e9 / (mhz * (1 + ppm * 1e-6))); }
Time part_of(Time period, double share) { return static_cast<Time>(static_cast<double>(period) * share); }
LinkSettings link_settings(const DeskSettings& s) {
  LinkSettings link;
  link.half_duplex = s.half_duplex;
  link.delay = s.medium_delay;
  link.echo = s.half_duplex ? s.echo : -1;
  link.seed = s.seed;
  return link;
}

// After this long without anything on the wire the chip has answered whatever it will answer: the longest message
// takes some 5,000 clocks, at 30 MHz.
constexpr Time kSettled = 300 * kMicrosecond;

}  // namespace

Desk::Desk(std::unique_ptr<ChipModel> chip, const DeskSettings& settings)
    : chip_(std::move(chip)),
      settings_(settings),
      link_(link_settings(settings)),
      to_chip_(settings.faults, settings.seed * 2 + 1),
      from_chip_(settings.faults, settings.seed * 2 + 2),
      clk_period_(period_of(settings.clk_mhz)),
      rx_period_(period_of(settings.speed_100 ? 25 : 2.5, settings.rx_ppm)),
      tx_period_(period_of(settings.speed_100 ? 25 : 2.5, settings.tx_ppm)),
      next_clk_(part_of(clk_period_, settings.clk_phase)),
      next_rx_(part_of(rx_period_, settings.rx_phase)),
      next_tx_(part_of(tx_period_, settings.tx_phase)),
      mii_clocks_(settings.mii_clocks) {
  if (!(settings.clk_mhz >= 30)) throw InputError("clk: the chip needs 30 MHz or more");
  link_.on_begin = [this](bool from_chip) { frame_begins(from_chip); };
  link_.on_end = [this](bool from_chip, bool good, const net::Bytes& frame) { frame_ends(from_chip, good, frame); };
  chip_->set_pins({!settings.half_duplex, settings.speed_100, settings.straps});
  chip_->set_medium(false, false);
  reset_chip();
}

void Desk::reset_chip(Time duration) {
  chip_->set_reset(true);
  in_reset_ = tx_unknown_ = true;
  run_for(std::max(duration, 10 * std::max(rx_period_, clk_period_)));
  chip_->set_reset(false);
  in_reset_ = false;
  released_ = clocks_;
  // Released in step with each clock, and memories that clear themselves have had their time.
  run_for(std::max(10 * rx_period_, 2000 * clk_period_));
}

void Desk::clk_before(Time end) {
  if (next_clk_ >= end) return;
  const int64_t count = (end - next_clk_ + clk_period_ - 1) / clk_period_;
  chip_->clk_edges(count, next_clk_, clk_period_);
  next_clk_ += count * clk_period_;
  clocks_ += count;
}

void Desk::run_to(Time end) {
  while (now_ < end) {
    const Time next = std::min(next_rx_, next_tx_);
    if (next > end) {
      clk_before(end);
      now_ = end;
      break;
    }
    clk_before(next);
    now_ = next;
    if (next == next_rx_) {
      rx_edge();
    } else {
      tx_edge();
    }
    const bool carrier = held_ || link_.carrier(), collision = link_.collision();
    if (carrier != carrier_ || collision != collision_) {
      carrier_ = carrier;
      collision_ = collision;
      chip_->set_medium(carrier, collision);
    }
    if (wave_open_ && clocks_ >= wave_end_) {
      chip_->close_wave();
      wave_open_ = false;
      wave_done_ = true;
    }
  }
}

void Desk::rx_edge() {
  next_rx_ += rx_period_;
  if (!to_chip_.empty()) {
    net::Bytes frame;
    while (to_chip_.take(now_, frame))
      if (plugged_) link_.send(std::move(frame));
  }
  if (!from_chip_.empty()) {
    net::Bytes frame;
    while (from_chip_.take(now_, frame)) {
      if (!plugged_ || !net::fcs_good(frame)) continue;  // as a network card does
      frame.resize(frame.size() - 4);
      if (on_frame) on_frame(frame);
    }
  }
  if (mii_clocks_ && rx_clock_) chip_->rx_edge(link_.rx_clock(), now_);
  if (wave_ && wave_->tile >= 0 && chip_->launches() > wave_->tile) open_wave();
}

void Desk::tx_edge() {
  next_tx_ += tx_period_;
  if (!mii_clocks_ || !tx_clock_) return;
  const MiiSample from_chip = chip_->tx_edge(now_);
  // A PHY is reset together with the chip, whose outputs say nothing before the first edge that resets them.
  link_.tx_clock(in_reset_ || tx_unknown_ ? MiiSample{} : from_chip);
  tx_unknown_ = false;
}

void Desk::frame_begins(bool from_chip) {
  ++frames_begun_;
  active_ = now_;
  if (wave_ && frames_begun_ == wave_->frame) open_wave();
  if (pcap_) recorded_.push_back({now_, from_chip, false, false, {}});
}

void Desk::frame_ends(bool from_chip, bool good, const net::Bytes& frame) {
  active_ = now_;
  if (pcap_) {
    // Both directions may be under way; each has one frame at a time.
    for (auto& r : recorded_) {
      if (r.from_chip != from_chip || r.over) continue;
      r.over = true;
      r.good = good && net::fcs_good(frame);
      if (r.good) r.frame.assign(frame.begin(), frame.end() - 4);
      break;
    }
    while (!recorded_.empty() && recorded_.front().over) {
      if (recorded_.front().good) pcap_->write(recorded_.front().frame, recorded_.front().begun);
      recorded_.pop_front();
    }
  }
  if (on_wire && good && net::fcs_good(frame)) on_wire(from_chip, net::Bytes(frame.begin(), frame.end() - 4));
  if (from_chip && good && plugged_) {
    net::Bytes bare(frame.begin(), frame.end() - 4);
    from_chip_.put(std::move(bare), now_);
  }
}

void Desk::open_wave() {
  if (wave_open_ || wave_done_) return;
  chip_->open_wave(wave_->file);
  wave_open_ = true;
  wave_end_ = clocks_ + wave_->clocks;
}

bool Desk::idle() const {
  return link_.quiet() && to_chip_.empty() && from_chip_.empty() && !chip_->session() && !chip_->busy() &&
         now_ - active_ > kSettled;
}

void Desk::finish() {
  if (wave_open_) chip_->close_wave();
  wave_done_ = wave_done_ || wave_open_;
  wave_open_ = false;
  if (!pcap_) return;
  pcap_->close();
  frames_recorded_ = pcap_->frames();
  pcap_.reset();
  recorded_.clear();
}

}  // namespace psweep::chip
