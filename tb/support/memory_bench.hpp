// SPDX-License-Identifier: Apache-2.0
// A memory with one write and one read port against its model: every word written and read, then random traffic, most
// of it where blocks and parts begin. Words read in the clock in which they are written are undefined and not compared.
#pragma once
#include <memory>
#include <random>

#include "simulator/coverage.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"

namespace psweep::tb {

template <class Dut, class Model>
class MemoryBench {
 public:
  MemoryBench(int bits, uint32_t depth, size_t latency, uint32_t seed)
      : depth_(depth), latency_(latency), mask_((uint64_t{1} << bits) - 1), random_(seed), model_(depth, latency) {
    context_.randReset(2);
    context_.randSeed(static_cast<int>(seed | 1));
    dut_ = std::make_unique<Dut>(&context_);
  }
  ~MemoryBench() {
    simulator::save_coverage(context_);
    dut_->final();
  }

  void clock(bool we, uint32_t waddr, uint32_t raddr) {
    const uint64_t data = (uint64_t{random_()} << 32 | random_()) & mask_;
    set(dut_->we, we);
    set(dut_->waddr, waddr);
    set(dut_->wdata, data);
    set(dut_->raddr, raddr);
    dut_->clk = 0;
    dut_->eval();
    if (const auto due = model_.due(); due && due->defined)
      board.compare(dut_->rdata, due->word, {-1, static_cast<int>(due->address), -1, -1}, now_);
    model_.clock(we, waddr, data, raddr);
    dut_->clk = 1;
    dut_->eval();
    ++now_;
  }
  void everything() {
    for (uint32_t a = 0; a < depth_; ++a) clock(true, a, any());
    for (uint32_t a = 0; a < depth_; ++a) clock(false, any(), a);
    for (int i = 0; i < 30000; ++i) clock(random_() & 1, some(), some());
    for (uint32_t a = depth_; a-- > 0;) clock(false, any(), a);
    for (size_t i = 0; i < latency_; ++i) clock(false, 0, 0);
  }

  Scoreboard board{"rdata"};

 private:
  template <class T>
  static void set(T& port, uint64_t value) {
    port = static_cast<T>(value);
  }
  uint32_t any() { return static_cast<uint32_t>(random_()) % depth_; }
  // At a multiple of 512, where blocks and parts begin, or at the ends, or anywhere.
  uint32_t some() {
    const uint32_t at = random_() % 4 == 0 ? any() : any() / 512 * 512 + any() % 3 - 1;
    return at < depth_ ? at : random_() & 1 ? 0 : depth_ - 1;
  }

  uint32_t depth_;
  size_t latency_;
  uint64_t mask_;
  std::mt19937 random_;
  VerilatedContext context_;
  std::unique_ptr<Dut> dut_;
  Model model_;
  uint64_t now_ = 0;
};

template <class Dut, class Model>
void try_memory(int bits, uint32_t depth, size_t latency) {
  const uint32_t seed = test_seed();
  INFO("seed " << seed << " bits " << bits << " depth " << depth << " latency " << latency);
  MemoryBench<Dut, Model> bench(bits, depth, latency, seed);
  bench.everything();
  INFO(bench.board.report());
  CHECK(bench.board.ok());
  CHECK(bench.board.compared() > 2 * depth);
}

}  // namespace psweep::tb
