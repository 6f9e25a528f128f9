// SPDX-License-Identifier: Apache-2.0
// Model of entity scheduler: what it writes to the engine, and how a tile ends.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "contract/protocol.hpp"
#include "contract/registers.hpp"

namespace psweep::golden {

class Scheduler {
 public:
  static constexpr RegisterWrite kStart{0, 1};
  static constexpr RegisterWrite kStop{0, 6};   // abort, clear errors and counters
  static constexpr RegisterWrite kAbort{0, 2};  // of the watch
  static constexpr int kWatch = 16;             // clocks

  void job(int word, uint32_t value) { job_[static_cast<size_t>(word)] = value; }
  std::vector<RegisterWrite> launch() const {
    std::vector<RegisterWrite> out;
    for (size_t i = 0; i < net::kJobWords; ++i) out.push_back({net::kJobRegisters[i], job_[i]});
    out.push_back(kStart);
    return out;
  }

  // Levels, one call a clock. started: in the clock of go, instead of clock().
  void started(uint16_t tile) {
    running_ = true;
    risen_ = tile_failed_ = recovered_ = false;
    run_tile_ = tile;
    watch_ = 1;
  }
  // Whether COMMAND 2 goes to the engine in the next clock.
  bool clock(bool engine_busy, bool map_last, bool starved = false, bool lost = false) {
    const bool over = watch_ >= kWatch;
    tile_failed_ = recovered_ = false;
    if (!running_) {
      watch_ = engine_busy && !over ? watch_ + 1 : 0;
      recovered_ = over;
      return over;
    }
    watch_ = !risen_ || starved ? watch_ + 1 : 0;
    if (map_last) {
      running_ = false;
    } else if ((risen_ && !engine_busy) || over || lost) {
      running_ = false;
      failed_ = tile_failed_ = true;
      failed_tile_ = run_tile_;
      recovered_ = over || lost;
    }
    risen_ = risen_ || engine_busy;
    if (!running_) watch_ = 0;
    return recovered_;
  }
  void stop() {
    running_ = failed_ = tile_failed_ = recovered_ = false;
    watch_ = 0;
  }

  bool running() const { return running_; }
  uint16_t run_tile() const { return run_tile_; }
  bool failed() const { return failed_; }
  uint16_t failed_tile() const { return failed_tile_; }
  bool tile_failed() const { return tile_failed_; }  // in the first clock of failed
  bool recovered() const { return recovered_; }

 private:
  std::array<uint32_t, net::kJobWords> job_{};
  bool running_ = false, risen_ = false, failed_ = false, tile_failed_ = false, recovered_ = false;
  int watch_ = 0;
  uint16_t run_tile_ = 0, failed_tile_ = 0;
};

}  // namespace psweep::golden
