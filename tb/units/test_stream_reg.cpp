// SPDX-License-Identifier: Apache-2.0
// stream_reg: nothing lost, doubled or reordered under any stall; full rate and one clock of latency without stalls;
// empty after reset. Also proves that the bench parts themselves notice what they are there for.
#include <random>

#include "Vstream_reg.h"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/stream.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

constexpr int kDataBits = 12;

struct Bench {
  Sim<Vstream_reg> sim;
  Scoreboard board{"stream_reg"};
  Vstream_reg& dut = sim.dut();
  decltype(stream_ports(&dut.s_tvalid, &dut.s_tready, &dut.s_tdata)) in =
      stream_ports(&dut.s_tvalid, &dut.s_tready, &dut.s_tdata);
  decltype(stream_ports(&dut.m_tvalid, &dut.m_tready, &dut.m_tdata)) out =
      stream_ports(&dut.m_tvalid, &dut.m_tready, &dut.m_tdata);
  StreamDriver<Vstream_reg, decltype(in)> driver;
  StreamMonitor<Vstream_reg, decltype(out)> monitor;

  Bench(uint32_t seed, double in_stall, double out_stall)
      : sim(200000, seed),
        driver(sim, in, kDataBits, seed, in_stall),
        monitor(sim, out, seed + 1, out_stall, [this](const Beat& b) { board.observe(b.data, b.clock); }) {
    sim.add(driver);
    sim.add(monitor);
    sim.reset();
  }
};

}  // namespace

TEST_CASE("stream_reg: order, completeness and protocol under stalls") {
  const double in_stall = GENERATE(0.0, 0.3, 0.8);
  const double out_stall = GENERATE(0.0, 0.3, 0.8);
  const uint32_t seed = test_seed();
  INFO("seed " << seed << " stalls " << in_stall << ' ' << out_stall);
  Bench bench(seed, in_stall, out_stall);
  std::mt19937 random(seed + 2);
  constexpr uint64_t kBeats = 3000;
  for (uint64_t i = 0; i < kBeats; ++i) {
    const uint64_t data = random() & ((1u << kDataBits) - 1);
    bench.driver.push(data);
    bench.board.expect(data);
  }
  bench.sim.run_until([&] { return bench.board.outstanding() == 0; });
  INFO(bench.board.report());
  CHECK(bench.board.ok());
  CHECK(bench.board.compared() == kBeats);
  CHECK(bench.monitor.protocol_errors() == 0);
  if (in_stall == 0 && out_stall == 0) CHECK(bench.sim.cycle() == kBeats + 1);
}

TEST_CASE("stream_reg: empty after reset, whatever was inside") {
  Bench bench(test_seed(), 0, 1.0);  // the receiver takes nothing
  bench.driver.push(1);
  bench.driver.push(2);
  bench.driver.push(3);
  bench.sim.run(10);
  REQUIRE(bench.driver.sent() == 2);  // both places full
  bench.driver.clear();
  bench.monitor.set_watching(false);
  bench.sim.reset();
  bench.monitor.set_watching(true);
  CHECK(bench.dut.m_tvalid == 0);
  CHECK(bench.dut.s_tready == 1);
  bench.monitor.set_stall(0);
  bench.driver.push(4);
  bench.board.expect(4);
  bench.sim.run_until([&] { return bench.board.outstanding() == 0; });
  bench.sim.run(5);
  INFO(bench.board.report());
  CHECK(bench.board.ok());
}

TEST_CASE("bench parts: a scoreboard that compared nothing, or misses a value, is not ok") {
  Scoreboard board("stage");
  CHECK_FALSE(board.ok());
  board.expect(5, {3, 2, 1, 0});
  CHECK_FALSE(board.ok());
  board.observe(5, 7);
  CHECK(board.ok());
  board.observe(6, 8);  // nobody expected it
  CHECK_FALSE(board.ok());
}

TEST_CASE("bench parts: a mismatch names tile, plane, cell, stage, clock and both values, eight times at most") {
  Scoreboard board("stage");
  for (int i = 0; i < 20; ++i) {
    board.expect(0xab, {3, 12, i, 5});
    board.observe(0xac, 1000);
  }
  CHECK(board.errors() == 20);
  const std::string report = board.report();
  CHECK_THAT(report, contains("tile 3 plane 12 cell (0,5) stage stage clock 1000: rtl 0xac model 0xab"));
  size_t lines = 0;
  for (size_t at = report.find("mismatch"); at != std::string::npos; at = report.find("mismatch", at + 1)) ++lines;
  CHECK(lines == Scoreboard::kMaxReports);
}

TEST_CASE("bench parts: a run that never ends throws, a source that breaks the protocol is counted") {
  Bench bench(test_seed(), 0, 1.0);
  CHECK_THROWS_AS(bench.sim.run_until([] { return false; }), Timeout);

  // A stand-in for a bad source: payload changes while it waits.
  CData valid = 1, ready = 0;
  IData data = 1;
  auto ports = stream_ports(&valid, &ready, &data);
  StreamMonitor<Vstream_reg, decltype(ports)> monitor(bench.sim, ports, 1, 1.0, [](const Beat&) {});
  monitor.drive(), monitor.sample();
  monitor.drive(), monitor.sample();
  CHECK(monitor.protocol_errors() == 0);
  data = 2;
  monitor.drive(), monitor.sample();
  CHECK(monitor.protocol_errors() == 1);
  valid = 0;
  monitor.drive(), monitor.sample();
  CHECK(monitor.protocol_errors() == 2);
}
