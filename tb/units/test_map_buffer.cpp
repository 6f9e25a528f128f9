// SPDX-License-Identifier: Apache-2.0
// map_buffer: maps of random sizes, whole and in rings; chunks read in order, again, too early and too late; stalls on
// both sides; forgotten in every state. Readiness in every clock and all bytes against the model. Upsets of every bit
// of every register.
#include <random>

#include "Vmap_buffer_12_7_64_64.h"
#include "Vmap_buffer_27_4_60_8.h"
#include "Vmap_buffer_31_352_32760_32760.h"
#include "Vmap_buffer_31_352_33280_33280.h"
#include "Vmap_buffer_31_352_33280_7040.h"
#include "Vmap_buffer_31_6_45_50.h"
#include "Vmap_buffer_36_3_50_15.h"
#include "Vmap_buffer_48_2_33_2.h"
#include "Vmap_buffer_9_5_40_40.h"
#include "Vmap_buffer_upset.h"
#include "golden/map_buffer.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"
#include "support/upset.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

struct Shape {
  int cell_bits, chunk_cells, cells, depth;
};

struct Rates {
  double source = 0;     // s_tvalid low
  double sink = 0;       // f_take low
  double stray = 0;      // another chunk than the next one is asked for
  double forget = 0;     // per clock, in any state
  bool largest = false;  // all maps are as large as can be
  double fail = 0;       // per clock: the launched tile, or none, has failed
};

template <class Dut>
class Bench : public Agent {
 public:
  Bench(const Shape& shape, const Rates& rates, uint32_t seed)
      : sim(2000000, seed),
        dut(sim.dut()),
        model(shape.cell_bits, shape.chunk_cells, shape.cells, shape.depth),
        shape_(shape),
        rates_(rates),
        random_(seed) {
    dut.s_tvalid = dut.release_map = dut.clear = dut.fail = dut.f_start = dut.f_take = 0;
    dut.keep = dut.f_chunk = 0;
    new_tile();
    sim.add(*this);
    sim.reset();
  }

  Sim<Dut> sim;
  Dut& dut;
  golden::MapBuffer model;
  Scoreboard status{"status"}, bytes{"bytes"};
  int tiles_done = 0, forgotten = 0, failed = 0, failed_sending = 0, failed_complete = 0, chunks_read = 0, reread = 0,
      not_ready = 0;
  uint64_t chunk_clocks = 0;  // first to last byte of the latest whole chunk

  bool ok() const { return status.ok() && bytes.ok(); }
  std::string report() const { return status.report() + bytes.report(); }

  void drive() override {
    dut.release_map = dut.clear = dut.f_start = 0;
    dut.fail = chance(rates_.fail);
    if (chance(rates_.forget)) {
      (draw(2) ? dut.clear : dut.release_map) = 1;
    } else if (done_ && chance(0.2)) {
      dut.release_map = 1;
    }
    // What a chunk that is being sent is read from stays as it is.
    if (!sending_) wait_sent_ = false;
    if (!offered_ && left_ > 0 && !wait_sent_) offered_ = !chance(rates_.source);
    dut.s_tvalid = offered_ && !dut.fail;  // a failed tile sends no more
    if (!offered_ || !held_) cell_ = (uint64_t{draw(0x10000)} << 32 | random_()) & mask();
    set(dut.s_tdata, cell_);
    dut.s_tlast = offered_ ? left_ == 1 : draw(2) != 0;
    dut.f_take = !chance(rates_.sink);
    drive_reader();
  }

  void sample() override {
    const uint64_t now = sim.cycle();
    const bool fire = dut.s_tvalid && dut.s_tready, forget = dut.release_map || dut.clear;
    const Place place{tile_, -1, dut.f_chunk, 0};
    status.compare(dut.s_tready, model.takes(), place, now);
    status.compare(dut.busy, model.busy(), place, now);
    status.compare(dut.complete, model.complete(), place, now);
    status.compare(dut.recovered, 0, place, now);
    status.compare(dut.count, static_cast<uint64_t>(model.count()), place, now);
    status.compare(dut.started, fire && !model.busy(), place, now);
    // Readiness: late only by the walk, early never.
    const bool ready = model.ready(dut.f_chunk) && !sending_;
    ready_for_ = ready ? ready_for_ + 1 : 0;
    unready_for_ = model.ready(dut.f_chunk) ? 0 : unready_for_ + 1;
    if (steady_for_ >= 3 && unready_for_ > 2) {
      status.compare(dut.f_ready, 0, place, now);
      ++not_ready;
    }
    if (std::min(ready_for_, steady_for_) > dut.f_chunk + model.finished() + 3)
      status.compare(dut.f_ready, 1, place, now);
    if (sending_ && got_ + 1 < expected_.size()) status.compare(dut.f_ready, 0, place, now);
    ++steady_for_;

    if (byte_held_) {
      bytes.compare(dut.f_valid, 1, place, now);
      bytes.compare(dut.f_data, held_byte_, place, now);
    }
    byte_held_ = dut.f_valid && !dut.f_take && !forget;
    held_byte_ = dut.f_data;
    if (dut.f_valid && dut.f_take) {
      if (!sending_) {
        bytes.observe(dut.f_data, now);  // nobody expected it
      } else {
        const Place at{tile_, -1, chunk_, static_cast<int>(got_)};
        if (got_ == 0) first_byte_ = now;
        bytes.compare(dut.f_data, expected_[got_], at, now);
        ++got_;
        bytes.compare(dut.f_last, got_ == expected_.size(), at, now);
        if (got_ == expected_.size()) {
          sending_ = false;
          ready_for_ = 0;
          if (static_cast<int>(got_) == shape_.chunk_cells * model.cell_bytes()) chunk_clocks = now - first_byte_ + 1;
          ++chunks_read;
          if (chunk_ < next_) ++reread;
          next_ = std::max(next_, chunk_ + 1);
        }
      }
    }
    if (dut.f_start) {
      sending_ = true;
      chunk_ = dut.f_chunk;
      expected_ = model.bytes(chunk_);
      got_ = 0;
    }
    model.keep(dut.keep);
    held_ = offered_ && !fire;
    if (fire) {
      model.put(cell_, dut.s_tlast != 0);
      offered_ = false;
      --left_;
    }
    done_ = model.complete() && next_ >= model.finished() && !sending_;
    if (dut.fail && !forget) {
      if (model.complete()) {
        ++failed_complete;
      } else {
        ++failed;
        failed_sending += sending_;
        wait_sent_ = sending_;
        model.fail();
        ready_for_ = 0;
        new_tile();
      }
    }
    if (forget) {
      ++forgotten;
      if (done_) ++tiles_done;
      model.forget();
      sending_ = byte_held_ = false;
      ready_for_ = 0;
      new_tile();
    }
  }

 private:
  bool chance(double p) { return std::bernoulli_distribution(p)(random_); }
  uint32_t draw(int n) { return static_cast<uint32_t>(random_() % static_cast<unsigned>(n)); }
  uint64_t mask() const { return (uint64_t{1} << shape_.cell_bits) - 1; }
  template <class T>
  static void set(T& port, uint64_t value) {
    port = static_cast<T>(value);
  }

  void new_tile() {
    left_ = rates_.largest || chance(0.2) ? shape_.cells : 1 + static_cast<int>(draw(shape_.cells));
    offered_ = held_ = done_ = false;
    next_ = 0;
    keep_ = 0;
    ++tile_;
  }

  void drive_reader() {
    // keep may only rise for a map that has begun, and never beyond what is still wanted or being sent.
    if (model.busy() != was_busy_) keep_ = 0;
    was_busy_ = model.busy();
    if (!model.busy() && chance(0.05)) keep_ = static_cast<int>(draw(6));  // for another map
    // Chunks that nobody wants, some of them not even written.
    if (model.busy() && !model.whole() && !sending_ && !dut.f_start && chance(0.02 / shape_.chunk_cells))
      keep_ = next_ = next_ + 1 + static_cast<int>(draw(3));
    if (model.busy() && keep_ < next_ && !sending_ && !dut.f_start && chance(0.6 / shape_.chunk_cells))
      keep_ = keep_ + 1 + static_cast<int>(draw(next_ - keep_));
    // A falling one is ignored; while bytes come it does not rise.
    const int shown =
        std::min(chance(0.95) ? keep_ : static_cast<int>(draw(keep_ + 1)), sending_ ? int{dut.keep} : keep_);
    if (shown != dut.keep) {
      dut.keep = static_cast<SData>(shown);
      steady_for_ = 0;
    }
    if (sending_) {
      // The question may change once the bytes come.
      if (got_ > 0 && chance(0.1)) ask();
      return;
    }
    dut.eval();
    if (steady_for_ >= 3 && dut.f_ready && model.ready(dut.f_chunk)) {
      if (chance(0.5)) dut.f_start = !dut.release_map && !dut.clear;
      return;
    }
    if (steady_for_ > 3 && chance(0.2)) ask();
  }
  void ask() {
    int chunk = next_;
    if (chance(rates_.stray)) chunk = chance(0.1) ? static_cast<int>(draw(0x10000)) : static_cast<int>(draw(next_ + 3));
    if (chunk == dut.f_chunk) return;
    dut.f_chunk = static_cast<SData>(chunk);
    steady_for_ = 0;
  }

  Shape shape_;
  Rates rates_;
  std::mt19937 random_;
  bool offered_ = false, held_ = false, done_ = false, sending_ = false, byte_held_ = false, was_busy_ = false,
       wait_sent_ = false;
  int left_ = 0, next_ = 0, keep_ = 0, chunk_ = 0, tile_ = -1;
  int steady_for_ = 0, ready_for_ = 0, unready_for_ = 0;
  uint64_t cell_ = 0, held_byte_ = 0, first_byte_ = 0;
  size_t got_ = 0;
  std::vector<uint8_t> expected_;
};

template <class Dut>
void run_tiles(const Shape& shape, const Rates& rates, int tiles) {
  const uint32_t seed = test_seed();
  INFO("seed " << seed << " cell " << shape.cell_bits << " chunk " << shape.chunk_cells << " cells " << shape.cells
               << " depth " << shape.depth << " stalls " << rates.source << ' ' << rates.sink << " stray "
               << rates.stray << " forget " << rates.forget);
  Bench<Dut> bench(shape, rates, seed);
  bench.sim.run_until([&] { return bench.tiles_done >= tiles; });
  INFO(bench.report());
  CHECK(bench.ok());
  CHECK(bench.chunks_read > 0);
  CHECK(bench.not_ready > 0);
  if (rates.stray > 0 && rates.forget < 0.01) CHECK(bench.reread > 0);
  if (rates.forget > 0) CHECK(bench.forgotten > bench.tiles_done);
  if (rates.fail > 0) {
    CHECK(bench.failed > 5);
    CHECK(bench.failed_complete > 5);
    CHECK(bench.failed_sending > 0);
  }
}

template <class Dut>
void run_all(const Shape& shape) {
  run_tiles<Dut>(shape, {0.0, 0.0, 0.0, 0.0}, 40);
  run_tiles<Dut>(shape, {0.0, 0.5, 0.3, 0.0}, 40);
  run_tiles<Dut>(shape, {0.7, 0.0, 0.3, 0.0}, 40);
  run_tiles<Dut>(shape, {0.3, 0.3, 0.5, 0.002}, 40);
  run_tiles<Dut>(shape, {0.1, 0.1, 0.2, 0.03}, 3);
  run_tiles<Dut>(shape, {0.3, 0.3, 0.3, 0.0, false, 0.01}, 60);
}

}  // namespace

TEST_CASE("map_buffer: whole tiles, 31 bits, deeper than needed") { run_all<Vmap_buffer_31_6_45_50>({31, 6, 45, 50}); }
TEST_CASE("map_buffer: whole tiles, 9 bits") { run_all<Vmap_buffer_9_5_40_40>({9, 5, 40, 40}); }
TEST_CASE("map_buffer: whole tiles, 12 bits, all addresses") { run_all<Vmap_buffer_12_7_64_64>({12, 7, 64, 64}); }
TEST_CASE("map_buffer: ring of 2 chunks, 27 bits") { run_all<Vmap_buffer_27_4_60_8>({27, 4, 60, 8}); }
TEST_CASE("map_buffer: ring of 5 chunks, 36 bits") { run_all<Vmap_buffer_36_3_50_15>({36, 3, 50, 15}); }
TEST_CASE("map_buffer: ring of one chunk, 48 bits") { run_all<Vmap_buffer_48_2_33_2>({48, 2, 33, 2}); }

TEST_CASE("map_buffer: one idle clock a cell, and none else") {
  Bench<Vmap_buffer_31_6_45_50> bench({31, 6, 45, 50}, {}, test_seed());
  bench.sim.run_until([&] { return bench.tiles_done >= 5; });
  INFO(bench.report());
  CHECK(bench.ok());
  CHECK(bench.chunk_clocks == 6 * 5 - 1);  // the last cell's idle clock comes after its last byte
}

TEST_CASE("map_buffer: the sizes of 44-30-13-13, whole map") {
  run_tiles<Vmap_buffer_31_352_32760_32760>({31, 352, 32760, 32760}, {0.0, 0.0, 0.05, 0.0, true}, 2);
}
TEST_CASE("map_buffer: the sizes of 256 x 130 tiles, whole map and ring of 20 chunks") {
  run_tiles<Vmap_buffer_31_352_33280_33280>({31, 352, 33280, 33280}, {0.1, 0.1, 0.05, 0.0, true}, 2);
  run_tiles<Vmap_buffer_31_352_33280_7040>({31, 352, 33280, 7040}, {0.0, 0.1, 0.3, 0.0, true}, 3);
}

namespace {

const std::vector<UpsetSite> kSites = {
#include "map_buffer_upset.inc"
};

// Writes a whole map, then reads its chunks as the chip's responder does.
struct MapHost {
  static constexpr int kCells = 20, kChunkCells = 6, kChunks = 4, kCellBytes = 4;
  static constexpr int kClocks = kCells + kChunks * kChunkCells * (kCellBytes + 1);  // about, of a map

  Sim<Vmap_buffer_upset> sim{100000000, test_seed()};
  Vmap_buffer_upset& dut = sim.dut();
  std::mt19937 random{test_seed() + 41};
  uint64_t recovered = 0;
  int site = 0, flip_in = -1;  // the upset, and clocks until then
  bool flipped = false;

  MapHost() {
    dut.s_tvalid = dut.release_map = dut.clear = dut.fail = dut.f_start = dut.f_take = 0;
    dut.keep = dut.f_chunk = 0;
    dut.flip_site = 0;
    dut.flip_mask = 0;
    sim.reset();
  }

  void tick() {
    dut.flip_site = static_cast<SData>(flip_in == 0 ? site : 0);
    flipped = flipped || flip_in == 0;
    dut.eval();
    recovered += dut.recovered;
    sim.tick();
    if (flip_in >= 0) --flip_in;
  }

  // Is the map right? An upset of that register (0: of none) so many clocks after the first cell.
  bool map(int flip_site, int bit, int clocks) {
    std::vector<uint8_t> sent, got;
    site = flip_site;
    dut.flip_mask = uint64_t{1} << bit;
    flip_in = clocks;
    flipped = false;
    for (int i = 0; i < kCells; ++i) {
      const uint32_t cell = static_cast<uint32_t>(random() & 0x7ffffff);
      for (int k = kCellBytes - 1; k >= 0; --k) sent.push_back(static_cast<uint8_t>(cell >> 8 * k));
      dut.s_tvalid = 1;
      dut.s_tdata = cell;
      dut.s_tlast = i == kCells - 1;
      dut.eval();
      for (int wait = 0; !dut.s_tready && wait < 20; ++wait) tick();
      tick();
    }
    dut.s_tvalid = 0;
    for (int chunk = 0; chunk < kChunks; ++chunk) {
      dut.f_chunk = static_cast<SData>(chunk);
      for (int i = 0; i < 4; ++i) tick();
      if (!dut.f_ready) break;
      dut.f_start = 1;
      tick();
      dut.f_start = 0;
      bool last = false;
      for (int i = 0; i < 200 && !last; ++i) {
        dut.f_take = 1;
        dut.eval();
        if (dut.f_valid) {
          got.push_back(dut.f_data);
          last = dut.f_last;
        }
        tick();
      }
      dut.f_take = 0;
    }
    flip_in = -1;
    return got == sent;
  }

  void forget() {
    dut.clear = 1;
    tick();
    dut.clear = 0;
    tick();
  }
};

}  // namespace

TEST_CASE("map_buffer: no upset outlives its map, and what cannot be is told") {
  MapHost host;
  REQUIRE(host.map(0, 0, 0));
  host.forget();
  CHECK(host.recovered == 0);
  int flips = 0, wrong = 0;
  for (size_t site = 0; site < kSites.size(); ++site) {
    for (int bit = 0; bit < kSites[site].bits; ++bit) {
      for (int round = 0; round < 12; ++round) {
        const int clocks = static_cast<int>(host.random() % MapHost::kClocks);
        INFO("register " << kSites[site].name << " bit " << bit << ", " << clocks << " clocks after the first cell");
        const uint64_t before = host.recovered;
        wrong += !host.map(static_cast<int>(site) + 1, bit, clocks);
        const std::string name = kSites[site].name;
        // One bit of these makes a code that is no state, in every clock in which a map is here.
        if (host.flipped && (name == "filling" || name == "complete_q" || name == "read_state"))
          CHECK(host.recovered > before);
        host.forget();
        REQUIRE(host.map(0, 0, 0));
        host.forget();
        ++flips;
      }
    }
  }
  INFO(flips << " upsets, " << wrong << " maps wrong, recovered " << host.recovered);
  CHECK(flips > 500);
  CHECK(wrong > 50);
  CHECK(host.recovered > 50);
}
