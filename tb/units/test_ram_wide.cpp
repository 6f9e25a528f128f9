// SPDX-License-Identifier: Apache-2.0
// ram_wide, cut into blocks or not, with latency 1 and 2: every word of the memory written and read, then random
// traffic, most of it at the borders of the blocks. Words read in the clock in which they are written are undefined and
// not compared.
#include <deque>
#include <random>
#include <vector>

#include "Vram_wide_18_4128_1.h"
#include "Vram_wide_1_2_2.h"
#include "Vram_wide_20_14352_1.h"
#include "Vram_wide_20_14352_2.h"
#include "Vram_wide_20_14385_1.h"
#include "Vram_wide_20_16384_1.h"
#include "Vram_wide_20_3484_2.h"
#include "Vram_wide_36_2050_1.h"
#include "Vram_wide_38_6144_2.h"
#include "support/catch.hpp"
#include "support/coverage.hpp"
#include "support/scoreboard.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

template <class Dut>
class Bench {
 public:
  Bench(int bits, uint32_t depth, size_t latency, uint32_t seed)
      : depth_(depth),
        latency_(latency),
        mask_((uint64_t{1} << bits) - 1),
        random_(seed),
        memory_(depth),
        known_(depth) {
    context_.randReset(2);
    context_.randSeed(static_cast<int>(seed | 1));
    dut_ = std::make_unique<Dut>(&context_);
  }
  ~Bench() {
    save_coverage(context_);
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
    if (way_.size() == latency_) {
      const Read& due = way_.front();
      if (due.known) board.compare(dut_->rdata, due.word, {-1, static_cast<int>(due.address), -1, -1}, now_);
      way_.pop_front();
    }
    way_.push_back({memory_[raddr], raddr, known_[raddr] && !(we && waddr == raddr)});
    if (we) {
      memory_[waddr] = data;
      known_[waddr] = true;
    }
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
  // At a multiple of 512, where blocks begin, or at the ends, or anywhere.
  uint32_t some() {
    const uint32_t at = random_() % 4 == 0 ? any() : any() / 512 * 512 + any() % 3 - 1;
    return at < depth_ ? at : random_() & 1 ? 0 : depth_ - 1;
  }

  struct Read {
    uint64_t word;
    uint32_t address;
    bool known;
  };

  uint32_t depth_;
  size_t latency_;
  uint64_t mask_;
  std::mt19937 random_;
  VerilatedContext context_;
  std::unique_ptr<Dut> dut_;
  std::vector<uint64_t> memory_;
  std::vector<bool> known_;
  std::deque<Read> way_;
  uint64_t now_ = 0;
};

template <class Dut>
void run(int bits, uint32_t depth, size_t latency) {
  const uint32_t seed = test_seed();
  INFO("seed " << seed << " bits " << bits << " depth " << depth << " latency " << latency);
  Bench<Dut> bench(bits, depth, latency, seed);
  bench.everything();
  INFO(bench.board.report());
  CHECK(bench.board.ok());
  CHECK(bench.board.compared() > 2 * depth);
}

}  // namespace

TEST_CASE("ram_wide: seven blocks, 16 words, 2 bits") { run<Vram_wide_20_14352_1>(20, 14352, 1); }
TEST_CASE("ram_wide: the same with latency 2") { run<Vram_wide_20_14352_2>(20, 14352, 2); }
TEST_CASE("ram_wide: two eighteens, no bit above") { run<Vram_wide_36_2050_1>(36, 2050, 1); }
TEST_CASE("ram_wide: two eighteens, two bits above, no word behind") { run<Vram_wide_38_6144_2>(38, 6144, 2); }
TEST_CASE("ram_wide: 32 words behind") { run<Vram_wide_18_4128_1>(18, 4128, 1); }
TEST_CASE("ram_wide: eight blocks") { run<Vram_wide_20_16384_1>(20, 16384, 1); }
TEST_CASE("ram_wide: too many words behind the blocks") { run<Vram_wide_20_14385_1>(20, 14385, 1); }
TEST_CASE("ram_wide: no block less") { run<Vram_wide_20_3484_2>(20, 3484, 2); }
TEST_CASE("ram_wide: two words of one bit") { run<Vram_wide_1_2_2>(1, 2, 2); }
