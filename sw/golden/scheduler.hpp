// SPDX-License-Identifier: Apache-2.0
// Model of entity scheduler: what it writes to the engine, and how a tile ends.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "net/protocol.hpp"

namespace psweep::golden {

struct RegisterWrite {
  uint16_t address = 0;
  uint32_t value = 0;
  uint64_t word() const { return uint64_t{address} << 32 | value; }  // s_cfg_tdata
};

class Scheduler {
 public:
  static constexpr RegisterWrite kStart{0, 1};
  static constexpr RegisterWrite kStop{0, 6};  // abort, clear errors and counters

  void job(int word, uint32_t value) { job_[static_cast<size_t>(word)] = value; }
  std::vector<RegisterWrite> launch() const {
    std::vector<RegisterWrite> out;
    for (size_t i = 0; i < net::kJobWords; ++i) out.push_back({net::kJobRegisters[i], job_[i]});
    out.push_back(kStart);
    return out;
  }

  // Levels, one call a clock.
  void started(uint16_t tile) {
    running_ = true;
    risen_ = false;
    run_tile_ = tile;
  }
  void clock(bool engine_busy, bool map_last) {
    if (!running_) return;
    if (map_last) {
      running_ = false;
    } else if (risen_ && !engine_busy) {
      running_ = false;
      failed_ = true;
      failed_tile_ = run_tile_;
    }
    risen_ = risen_ || engine_busy;
  }
  void stop() { running_ = failed_ = false; }

  bool running() const { return running_; }
  uint16_t run_tile() const { return run_tile_; }
  bool failed() const { return failed_; }
  uint16_t failed_tile() const { return failed_tile_; }

 private:
  std::array<uint32_t, net::kJobWords> job_{};
  bool running_ = false, risen_ = false, failed_ = false;
  uint16_t run_tile_ = 0, failed_tile_ = 0;
};

}  // namespace psweep::golden
