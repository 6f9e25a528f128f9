// SPDX-License-Identifier: Apache-2.0
// The simulated desk by itself: clocks, wire, faults, recording and station around a stand-in for the chip.
#include <cstring>
#include <fstream>
#include <iterator>
#include <set>

#include "chip/echo_chip.hpp"
#include "desk/desk.hpp"
#include "desk/station.hpp"
#include "support/catch.hpp"
#include "support/temporary_dir.hpp"

using namespace psweep;
using namespace psweep::chip;

namespace {

const net::Address kChip{{0x02, 0x50, 0x53, 0x57, 0x50, 0x01}, 0x0a535702, net::kUdpPort};
const net::Address kHost{{0x02, 0x00, 0x00, 0x00, 0x00, 0x01}, 0x0a535701, 40000};

struct Bench {
  explicit Bench(const DeskSettings& settings = {}) : chip(new EchoChip(kChip)), desk(own(), settings) {}
  std::unique_ptr<ChipModel> own() { return std::unique_ptr<ChipModel>(chip); }
  EchoChip* chip;
  Desk desk;
  Station station{desk, kHost, kChip.ip, kChip.port};
};

net::Bytes pattern(size_t size, uint32_t salt) {
  net::Bytes b(size);
  for (size_t i = 0; i < size; ++i) b[i] = static_cast<uint8_t>(i < 4 ? salt >> 8 * i : i * 7 + salt * 31 + i / 256);
  return b;
}

net::Bytes contents(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

TEST_CASE("link: ARP, ping and UDP of every length through the pins, both speeds") {
  const bool fast = GENERATE(true, false);
  DeskSettings settings;
  settings.speed_100 = fast;
  Bench b(settings);
  REQUIRE(b.station.resolve());
  CHECK(*b.station.chip_mac() == kChip.mac);
  for (size_t size = 0; size <= 1468; size += fast ? 1 : 73) {
    INFO("size " << size);
    REQUIRE(b.station.ping(size));
  }
  for (size_t size = 0; size <= net::kMaxUdpPayload; size += 46) {
    const net::Bytes sent = pattern(size, 3);
    b.station.send_udp(sent);
    const auto back = b.station.receive_udp(10 * kMillisecond);
    REQUIRE(back);
    CHECK(*back == sent);
  }
  CHECK(b.station.dropped() == 0);
  CHECK(b.desk.link().violations() == 0);
  CHECK(b.chip->disorder() == 0);
  CHECK(b.chip->bad_frames() == 0);
}

TEST_CASE("link: a round trip takes the wire's time, and clk the given number of edges") {
  const double mhz = GENERATE(30.0, 60.0, 166.0, 300.0);
  DeskSettings settings;
  settings.clk_mhz = mhz;
  Bench b(settings);
  REQUIRE(b.station.resolve());
  const Time begin = b.desk.now();
  const int64_t clocks = b.chip->clocks();
  const auto time = b.station.ping(1400);
  REQUIRE(time);
  // Two frames of 14 + 20 + 8 + 1400 + 4 bytes, each behind 8 bytes of preamble, at 80 ns a byte.
  const double wire = 2 * (8 + 1446) * 80e-9;
  CHECK(static_cast<double>(*time) / kSecond > wire);
  CHECK(static_cast<double>(*time) / kSecond < wire + 5e-6);
  const double expected = static_cast<double>(b.desk.now() - begin) / kSecond * mhz * 1e6;
  CHECK(std::abs(static_cast<double>(b.chip->clocks() - clocks) - expected) < 10);
  CHECK(b.desk.clocks() == b.chip->clocks());
  CHECK(b.chip->disorder() == 0);
}

TEST_CASE("link: full duplex carries both directions at once, back to back") {
  Bench b;
  REQUIRE(b.station.resolve());
  const int count = 100;
  const Time begin = b.desk.now();
  for (int i = 0; i < count; ++i) b.station.send_udp(pattern(1472, static_cast<uint32_t>(i)));
  for (int i = 0; i < count; ++i) {
    const auto back = b.station.receive_udp(5 * kMillisecond);
    REQUIRE(back);
    CHECK(*back == pattern(1472, static_cast<uint32_t>(i)));
  }
  const double seconds = static_cast<double>(b.desk.now() - begin) / kSecond;
  const double one_way = count * (8 + 1518 + 12) * 80e-9;
  CHECK(seconds > one_way);
  CHECK(seconds < one_way * 1.02 + 200e-6);
  CHECK(b.desk.link().violations() == 0);
}

TEST_CASE("link: half duplex, both sides send at will: collisions, and nothing is lost") {
  DeskSettings settings;
  settings.half_duplex = true;
  settings.medium_delay = GENERATE(0, 3, 20, 40);
  settings.seed = test_seed();
  INFO("delay " << settings.medium_delay << ", seed " << settings.seed);
  Bench b(settings);
  REQUIRE(b.station.resolve());
  const int count = 60;
  for (int i = 0; i < count; ++i) b.station.send_udp(pattern(300, static_cast<uint32_t>(i)));
  for (int i = 0; i < count; ++i) {
    const auto back = b.station.receive_udp(100 * kMillisecond);
    REQUIRE(back);
    CHECK(*back == pattern(300, static_cast<uint32_t>(i)));
  }
  const LinkCounters& l = b.desk.link();
  CHECK(l.violations() == 0);
  CHECK(l.late == 0);
  CHECK(l.excessive == 0);
  CHECK(l.received == count + 1);
  if (settings.medium_delay >= 3) CHECK(l.collisions > 0);
}

TEST_CASE("faults: each rate does what it says, in both directions, and the same with the same seed") {
  struct Case {
    const char* name;
    double FaultRates::*rate;
    uint64_t FaultCounters::*count;
  };
  const Case c = GENERATE(Case{"loss", &FaultRates::loss, &FaultCounters::lost},
                          Case{"duplicate", &FaultRates::duplicate, &FaultCounters::duplicated},
                          Case{"reorder", &FaultRates::reorder, &FaultCounters::reordered},
                          Case{"delay", &FaultRates::delay, &FaultCounters::delayed},
                          Case{"corrupt", &FaultRates::corrupt, &FaultCounters::corrupted},
                          Case{"corrupt_fcs", &FaultRates::corrupt_fcs, &FaultCounters::corrupted_fcs});
  INFO(c.name << " seed " << test_seed());
  const int count = 400;
  auto run = [&](uint32_t seed) {
    DeskSettings settings;
    settings.seed = seed;
    Bench b(settings);
    REQUIRE(b.station.resolve());
    FaultRates rates;
    rates.*c.rate = 0.1;
    b.desk.set_faults(rates);
    for (int i = 0; i < count; ++i) b.station.send_udp(pattern(60, static_cast<uint32_t>(i)));
    std::vector<int> order;
    while (auto back = b.station.receive_udp(5 * kMillisecond)) {
      int which = -1;
      for (int i = 0; i < count && which < 0; ++i)
        if (*back == pattern(60, static_cast<uint32_t>(i))) which = i;
      REQUIRE(which >= 0);  // nothing wrong ever arrives
      order.push_back(which);
    }
    CHECK(b.desk.idle());
    const uint64_t there = b.desk.faults_to_chip().*c.count, back = b.desk.faults_from_chip().*c.count;
    CHECK(there > count / 25);
    CHECK(there < count / 4);
    CHECK(back > count / 25);
    const std::set<int> different(order.begin(), order.end());
    const bool in_order = std::is_sorted(order.begin(), order.end());
    const std::string name = c.name;
    if (name == "loss" || name == "corrupt") CHECK(order.size() == count - there - back);
    // A bit in the padding or identification field may hurt nobody; most are caught.
    if (name == "corrupt_fcs") CHECK(order.size() < count - (there + back) / 2);
    if (name == "corrupt") CHECK(b.chip->bad_frames() == there);
    if (name == "duplicate") CHECK(order.size() == count + there + back);
    if (name == "duplicate" || name == "reorder" || name == "delay") CHECK(different.size() == count);
    if (name == "reorder" || name == "delay") CHECK_FALSE(in_order);
    if (name == "loss" || name == "corrupt") CHECK(in_order);
    return order;
  };
  const auto first = run(test_seed());
  CHECK(first == run(test_seed()));
  CHECK(first != run(test_seed() + 1));
}

TEST_CASE("recording: every good frame once, in the order of the wire, simulated time, no FCS") {
  TemporaryDir dir;
  const auto file = dir / "wire.pcap";
  {
    Bench b;
    b.desk.record(file.string());
    REQUIRE(b.station.resolve());
    REQUIRE(b.station.ping(56));
    net::Bytes broken = net::make_arp_request(kHost, kChip.ip);
    net::append_fcs(broken);
    broken[20] ^= 1;
    b.desk.send_raw(broken);
    b.station.send_udp(pattern(1472, 1));
    REQUIRE(b.station.receive_udp(10 * kMillisecond));
    b.desk.run_for(kMillisecond);
    CHECK(b.desk.recorded() == 6);
    b.desk.finish();
  }
  const net::Bytes p = contents(file);
  auto word = [&p](size_t at) {
    REQUIRE(at + 4 <= p.size());
    return uint32_t{p[at]} | uint32_t{p[at + 1]} << 8 | uint32_t{p[at + 2]} << 16 | uint32_t{p[at + 3]} << 24;
  };
  CHECK(word(0) == 0xa1b23c4d);
  CHECK(word(4) == 0x00040002);
  CHECK(word(20) == 1);
  const uint32_t lengths[] = {60, 60, 98, 98, 1514, 1514};
  size_t at = 24;
  uint64_t before = 0;
  for (const uint32_t length : lengths) {
    const uint64_t time = uint64_t{word(at)} * 1000000000 + word(at + 4);
    CHECK(time > before);
    before = time;
    CHECK(word(at + 8) == length);
    CHECK(word(at + 12) == length);
    at += 16 + length;
  }
  CHECK(at == p.size());
}

TEST_CASE("link: wrong frames of the chip are counted and do not get through") {
  using Damage = EchoChip::Damage;
  Bench b;
  REQUIRE(b.station.resolve());
  const LinkCounters& l = b.desk.link();
  auto ping_with = [&b](Damage damage) {
    b.chip->damage = damage;
    return b.station.ping(100, kMillisecond).has_value();
  };
  CHECK_FALSE(ping_with(Damage::kFcs));
  CHECK(l.fcs == 1);
  CHECK_FALSE(ping_with(Damage::kPreamble));
  CHECK_FALSE(ping_with(Damage::kOddNibble));
  CHECK(l.malformed == 2);
  CHECK_FALSE(ping_with(Damage::kShort));
  CHECK(l.short_frames == 1);
  CHECK(l.violations() == 4);
  CHECK(ping_with(Damage::kNone));
}

TEST_CASE("desk: cable out and in again, at rest when nothing is to come") {
  Bench b;
  REQUIRE(b.station.ping(10));
  b.desk.run_for(kMillisecond);
  CHECK(b.desk.idle());
  b.desk.set_cable(false);
  const uint64_t received = b.chip->good_frames();
  CHECK_FALSE(b.station.ping(10));
  CHECK(b.chip->good_frames() == received);
  b.desk.set_cable(true);
  CHECK(b.station.ping(10));
  CHECK_FALSE(b.desk.idle());
}
