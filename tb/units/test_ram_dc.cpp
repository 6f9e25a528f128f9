// SPDX-License-Identifier: Apache-2.0
// ram_dc against its model: random writes and reads at unrelated clocks, every word written and read.
#include <random>
#include <vector>

#include "Vram_dc_13_37.h"
#include "Vram_dc_1_512.h"
#include "Vram_dc_8_2.h"
#include "golden/ram_dc.hpp"
#include "support/catch.hpp"
#include "support/clocks.hpp"
#include "support/scoreboard.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

struct Shape13x37 {
  using Dut = Vram_dc_13_37;
  static constexpr unsigned kBits = 13, kDepth = 37;
};
struct Shape8x2 {
  using Dut = Vram_dc_8_2;
  static constexpr unsigned kBits = 8, kDepth = 2;
};
struct Shape1x512 {
  using Dut = Vram_dc_1_512;
  static constexpr unsigned kBits = 1, kDepth = 512;
};

template <class Port>
void set(Port& port, uint64_t value) {
  port = static_cast<Port>(value);
}

template <class Shape>
struct Writer : Agent {
  Writer(typename Shape::Dut& dut, golden::RamDc& model, uint32_t seed) : dut_(dut), model_(model), random_(seed) {}
  void drive() override {
    dut_.we = random_() % 3 != 0;
    set(dut_.waddr, random_() % Shape::kDepth);
    set(dut_.wdata, random_() & ((1u << Shape::kBits) - 1));
  }
  void sample() override { model_.write_edge(dut_.we, dut_.waddr, dut_.wdata); }

 private:
  typename Shape::Dut& dut_;
  golden::RamDc& model_;
  std::mt19937 random_;
};

// Edges of the two clocks never meet here, so what the model holds at a reader's edge is the word that must come.
template <class Shape>
struct Reader : Agent {
  Reader(typename Shape::Dut& dut, const CycleCounter& clock, golden::RamDc& model, Scoreboard& board, uint32_t seed)
      : seen(Shape::kDepth), dut_(dut), clock_(clock), model_(model), board_(board), random_(seed) {}
  void drive() override { set(dut_.raddr, random_() % Shape::kDepth); }
  void sample() override {
    if (const auto word = model_.rdata())
      board_.compare(dut_.rdata, *word, {-1, -1, static_cast<int>(model_.address()), 0}, clock_.cycle());
    model_.read_edge(dut_.raddr);
    if (model_.rdata()) seen[model_.address()] = true;
  }
  std::vector<bool> seen;

 private:
  typename Shape::Dut& dut_;
  const CycleCounter& clock_;
  golden::RamDc& model_;
  Scoreboard& board_;
  std::mt19937 random_;
};

}  // namespace

TEMPLATE_TEST_CASE("ram_dc: reads give what was written before", "", Shape13x37, Shape8x2, Shape1x512) {
  const double w_period = GENERATE(200.13, 1000.37, 30011.7);
  Clocks<typename TestType::Dut> clocks(1e12, test_seed());
  auto& dut = clocks.dut();
  auto& w = clocks.add({"w_clk", &dut.w_clk, w_period, 17.001});
  auto& r = clocks.add({"r_clk", &dut.r_clk, 1000, 0});
  golden::RamDc model(TestType::kDepth);
  Scoreboard board("ram_dc");
  Writer<TestType> writer(dut, model, test_seed());
  Reader<TestType> reader(dut, r, model, board, test_seed() + 1);
  w.add(writer);
  r.add(reader);
  clocks.run(r, 20 * TestType::kDepth + 2000);
  clocks.run(w, 20 * TestType::kDepth);
  clocks.run(r, 20 * TestType::kDepth);
  INFO("seed " << test_seed() << " period " << w_period << '\n' << board.report());
  CHECK(board.ok());
  CHECK(board.compared() > TestType::kDepth);
  for (size_t i = 0; i < reader.seen.size(); ++i) {
    INFO("word " << i);
    CHECK(reader.seen[i]);
  }
}
