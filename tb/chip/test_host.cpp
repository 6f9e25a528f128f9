// SPDX-License-Identifier: Apache-2.0
// Tools of the host at the chip's wire, in simulated time: psweep bench-link says what is counted at the pins, for
// every configuration, at both speeds and in both duplexes; psweep-sim --session-wall ends the session of a host that
// is gone. The chip is its model at the pins (chip/model_chip.hpp); one case has the Verilated chip.
#include <cmath>
#include <cstdio>

#include "chip/goodput.hpp"
#include "chip/model_chip.hpp"
#include "desk/session_watch.hpp"
#include "support/catch.hpp"
#include "verilated/chips.hpp"

using namespace psweep;
using namespace psweep::chip;

namespace {

const net::Address kHost{{0x02, 0x00, 0x00, 0x00, 0x00, 0x01}, 0x0a050001, 40000};
const net::Address kOther{{0x02, 0x00, 0x00, 0x00, 0x00, 0x02}, 0x0a050003, 40001};

// The client's clock goes `slow` times as fast as the simulated one, as the wall clock does for psweep-sim.
class Slowly : public ChipTransport {
 public:
  Slowly(Station& station, const net::Address& chip, double slow) : ChipTransport(station, chip), slow_(slow) {}
  std::optional<net::Bytes> receive(double timeout_s) override { return ChipTransport::receive(timeout_s / slow_); }
  double now() override { return slow_ * ChipTransport::now(); }

 private:
  const double slow_;
};

// bench-link and the wire within 5 % in all three measurements; only the first tile is swept.
void agree(const char* what, const Chip& chip, Desk& desk, double seconds, double least, double slow = 1) {
  Station station(desk, kHost, chip.address.ip, chip.address.port);
  Slowly transport(station, chip.address, slow);
  net::Client client(transport, 5.0, test_seed());
  const auto capabilities = client.info();
  net::LinkBench bench(client, capabilities);
  for (const auto& [up, down] : {std::pair{true, false}, std::pair{false, true}, std::pair{true, true}}) {
    Goodput g = goodput(desk, chip.address.port, bench, up, down, seconds, slow);
    g.bench.up *= slow;
    g.bench.down *= slow;
    std::printf("%s %s, %s: bench-link %.2f up, %.2f down; wire %.2f up, %.2f down Mbit/s\n", what, chip.name.c_str(),
                up && down ? "both"
                : up       ? "up"
                           : "down",
                g.bench.up, g.bench.down, g.wire_up, g.wire_down);
    INFO(what << " " << chip.name << ", up " << up << ", down " << down);
    CHECK(g.worst() < 0.05);
    if (up) CHECK(g.bench.chunks_up == g.bench.chunks_sent);
    if (up && !down) CHECK(g.bench.up > least);
    if (down && !up && capabilities.config.chunk_bytes > 1000 && chip.name == "tile") CHECK(g.bench.down > least);
  }
  const auto status = client.request(net::kStatus).status;
  REQUIRE(status);
  CHECK(status->tiles_done == 1);
  CHECK(status->tiles_dropped == 0);
  CHECK(status->has(net::kFlagRows));  // the second tile is open, and not launched
  client.close();
  CHECK(desk.link().violations() == 0);
}

struct ModelDesk {
  ModelDesk(const net::ArbiterConfig& config, const net::Address& address, const DeskSettings& s)
      : chip(new ModelChip(config, address)), desk(std::unique_ptr<ChipModel>(chip), s) {}
  ModelChip* chip;
  Desk desk;
};

}  // namespace

TEST_CASE("bench-link: its figures are those of the wire") {
  for (const Chip& chip : chips()) {
    ModelDesk d(chip.config, chip.address, {});
    // Headers leave 94.5 Mbit/s to chunks of 1408 bytes, 48 to those of 64.
    agree("100 Mbit/s,", chip, d.desk, 0.03, chip.config.chunk_bytes > 1000 ? 90 : 40);
  }
}

TEST_CASE("bench-link: a wire so slow that its queue holds longer than an answer takes") {
  const Chip& chip = chip_named("tiny");
  DeskSettings s;
  s.speed_100 = false;
  ModelDesk d(chip.config, chip.address, s);
  agree("10 Mbit/s,", chip, d.desk, 0.5, 9);
}

TEST_CASE("bench-link: a simulator 300 times slower than the chip") {
  const Chip& chip = chip_named("tiny");
  ModelDesk d(chip.config, chip.address, {});
  agree("slowly,", chip, d.desk, 0.03, 90, 300);
}

TEST_CASE("bench-link: half duplex") {
  const Chip& chip = chip_named("tile");
  DeskSettings s;
  s.half_duplex = true;
  ModelDesk d(chip.config, chip.address, s);
  agree("half duplex,", chip, d.desk, 0.05, 70);
}

// The window of the only tile that there can be fits into one chunk.
TEST_CASE("bench-link: starts no tile by accident on a chip whose tile fits one chunk") {
  Chip chip = chip_named("tiny");
  chip.config.engine.img_cols = 24;
  chip.config.engine.img_rows = 20;
  chip.config.row_slots = 2;
  ModelDesk d(chip.config, chip.address, {});
  agree("one chunk,", chip, d.desk, 0.02, 90);
}

TEST_CASE("bench-link: the Verilated chip") {
  const Chip& chip = chip_named("tiny");
  Desk desk(chip.make(), {});
  agree("RTL,", chip, desk, 0.01, 85);
  CHECK(desk.chip().launches() == 1);
}

TEST_CASE("psweep-sim: a session ends when its host has been silent in wall time, not before") {
  const bool rtl = GENERATE(false, true);
  Chip chip = chip_named("tiny");
  chip.config.session_ms = 60000;  // of the model; the RTL's 200 ms are not reached here either
  DeskSettings s;
  const bool bad_wire = GENERATE(false, true);
  if (bad_wire) s.faults.duplicate = 0.5;
  Desk desk(rtl ? chip.make() : std::make_unique<ModelChip>(chip.config, chip.address), s);
  SessionWatch watch(desk, chip.address, 3);
  auto pass = [&](double from, double to) {  // wall time; simulated time is a thousand times slower
    for (double t = from; t < to; t += 0.1) {
      watch.look(t);
      desk.run_for(100 * kMicrosecond);
    }
  };
  {
    Station station(desk, kHost, chip.address.ip, chip.address.port);
    ChipTransport transport(station, chip.address);
    net::Client client(transport, 1.0, 1);
    client.open(client.info());
    for (int i = 0; i < 5; ++i) {  // alive, though slow
      pass(2 * i, 2 * i + 2);
      CHECK(client.request(net::kStatus).code == net::kOk);
    }
    CHECK(watch.ended() == 0);
  }
  // Killed: no CLOSE.
  pass(10, 12.9);
  CHECK(desk.chip().session());
  int kept_from_host = 0;
  desk.on_frame = [&](const net::Bytes& frame) { kept_from_host += SessionWatch::answer(frame); };
  pass(12.9, 13.5);
  CHECK_FALSE(desk.chip().session());
  CHECK(watch.ended() == 1);
  CHECK(kept_from_host >= 1);
  Station station(desk, kOther, chip.address.ip, chip.address.port);
  ChipTransport transport(station, chip.address);
  net::Client next(transport, 1.0, 2);
  const auto capabilities = next.info();
  const Time begin = desk.now();
  next.open(capabilities);
  CHECK(desk.now() - begin < 10 * kMillisecond);
  next.close();
  CHECK(watch.ended() == 1);
}
