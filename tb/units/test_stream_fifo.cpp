// SPDX-License-Identifier: Apache-2.0
// stream_fifo: nothing lost, doubled or reordered under any stall; full rate and two clocks of latency without stalls;
// all places used, 'few' and 'more' right, empty after reset. Also proves that the bench parts themselves notice what
// they are there for.
#include <deque>
#include <random>

#include "Vstream_fifo.h"
#include "golden/stream_fifo.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/stream.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

constexpr int kDataBits = 12;

constexpr size_t kPlaces = 15;

// The model, fed and emptied by what the handshakes say.
struct Mirror : Agent {
  Mirror(Vstream_fifo& d, const CycleCounter& c) : dut(d), clock(c) {}
  void sample() override {
    if (dut.m_tvalid && dut.m_tready) board.compare(dut.m_tdata, model.take(), {}, clock.cycle());
    if (dut.s_tvalid && dut.s_tready) model.put(dut.s_tdata);
  }
  Vstream_fifo& dut;
  const CycleCounter& clock;
  golden::StreamFifo model{kPlaces};
  Scoreboard board{"model"};
};

struct Bench {
  Sim<Vstream_fifo> sim;
  Scoreboard board{"stream_fifo"};
  Vstream_fifo& dut = sim.dut();
  decltype(stream_ports(&dut.s_tvalid, &dut.s_tready, &dut.s_tdata)) in =
      stream_ports(&dut.s_tvalid, &dut.s_tready, &dut.s_tdata);
  decltype(stream_ports(&dut.m_tvalid, &dut.m_tready, &dut.m_tdata)) out =
      stream_ports(&dut.m_tvalid, &dut.m_tready, &dut.m_tdata);
  StreamDriver<Vstream_fifo, decltype(in)> driver;
  StreamMonitor<Vstream_fifo, decltype(out)> monitor;
  Mirror mirror{dut, sim};

  Bench(uint32_t seed, double in_stall, double out_stall)
      : sim(200000, seed),
        driver(sim, in, kDataBits, seed, in_stall),
        monitor(sim, out, seed + 1, out_stall, [this](const Beat& b) { board.observe(b.data, b.clock); }) {
    sim.add(driver);
    sim.add(monitor);
    sim.add(mirror);
    sim.reset();
  }
};

}  // namespace

TEST_CASE("stream_fifo: order, completeness and protocol under stalls") {
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
  INFO(bench.board.report() << bench.mirror.board.report());
  CHECK(bench.board.ok());
  CHECK(bench.board.compared() == kBeats);
  CHECK(bench.mirror.board.ok());
  CHECK(bench.monitor.protocol_errors() == 0);
  if (in_stall == 0 && out_stall == 0) CHECK(bench.sim.cycle() == kBeats + 2);
}

TEST_CASE("stream_fifo: empty after reset, whatever was inside") {
  Bench bench(test_seed(), 0, 1.0);  // the receiver takes nothing
  for (uint64_t i = 0; i < 20; ++i) bench.driver.push(i);
  for (uint64_t taken = 0; taken < 15; ++taken) {
    CHECK(bench.dut.s_tready == 1);
    CHECK(bench.dut.few == (taken <= 8));  // of a clock ago
    CHECK(bench.dut.more == (taken >= 2 || (taken == 1 && !bench.dut.m_tvalid)));
    bench.sim.tick();
  }
  bench.sim.run(10);
  REQUIRE(bench.driver.sent() == kPlaces);  // all places full
  CHECK(bench.mirror.model.size() == kPlaces);
  CHECK(bench.dut.s_tready == 0);
  CHECK(bench.dut.few == 0);
  bench.driver.clear();
  bench.mirror.model.clear();
  bench.monitor.set_watching(false);
  bench.sim.reset();
  bench.monitor.set_watching(true);
  CHECK(bench.dut.m_tvalid == 0);
  CHECK(bench.dut.s_tready == 1);
  CHECK(bench.dut.few == 1);
  CHECK(bench.dut.more == 0);
  bench.monitor.set_stall(0);
  bench.driver.push(4);
  bench.board.expect(4);
  bench.sim.run_until([&] { return bench.board.outstanding() == 0; });
  bench.sim.run(5);
  INFO(bench.board.report());
  CHECK(bench.board.ok());
}

TEST_CASE("stream_fifo: a sender that looks at 'few' alone loses nothing six clocks later") {
  const double out_stall = GENERATE(0.0, 0.3, 0.9);
  const uint32_t seed = test_seed();
  INFO("seed " << seed << " stalls " << out_stall);
  Sim<Vstream_fifo> sim(200000, seed);
  Vstream_fifo& dut = sim.dut();
  Scoreboard board{"stream_fifo"};
  auto out = stream_ports(&dut.m_tvalid, &dut.m_tready, &dut.m_tdata);
  StreamMonitor<Vstream_fifo, decltype(out)> monitor(sim, out, seed, out_stall,
                                                     [&](const Beat& b) { board.observe(b.data, b.clock); });
  // Begun while few = '1', put in six clocks later.
  struct Sender : Agent {
    Vstream_fifo& dut;
    Scoreboard& board;
    std::deque<bool> way = std::deque<bool>(6, false);
    uint64_t sent = 0, refused = 0;
    Sender(Vstream_fifo& d, Scoreboard& b) : dut(d), board(b) { dut.s_tvalid = 0; }
    void drive() override {
      dut.s_tvalid = way.front();
      dut.s_tdata = sent & 0xfff;
    }
    void sample() override {
      way.pop_front();
      way.push_back(dut.few && sent < 3000);
      if (!dut.s_tvalid) return;
      refused += !dut.s_tready;
      board.expect(sent++ & 0xfff);
    }
  } sender(dut, board);
  sim.add(sender);
  sim.add(monitor);
  sim.reset();
  sim.run_until([&] { return sender.sent >= 3000 && board.outstanding() == 0; });
  INFO(board.report());
  CHECK(board.ok());
  CHECK(sender.refused == 0);
  CHECK(monitor.protocol_errors() == 0);
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
  StreamMonitor<Vstream_fifo, decltype(ports)> monitor(bench.sim, ports, 1, 1.0, [](const Beat&) {});
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
