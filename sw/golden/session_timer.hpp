// SPDX-License-Identifier: Apache-2.0
// Model of entity session_timer: milliseconds, silence, watchdog, and waits divided by 256.
#pragma once
#include <cstdint>

namespace psweep::golden {

class SessionTimer {
 public:
  SessionTimer(int clk_khz, int session_ms) : clk_khz_(clk_khz), session_ms_(session_ms) {}

  bool tick() const { return tick_; }
  bool expired() const { return expired_; }
  bool stuck(bool session) const { return (expired_ && tick_) || (!session && (lapse() || silence_ >> 10 & 1)); }
  bool wait_rows() const { return wait_rows_; }
  bool wait_map() const { return wait_map_; }

  void clock(bool alive, bool no_rows, bool no_room) {
    if (alive) {
      silence_ = 0;
      expired_ = false;
    } else if (lapse()) {
      silence_ = 0;
      expired_ = true;
    } else if (tick_) {
      ++silence_;
    }
    wait_rows_ = rows_were_missing_ && ++rows_ == 0;
    wait_map_ = no_room && ++map_ == 0;
    rows_were_missing_ = no_rows;
    tick_ = ++clock_ == clk_khz_;
    if (tick_) clock_ = 0;
  }

 private:
  bool lapse() const { return tick_ && silence_ == session_ms_ - 1; }

  int clk_khz_, session_ms_;
  int clock_ = 0, silence_ = 0;
  uint8_t rows_ = 0, map_ = 0;
  bool tick_ = false, expired_ = false, wait_rows_ = false, wait_map_ = false, rows_were_missing_ = false;
};

}  // namespace psweep::golden
