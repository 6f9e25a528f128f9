// SPDX-License-Identifier: Apache-2.0
// mac_tx: nibbles of every frame as the model says, gap, slots and answers in full duplex; in half duplex collisions at
// every nibble, backoff, late and excessive collisions, deference and its limit; traffic with other stations on a bus;
// slots out of turn, upsets of every bit of every register.
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <random>

#include "Vmac_tx.h"
#include "Vmac_tx_upset.h"
#include "support/catch.hpp"
#include "support/mii_bus.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"
#include "support/upset.hpp"

using namespace psweep;
using namespace psweep::golden;
using namespace psweep::tb;

namespace {

using Bytes = std::vector<uint8_t>;

struct Burst {
  uint64_t begin;
  std::vector<uint8_t> nibbles;
  uint64_t end() const { return begin + nibbles.size(); }
};
struct Answer {
  int slot, result;
  uint64_t clock;
};

// The RAM and the handshake in front of the entity, and a recorder behind it.
struct Bench : Agent {
  Sim<Vmac_tx> sim;
  Vmac_tx& dut = sim.dut();
  std::vector<Bytes> frames;  // offered in this order, slot 0 first
  size_t offered = 0;
  std::vector<Answer> answers;
  std::vector<Burst> bursts;
  std::function<void(Bench&)> pins = [](Bench&) {};  // sets crs and col; may look at sending() and nibble()
  uint64_t flips = 0;
  bool record = true;

  explicit Bench(uint32_t seed, bool full_duplex) : sim(2000000000, seed) {
    sim.add(*this);
    dut.full_duplex = full_duplex;
    dut.mii_crs = dut.mii_col = 0;
    dut.f_request = 0;
    sim.reset();
    sim.run(30);  // the first gap
  }
  bool sending() const { return dut.mii_tx_en; }
  size_t nibble() const { return in_burst_ ? bursts.back().nibbles.size() : 0; }  // of the clock that begins

  void drive() override {
    for (int slot = 0; slot < 2; ++slot) {
      if ((dut.f_request >> slot & 1) != (dut.f_done >> slot & 1) || offered == frames.size() ||
          static_cast<int>(offered % 2) != slot)
        continue;
      const Bytes& f = frames[offered++];
      for (size_t i = 0; i < f.size(); ++i) ram_[static_cast<size_t>(slot) * 2048 + i] = f[i];
      (slot ? dut.f_length_1 : dut.f_length_0) = static_cast<SData>(f.size());
      dut.f_request = static_cast<CData>(dut.f_request ^ 1 << slot);
    }
    dut.r_data = data_;
    pins(*this);
  }
  void sample() override {
    data_ = ram_[dut.r_addr];
    for (int slot = 0; slot < 2; ++slot)
      if ((dut.f_done ^ done_) >> slot & 1)
        answers.push_back({slot, slot ? dut.f_result_1 : dut.f_result_0, sim.cycle()});
    done_ = dut.f_done;
    flips += dut.collisions != flip_;
    flip_ = dut.collisions;
    if (dut.mii_tx_en) {
      if (!in_burst_) {
        if (!record) bursts.clear();
        bursts.push_back({sim.cycle(), {}});
      }
      bursts.back().nibbles.push_back(dut.mii_txd);
    }
    in_burst_ = dut.mii_tx_en;
  }
  void send(std::vector<Bytes> list) {
    frames = std::move(list);
    // Slots go on in turn: an odd number of frames so far means that slot 1 is next.
    if (turn_) frames.insert(frames.begin(), Bytes{});
    offered = turn_ ? 1 : 0;
    answers.clear();
    bursts.clear();
    flips = 0;
    const size_t count = frames.size() - offered;
    sim.run_until([&] { return answers.size() == count; });
    sim.run(60);
    turn_ = (turn_ + count) % 2;
  }
  // As if packet_tx had counted once too often: the next frame is for the other slot.
  void skip_turn() { turn_ = 1 - turn_; }

 private:
  std::vector<uint8_t> ram_ = std::vector<uint8_t>(4096, 0xaa);
  uint8_t data_ = 0;
  unsigned done_ = 0, flip_ = 0;
  bool in_burst_ = false;
  size_t turn_ = 0;
};

Bytes random_frame(std::mt19937& random, size_t size) {
  Bytes b(size);
  for (auto& x : b) x = static_cast<uint8_t>(random());
  return b;
}

void compare(Scoreboard& board, int frame, const Burst& got, const std::vector<uint8_t>& want) {
  board.compare(got.nibbles.size(), want.size(), {frame}, got.begin);
  for (size_t i = 0; i < std::min(got.nibbles.size(), want.size()); ++i)
    board.compare(got.nibbles[i], want[i], {frame, static_cast<int>(i)}, got.begin + i);
}

}  // namespace

TEST_CASE("mac_tx: every length, gap of exactly 24 nibbles, slots in turn, full duplex with noise on crs and col") {
  Bench bench(test_seed(), true);
  std::mt19937 random(test_seed());
  bench.pins = [&](Bench& b) {
    b.dut.mii_crs = random() & 1;
    b.dut.mii_col = random() & 1;
  };
  std::vector<Bytes> frames;
  for (size_t size = 0; size <= 1600; ++size) frames.push_back(random_frame(random, size));
  for (int i = 0; i < 200; ++i) frames.push_back(random_frame(random, random() % 70));
  bench.send(frames);
  Scoreboard board("mac_tx");
  REQUIRE(bench.bursts.size() == frames.size());
  for (size_t f = 0; f < frames.size(); ++f) {
    const int number = static_cast<int>(f);
    compare(board, number, bench.bursts[f], transmit_nibbles(frames[f]));
    board.compare(static_cast<uint64_t>(bench.answers[f].slot), f % 2, {number}, bench.answers[f].clock);
    board.compare(static_cast<uint64_t>(bench.answers[f].result), 0, {number}, bench.answers[f].clock);
    if (f > 0) board.compare(bench.bursts[f].begin - bench.bursts[f - 1].end(), kGapNibbles, {number}, 0);
  }
  INFO("tile: number of the frame, plane: nibble\n" << board.report());
  CHECK(board.ok());
  CHECK(bench.flips == 0);
}

TEST_CASE("mac_tx: a collision at every nibble, late ones are not sent again") {
  const bool carrier = GENERATE(false, true);
  Bench bench(test_seed(), false);
  std::mt19937 random(test_seed());
  Scoreboard board("mac_tx");
  for (const size_t size : {100, 60, 14}) {
    const Bytes frame = random_frame(random, size);
    const auto whole = transmit_nibbles(frame);
    for (size_t at = 0; at < whole.size() + 10; ++at) {
      bool first = true, was = false;
      bench.pins = [&](Bench& b) {
        if (was && !b.sending()) first = false;
        was = b.sending();
        b.dut.mii_crs = carrier && b.sending();
        b.dut.mii_col = b.sending() && first && b.nibble() == at;
      };
      bench.send({frame});
      const int place = static_cast<int>(at);
      // Seen four nibbles later; from the last four of the frame on not at all.
      const bool seen = at + 4 < whole.size();
      const bool late = at >= static_cast<size_t>(kSlotNibbles);
      compare(board, place, bench.bursts.at(0), seen ? jammed_nibbles(frame, at + 4) : whole);
      board.compare(bench.flips, seen, {place}, 0);
      board.compare(static_cast<uint64_t>(bench.answers.at(0).result), seen && late ? 2 : 0, {place}, 0);
      board.compare(bench.bursts.size(), seen && !late ? 2 : 1, {place}, 0);
      if (bench.bursts.size() == 2) compare(board, place, bench.bursts[1], whole);
    }
  }
  INFO("tile: nibble of the collision, plane: nibble\n" << board.report());
  CHECK(board.ok());
}

TEST_CASE("mac_tx: backoff within its range, spread evenly, sixteen collisions give a frame up") {
  Bench bench(test_seed(), false);
  std::mt19937 random(test_seed());
  std::map<int, std::map<uint64_t, int>> seen;  // collision -> slots -> times
  Bytes frame = random_frame(random, 60);
  const auto round = [&](int times, int collide) {
    for (int i = 0; i < times; ++i) {
      frame[7] = static_cast<uint8_t>(random());
      int attempt = 0;
      bool was = false;
      bench.pins = [&](Bench& b) {
        attempt += b.sending() && !was;
        was = b.sending();
        b.dut.mii_col = b.sending() && attempt <= collide && b.nibble() == 30;
      };
      bench.send({frame});
      const bool up = collide >= kAttempts;
      REQUIRE(bench.bursts.size() == static_cast<size_t>(up ? kAttempts : collide + 1));
      CHECK(bench.flips == static_cast<uint64_t>(std::min(collide, kAttempts)));
      CHECK(bench.answers[0].result == (up ? 1 : 0));
      for (size_t n = 1; n < bench.bursts.size(); ++n) {
        const uint64_t pause = bench.bursts[n].begin - bench.bursts[n - 1].end();
        // Two clocks pass between the end of a slot and the first nibble.
        const uint64_t slots = pause == kGapNibbles ? 0 : (pause - 2) / kSlotNibbles;
        if (pause != kGapNibbles) CHECK((pause - 2) % kSlotNibbles == 0);
        CHECK(slots <= static_cast<uint64_t>(backoff_most(static_cast<int>(n))));
        ++seen[static_cast<int>(n)][slots];
      }
    }
  };
  round(800, 4);
  round(12, 15);
  round(12, 16);
  round(12, 20);
  for (int n = 1; n <= 4; ++n) {
    const int values = backoff_most(n) + 1;
    int total = 0;
    double chi = 0;
    for (const auto& [slots, times] : seen[n]) total += times;
    for (int v = 0; v < values; ++v) {
      const double expected = static_cast<double>(total) / values, off = seen[n][static_cast<uint64_t>(v)] - expected;
      chi += off * off / expected;
    }
    INFO("collision " << n << ": chi square " << chi << " with " << values - 1 << " degrees of freedom");
    CHECK(chi < values - 1 + 5 * std::sqrt(2.0 * (values - 1)) + 3);
  }
  for (int n = 10; n <= 15; ++n) {
    uint64_t most = 0, total = 0, times = 0;
    for (const auto& [slots, count] : seen[n]) {
      most = std::max(most, slots);
      total += slots * static_cast<uint64_t>(count);
      times += static_cast<uint64_t>(count);
    }
    INFO("collision " << n << ": largest " << most << ", mean " << total / times << " of " << times);
    CHECK(most > 600);
    CHECK(total / times > 300);
    CHECK(total / times < 720);
    CHECK(seen[n].size() > times * 3 / 4);
  }
}

TEST_CASE("mac_tx: waits for carrier, carrier in the gap's first part starts it again, later it does not") {
  Bench bench(test_seed(), false);
  std::mt19937 random(test_seed());
  for (int pulse = 0; pulse < 40; ++pulse) {
    const uint64_t fall = bench.sim.cycle() + 200;
    bench.pins = [&](Bench& b) {
      const uint64_t now = b.sim.cycle();
      b.dut.mii_crs = now < fall || now == fall + static_cast<uint64_t>(pulse);
      b.dut.mii_col = 0;
    };
    bench.sim.run(10);
    bench.send({random_frame(random, 60)});
    // Four clocks of crossing and pipeline. Beyond the gap's end the pulse falls into the transmission.
    const uint64_t restart = pulse < 15 ? static_cast<uint64_t>(pulse) + 1 : 0;
    INFO("pulse " << pulse);
    CHECK(bench.bursts.at(0).begin == fall + restart + kGapNibbles + 4);
  }
  // No frame waits when the gap ends: later carrier holds the frame back.
  for (const uint64_t busy : {1, 5, 100}) {
    bench.sim.run(100);
    const uint64_t rise = bench.sim.cycle() + 20;
    bench.pins = [&](Bench& b) {
      const uint64_t now = b.sim.cycle();
      b.dut.mii_crs = now >= rise && now < rise + busy;
    };
    bench.sim.run(20 + 3);
    bench.send({random_frame(random, 60)});
    CHECK(bench.bursts.at(0).begin == rise + busy + kGapNibbles + 4);
  }
}

TEST_CASE("mac_tx: duplex, crs and col that change at any time never stop it, and what it says is true") {
  Bench bench(test_seed(), false);
  std::mt19937 random(test_seed());
  const unsigned often = GENERATE(7u, 200u, 3000u);
  bench.pins = [&](Bench& b) {
    if (random() % often == 0) b.dut.full_duplex = !b.dut.full_duplex;
    if (random() % (often / 2) == 0) b.dut.mii_crs = !b.dut.mii_crs;
    b.dut.mii_col = random() % often == 0;
  };
  std::vector<Bytes> frames;
  for (int i = 0; i < (often < 100 ? 10 : 60); ++i) frames.push_back(random_frame(random, 14 + random() % 200));
  bench.send(frames);
  size_t burst = 0, sent = 0;
  for (size_t f = 0; f < frames.size(); ++f) {
    const auto whole = transmit_nibbles(frames[f]);
    // Each answer lies in the last burst of its frame, or just behind it.
    size_t complete = 0;
    while (burst < bench.bursts.size() && bench.bursts[burst].begin <= bench.answers[f].clock + 2)
      complete += bench.bursts[burst++].nibbles == whole;
    CHECK(complete == (bench.answers[f].result == 0 ? 1 : 0));
    sent += complete;
  }
  if (often > 100) CHECK(sent > 0);  // else something always comes between
  for (size_t i = 1; i < bench.bursts.size(); ++i)
    CHECK(bench.bursts[i].begin - bench.bursts[i - 1].end() >= kGapNibbles);
}

TEST_CASE("mac_tx: the preamble reads the source address, which stirs the random numbers") {
  Bench bench(test_seed(), false);
  std::map<unsigned, int> seen;
  bench.pins = [&](Bench& b) {
    if (b.sending() && b.nibble() < 13) ++seen[b.dut.r_addr];
  };
  bench.send({Bytes(60, 0)});
  CHECK(seen.begin()->first >= 8);
  CHECK(seen.rbegin()->first == 15);
  CHECK(seen.size() >= 7);
}

TEST_CASE("mac_tx: a reset within a frame, jam or backoff, the next frame is right") {
  for (const int clocks : {10, 28, 40, 70, 90, 300}) {
    Bench bench(test_seed(), false);
    std::mt19937 random(test_seed());
    bench.pins = [&](Bench& b) { b.dut.mii_col = b.sending() && b.nibble() == 30; };
    bench.frames = {random_frame(random, 60)};
    bench.sim.run(static_cast<uint64_t>(clocks));
    bench.dut.f_request = 0;
    bench.sim.reset();
    bench.sim.run(30);
    CHECK(bench.dut.mii_tx_en == 0);
    bench.pins = [](Bench& b) { b.dut.mii_col = 0; };
    const Bytes frame = random_frame(random, 70);
    bench.send({frame});
    REQUIRE(bench.bursts.size() == 1);
    CHECK(bench.bursts[0].nibbles == transmit_nibbles(frame));
  }
}

TEST_CASE("mac_tx: a frame that is deferred for 2^14 nibbles is given up, each frame has all of them") {
  Bench bench(test_seed(), false);
  std::mt19937 random(test_seed());
  uint64_t fall = UINT64_MAX;  // of crs
  bench.pins = [&](Bench& b) { b.dut.mii_crs = b.sim.cycle() < fall; };
  bench.sim.run(10);
  std::vector<Bytes> frames;
  for (int i = 0; i < 5; ++i) frames.push_back(random_frame(random, 60));
  const uint64_t begin = bench.sim.cycle();
  bench.send(frames);
  CHECK(bench.bursts.empty());
  uint64_t before = begin;
  for (const Answer& a : bench.answers) {
    CHECK(a.result == 3);
    CHECK(a.clock - before <= (1u << 14) + 4);
    CHECK(a.clock - before >= (1u << 14) - 16);
    before = a.clock;
  }
  // A little less, and it is sent.
  fall = bench.sim.cycle() + (1u << 14) - 100;
  bench.send({random_frame(random, 60)});
  CHECK(bench.answers.at(0).result == 0);
  CHECK(bench.bursts.size() == 1);
  // After a collision, a backoff of up to 1023 slots counts for nothing; in full duplex crs means nothing.
  for (const bool full : {false, true}) {
    bench.dut.full_duplex = full;
    int attempt = 0;
    bool was = false;
    bench.pins = [&](Bench& b) {
      attempt += b.sending() && !was;
      was = b.sending();
      b.dut.mii_col = b.sending() && attempt <= 11 && b.nibble() == 30;
      b.dut.mii_crs = full || (attempt == 11 && !b.sending());
    };
    bench.send({random_frame(random, 60)});
    CHECK(bench.answers.at(0).result == (full ? 0 : 3));
    CHECK(bench.bursts.size() == (full ? 1 : 11));
    if (!full) {
      CHECK(bench.answers[0].clock - bench.bursts.back().end() >= (1u << 14) - 16);
      bench.pins = [](Bench& b) { b.dut.mii_crs = b.dut.mii_col = 0; };
      const Bytes next = random_frame(random, 60);
      bench.send({next});
      CHECK(bench.answers.at(0).result == 0);
      CHECK(bench.bursts.at(0).nibbles == transmit_nibbles(next));
    }
  }
}

TEST_CASE("mac_tx: a slot out of turn is served, and from then on turns are right again") {
  Bench bench(test_seed(), true);
  std::mt19937 random(test_seed());
  for (int round = 0; round < 20; ++round) {
    const unsigned before = bench.dut.resynchronised;
    if (round % 2) {  // what comes next is for the slot that is not served next
      bench.skip_turn();
      const Bytes alone = random_frame(random, 60);
      bench.send({alone});
      REQUIRE(bench.bursts.size() == 1);
      CHECK(bench.bursts[0].nibbles == transmit_nibbles(alone));
    }
    std::vector<Bytes> frames;
    for (int i = 0; i < 1 + round % 5; ++i) frames.push_back(random_frame(random, 60 + random() % 20));
    bench.send(frames);
    REQUIRE(bench.bursts.size() == frames.size());
    for (size_t i = 0; i < frames.size(); ++i) CHECK(bench.bursts[i].nibbles == transmit_nibbles(frames[i]));
    CHECK((bench.dut.resynchronised != before) == (round % 2 != 0));
  }
}

TEST_CASE("mac_tx: sending is tx_en a clock before, and tick never rests") {
  Bench bench(test_seed(), false);
  std::mt19937 random(test_seed());
  unsigned ahead = 0, ticks = 0, last_tick = 0;
  int rest = 0, most = 0;
  uint64_t apart = 0, on = 0;
  bench.pins = [&](Bench& b) {
    b.dut.eval();
    apart += b.dut.mii_tx_en != ahead;
    on += ahead;
    ahead = b.dut.sending;
    rest = b.dut.tick == last_tick ? rest + 1 : 0;
    ticks += rest == 0;
    last_tick = b.dut.tick;
    most = std::max(most, rest);
    b.dut.mii_crs = b.sending() || random() % 5000 == 0;
    b.dut.mii_col = b.sending() && b.nibble() == 30 && random() % 3 != 0;
  };
  std::vector<Bytes> frames;
  for (int i = 0; i < 30; ++i) frames.push_back(random_frame(random, 14 + random() % 200));
  bench.send(frames);
  bench.sim.run(1000);
  CHECK(apart <= 1);  // the first look
  CHECK(on > 3000);
  CHECK(ticks > 1000);
  CHECK(most < 40);
}

namespace {

const std::vector<UpsetSite> kSites = {
#include "mac_tx_upset.inc"
};

// The handshake as packet_tx does it, and a medium that collides now and then.
struct UpsetBench : Agent {
  Sim<Vmac_tx_upset> sim{2000000000, test_seed()};
  Vmac_tx_upset& dut = sim.dut();
  std::mt19937 random{test_seed() + 3};
  std::vector<Bytes> queue;
  std::vector<std::vector<uint8_t>> bursts;
  int slot = 0;
  bool collide = false;
  uint64_t recovered = 0, resynchronised = 0;

  UpsetBench() {
    sim.add(*this);
    dut.full_duplex = dut.mii_crs = dut.mii_col = dut.f_request = 0;
    dut.flip_site = 0;
    dut.flip_mask = 0;
    sim.reset();
    sim.run(30);
  }
  bool idle() const { return queue.empty() && dut.f_request == dut.f_done && !dut.mii_tx_en; }
  void drive() override {
    if (!queue.empty() && ((dut.f_request ^ dut.f_done) >> slot & 1) == 0) {
      const Bytes& f = queue.front();
      std::copy(f.begin(), f.end(), ram_.begin() + slot * 2048);
      (slot ? dut.f_length_1 : dut.f_length_0) = static_cast<SData>(f.size());
      const unsigned bit = 1u << slot;
      dut.f_request = static_cast<CData>((dut.f_request & ~bit) | (~dut.f_done & bit));
      queue.erase(queue.begin());
      slot = 1 - slot;
    }
    dut.r_data = data_;
    dut.mii_col = collide && dut.mii_tx_en && random() % 150 == 0;
    dut.mii_crs = dut.mii_tx_en || (collide && random() % 40 == 0);
  }
  void sample() override {
    data_ = ram_[dut.r_addr];
    if (dut.mii_tx_en) {
      if (!on_) bursts.emplace_back();
      bursts.back().push_back(dut.mii_txd);
    }
    on_ = dut.mii_tx_en;
    recovered += dut.recovered != was_recovered_;
    resynchronised += dut.resynchronised != was_resynchronised_;
    was_recovered_ = dut.recovered;
    was_resynchronised_ = dut.resynchronised;
  }

 private:
  std::vector<uint8_t> ram_ = std::vector<uint8_t>(4096, 0x55);
  uint8_t data_ = 0;
  bool on_ = false;
  unsigned was_recovered_ = 0, was_resynchronised_ = 0;
};

}  // namespace

TEST_CASE("mac_tx: after an upset of any register all that is requested is done, and what follows is right") {
  UpsetBench bench;
  uint64_t upsets = 0, harmed = 0;
  for (size_t site = 0; site < kSites.size(); ++site) {
    const std::string name = kSites[site].name;
    for (int bit = 0; bit < kSites[site].bits; ++bit) {
      for (int round = 0; round < (kSites[site].bits == 1 ? 60 : 8); ++round) {
        INFO(name << ", bit " << bit << ", round " << round);
        bench.collide = round % 2 != 0;
        std::vector<Bytes> frames;
        for (int i = 0; i < (round % 4 == 0 ? 0 : 4); ++i) frames.push_back(random_frame(bench.random, 60));
        bench.queue = frames;
        bench.bursts.clear();
        bench.sim.run(bench.random() % (frames.empty() ? 40 : 700));
        bench.dut.flip_site = static_cast<uint16_t>(site + 1);
        bench.dut.flip_mask = uint64_t{1} << bit;
        bench.sim.tick();
        bench.dut.flip_site = 0;
        // The longest state is a backoff of 2^17 nibbles; then everything has to be over soon.
        int clocks = 0, quiet = 0;
        for (; quiet < 60 && clocks < 800000; ++clocks) {
          bench.sim.tick();
          quiet = bench.idle() ? quiet + 1 : 0;
        }
        REQUIRE(quiet == 60);
        if (!bench.collide) {
          size_t whole = 0;
          for (const auto& b : bench.bursts) whole += whole < frames.size() && b == transmit_nibbles(frames[whole]);
          harmed += whole != frames.size() || bench.bursts.size() != frames.size();
        }
        bench.collide = false;
        bench.bursts.clear();
        frames.clear();
        for (int i = 0; i < 3; ++i) frames.push_back(random_frame(bench.random, 60));
        bench.queue = frames;
        for (clocks = 0, quiet = 0; quiet < 60 && clocks < 3000; ++clocks) {
          bench.sim.tick();
          quiet = bench.idle() ? quiet + 1 : 0;
        }
        REQUIRE(quiet == 60);
        REQUIRE(bench.bursts.size() == frames.size());
        for (size_t i = 0; i < frames.size(); ++i) REQUIRE(bench.bursts[i] == transmit_nibbles(frames[i]));
        ++upsets;
      }
    }
  }
  INFO(upsets << " upsets, " << harmed << " harmed a frame, " << bench.recovered << " recovered, "
              << bench.resynchronised << " resynchronised");
  CHECK(upsets > 1500);
  CHECK(harmed > 100);
  CHECK(bench.recovered > 50);
  CHECK(bench.resynchronised > 20);
}

namespace {

// Two mac_tx, a listener and other stations on one bus.
struct Wire {
  MiiBus bus;
  std::vector<std::unique_ptr<Bench>> macs;
  std::vector<std::unique_ptr<MiiStation>> others;

  Wire(size_t macs_count, size_t others_count, size_t distance) : bus(macs_count + others_count, distance) {
    for (size_t i = 0; i < macs_count; ++i) {
      macs.push_back(std::make_unique<Bench>(test_seed(), false));
      macs.back()->pins = [this, i](Bench& b) {
        b.dut.mii_crs = bus.crs(i);
        b.dut.mii_col = bus.col(i);
      };
    }
    for (size_t i = 0; i < others_count; ++i)
      others.push_back(std::make_unique<MiiStation>(bus, macs_count + i, test_seed() + static_cast<uint32_t>(i)));
  }
  void step() {
    for (size_t i = 0; i < macs.size(); ++i) {
      macs[i]->sim.tick();
      bus.drive(i, macs[i]->dut.mii_tx_en, macs[i]->dut.mii_txd);
    }
    for (auto& station : others) station->step();
    bus.step();
  }
  void run_until(const std::function<bool()>& done, uint64_t most) {
    while (!done()) {
      step();
      REQUIRE(bus.time() < most);
    }
  }
};

// Number of the source, then of the frame.
Bytes numbered(std::mt19937& random, size_t source, size_t number, size_t size) {
  Bytes b = random_frame(random, std::max<size_t>(size, 60));
  for (size_t i = 0; i < 12; ++i) b[i] = i < 6 ? 0xff : i < 11 ? 2 : static_cast<uint8_t>(source);
  b[12] = static_cast<uint8_t>(number >> 8);
  b[13] = static_cast<uint8_t>(number);
  return b;
}

}  // namespace

TEST_CASE("mac_tx: two of them with the same seed, and a model station, deliver random traffic completely") {
  const size_t distance = GENERATE(1, 8, 25, 50);
  Wire wire(2, 2, distance);  // the last station only listens
  std::mt19937 random(test_seed());
  constexpr size_t kFrames = 150;
  for (size_t s = 0; s < 3; ++s) {
    for (size_t i = 0; i < kFrames; ++i) {
      const Bytes f = numbered(random, s, i, random() % 2 ? 60 + random() % 100 : 60 + random() % 1455);
      if (s < 2) {
        wire.macs[s]->frames.push_back(f);
      } else {
        wire.others[0]->send(f);
      }
    }
  }
  std::vector<Bytes> model;
  wire.run_until(
      [&] {
        return wire.macs[0]->answers.size() == kFrames && wire.macs[1]->answers.size() == kFrames &&
               wire.others[0]->idle();
      },
      20000000);
  const double clocks = static_cast<double>(wire.bus.time());
  for (int i = 0; i < 200; ++i) wire.step();
  std::vector<size_t> got(3), next(3);
  double bits = 0;
  for (const Bytes& f : wire.others[1]->frames()) {
    const size_t s = f[11];
    REQUIRE(s < 3);
    const size_t number = static_cast<size_t>(f[12]) << 8 | f[13];
    CHECK(number >= next[s]);  // in order, none twice
    next[s] = number + 1;
    if (s < 2) CHECK(f == wire.macs[s]->frames[number]);
    ++got[s];
    bits += 8.0 * static_cast<double>(f.size());
  }
  size_t given_up = 0;
  for (size_t s = 0; s < 2; ++s) {
    size_t sent = 0;
    for (const Answer& a : wire.macs[s]->answers) {
      sent += a.result == 0;
      given_up += a.result == 1;
      CHECK(a.result != 2);  // the bus is short enough
    }
    CHECK(got[s] == sent);
  }
  CHECK(got[2] == wire.others[0]->sent());
  INFO("distance " << distance << ": goodput sum " << bits / clocks / 4 * 100 << " Mbit/s, collisions "
                   << wire.macs[0]->flips << ' ' << wire.macs[1]->flips << ' ' << wire.others[0]->collisions()
                   << ", given up " << given_up + wire.others[0]->given_up());
  CHECK(wire.macs[0]->flips > 0);
  CHECK(wire.macs[1]->flips > 0);
  CHECK(bits / clocks / 4 > 0.5);
  CHECK(given_up < 2 * kFrames / 20);
}

TEST_CASE("mac_tx: two in lock step with the same seed share the medium, neither starves") {
  Wire wire(2, 1, 8);
  std::mt19937 random(test_seed());
  for (size_t s = 0; s < 2; ++s)
    for (size_t i = 0; i < 2000; ++i) wire.macs[s]->frames.push_back(numbered(random, s, i, 600));
  constexpr uint64_t kTime = 1000000;
  while (wire.bus.time() < kTime) wire.step();
  const size_t a = wire.macs[0]->answers.size(), b = wire.macs[1]->answers.size();
  INFO("frames " << a << " and " << b << ", goodput sum "
                 << static_cast<double>(a + b) * 600 * 8 / static_cast<double>(kTime) / 4 * 100 << " Mbit/s");
  CHECK(a > 100);
  CHECK(b > 100);
}

TEST_CASE("mac_tx: a station that obeys nothing") {
  Wire wire(1, 2, 8);
  std::mt19937 random(test_seed());
  MiiStation rude(wire.bus, 1, test_seed(), false);
  std::vector<Bytes> frames;
  for (size_t i = 0; i < 300; ++i) wire.macs[0]->frames.push_back(numbered(random, 0, i, 60 + random() % 300));
  uint64_t at = 0;
  for (int i = 0; i < 2000; ++i) {
    at += 100 + random() % 1500;
    rude.send_at(at, std::vector<uint8_t>(1 + random() % 300, 0x5));
  }
  size_t steps = 0;
  while (wire.macs[0]->answers.size() < 300) {
    wire.macs[0]->sim.tick();
    wire.bus.drive(0, wire.macs[0]->dut.mii_tx_en, wire.macs[0]->dut.mii_txd);
    rude.step();
    wire.others[1]->step();
    wire.bus.step();
    REQUIRE(++steps < 20000000);
  }
  for (int i = 0; i < 200; ++i) {
    wire.macs[0]->sim.tick();
    wire.bus.drive(0, wire.macs[0]->dut.mii_tx_en, wire.macs[0]->dut.mii_txd);
    wire.others[1]->step();
    wire.bus.drive(1, false, 0);
    wire.bus.step();
  }
  size_t sent = 0, late = 0;
  for (const Answer& a : wire.macs[0]->answers) {
    sent += a.result == 0;
    late += a.result == 2;
  }
  INFO("sent " << sent << ", late " << late << ", collisions " << wire.macs[0]->flips);
  CHECK(late > 0);
  CHECK(sent > 0);
  // A collision in the last nibbles spoils a frame that counts as sent.
  CHECK(wire.others[1]->frames().size() <= sent);
  CHECK(wire.others[1]->frames().size() + sent / 20 + 2 >= sent);
}
