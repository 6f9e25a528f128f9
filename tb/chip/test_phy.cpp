// SPDX-License-Identifier: Apache-2.0
// The whole chip and its PHY: clocks that are missing, stop and come back, pulses on the reset pin, frames that the PHY
// loops back, carrier sense that is stuck; UDP to a closed port.
#include "desk/chip_transport.hpp"
#include "net/client.hpp"
#include "support/catch.hpp"
#include "verilated/chips.hpp"

using namespace psweep;
using namespace psweep::chip;

namespace {

const net::Address kHost{{0x02, 0x00, 0x00, 0x00, 0x00, 0x01}, 0x0a050001, 40000};

DeskSettings settings() {
  DeskSettings s;
  s.clk_mhz = chip_named("tiny").config.clk_khz / 1000.0;
  s.seed = test_seed();
  return s;
}

struct Bench {
  explicit Bench(const DeskSettings& s)
      : address(chip_named("tiny").address), desk(chip_named("tiny").make(), s), transport(station, address) {}
  std::vector<uint32_t> counters() {
    net::Client client(transport, 1.0, 9);
    return client.counters();
  }
  uint32_t counted(net::Counter counter) { return counters().at(static_cast<size_t>(counter)); }

  net::Address address;
  Desk desk;
  Station station{desk, kHost, address.ip, address.port};
  ChipTransport transport;
};

net::Header answer(Station& station, uint8_t type, uint32_t token, const net::Bytes& payload = {}) {
  net::Header h;
  h.type = type;
  h.token = token;
  h.sequence = 7;
  net::Bytes message = net::encode(h);
  message.insert(message.end(), payload.begin(), payload.end());
  REQUIRE(station.send_udp(message));
  const auto reply = station.receive_udp(10 * kMillisecond);
  REQUIRE(reply);
  const auto got = net::decode(*reply);
  REQUIRE(got);
  return *got;
}

}  // namespace

TEST_CASE("phy: the chip works without its clocks, says which one is missing, and goes on when it comes") {
  DeskSettings s = settings();
  s.mii_clocks = false;
  Bench b(s);
  const auto wait = [&] { b.desk.run_for(2200 * kMicrosecond); };
  CHECK(b.desk.chip().clock_missing() == 0);
  wait();
  CHECK(b.desk.chip().clock_missing() == 3);  // so clk's side is out of its reset
  b.desk.set_tx_clock(false);
  b.desk.set_mii_clocks(true);
  wait();
  CHECK(b.desk.chip().clock_missing() == 2);
  b.desk.set_tx_clock(true);
  wait();
  CHECK(b.desk.chip().clock_missing() == 0);
  REQUIRE(b.station.resolve(3));
  CHECK(b.station.ping(100));
  CHECK(b.counted(net::kRxClockLost) == 1);
  CHECK(b.counted(net::kTxClockLost) == 1);
  for (const bool rx : {true, false}) {  // one of them stops, while frames go to and fro
    const uint64_t before = b.desk.link().received;
    if (rx) b.desk.set_rx_clock(false);
    if (!rx) b.desk.set_tx_clock(false);
    for (size_t i = 0; i < 6; ++i) CHECK_FALSE(b.station.ping(50 + i, 500 * kMicrosecond));
    CHECK(b.desk.chip().clock_missing() == (rx ? 1 : 2));
    CHECK(b.desk.link().received == before);
    b.desk.set_rx_clock(true);
    b.desk.set_tx_clock(true);
    wait();
    CHECK(b.desk.chip().clock_missing() == 0);
    for (int i = 0; i < 4; ++i) CHECK(b.station.ping(300));
    CHECK(b.counted(rx ? net::kRxClockLost : net::kTxClockLost) == 2);
  }
  CHECK(b.desk.link().violations() == 0);
}

TEST_CASE("phy: a short pulse on the reset pin does nothing, a longer one resets") {
  Bench b(settings());
  const Time period = static_cast<Time>(1e9 / b.desk.clk_mhz());
  const net::Header first = answer(b.station, net::kOpen, 0, {1, 2, 3, 4});
  REQUIRE(first.flags == net::kOk);
  for (const int clocks : {1, 2, 3, 7, 14}) {
    b.desk.pulse_reset(clocks * period);
    b.desk.run_for(3 * kMicrosecond);
    INFO(clocks << " clocks");
    CHECK(b.desk.chip().session());
    CHECK(answer(b.station, net::kStatus, first.token).flags == net::kOk);
  }
  b.desk.pulse_reset(19 * period);
  b.desk.run_for(20 * kMicrosecond);
  CHECK_FALSE(b.desk.chip().session());
  CHECK(answer(b.station, net::kStatus, first.token).flags == net::kNoSession);
}

TEST_CASE("phy: frames of the chip that come back to it in half duplex are not received") {
  DeskSettings s = settings();
  s.half_duplex = true;
  s.echo = GENERATE(0, 4, 40);
  INFO("echo after " << s.echo << " nibbles");
  Bench b(s);
  REQUIRE(b.station.resolve(3));
  for (size_t size = 0; size < 20; ++size) {
    CHECK(b.station.ping(size * 70));
    b.desk.run_for(kMillisecond);  // more often the chip does not answer a stranger
  }
  const auto counters = b.counters();
  for (const net::Counter none : {net::kRxFiltered, net::kRxOther, net::kBadSource, net::kAnswers, net::kRxShort,
                                  net::kRxFcs, net::kRxAlign, net::kRxFragment})
    CHECK(counters[static_cast<size_t>(none)] == 0);
  CHECK(counters[net::kTxFrames] == 21);
  CHECK(counters[net::kRxFrames] == 22);
}

TEST_CASE("phy: carrier sense stuck in half duplex gives frames up, and ends with the fault") {
  DeskSettings s = settings();
  s.half_duplex = true;
  Bench b(s);
  REQUIRE(b.station.resolve(3));
  b.desk.hold_carrier(true);
  for (int i = 0; i < 6; ++i) CHECK_FALSE(b.station.ping(40, kMillisecond));
  b.desk.hold_carrier(false);
  b.desk.run_for(2 * kMillisecond);
  CHECK(b.station.ping(100));
  const uint32_t deferred = b.counted(net::kTxDeferred);
  CHECK(deferred >= 5);
  CHECK(deferred <= 6);
}

TEST_CASE("phy: UDP to a closed port is answered by ICMP port unreachable, a broadcast is not") {
  Bench b(settings());
  REQUIRE(b.station.resolve(3));
  uint32_t sent_frames = 0;
  {
    std::vector<net::Bytes> frames;
    b.desk.on_frame = [&](const net::Bytes& f) { frames.push_back(f); };
    for (const size_t size : {1, 8, 9, 100, 1400}) {
      net::Address closed = b.address;
      closed.port = static_cast<uint16_t>(b.address.port + size);
      net::Bytes sent = net::make_udp(kHost, closed, net::Bytes(size, 0x5a));
      b.desk.send(sent);
      b.desk.run_for(kMillisecond);
      REQUIRE(frames.size() == 1);
      net::Bytes about(32, 0);
      std::copy_n(sent.begin() + 14, 28, about.begin() + 4);
      net::Bytes want = net::make_icmp_echo(b.address, kHost, 3, about);
      want.resize(70);  // without padding
      want[35] = 3;
      net::put16(want, 36, 0);
      net::put16(want, 36, net::internet_checksum(want.data() + 34, 36));
      REQUIRE(frames[0].size() >= want.size());
      CHECK(net::Bytes(frames[0].begin(), frames[0].begin() + 70) == want);
      frames.clear();
      std::fill_n(sent.begin(), 6, uint8_t{0xff});
      b.desk.send(sent);
      b.desk.run_for(kMillisecond);
      CHECK(frames.empty());
      ++sent_frames;
    }
  }
  Station again(b.desk, kHost, b.address.ip, b.address.port);
  ChipTransport transport(again, b.address);
  net::Client client(transport, 1.0, 3);
  const auto counters = client.counters();
  CHECK(counters[net::kUnreachable] == sent_frames);
  CHECK(counters[net::kRxOther] == sent_frames);
  CHECK(counters[net::kRxFiltered] == sent_frames);
}
