// SPDX-License-Identifier: Apache-2.0
// EngineModel: interface between RtlEngine and the Verilated class of one configuration (verilated_engine.hpp).
#pragma once
#include <atomic>
#include <cstdint>
#include <vector>

#include "verilated/rtl_engine.hpp"

namespace psweep::rtl {

class EngineModel {
 public:
  virtual ~EngineModel() = default;
  virtual void set_table(const std::vector<golden::PlaneEntry>& table) = 0;
  virtual TileOutput run(const golden::TileJob& job, const golden::Pixels& left, const golden::Pixels& right) = 0;
  virtual void count_clocks_in(std::atomic<uint64_t>* counter) = 0;
};

}  // namespace psweep::rtl
