// SPDX-License-Identifier: Apache-2.0
// EngineDriver<Dut>: the streams of a Verilated psweep, driven without stalls: words of the configuration, pixels of a
// tile. What a clock is, and what is looked at in it, is the caller's: clock() is called once for each with the inputs
// set, and returns whether it took the pixel on s_pix. (Benches with stalls: tb/engine/engine_bench.hpp.)
//
//   driver.write(tile_words(job, &table), clock);
//   driver.send(left, right, clock);
#pragma once
#include <cstddef>
#include <type_traits>
#include <vector>

#include "contract/registers.hpp"
#include "contract/tile.hpp"

namespace psweep::simulator {

// What starts a tile. table: nullptr if the engine has it already.
inline std::vector<golden::RegisterWrite> tile_words(const golden::TileJob& job,
                                                     const std::vector<golden::PlaneEntry>* table) {
  std::vector<golden::RegisterWrite> words;
  auto append = [&words](const std::vector<golden::RegisterWrite>& more) {
    words.insert(words.end(), more.begin(), more.end());
  };
  if (table) append(golden::table_writes(*table));
  append(golden::job_writes(job));
  words.push_back({golden::kRegCommand, golden::kCommandStart});
  return words;
}

template <class Dut>
class EngineDriver {
 public:
  EngineDriver(Dut& dut, const golden::Config& config) : dut_(dut), config_(config) {}

  // Nothing is offered, the map is taken.
  void rest() {
    dut_.s_cfg_tvalid = 0;
    dut_.s_pix_tvalid = 0;
    dut_.s_pix_tlast = 0;
    dut_.m_map_tready = 1;
  }
  template <class Clock>
  void write(const std::vector<golden::RegisterWrite>& words, Clock&& clock) {
    for (const auto& word : words) {
      dut_.s_cfg_tvalid = 1;
      dut_.s_cfg_tdata = word.word();
      clock();  // tready is always 1
      dut_.s_cfg_tvalid = 0;
    }
  }
  // Offers pixel i of both windows; nothing, and false, behind the last one.
  bool offer(const golden::Pixels& left, const golden::Pixels& right, size_t i) {
    const bool more = i < left.data.size();
    dut_.s_pix_tvalid = more;
    dut_.s_pix_tlast = i + 1 == left.data.size();
    if (more) {
      const unsigned beat = golden::pixel_beat(config_, left, right, i);
      dut_.s_pix_tdata = static_cast<std::remove_reference_t<decltype(dut_.s_pix_tdata)>>(beat);
    }
    return more;
  }
  template <class Clock>
  void send(const golden::Pixels& left, const golden::Pixels& right, Clock&& clock) {
    for (size_t i = 0; offer(left, right, i);) i += clock() ? 1 : 0;
  }

 private:
  Dut& dut_;
  golden::Config config_;
};

}  // namespace psweep::simulator
