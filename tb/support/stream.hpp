// SPDX-License-Identifier: Apache-2.0
// Stream agents (AXI-Stream rules: a transfer is tvalid and tready at the edge; once up, tvalid and payload hold until
// taken; tvalid never waits for tready). They know ports by pointer, so they serve any Verilated model:
//   auto in = stream_ports(&dut.s_pix_tvalid, &dut.s_pix_tready, &dut.s_pix_tdata, &dut.s_pix_tlast);
//   StreamDriver driver(sim, in, seed, stall);  sim.add(driver);  driver.push(data, last);
//   StreamMonitor monitor(sim, out, seed, stall, [](const Beat& b) { .. });  sim.add(monitor);
// With several clocks the first argument is the ClockDomain (support/clocks.hpp), and the class is written out:
//   StreamDriver<Vdut, decltype(in)> driver(w_clock, in, ..);
// Payload up to 64 bits (Verilator's 8- to 64-bit ports); tlast may be missing (nullptr). Stall = probability of an
// idle clock (driver) or of tready low (monitor). While tvalid is low the driver shows random payload.
#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <random>
#include <string>

#include "support/sim.hpp"

namespace psweep::tb {

struct Beat {
  uint64_t data = 0;
  bool last = false;
  uint64_t clock = 0;
};

template <class Valid, class Ready, class Data, class Last>
struct StreamPorts {
  Valid* valid;
  Ready* ready;
  Data* data;
  Last* last;  // may be nullptr
};
template <class Valid, class Ready, class Data, class Last = CData>
StreamPorts<Valid, Ready, Data, Last> stream_ports(Valid* valid, Ready* ready, Data* data, Last* last = nullptr) {
  return {valid, ready, data, last};
}

template <class Dut, class Ports>
class StreamDriver : public Agent {
 public:
  // data_bits: width of tdata, for the garbage shown while idle.
  StreamDriver(const CycleCounter& sim, Ports ports, int data_bits, uint32_t seed, double stall = 0)
      : sim_(sim),
        ports_(ports),
        mask_(data_bits >= 64 ? ~uint64_t{0} : (uint64_t{1} << data_bits) - 1),
        random_(seed),
        idle_(stall) {
    *ports_.valid = 0;
  }
  void push(uint64_t data, bool last = false) { queue_.push_back({data, last, 0}); }
  size_t pending() const { return queue_.size(); }
  bool done() const { return queue_.empty(); }
  uint64_t sent() const { return sent_; }
  uint64_t last_clock() const { return last_clock_; }  // clock of the latest transfer
  void set_stall(double probability) { idle_ = std::bernoulli_distribution(probability); }
  // After a reset: whatever was offered is gone.
  void clear() {
    queue_.clear();
    offering_ = false;
    *ports_.valid = 0;
  }

  void drive() override {
    if (!offering_ && !queue_.empty()) offering_ = !idle_(random_);
    *ports_.valid = offering_;
    const uint64_t data = offering_ ? queue_.front().data : (uint64_t{random_()} << 32 | random_()) & mask_;
    const bool last = offering_ ? queue_.front().last : (random_() & 1) != 0;
    *ports_.data = static_cast<std::remove_reference_t<decltype(*ports_.data)>>(data);
    if (ports_.last) *ports_.last = last;
  }
  void sample() override {
    if (!offering_ || !*ports_.ready) return;
    queue_.pop_front();
    offering_ = false;
    ++sent_;
    last_clock_ = sim_.cycle();
  }

 private:
  const CycleCounter& sim_;
  Ports ports_;
  uint64_t mask_;
  std::mt19937 random_;
  std::bernoulli_distribution idle_;
  std::deque<Beat> queue_;
  bool offering_ = false;
  uint64_t sent_ = 0, last_clock_ = 0;
};

template <class Dut, class Ports, class... Rest>
StreamDriver(Sim<Dut>&, Ports, Rest...) -> StreamDriver<Dut, Ports>;

template <class Dut, class Ports>
class StreamMonitor : public Agent {
 public:
  StreamMonitor(const CycleCounter& sim, Ports ports, uint32_t seed, double stall,
                std::function<void(const Beat&)> sink)
      : sim_(sim), ports_(ports), random_(seed), stall_(stall), sink_(std::move(sink)) {
    *ports_.ready = 0;
  }
  void set_stall(double probability) { stall_ = std::bernoulli_distribution(probability); }
  uint64_t beats() const { return beats_; }
  uint64_t protocol_errors() const { return protocol_errors_; }
  // Off around a reset or an abort, when an offered beat may vanish.
  void set_watching(bool on) {
    watching_ = on;
    held_ = false;
  }

  void drive() override { *ports_.ready = !stall_(random_); }
  void sample() override {
    const bool valid = *ports_.valid != 0, ready = *ports_.ready != 0;
    const Beat beat{static_cast<uint64_t>(*ports_.data), ports_.last && *ports_.last, sim_.cycle()};
    if (held_ && (!valid || beat.data != waiting_.data || beat.last != waiting_.last)) ++protocol_errors_;
    held_ = watching_ && valid && !ready;
    waiting_ = beat;
    if (valid && ready) {
      ++beats_;
      sink_(beat);
    }
  }

 private:
  const CycleCounter& sim_;
  Ports ports_;
  std::mt19937 random_;
  std::bernoulli_distribution stall_;
  std::function<void(const Beat&)> sink_;
  bool held_ = false, watching_ = true;
  Beat waiting_;
  uint64_t beats_ = 0, protocol_errors_ = 0;
};

template <class Dut, class Ports, class... Rest>
StreamMonitor(Sim<Dut>&, Ports, Rest...) -> StreamMonitor<Dut, Ports>;

}  // namespace psweep::tb
