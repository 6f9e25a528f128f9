// SPDX-License-Identifier: Apache-2.0
// ram_deep of one to four parts, with and without columns of nine bits: every word of the memory written and read, then
// random traffic, most of it at the borders of the parts. Words read in the clock in which they are written are
// undefined and not compared.
#include <random>
#include <vector>

#include "Vram_deep_11_13000_9.h"
#include "Vram_deep_16_49280_0.h"
#include "Vram_deep_1_124688_0.h"
#include "Vram_deep_2_2_0.h"
#include "Vram_deep_31_33280_27.h"
#include "Vram_deep_3_2049_0.h"
#include "Vram_deep_5_30720_0.h"
#include "Vram_deep_7_600_0.h"
#include "support/catch.hpp"
#include "support/coverage.hpp"
#include "support/scoreboard.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

template <class Dut>
class Bench {
 public:
  Bench(int bits, uint32_t depth, uint32_t seed)
      : depth_(depth), mask_((uint64_t{1} << bits) - 1), random_(seed), memory_(depth), known_(depth) {
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
    if (due_) board.compare(dut_->rdata, want_, {-1, static_cast<int>(read_), -1, -1}, now_);
    due_ = known_[raddr] && !(we && waddr == raddr);
    want_ = memory_[raddr];
    read_ = raddr;
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
    clock(false, 0, 0);
  }

  Scoreboard board{"rdata"};

 private:
  template <class T>
  static void set(T& port, uint64_t value) {
    port = static_cast<T>(value);
  }
  uint32_t any() { return static_cast<uint32_t>(random_()) % depth_; }
  // At a multiple of 512, where parts begin, or at the ends, or anywhere.
  uint32_t some() {
    const uint32_t at = random_() % 4 == 0 ? any() : any() / 512 * 512 + any() % 3 - 1;
    return at < depth_ ? at : random_() & 1 ? 0 : depth_ - 1;
  }

  uint32_t depth_;
  uint64_t mask_;
  std::mt19937 random_;
  VerilatedContext context_;
  std::unique_ptr<Dut> dut_;
  std::vector<uint64_t> memory_;
  std::vector<bool> known_;
  bool due_ = false;
  uint64_t want_ = 0, now_ = 0;
  uint32_t read_ = 0;
};

template <class Dut>
void run(int bits, uint32_t depth) {
  const uint32_t seed = test_seed();
  INFO("seed " << seed << " bits " << bits << " depth " << depth);
  Bench<Dut> bench(bits, depth, seed);
  bench.everything();
  INFO(bench.board.report());
  CHECK(bench.board.ok());
  CHECK(bench.board.compared() > 2 * depth);
}

}  // namespace

TEST_CASE("ram_deep: 32768 + 16384 + 512") { run<Vram_deep_16_49280_0>(16, 49280); }
TEST_CASE("ram_deep: 32768 + 512, 27 bits in columns of nine") { run<Vram_deep_31_33280_27>(31, 33280); }
TEST_CASE("ram_deep: 8192 + 4096 + 1024, one column of nine") { run<Vram_deep_11_13000_9>(11, 13000); }
TEST_CASE("ram_deep: four parts") { run<Vram_deep_5_30720_0>(5, 30720); }
TEST_CASE("ram_deep: four parts, the last one as large as the third") { run<Vram_deep_1_124688_0>(1, 124688); }
TEST_CASE("ram_deep: one part, more words than asked for") { run<Vram_deep_3_2049_0>(3, 2049); }
TEST_CASE("ram_deep: small") { run<Vram_deep_7_600_0>(7, 600); }
TEST_CASE("ram_deep: two words") { run<Vram_deep_2_2_0>(2, 2); }
