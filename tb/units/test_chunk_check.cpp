// SPDX-License-Identifier: Apache-2.0
// chunk_check: corners and random pairs of pixels and chunks, for chunks of one pair, of a power of two, and others.
#include <verilated.h>

#include <random>

#include "Vchunk_check_1.h"
#include "Vchunk_check_1440.h"
#include "Vchunk_check_64.h"
#include "Vchunk_check_704.h"
#include "golden/chunk_check.hpp"
#include "simulator/coverage.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

template <class Dut>
struct Bench {
  explicit Bench(uint32_t chunk_pairs) : pairs(chunk_pairs) { dut.clk = 0; }
  ~Bench() {
    simulator::save_coverage(context);
    dut.final();
  }
  void clock() {
    dut.clk = 0;
    dut.eval();
    dut.clk = 1;
    dut.eval();
  }
  void put(uint32_t pixels, uint32_t chunks) {
    dut.pixels = pixels & 0xffffff;
    dut.chunks = static_cast<SData>(chunks);
    dut.clear = 1;
    dut.run = 0;
    clock();
    dut.clear = 0;
    dut.run = 1;
    for (unsigned step = 8; step < 32; ++step) {
      dut.step = static_cast<CData>(step);
      clock();
    }
    dut.run = 0;
    for (int i = 0; i < 2; ++i) {  // and it stays
      dut.eval();
      const bool want = golden::chunks_fit(dut.pixels, dut.chunks, pairs);
      board.compare(dut.fits, want, {-1, -1, static_cast<int>(dut.pixels), static_cast<int>(dut.chunks)}, number);
      fitted += want;
      clock();
    }
    ++number;
  }
  void around(uint32_t pixels) {
    const uint32_t chunks = (pixels + pairs - 1) / pairs;
    for (const uint32_t c : {chunks, chunks + 1, chunks - 1, chunks ^ 0x8000, chunks << 1, uint32_t{0}})
      put(pixels, c & 0xffff);
  }

  VerilatedContext context;
  Dut dut{&context};
  uint32_t pairs;
  uint64_t number = 0, fitted = 0;
  Scoreboard board{"chunks"};
};

template <class Dut>
void run(uint32_t pairs) {
  INFO("seed " << test_seed() << ", chunks of " << pairs);
  std::mt19937 random(test_seed());
  Bench<Dut> bench(pairs);
  for (const uint32_t chunks : {1u, 2u, 3u, 255u, 256u, 32767u, 32768u, 65535u, 65536u, 65537u, 0xffffffu})
    for (const int more : {-1, 0, 1}) {
      const int64_t pixels = int64_t{chunks} * pairs + more;
      if (pixels < 1 << 24) bench.around(static_cast<uint32_t>(pixels));
    }
  bench.around(0xffffff);
  for (int i = 0; i < 3000; ++i) bench.around(static_cast<uint32_t>(random() >> (8 + random() % 20)));
  for (int i = 0; i < 3000; ++i) bench.put(random() & 0xffffff, random() & 0xffff);
  INFO(bench.board.report());
  CHECK(bench.board.ok());
  CHECK(bench.fitted > 1000);
}

}  // namespace

TEST_CASE("chunk_check: chunks of one pair") { run<Vchunk_check_1>(1); }
TEST_CASE("chunk_check: chunks of 64 pairs") { run<Vchunk_check_64>(64); }
TEST_CASE("chunk_check: chunks of 704 pairs") { run<Vchunk_check_704>(704); }
TEST_CASE("chunk_check: chunks of 1440 pairs") { run<Vchunk_check_1440>(1440); }
