// SPDX-License-Identifier: Apache-2.0
// row_buffer: chunks in any order with duplicates and some outside of the window, whole tiles and rings, stalls on both
// sides, clears in every state, tiles back to back; every answer, status word, bitmap bit and pixel against the model;
// upsets of every bit of every register.
#include <algorithm>
#include <deque>
#include <random>

#include "Vrow_buffer_12_3_3.h"
#include "Vrow_buffer_1_9_7.h"
#include "Vrow_buffer_4_2_2.h"
#include "Vrow_buffer_5_17_16.h"
#include "Vrow_buffer_8_5_64.h"
#include "Vrow_buffer_8_6_70.h"
#include "Vrow_buffer_8_704_70.h"
#include "Vrow_buffer_upset.h"
#include "golden/row_buffer.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"
#include "support/upset.hpp"

using namespace psweep;
using namespace psweep::tb;
using Answer = golden::RowBuffer::Answer;

namespace {

struct Shape {
  int pix_bits, chunk_pairs, slots;
  int bits() const {
    int n = 2;
    while (n < slots) n *= 2;
    return n;
  }
};

struct Rates {
  double write_gap = 0;     // idle clock between bytes, and before a check
  double stall = 0;         // m_tready low
  double stray = 0.2;       // a chunk that is not what the tile needs
  double clear = 0;         // per clock
  bool sequential = false;  // chunks in order
  double hold = 0;          // b_hold rises, for up to 60 clocks
  bool largest = false;     // all tiles are as large as can be
  double fail = 0;          // per clock: the launched tile, or none, has failed
};

// Drives everything and compares in every clock. One tile after the other, of random sizes.
template <class Dut>
class Bench : public Agent {
 public:
  Bench(const Shape& shape, const Rates& rates, int max_chunks, uint32_t seed)
      : sim(4000000, seed),
        dut(sim.dut()),
        model(shape.pix_bits, shape.chunk_pairs, shape.slots),
        shape_(shape),
        rates_(rates),
        max_chunks_(max_chunks),
        random_(seed) {
    dut.clear = dut.open_tile = dut.w_check = dut.w_valid = dut.w_commit = dut.go = dut.m_tready = dut.b_hold = 0;
    dut.fail = 0;
    sim.add(*this);
    sim.reset();
    quiet_from_ = 0;
  }

  Sim<Dut> sim;
  Dut& dut;
  golden::RowBuffer model;
  Scoreboard pixels{"pixels"}, answers{"answers"}, bits{"bitmap"}, status{"status"};
  int tiles_done = 0, clears = 0, fails = 0, fails_staged = 0, new_chunks = 0, repeated = 0, refused = 0, holds = 0;
  uint64_t go_clock = 0, first_clock = 0, last_clock = 0;  // of the latest tile: go, first and last beat

  bool ok() const { return pixels.ok() && answers.ok() && bits.ok() && status.ok(); }
  std::string report() const { return pixels.report() + answers.report() + bits.report() + status.report(); }

  void drive() override {
    dut.clear = dut.open_tile = dut.w_check = dut.w_valid = dut.w_commit = dut.go = 0;
    dut.w_data = static_cast<CData>(random_());
    dut.w_chunk = static_cast<SData>(random_());
    dut.open_pixels = draw(1 << 24);
    dut.open_chunks = static_cast<SData>(random_());
    dut.m_tready = !chance(rates_.stall);
    if (hold_left_ > 0) --hold_left_;
    if (hold_left_ == 0 && chance(rates_.hold)) hold_left_ = 1 + draw(60);
    dut.b_hold = hold_left_ > 0;
    dut.b_index = static_cast<SData>(chance(0.9) ? draw(shape_.slots) : random_() & 0x3ff);
    dut.fail = chance(rates_.fail);
    if (dut.fail && gone_) {
      check_at_once();
      late_ = writing_;
      writing_ = false;
      wait_ = 0;
      return;
    }
    if (chance(rates_.clear)) {
      dut.clear = 1;
      check_at_once();
      late_ = writing_;
      writing_ = false;
      wait_ = 0;
      return;
    }
    if (late_ && !model.open() && chance(0.05)) {  // the commit of a chunk that clear has taken back: nothing happens
      dut.w_commit = 1;
      late_ = false;
      return;
    }
    dut.eval();
    if (!dut.busy && !model.open() && !chance(0.3)) {
      const int chunks = rates_.largest ? max_chunks_ : 1 + static_cast<int>(draw(max_chunks_));
      const uint32_t spare = rates_.largest ? 0 : draw(shape_.chunk_pairs);
      dut.open_tile = 1;
      late_ = false;
      dut.open_chunks = static_cast<SData>(chunks);
      dut.open_pixels = static_cast<uint32_t>(chunks * shape_.chunk_pairs) - spare;
      wait_ = 2;
      writing_ = false;
      return;
    }
    if (model.complete() && !gone_ && dut.complete && chance(0.2)) dut.go = 1;
    drive_writer();
  }

  void sample() override {
    const uint64_t now = sim.cycle();
    // Status. A clock of b_hold lets the base stand in the next one.
    if (was_held_) {
      status.compare(dut.base, base_before_, {tile_count_}, now);
      ++holds;
    }
    const bool cleared = dut.clear || (dut.fail && gone_);
    was_held_ = dut.b_hold && !cleared && !dut.open_tile;
    base_before_ = dut.base;
    if (!clearing_) {
      const int low = model.chunks_of(taken_), high = model.chunks_of(std::min(taken_ + 1, model.pixels()));
      if (tile_) {
        while (model.base() < dut.base && model.base() < high) model.consume();
        if (dut.base < low) status.compare(dut.base, static_cast<uint64_t>(low), {tile_count_}, now);
      }
      status.compare(dut.base, static_cast<uint64_t>(model.base()), {tile_count_}, now);
      status.compare(dut.received, static_cast<uint64_t>(model.received()), {tile_count_}, now);
    }
    if (tile_) status.compare(dut.busy, 1, {tile_count_}, now);
    status.compare(dut.staged, tile_ && !gone_, {tile_count_}, now);
    status.compare(dut.recovered, 0, {tile_count_}, now);
    if (!tile_ && now > quiet_from_ + static_cast<uint64_t>(shape_.bits()) + 3)
      status.compare(dut.busy, 0, {tile_count_}, now);
    if (!gone_) {
      if (!model.complete()) status.compare(dut.complete, 0, {tile_count_}, now);
      if (model.complete() && complete_before_) status.compare(dut.complete, 1, {tile_count_}, now);
    }
    complete_before_ = model.complete();

    sample_bits(now);
    sample_answer(now);
    sample_output(now);

    if (dut.w_commit && model.open()) model.store(chunk_, data_);
    if (dut.go) {
      gone_ = true;
      go_clock = now;
    }
    if (dut.open_tile) {
      model.open_tile(dut.open_pixels, dut.open_chunks);
      tile_ = true;
      ++tile_count_;
      gone_ = false;
      clearing_ = false;
      taken_ = 0;
      answer_due_ = ~uint64_t{0};
    }
    if (dut.fail && tile_ && !gone_) ++fails_staged;
    if (cleared) {
      ++(dut.clear ? clears : fails);
      dut.clear ? model.clear() : model.fail(true);
      tile_ = gone_ = held_ = false;
      clearing_ = true;
      quiet_from_ = now;
      answer_due_ = ~uint64_t{0};
    } else if (clearing_ && !dut.busy) {
      clearing_ = false;
    }
  }

 private:
  bool chance(double p) { return std::bernoulli_distribution(p)(random_); }

  uint32_t draw(int n) { return static_cast<uint32_t>(random_() % static_cast<unsigned>(n)); }

  // A check in the clock in which the tile is forgotten.
  void check_at_once() {
    if (writing_ || wait_ > 0 || !chance(0.5)) return;
    chunk_ = model.base() + static_cast<int>(draw(shape_.slots));
    dut.w_check = 1;
    dut.w_chunk = static_cast<SData>(chunk_);
  }

  void drive_writer() {
    if (writing_) {
      if (chance(rates_.write_gap)) return;
      if (sent_ < data_.size()) {
        dut.w_valid = 1;
        dut.w_data = data_[sent_++];
      } else {
        dut.w_commit = 1;
        writing_ = false;
      }
      return;
    }
    if (wait_ > 0) {
      --wait_;
      if (wait_ == 0 && answer_ == Answer::kNew && answer_due_ != ~uint64_t{0}) {
        writing_ = true;
        sent_ = 0;
        data_.resize(model.chunk_bytes());
        for (auto& b : data_) b = static_cast<uint8_t>(random_());
        if (!chance(rates_.write_gap)) {  // at the earliest moment
          dut.w_valid = 1;
          dut.w_data = data_[sent_++];
        }
      }
      return;
    }
    if (chance(rates_.write_gap)) return;
    const int span = std::max(1, std::min(shape_.slots, max_chunks_));
    if (chance(rates_.stray)) {
      const int around = model.base() - 2 + static_cast<int>(draw(shape_.slots + 5));
      chunk_ = chance(0.1) ? static_cast<int>(random_() & 0xffff) : std::max(0, around);
    } else {
      int index = rates_.sequential ? 0 : static_cast<int>(draw(span));
      for (int i = 0; i < span && model.check(model.base() + index) != Answer::kNew; ++i) index = (index + 1) % span;
      chunk_ = model.base() + index;
      if (model.check(chunk_) != Answer::kNew) return;
    }
    dut.w_check = 1;
    dut.w_chunk = static_cast<SData>(chunk_);
    wait_ = 2;
  }

  void sample_bits(uint64_t now) {
    // What is asked in this clock; certain only if nothing changes in this clock.
    const bool steady = !dut.w_commit && !dut.clear && !dut.open_tile && !dut.fail;
    history_.push_back({now, model.bit(dut.b_index), steady, model.base()});
    if (history_.size() < 3) return;
    const Asked asked = history_.front();
    history_.pop_front();
    if (asked.steady && asked.clock + 2 == now && history_.front().base == asked.base)
      bits.compare(dut.b_bit, asked.bit, {tile_count_}, now);
  }

  void sample_answer(uint64_t now) {
    // Until the next check: clear, fail and open_tile take the answer back, also one that is still on its way.
    if (taken_back_) answers.compare(dut.w_new, 0, {tile_count_}, now);
    if (dut.w_check) taken_back_ = false;
    if (dut.clear || (dut.fail && gone_) || dut.open_tile) taken_back_ = true;
    if (dut.w_check) {
      answer_ = model.check(chunk_);
      answer_due_ = now + 2;
      (answer_ == Answer::kNew ? new_chunks : answer_ == Answer::kRepeated ? repeated : refused) += 1;
    } else if (now >= answer_due_) {
      const uint64_t want = answer_ == Answer::kNew ? 2 : answer_ == Answer::kRepeated ? 1 : 0;
      answers.compare(static_cast<uint64_t>(dut.w_new << 1 | dut.w_repeated), want, {tile_count_, -1, chunk_, 0}, now);
    }
  }

  void sample_output(uint64_t now) {
    if (held_) {
      pixels.compare(dut.m_tvalid, 1, {tile_count_, -1, static_cast<int>(taken_), 0}, now);
      pixels.compare(dut.m_tdata, held_data_, {tile_count_, -1, static_cast<int>(taken_), 0}, now);
    }
    held_ = dut.m_tvalid && !dut.m_tready;
    held_data_ = dut.m_tdata;
    if (!dut.m_tvalid) return;
    if (!gone_ || taken_ >= model.pixels()) {
      pixels.observe(dut.m_tdata, now);  // nobody expected it
      return;
    }
    if (!dut.m_tready) return;
    const bool last = taken_ + 1 == model.pixels();
    const Place place{tile_count_, -1, static_cast<int>(taken_), 0};
    pixels.compare(model.there(taken_), 1, place, now);
    pixels.compare(dut.m_tdata, model.beat(taken_), place, now);
    pixels.compare(dut.m_tlast, last, place, now);
    if (taken_ == 0) first_clock = now;
    ++taken_;
    if (last) {
      last_clock = now;
      while (model.base() < model.chunks_of(taken_)) model.consume();
      tile_ = gone_ = false;
      quiet_from_ = now;
      ++tiles_done;
    }
  }

  struct Asked {
    uint64_t clock;
    bool bit, steady;
    int base;
  };
  Shape shape_;
  Rates rates_;
  int max_chunks_;
  std::mt19937 random_;
  bool tile_ = false, gone_ = false, clearing_ = true, writing_ = false, held_ = false, complete_before_ = false;
  bool was_held_ = false;
  uint64_t base_before_ = 0;
  uint32_t hold_left_ = 0;
  int tile_count_ = 0, wait_ = 0, chunk_ = 0;
  uint32_t taken_ = 0;
  uint64_t held_data_ = 0, quiet_from_ = 0, answer_due_ = ~uint64_t{0};
  Answer answer_ = Answer::kRefused;
  size_t sent_ = 0;
  bool late_ = false, taken_back_ = false;
  std::vector<uint8_t> data_;
  std::deque<Asked> history_;
};

template <class Dut>
void run_tiles(const Shape& shape, const Rates& rates, int max_chunks, int tiles) {
  const uint32_t seed = test_seed();
  INFO("seed " << seed << " pix " << shape.pix_bits << " pairs " << shape.chunk_pairs << " slots " << shape.slots
               << " gap " << rates.write_gap << " stall " << rates.stall << " clear " << rates.clear);
  Bench<Dut> bench(shape, rates, max_chunks, seed);
  bench.sim.run_until([&] { return bench.tiles_done >= tiles; });
  INFO(bench.report());
  CHECK(bench.ok());
  CHECK(bench.new_chunks > 0);
  if (rates.clear < 0.01) CHECK((bench.repeated > 0 && bench.refused > 0));
  if (rates.clear > 0) CHECK(bench.clears > 0);
  if (rates.hold > 0) CHECK(bench.holds > 0);
  if (rates.fail > 0) CHECK(bench.fails > 0);
  if (rates.fail > 0) CHECK(bench.fails_staged > 0);
}

template <class Dut>
void run_all(const Shape& shape, int tiles) {
  const int chunks = shape.slots < 20 ? 5 * shape.slots : shape.slots + 30;  // rings
  const int few = std::max(1, shape.slots);                                  // whole tiles
  run_tiles<Dut>(shape, {0.0, 0.0, 0.2, 0.0, false}, chunks, tiles);
  run_tiles<Dut>(shape, {0.3, 0.0, 0.3, 0.0, false}, chunks, tiles);
  run_tiles<Dut>(shape, {0.0, 0.6, 0.5, 0.0, false, 0.01}, chunks, tiles);
  run_tiles<Dut>(shape, {0.2, 0.3, 0.2, 0.0, false, 0.1}, few, tiles);
  run_tiles<Dut>(shape, {0.1, 0.2, 0.2, 0.5 / (chunks * shape.chunk_pairs), false}, chunks, tiles);
  run_tiles<Dut>(shape, {0.1, 0.2, 0.2, 0.05, false}, 2, std::max(2, tiles / 10));
  run_tiles<Dut>(shape, {0.1, 0.2, 0.2, 0.0, false, 0.01, false, 0.5 / (chunks * shape.chunk_pairs)}, chunks, tiles);
}

}  // namespace

TEST_CASE("row_buffer: 8-bit pixels, 70 slots") { run_all<Vrow_buffer_8_6_70>({8, 6, 70}, 12); }
TEST_CASE("row_buffer: 8-bit pixels, 64 slots") { run_all<Vrow_buffer_8_5_64>({8, 5, 64}, 12); }
TEST_CASE("row_buffer: 12-bit pixels, 3 slots") { run_all<Vrow_buffer_12_3_3>({12, 3, 3}, 60); }
TEST_CASE("row_buffer: 1-bit pixels, 7 slots") { run_all<Vrow_buffer_1_9_7>({1, 9, 7}, 30); }
TEST_CASE("row_buffer: 5-bit pixels, 16 slots") { run_all<Vrow_buffer_5_17_16>({5, 17, 16}, 12); }
TEST_CASE("row_buffer: the shortest chunks and fewest slots") { run_all<Vrow_buffer_4_2_2>({4, 2, 2}, 100); }

TEST_CASE("row_buffer: a chunk that is committed after the end of its tile leaves nothing behind") {
  // The tile has more chunks than pixels (a START that the chip should have refused): chunk 1 is not needed.
  Sim<Vrow_buffer_4_2_2> sim(1000, test_seed());
  auto& dut = sim.dut();
  dut.clear = dut.open_tile = dut.w_check = dut.w_valid = dut.w_commit = dut.go = dut.b_hold = dut.fail = 0;
  dut.m_tready = 1;
  sim.reset();
  auto pulse = [&](auto& pin) {
    pin = 1;
    sim.tick();
    pin = 0;
  };
  auto wait_idle = [&] {
    dut.eval();
    sim.run_until([&] { return dut.busy == 0; });
  };
  auto open = [&](int pixels) {
    wait_idle();
    dut.open_pixels = static_cast<uint32_t>(pixels);
    dut.open_chunks = 2;
    pulse(dut.open_tile);
  };
  auto check = [&](int chunk) {
    dut.w_chunk = static_cast<SData>(chunk);
    pulse(dut.w_check);
    sim.run(2);
    return dut.w_new == 1;
  };
  auto bytes = [&] {
    dut.w_valid = 1;
    sim.run(2);
    dut.w_valid = 0;
  };
  open(2);
  REQUIRE(check(0));
  bytes();
  pulse(dut.w_commit);
  REQUIRE(check(1));
  bytes();
  pulse(dut.go);
  wait_idle();
  pulse(dut.w_commit);
  open(4);
  CHECK(dut.received == 0);
  CHECK(check(0));
  CHECK(check(1));
}

TEST_CASE("row_buffer: a pixel per clock from the first to the last") {
  // Everything is there before go, nothing is written meanwhile.
  Bench<Vrow_buffer_8_6_70> bench({8, 6, 70}, {0, 0, 0, 0, true}, 70, test_seed());
  for (int tile = 1; tile <= 10; ++tile) {
    bench.sim.run_until([&] { return bench.tiles_done >= tile; });
    CHECK(bench.first_clock - bench.go_clock == 3);
    CHECK(bench.last_clock - bench.first_clock + 1 == bench.model.pixels());
  }
  INFO(bench.report());
  CHECK(bench.ok());
}

TEST_CASE("row_buffer: the sizes of 44-30-13-13 and of 256 x 130 tiles, whole tile and ring") {
  run_tiles<Vrow_buffer_8_704_70>({8, 704, 70}, {0.0, 0.0, 0.2, 0.0, false, 0.001, true}, 70, 2);
  run_tiles<Vrow_buffer_8_704_70>({8, 704, 70}, {0.0, 0.1, 0.2, 0.0, false, 0.001, true}, 150, 1);
}

namespace {

const std::vector<UpsetSite> kSites = {
#include "row_buffer_upset.inc"
};

// Whole tiles, written before they go, as the chip's responder and a host with a time limit would do it.
struct TileHost {
  static constexpr int kPairs = 12, kSlots = 5, kChunks = 4, kPixels = kPairs * kChunks - 3;
  enum class End { kRight, kWrong, kLost };

  Sim<Vrow_buffer_upset> sim{100000000, test_seed()};
  Vrow_buffer_upset& dut = sim.dut();
  std::mt19937 random{test_seed() + 37};
  std::vector<uint16_t> sent, got;
  uint64_t recovered = 0;
  int site = 0, flip_in = -1;  // the upset, and clocks until then

  TileHost() {
    dut.clear = dut.open_tile = dut.w_check = dut.w_valid = dut.w_commit = dut.go = dut.b_hold = dut.fail = 0;
    dut.flip_site = 0;
    dut.flip_mask = 0;
    dut.m_tready = 1;
    sim.reset();
    while (dut.busy) tick();
  }

  void tick() {
    dut.flip_site = static_cast<SData>(flip_in == 0 ? site : 0);
    dut.eval();
    if (dut.m_tvalid && dut.m_tready) got.push_back(dut.m_tdata);
    recovered += dut.recovered;
    sim.tick();
    if (flip_in >= 0) --flip_in;
  }

  // An upset of that register (0: of none) so many clocks after go; what the host sees of the tile.
  End tile(int flip_site, int bit, int clocks) {
    sent.clear();
    got.clear();
    dut.open_pixels = kPixels;
    dut.open_chunks = kChunks;
    dut.open_tile = 1;
    tick();
    dut.open_tile = 0;
    for (int chunk = 0; chunk < kChunks; ++chunk) {
      dut.w_check = 1;
      dut.w_chunk = static_cast<SData>(chunk);
      tick();
      dut.w_check = 0;
      tick();
      tick();
      for (int i = 0; i < kPairs; ++i) {
        const uint16_t pair = static_cast<uint16_t>(random());
        if (static_cast<int>(sent.size()) < kPixels) sent.push_back(static_cast<uint16_t>(pair >> 8 | pair << 8));
        for (const int shift : {8, 0}) {
          dut.w_valid = 1;
          dut.w_data = static_cast<CData>(pair >> shift);
          tick();
        }
      }
      dut.w_valid = 0;
      dut.w_commit = 1;
      tick();
      dut.w_commit = 0;
    }
    tick();
    dut.go = 1;
    tick();
    dut.go = 0;
    dut.flip_mask = uint64_t{1} << bit;
    site = flip_site;
    flip_in = clocks;
    for (int i = 0; i < 4 * kPixels && (i < kPixels + 20 || dut.busy); ++i) tick();
    flip_in = -1;
    return got == sent ? End::kRight : static_cast<int>(got.size()) >= kPixels ? End::kWrong : End::kLost;
  }

  void clear() {
    dut.clear = 1;
    tick();
    dut.clear = 0;
    dut.eval();
    for (int i = 0; i < 40 && dut.busy; ++i) tick();
  }
};

}  // namespace

TEST_CASE("row_buffer: no upset outlives its tile, and a lost place of the output never makes a whole wrong tile") {
  TileHost host;
  REQUIRE(host.tile(0, 0, 0) == TileHost::End::kRight);
  // The last full chunk ends so many clocks after go.
  const int full = TileHost::kPairs * (TileHost::kChunks - 1) + 1;
  int flips = 0, lost = 0, wrong = 0, place = 0;
  for (size_t site = 0; site < kSites.size(); ++site) {
    for (int bit = 0; bit < kSites[site].bits; ++bit) {
      for (int round = 0; round < 12; ++round) {
        const int clocks = static_cast<int>(host.random() % (TileHost::kPixels + 6));
        INFO("register " << kSites[site].name << " bit " << bit << ", " << clocks << " clocks after go");
        const auto end = host.tile(static_cast<int>(site) + 1, bit, clocks);
        ++flips;
        lost += end == TileHost::End::kLost;
        wrong += end == TileHost::End::kWrong;
        const std::string name = kSites[site].name;
        if ((name == "r_addr" || name == "base_slot") && clocks < full - 2) {
          ++place;
          CHECK(end != TileHost::End::kWrong);
        }
        host.clear();
        REQUIRE(host.dut.busy == 0);
        REQUIRE(host.tile(0, 0, 0) == TileHost::End::kRight);
      }
    }
  }
  INFO(flips << " upsets, " << lost << " tiles lost, " << wrong << " wrong, recovered " << host.recovered);
  CHECK(flips > 1000);
  CHECK(place > 60);
  CHECK(lost > 100);
  CHECK(host.recovered > 50);
  CHECK(wrong > 0);  // pixels on their way have no parity
}
