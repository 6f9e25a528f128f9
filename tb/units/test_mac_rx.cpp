// SPDX-License-Identifier: Apache-2.0
// mac_rx: bytes and verdict of every frame as the model says, for every length, error, preamble and gap; a reader that
// pauses costs beats, never the verdict and never without bit 5; what begins while the station itself sends in half
// duplex is not received; upsets of every bit of every register.
#include <random>

#include "Vmac_rx.h"
#include "Vmac_rx_upset.h"
#include "contract/frames.hpp"
#include "golden/mac_rx.hpp"
#include "golden/mac_tx.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"
#include "support/upset.hpp"

using namespace psweep;
using namespace psweep::golden;
using namespace psweep::tb;

namespace {

using Bytes = std::vector<uint8_t>;
using Samples = std::vector<MiiSample>;

// Plays samples, then silence, and puts the beats together.
struct Bench : Agent {
  Sim<Vmac_rx> sim;
  Vmac_rx& dut = sim.dut();
  std::mt19937 random;
  double pause = 0;       // share of the clocks in which m_ready is 0
  bool hold_all = false;  // m_ready stays 0
  Samples samples;
  size_t at = 0;
  std::vector<ReceivedFrame> frames;
  Bytes bytes;
  bool shown = false;  // a beat was not taken: it has to stay
  unsigned shown_data = 0;
  size_t broken = 0;

  explicit Bench(uint32_t seed = 1) : sim(100000000, seed), random(seed) {
    sim.add(*this);
    dut.m_ready = 1;
    dut.full_duplex = 0;
    dut.sending = 0;
    sim.reset();
    sim.run(4);  // the receiver wants to see rx_dv = 0 first
  }
  void drive() override {
    const MiiSample s = at < samples.size() ? samples[at] : MiiSample{};
    dut.mii_rx_dv = s.dv;
    dut.mii_rx_er = s.er;
    dut.mii_rxd = s.nibble;
    dut.m_ready = !hold_all && (pause == 0 || std::uniform_real_distribution<>(0, 1)(random) >= pause);
  }
  void sample() override {
    ++at;
    const unsigned beat = dut.m_data | (dut.m_last ? 256u : 0u);
    if (shown && (!dut.m_valid || beat != shown_data)) ++broken;
    shown = dut.m_valid && !dut.m_ready;
    shown_data = beat;
    if (!dut.m_valid || !dut.m_ready) return;
    if (dut.m_last) {
      frames.push_back({bytes, dut.m_data});
      bytes.clear();
    } else {
      bytes.push_back(dut.m_data);
    }
  }
  std::vector<ReceivedFrame> play(Samples s, int silence = 40) {
    samples = std::move(s);
    at = 0;
    frames.clear();
    sim.run(samples.size() + static_cast<size_t>(silence));
    return frames;
  }
};

void silence(Samples& s, int clocks) { s.resize(s.size() + static_cast<size_t>(clocks)); }
void nibble(Samples& s, unsigned value, bool er = false) { s.push_back({true, er, static_cast<uint8_t>(value)}); }
void preamble(Samples& s, int nibbles = 15) {
  for (int i = 0; i < nibbles; ++i) nibble(s, 0x5);
  nibble(s, 0xd);
}
void content(Samples& s, const Bytes& bytes) {
  for (const uint8_t b : bytes) {
    nibble(s, b & 15u);
    nibble(s, b >> 4);
  }
}
void frame(Samples& s, const Bytes& with_fcs, int gap = 24) {
  preamble(s);
  content(s, with_fcs);
  silence(s, gap);
}
Bytes random_bytes(std::mt19937& random, size_t size) {
  Bytes b(size);
  for (auto& x : b) x = static_cast<uint8_t>(random());
  return b;
}
// `size` bytes, the last four of them the FCS (no padding).
Bytes good_frame(std::mt19937& random, size_t size) {
  if (size < 4) return random_bytes(random, size);
  Bytes b = random_bytes(random, size - 4);
  for (const uint8_t x : frame_check_sequence(b.data(), b.size())) b.push_back(x);
  return b;
}

// Plays and compares with the model, byte by byte.
void check(Bench& bench, const Samples& samples, size_t at_least) {
  const auto want = receive(samples);
  const auto got = bench.play(samples);
  Scoreboard board("mac_rx");
  for (size_t f = 0; f < std::max(want.size(), got.size()); ++f) {
    const int frame = static_cast<int>(f);
    if (f >= want.size() || f >= got.size()) {
      board.compare(f < got.size(), f < want.size(), {frame}, bench.sim.cycle());
      continue;
    }
    board.compare(got[f].verdict, want[f].verdict, {frame}, bench.sim.cycle());
    board.compare(got[f].bytes.size(), want[f].bytes.size(), {frame}, bench.sim.cycle());
    for (size_t i = 0; i < std::min(got[f].bytes.size(), want[f].bytes.size()); ++i)
      board.compare(got[f].bytes[i], want[f].bytes[i], {frame, static_cast<int>(i)}, bench.sim.cycle());
  }
  INFO("tile: number of the frame, plane: byte\n" << board.report());
  CHECK(board.ok());
  CHECK(want.size() >= at_least);
  CHECK(bench.broken == 0);
}

}  // namespace

TEST_CASE("mac: FCS of known messages") {
  const auto fcs = [](const std::string& text) {
    return frame_check_sequence(reinterpret_cast<const uint8_t*>(text.data()), text.size());
  };
  // Check value of CRC-32/ISO-HDLC (catalogue of parametrised CRC algorithms): 0xCBF43926 for "123456789".
  CHECK(fcs("123456789") == Bytes{0x26, 0x39, 0xf4, 0xcb});
  CHECK(fcs("") == Bytes{0, 0, 0, 0});
  CHECK(fcs("a") == Bytes{0x43, 0xbe, 0xb7, 0xe8});
  CHECK(fcs("The quick brown fox jumps over the lazy dog") == Bytes{0x39, 0xa3, 0x4f, 0x41});
  // RFC 3720 and others state CRC-32 of 32 zeros and of 32 ones bytes as 0x190A55AD and 0xFF6CAB0B.
  CHECK(fcs(std::string(32, '\0')) == Bytes{0xad, 0x55, 0x0a, 0x19});
  CHECK(fcs(std::string(32, '\xff')) == Bytes{0x0b, 0xab, 0x6c, 0xff});
  std::mt19937 random(test_seed());
  for (size_t size = 0; size < 200; ++size) {  // against the host's own
    const Bytes b = random_bytes(random, size);
    const uint32_t crc = net::crc32(b.data(), b.size());
    const Bytes want = {static_cast<uint8_t>(crc), static_cast<uint8_t>(crc >> 8), static_cast<uint8_t>(crc >> 16),
                        static_cast<uint8_t>(crc >> 24)};
    CHECK(frame_check_sequence(b.data(), b.size()) == want);
  }
}

TEST_CASE("mac_rx: every length, good and bad, 0 to 1600 bytes") {
  Bench bench(test_seed());
  std::mt19937 random(test_seed());
  Samples good, bad;
  for (size_t size = 0; size <= 1600; ++size) {
    frame(good, good_frame(random, size));
    Bytes b = good_frame(random, size);
    if (size) b[random() % size] ^= static_cast<uint8_t>(1u << random() % 8);
    frame(bad, b);
  }
  check(bench, good, 1601);
  check(bench, bad, 1601);
  const auto frames = receive(good);
  CHECK(frames[63].verdict == kTooShort);
  CHECK(frames[64].verdict == 0);
  CHECK(frames[1518].verdict == 0);
  CHECK(frames[1519].verdict == kTooLong);
}

TEST_CASE("mac_rx: one nibble more or less, with good and bad FCS, at lengths around the limits") {
  Bench bench(test_seed());
  std::mt19937 random(test_seed());
  Samples s;
  for (const size_t size : {0, 1, 4, 5, 62, 63, 64, 65, 100, 1517, 1518, 1519, 1520, 1600}) {
    for (int damage = 0; damage < 2; ++damage) {
      Bytes b = good_frame(random, size);
      if (damage && size) b[size / 2] ^= 0x10;
      frame(s, b, 0);
      nibble(s, random() & 15);
      silence(s, 24);
      if (size == 0) continue;
      frame(s, b, 0);
      s.pop_back();
      silence(s, 24);
    }
  }
  check(bench, s, 50);
}

TEST_CASE("mac_rx: rx_er at each place of a frame, of its preamble and around it, with other errors") {
  Bench bench(test_seed());
  std::mt19937 random(test_seed());
  for (const int kind : {0, 1, 2, 3}) {
    Bytes b = good_frame(random, kind == 3 ? 40 : 64);
    if (kind == 1) b[20] ^= 1;
    Samples one;
    silence(one, 2);
    frame(one, b, 0);
    if (kind == 2) nibble(one, 3);
    silence(one, 2);
    Samples all;
    for (size_t at = 0; at < one.size(); ++at) {
      Samples s = one;
      s[at].er = true;
      all.insert(all.end(), s.begin(), s.end());
    }
    check(bench, all, one.size());
  }
}

TEST_CASE("mac_rx: preambles of any length, none, broken, and false SFDs") {
  Bench bench(test_seed());
  std::mt19937 random(test_seed());
  Samples s;
  for (int n = 0; n <= 40; ++n) {  // n = 0: a D alone is no SFD, unless a 5 and a D come later
    preamble(s, n);
    content(s, good_frame(random, 64));
    silence(s, 24);
  }
  for (int n = 1; n <= 40; ++n) {  // no SFD at all
    for (int i = 0; i < n; ++i) nibble(s, 0x5);
    silence(s, 3);
    for (int i = 0; i < n; ++i) nibble(s, random() % 13 == 5 ? 4 : 0xd);
    silence(s, 3);
  }
  for (int place = 0; place < 15; ++place) {  // one nibble of the preamble wrong
    for (unsigned value = 0; value < 16; ++value) {
      Samples one;
      preamble(one);
      one[static_cast<size_t>(place)].nibble = static_cast<uint8_t>(value);
      s.insert(s.end(), one.begin(), one.end());
      content(s, good_frame(random, 64));
      silence(s, 2);
    }
  }
  // 5 D within the frame begins nothing.
  preamble(s);
  content(s, Bytes(64, 0xd5));
  silence(s, 24);
  check(bench, s, 41 + 15 * 15);
}

TEST_CASE("mac_rx: back to back at any gap, one clock included, and glitches of rx_dv") {
  Bench bench(test_seed());
  std::mt19937 random(test_seed());
  Samples s;
  for (int gap = 1; gap <= 24; ++gap) {
    for (int i = 0; i < 4; ++i) {
      const size_t size = i == 3 ? random() % 8 : 60 + random() % 10;
      preamble(s, i == 2 ? 1 : 15);
      content(s, good_frame(random, size));
      if (random() % 2) nibble(s, random() & 15);
      silence(s, gap);
    }
    nibble(s, 0x5);  // glitches
    silence(s, gap);
    nibble(s, 0xd);
    silence(s, gap);
    nibble(s, 0x5), nibble(s, 0xd);  // a frame of nothing
    silence(s, gap);
    for (int hole = 0; hole < 2; ++hole) {  // a frame with a hole of one clock: two frames, or one and something
      Samples one;
      frame(one, good_frame(random, 80), 0);
      one[hole ? random() % one.size() : 15u + static_cast<size_t>(gap)] = {false, random() % 2 == 0, 0xe};
      s.insert(s.end(), one.begin(), one.end());
      silence(s, gap);
    }
  }
  check(bench, s, 24 * 6);
}

TEST_CASE("mac_rx: random nibbles, dv and er") {
  Bench bench(test_seed());
  std::mt19937 random(test_seed());
  Samples s;
  for (int i = 0; i < 300000; ++i) {
    const auto r = static_cast<uint32_t>(random());
    const bool stay = (r >> 8) % 40 != 0;
    const bool before = !s.empty() && s.back().dv;
    s.push_back(
        {stay ? before : !before, (r >> 16) % 50 == 0, static_cast<uint8_t>(r % 3 ? (r & 32 ? 5 : 13) : r >> 28)});
  }
  silence(s, 2);
  check(bench, s, 1000);
}

TEST_CASE("mac_rx: a reader that pauses loses beats with bit 5, and always gets the verdict") {
  const double pause = GENERATE(0.1, 0.3, 0.5, 0.9);
  Bench bench(test_seed());
  std::mt19937 random(test_seed());
  size_t lost = 0, whole = 0;
  for (int i = 0; i < 200; ++i) {
    Samples s;
    Bytes b = good_frame(random, 1 + random() % 100);
    if (random() % 3 == 0) b[0] ^= 1;
    frame(s, b);
    const auto want = receive(s).at(0);
    bench.pause = pause;
    const auto got = bench.play(s, 400);
    bench.pause = 0;
    REQUIRE(got.size() == 1);
    CHECK((got[0].verdict & ~kBeatLost) == want.verdict);
    if (got[0].verdict & kBeatLost) {
      ++lost;
      CHECK(got[0].bytes.size() < want.bytes.size());
      size_t at = 0;  // what came is part of it, in order
      for (const uint8_t x : got[0].bytes) {
        while (at < want.bytes.size() && want.bytes[at] != x) ++at;
        REQUIRE(at++ < want.bytes.size());
      }
    } else {
      ++whole;
      CHECK(got[0].bytes == want.bytes);
    }
  }
  CHECK(bench.broken == 0);
  CHECK(lost > 0);
  if (pause < 0.2) CHECK(whole > 0);
}

TEST_CASE("mac_rx: a verdict that waits long is kept, what comes meanwhile is dropped, what comes then is right") {
  Bench bench(test_seed());
  std::mt19937 random(test_seed());
  for (const int frames : {1, 2, 3}) {
    for (const int rest : {0, 1, 20, 60}) {  // clocks of the last frame that come after the reader has woken up
      Samples s;
      for (int i = 0; i < frames; ++i) frame(s, good_frame(random, 70), 2);
      bench.hold_all = true;
      bench.samples = s;
      bench.at = 0;
      bench.frames.clear();
      bench.sim.run(s.size() - static_cast<size_t>(rest));
      CHECK(bench.frames.empty());
      bench.hold_all = false;
      bench.sim.run(100);
      if (frames == 1 || rest < 3) {
        REQUIRE(bench.frames.size() == 1);
        CHECK(bench.frames[0].verdict == kBeatLost);
      }
      CHECK(bench.broken == 0);
      Samples next;
      frame(next, good_frame(random, 64));
      check(bench, next, 1);
    }
  }
}

TEST_CASE("mac_rx: a reset within a frame leaves nothing of it") {
  Bench bench(test_seed());
  std::mt19937 random(test_seed());
  for (const int clocks : {3, 15, 16, 17, 18, 40, 100, 143, 144, 145, 146}) {
    Samples s;
    frame(s, good_frame(random, 64));
    bench.samples = s;
    bench.at = 0;
    bench.sim.run(static_cast<uint64_t>(clocks));
    bench.shown = false;
    bench.frames.clear();
    bench.bytes.clear();
    bench.sim.reset();
    bench.sim.run(300);
    INFO("reset after " << clocks);
    CHECK(bench.frames.empty());  // the pins go on where they were
    CHECK(bench.bytes.empty());
    check(bench, s, 1);
  }
}

TEST_CASE("mac_rx: in half duplex what begins while the station sends is not received, the next frame is") {
  Bench bench(test_seed());
  std::mt19937 random(test_seed());
  int masked = 0, received = 0;
  for (const bool full : {false, true}) {
    bench.dut.full_duplex = full;
    for (int late = -30; late <= 60; ++late) {   // clocks from the beginning of `sending` to rx_dv
      for (const int length : {24, 144, 300}) {  // of it: a collision, the shortest frame, a longer one
        Samples s;
        silence(s, 40);
        const Bytes frame_bytes = good_frame(random, 64);
        frame(s, frame_bytes, 0);
        silence(s, 400);
        frame(s, frame_bytes);
        const int begin = 40 - late;
        bench.samples = s;
        bench.at = 0;
        bench.frames.clear();
        for (int clock = 0; clock < static_cast<int>(s.size()) + 40; ++clock) {
          bench.dut.sending = clock >= begin && clock < begin + length;
          bench.sim.tick();
        }
        // rx_dv is in its register a clock after the pin, `sending` two; the SFD comes 15 clocks behind rx_dv.
        const int on = begin + 2, off = begin + length + 2, rise = 41, sfd = 41 + 15;
        const bool mask = !full && on <= sfd && off > rise;
        INFO("late " << late << ", length " << length << ", full duplex " << full);
        REQUIRE(bench.frames.size() == (mask ? 1 : 2));
        for (const auto& f : bench.frames) REQUIRE((f.verdict == 0 && f.bytes == frame_bytes));
        masked += mask;
        received += !mask;
      }
    }
  }
  CHECK(masked > 150);
  CHECK(received > 300);
  CHECK(bench.broken == 0);
}

TEST_CASE("mac_rx: tick shows that there is a clock") {
  Bench bench(test_seed());
  unsigned before = bench.dut.tick;
  for (int i = 0; i < 20; ++i) {
    bench.sim.tick();
    REQUIRE(bench.dut.tick != before);
    before = bench.dut.tick;
  }
}

namespace {

const std::vector<UpsetSite> kSites = {
#include "mac_rx_upset.inc"
};

}  // namespace

TEST_CASE("mac_rx: an upset of any register at any time costs the frame or adds an empty one, the next one is right") {
  Sim<Vmac_rx_upset> sim(2000000000, test_seed());
  Vmac_rx_upset& dut = sim.dut();
  std::mt19937 random(test_seed());
  dut.full_duplex = dut.m_ready = 1;
  dut.sending = 0;
  dut.flip_site = 0;
  dut.flip_mask = 0;
  dut.mii_rx_dv = dut.mii_rx_er = 0;
  sim.reset();
  sim.run(4);
  std::vector<ReceivedFrame> got;
  Bytes bytes;
  const auto play = [&](const Samples& samples, int from, int site, uint64_t mask) {
    for (size_t i = 0; i < samples.size(); ++i) {
      dut.mii_rx_dv = samples[i].dv;
      dut.mii_rxd = samples[i].nibble;
      dut.m_ready = random() % 4 != 0;
      const bool now = static_cast<int>(i) == from;
      dut.flip_site = static_cast<uint16_t>(now ? site : 0);
      dut.flip_mask = now ? mask : 0;
      dut.eval();
      if (dut.m_valid && dut.m_ready) {
        if (dut.m_last) {
          got.push_back({bytes, dut.m_data});
          bytes.clear();
        } else {
          bytes.push_back(dut.m_data);
        }
      }
      sim.tick();
    }
  };
  int upsets = 0, harmed = 0;
  for (size_t site = 0; site < kSites.size(); ++site) {
    for (int bit = 0; bit < kSites[site].bits; ++bit) {
      for (int round = 0; round < 12; ++round) {
        const Bytes first = good_frame(random, 64), second = good_frame(random, 70);
        Samples s;
        silence(s, 12);
        frame(s, first);
        got.clear();
        bytes.clear();
        play(s, round < 2 ? static_cast<int>(random() % 12) : static_cast<int>(random() % s.size()),
             static_cast<int>(site) + 1, uint64_t{1} << bit);
        harmed += got.size() != 1 || got[0].verdict != 0 || got[0].bytes != first;
        got.clear();
        bytes.clear();
        Samples next;
        frame(next, second);
        play(next, -1, 0, 0);
        INFO(kSites[site].name << ", bit " << bit);
        REQUIRE(got.size() == 1);
        REQUIRE((got[0].verdict & ~kBeatLost) == 0);
        if (got[0].verdict == 0) REQUIRE(got[0].bytes == second);
        ++upsets;
      }
    }
  }
  INFO(upsets << " upsets, " << harmed << " harmed their frame");
  CHECK(upsets > 800);
  CHECK(harmed > 100);
}
