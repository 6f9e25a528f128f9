// SPDX-License-Identifier: Apache-2.0
// Sim<Dut>: one Verilated model with one clock `clk` and one synchronous reset `rst`.
//   Timing rule, so that no agent sees another's half-made cycle. Every tick():
//     all drive() -> eval -> all sample() -> rising edge
//   drive() sets inputs from the agent's own state; sample() sees what the coming edge will capture: settled inputs
//   and combinational outputs. Test code between ticks may set inputs directly: they hold until changed.
//   cycle() counts rising edges outside reset(); tick() throws after `timeout` of them.
//   Registers and RAMs without reset start with random contents (seeded).
//   Waves: file name in `wave`; environment PSWEEP_WAVE names one for the first simulation of a program. Only for
//   models built with TRACE.
#pragma once
#include <verilated.h>

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "simulator/coverage.hpp"
#include "simulator/wave.hpp"

namespace psweep::tb {

struct Agent {
  virtual ~Agent() = default;
  virtual void drive() {}
  virtual void sample() {}
};

// What an agent may ask its clock for.
struct CycleCounter {
  virtual ~CycleCounter() = default;
  virtual uint64_t cycle() const = 0;
};

// The name in PSWEEP_WAVE, the first time; then nothing.
inline std::string wave_from_environment() {
  static bool taken = false;
  const char* const name = taken ? nullptr : std::getenv("PSWEEP_WAVE");
  taken = true;
  return name ? name : "";
}

struct Timeout : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Opens the waves that are asked for; without a name those of PSWEEP_WAVE, once in a program.
template <class Dut>
void open_wave(simulator::Wave<Dut>& wave, Dut& dut, std::string file) {
  if constexpr (simulator::Wave<Dut>::kBuiltIn) {
    if (file.empty()) file = wave_from_environment();
    if (!file.empty()) wave.open(dut, file);
  }
}

template <class Dut>
class Sim : public CycleCounter {
 public:
  explicit Sim(uint64_t timeout, uint32_t seed = 1, const std::string& wave = "") : timeout_(timeout) {
    context_.randReset(2);
    context_.randSeed(static_cast<int>(seed | 1));  // 0 would mean: from the clock
    dut_ = std::make_unique<Dut>(&context_);
    open_wave(wave_, *dut_, wave);
    dut_->clk = 0;
    dut_->rst = 1;
  }
  Sim(const Sim&) = delete;
  Sim& operator=(const Sim&) = delete;
  ~Sim() override {
    wave_.close();
    simulator::save_coverage(context_);
    dut_->final();
  }

  Dut& dut() { return *dut_; }
  uint64_t cycle() const override { return cycle_; }
  void add(Agent& agent) { agents_.push_back(&agent); }

  // Agents sleep during reset.
  void reset(int cycles = 4) {
    dut_->rst = 1;
    for (int i = 0; i < cycles; ++i) edge();
    dut_->rst = 0;
    dut_->eval();
  }
  void tick() {
    for (auto* agent : agents_) agent->drive();
    dut_->eval();
    for (auto* agent : agents_) agent->sample();
    edge();
    if (++cycle_ > timeout_) throw Timeout("simulation: no end after " + std::to_string(timeout_) + " clocks");
  }
  void run(uint64_t cycles) {
    for (uint64_t i = 0; i < cycles; ++i) tick();
  }
  // Ticks until done() holds; done() is asked before each tick.
  template <class Done>
  void run_until(Done&& done) {
    while (!done()) tick();
  }

 private:
  void edge() {
    dut_->clk = 0;
    dut_->eval();
    dump();
    dut_->clk = 1;
    dut_->eval();
    dump();
  }
  void dump() {
    wave_.dump(context_.time());
    context_.timeInc(1);
  }

  VerilatedContext context_;
  std::unique_ptr<Dut> dut_;
  simulator::Wave<Dut> wave_;
  std::vector<Agent*> agents_;
  uint64_t timeout_, cycle_ = 0;
};

}  // namespace psweep::tb
