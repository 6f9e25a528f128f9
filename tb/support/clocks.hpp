// SPDX-License-Identifier: Apache-2.0
// Clocks<Dut>: one Verilated model with any number of clocks, each with its own period, phase and jitter.
//   Use:
//     Clocks<Vasync_fifo> clocks(50e6, seed);                     // time out after 50 us (times are picoseconds)
//     auto& w = clocks.add({"w_clk", &clocks.dut().w_clk, 40000});      // 25 MHz
//     auto& r = clocks.add({"r_clk", &clocks.dut().r_clk, 8000.5, 123, 50});
//     w.add(driver);  r.add(monitor);                             // agents of a clock: Agent of support/sim.hpp
//     clocks.reset({&clocks.dut().w_rst, &clocks.dut().r_rst});   // 4 edges of every clock
//     clocks.run_until([&] { return board.outstanding() == 0; });
//   Times     : picoseconds, fractions allowed. Edge n of a clock is at phase + n * period, +- jitter/2 evenly
//               distributed (jitter below half a period); rounding never adds up. The falling edge is half a period
//               later. Clocks begin low.
//   Timing    : that of Sim<Dut>, for each clock by itself. At each rising edge:
//               all drive() of the clock -> eval -> all sample() of the clock -> rising edge
//               Edges at the same time (within 0.001 ps) happen together: all drive(), one eval, all sample(), all
//               rise. Inputs set by test code hold until changed. An input without clock (asynchronous reset, crs) is
//               best changed between two steps: it takes effect at once.
//   cycle()   : of a clock: its rising edges outside reset(); of `clocks`: those of the first clock
//   Time-out  : run*() throw Timeout after `timeout` picoseconds
//   Start     : registers and RAMs without reset start with random contents (seeded)
//   Waves     : file name in `wave`; environment PSWEEP_WAVE names one for the first simulation of a program. Only for
//               models built with TRACE; one unit of time is a picosecond.
// A ClockDomain is the first argument of the agents of support/stream.hpp.
#pragma once
#include <cmath>
#include <initializer_list>
#include <limits>
#include <random>

#include "support/sim.hpp"

namespace psweep::tb {

struct ClockSpec {
  const char* name;
  CData* pin;
  double period;
  double phase = 0;  // time of the first rising edge
  double jitter = 0;
};

class ClockDomain : public CycleCounter {
 public:
  ClockDomain(const ClockSpec& spec, uint32_t seed) : spec_(spec), random_(seed) {
    if (!(spec.period >= 1) || !(spec.jitter >= 0) || !(spec.jitter < spec.period / 2) || !(spec.phase >= 0))
      throw std::invalid_argument(std::string("clock ") + spec.name + ": period, phase or jitter");
    *spec_.pin = 0;
    plan();
  }
  void add(Agent& agent) { agents_.push_back(&agent); }
  uint64_t cycle() const override { return cycle_; }
  const char* name() const { return spec_.name; }
  double period() const { return spec_.period; }
  // A clock that stands still (cable pulled) stays low and counts nothing; it goes on at one of its edges.
  void set_running(bool on) { running_ = on; }

 private:
  template <class Dut>
  friend class Clocks;

  double next() const { return *spec_.pin ? fall_ : rise_; }
  void plan() {
    const double shift = spec_.jitter * (std::uniform_real_distribution<double>(-0.5, 0.5)(random_));
    rise_ = std::max(0.0, spec_.phase + static_cast<double>(edges_) * spec_.period + shift);
    fall_ = rise_ + spec_.period / 2;
    ++edges_;
  }

  ClockSpec spec_;
  std::mt19937 random_;
  std::vector<Agent*> agents_;
  uint64_t cycle_ = 0, edges_ = 0;
  double rise_ = 0, fall_ = 0;
  bool running_ = true;
};

template <class Dut>
class Clocks {
 public:
  explicit Clocks(double timeout, uint32_t seed = 1, const std::string& wave = "") : timeout_(timeout), seed_(seed) {
    context_.randReset(2);
    context_.randSeed(static_cast<int>(seed | 1));  // 0 would mean: from the clock
    dut_ = std::make_unique<Dut>(&context_);
    open_wave(wave_, *dut_, wave);
  }
  Clocks(const Clocks&) = delete;
  Clocks& operator=(const Clocks&) = delete;
  ~Clocks() {
    wave_.close();
    simulator::save_coverage(context_);
    dut_->final();
  }

  Dut& dut() { return *dut_; }
  double now() const { return now_; }
  uint64_t cycle() const { return domains_.at(0)->cycle(); }

  // All clocks are added before the first step.
  ClockDomain& add(const ClockSpec& spec) {
    domains_.push_back(std::make_unique<ClockDomain>(spec, seed_ * 31 + static_cast<uint32_t>(domains_.size())));
    return *domains_.back();
  }

  // To the next edge (of either direction) and over it.
  void step() {
    double at = std::numeric_limits<double>::infinity();
    for (const auto& domain : domains_) at = std::min(at, domain->next());
    if (at > timeout_) throw Timeout("simulation: no end after " + std::to_string(timeout_) + " ps");
    now_ = at;
    rising_.clear();
    for (const auto& domain : domains_) {
      if (domain->next() > at + kTogether) continue;
      if (*domain->spec_.pin) {
        *domain->spec_.pin = 0;
        domain->plan();
      } else if (domain->running_) {
        rising_.push_back(domain.get());
      } else {
        domain->plan();
      }
    }
    if (!asleep_)
      for (auto* domain : rising_)
        for (auto* agent : domain->agents_) agent->drive();
    dut_->eval();
    if (!asleep_)
      for (auto* domain : rising_)
        for (auto* agent : domain->agents_) agent->sample();
    for (auto* domain : rising_) {
      *domain->spec_.pin = 1;
      if (!asleep_) ++domain->cycle_;
    }
    if (!rising_.empty()) dut_->eval();
    dump();
  }
  // `count` rising edges of this clock, which must be running.
  void run(const ClockDomain& domain, uint64_t count) {
    uint64_t seen = 0;
    while (seen < count) {
      step();
      for (const auto* risen : rising_) seen += risen == &domain;
    }
  }
  void run_for(double picoseconds) {
    const double end = now_ + picoseconds;
    while (now_ < end) step();
  }
  // Steps until done() holds; done() is asked before each step.
  template <class Done>
  void run_until(Done&& done) {
    while (!done()) step();
  }
  // Holds the given inputs at '1' until every running clock has had `edges` edges; agents sleep.
  void reset(std::initializer_list<CData*> pins, uint64_t edges = 4) {
    for (auto* pin : pins) *pin = 1;
    asleep_ = true;
    for (const auto& domain : domains_)
      if (domain->running_) run(*domain, edges);
    asleep_ = false;
    for (auto* pin : pins) *pin = 0;
    dut_->eval();
  }

 private:
  static constexpr double kTogether = 1e-3;

  void dump() {
    const auto at = static_cast<uint64_t>(std::llround(now_));
    // The file wants time to advance: edges of one picosecond become one entry.
    if (at > dumped_ || !any_dumped_) wave_.dump(at);
    any_dumped_ = true;
    dumped_ = at;
    context_.time(at);
  }

  VerilatedContext context_;
  std::unique_ptr<Dut> dut_;
  simulator::Wave<Dut> wave_;
  uint64_t dumped_ = 0;
  bool any_dumped_ = false;
  std::vector<std::unique_ptr<ClockDomain>> domains_;
  std::vector<ClockDomain*> rising_;
  double timeout_, now_ = 0;
  uint32_t seed_;
  bool asleep_ = false;
};

}  // namespace psweep::tb
