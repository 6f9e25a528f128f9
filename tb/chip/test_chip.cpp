// SPDX-License-Identifier: Apache-2.0
// The whole chip from the pins on, over the in-process link, in simulated time: ARP, ping, capabilities, whole tiled
// pairs by the host library, cell by cell equal to the model, without and with faults, in half duplex, at several
// clocks, with the smallest buffers; cable pulled, chip reset, a second host, a host that falls silent; recordings.
#include <bitset>
#include <filesystem>
#include <set>

#include "chip/chip_transport.hpp"
#include "core/error.hpp"
#include "engine/stimulus.hpp"
#include "golden/psweep.hpp"
#include "net/link_engine.hpp"
#include "plan/planner.hpp"
#include "rtl/registers.hpp"
#include "scene/scene.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/temporary_dir.hpp"

using namespace psweep;
using namespace psweep::chip;
using namespace psweep::tb;

namespace {

const net::Address kHost{{0x02, 0x00, 0x00, 0x00, 0x00, 0x01}, 0x0a050001, 40000};
const net::Address kOther{{0x02, 0x00, 0x00, 0x00, 0x00, 0x02}, 0x0a050003, 40001};

DeskSettings settings_for(const Chip& chip) {
  DeskSettings s;
  s.clk_mhz = chip.config.clk_khz / 1000.0;
  s.seed = test_seed();
  return s;
}

// Does things at given simulated times, while the client waits. Looks at every status block on its way.
class Eventful : public ChipTransport {
 public:
  using ChipTransport::ChipTransport;
  std::vector<std::pair<Time, std::function<void(Desk&)>>> events;  // ascending
  Desk* desk = nullptr;
  uint64_t blocks = 0, torn = 0;  // status blocks; those whose words are not of one moment

  std::optional<net::Bytes> receive(double timeout_s) override {
    const Time end = desk->now() + to_time(timeout_s);
    for (;;) {
      while (!events.empty() && events.front().first <= desk->now()) {
        events.front().second(*desk);
        events.erase(events.begin());
      }
      const Time until = events.empty() ? end : std::min(end, events.front().first);
      auto packet = ChipTransport::receive(static_cast<double>(std::max<Time>(0, until - desk->now())) / kSecond);
      if (packet) look_at(*packet);
      if (packet || until == end) return packet;
    }
  }

 private:
  void look_at(const net::Bytes& packet) {
    const auto h = net::decode(packet);
    if (!h || h->type == (net::kInfo | net::kReply) || h->type == (net::kCounters | net::kReply) ||
        h->type == net::kMap)
      return;
    std::vector<uint32_t> words;
    for (size_t at = net::kHeaderBytes; at + 4 <= packet.size(); at += 4) words.push_back(net::get32(packet, at));
    const auto s = net::parse_status(words);
    if (!s) return;
    ++blocks;
    size_t chunks = s->base;
    for (const uint32_t word : s->bitmap) chunks += std::bitset<32>(word).count();
    torn += chunks != s->received;
  }
};

struct Bench {
  explicit Bench(const Chip& c, const DeskSettings& s)
      : chip(c), address(strapped(c.address, s.straps)), desk(c.make(), s), transport(station, address) {
    transport.desk = &desk;
  }
  explicit Bench(const Chip& c) : Bench(c, settings_for(c)) {}

  // The pair in tiles over the link; every cell against the model.
  void run_pair(int size, int planes, int in_flight = 2) {
    const golden::Config& format = chip.config.engine;
    const Scene scene = render(SceneKind::kRocky, test_seed(), size, 1);
    SweepSetup setup{scene.rig, {planes, 1.0, 4.0}, format, threshold_for(format, 0.85)};
    const TileSize tile = largest_tile(setup);
    const Plan plan = plan_tiles(setup, tile.cols, tile.rows);
    const int count = static_cast<int>(plan.tiles.size());
    REQUIRE(count > 1);
    auto input = [&](int i) {
      const PlacedTile& t = plan.tiles[static_cast<size_t>(i)];
      return net::LinkTile{t.job, cut_window(scene.left, t.left_x, t.left_y, t.job.win_cols, t.job.win_rows),
                           cut_window(scene.right, t.right_x, t.right_y, t.job.win_cols, t.job.win_rows)};
    };
    Scoreboard board("cell");
    std::set<int> done;
    uint64_t clocks = 0;  // of the engine, if nothing stalls it
    net::Client client(transport, 1.0, test_seed());
    const auto capabilities = client.info();
    net::LinkOptions options;
    options.in_flight = in_flight;
    figures = net::run_link_tiles(
        client, capabilities, plan.table, count, options, input,
        [&](int i, const std::vector<golden::MapCell>& cells) {
          const net::LinkTile in = input(i);
          if (done.insert(i).second) clocks += golden::engine_clocks(format, in.job) + net::kFirstPairClocks;
          const auto model = golden::run_tile(format, in.job, plan.table, in.left, in.right);
          REQUIRE(cells.size() == model.cells.size());
          for (size_t at = 0; at < cells.size(); ++at)
            board.compare(rtl::pack_cell(format, cells[at]), rtl::pack_cell(format, model.cells[at]),
                          {i, -1, static_cast<int>(at) % in.job.tile_cols, static_cast<int>(at) / in.job.tile_cols},
                          static_cast<uint64_t>(desk.clocks()));
        },
        [](uint64_t) {});
    statistics = client.statistics();
    INFO(board.report());
    CHECK(board.ok());
    CHECK(figures.engine_clocks >= clocks);
    if (in_flight == 1 && chip.config.row_slots == 0 && chip.config.map_depth == 0 && statistics.lost == 0)
      CHECK(figures.engine_clocks == clocks);
    CHECK(transport.blocks > 0);
    CHECK(transport.torn == 0);
    CHECK(static_cast<int>(done.size()) == count);
    CHECK(desk.link().violations() <= cut_frames);
    tiles = count;
  }

  const Chip& chip;
  net::Address address;
  Desk desk;
  Station station{desk, kHost, address.ip, address.port};
  Eventful transport;
  net::LinkFigures figures;
  net::LinkStatistics statistics;
  int tiles = 0;
  uint64_t cut_frames = 0;  // a frame that a reset may cut off is not whole
};

net::Bytes request(uint8_t type, uint32_t token = 0, const net::Bytes& payload = {}) {
  net::Header h;
  h.type = type;
  h.token = token;
  h.sequence = 7;
  net::Bytes b = net::encode(h);
  for (const uint8_t byte : payload) b.push_back(byte);
  return b;
}
net::Header answer(Station& station, const net::Bytes& message) {
  REQUIRE(station.send_udp(message));
  const auto reply = station.receive_udp(10 * kMillisecond);
  REQUIRE(reply);
  const auto h = net::decode(*reply);
  REQUIRE(h);
  return *h;
}

}  // namespace

TEST_CASE("chip: ARP, ping of all sizes, addresses by straps, both speeds") {
  DeskSettings s = settings_for(chip_named("tiny"));
  const bool fast = GENERATE(true, false);
  s.speed_100 = fast;
  s.straps = fast ? 0x00 : 0x9a;
  Bench b(chip_named("tiny"), s);
  REQUIRE(b.station.resolve(3));
  CHECK(*b.station.chip_mac() == b.address.mac);
  for (size_t size = 0; size <= 1468; size += fast && (size < 40 || size > 1440) ? 1 : fast ? 29 : 367) {
    INFO("size " << size << (fast ? ", 100" : ", 10") << " Mbit/s");
    CHECK(b.station.ping(size, 5 * kMillisecond));
  }
  CHECK(b.desk.link().violations() == 0);
  CHECK(b.station.dropped() == 0);
}

TEST_CASE("chip: capability words say what the configuration's file says") {
  for (const Chip& chip : chips()) {
    INFO("configuration " << chip.name);
    Bench b(chip);
    net::Client client(b.transport, 1.0, 1);
    const auto got = client.info();
    const net::ArbiterConfig& a = chip.config;
    const golden::Config &e = a.engine, &g = got.config.engine;
    CHECK(g.img_cols == e.img_cols);
    CHECK(g.img_rows == e.img_rows);
    CHECK(g.plane_cols == e.plane_cols);
    CHECK(g.plane_rows == e.plane_rows);
    CHECK(g.planes == e.planes);
    CHECK(g.window == e.window);
    CHECK(g.pix_bits == e.pix_bits);
    CHECK(g.weight_bits == e.weight_bits);
    CHECK(g.interp_frac == e.interp_frac);
    CHECK(g.mncc_bits == e.mncc_bits);
    CHECK(g.frac_bits == e.frac_bits);
    CHECK(g.lanes == e.lanes);
    CHECK(got.config.clk_khz == a.clk_khz);
    CHECK(got.config.chunk_bytes == a.chunk_bytes);
    CHECK(got.config.row_slots == a.slots());
    CHECK(got.config.rx_slots == a.rx_slots);
    CHECK(got.config.session_ms == a.session_ms);
    const int cells = a.map_depth > 0 ? a.map_depth : e.plane_cols * e.plane_rows;
    CHECK(got.config.map_depth >= cells);
    CHECK(got.config.map_depth < cells + a.chunk_cells());
    uint64_t mac = 0;
    for (const uint8_t byte : b.address.mac) mac = mac << 8 | byte;
    CHECK(got.mac == mac);
  }
}

TEST_CASE("chip: a tiled pair is the model's map, every configuration for tests, one and two tiles in flight") {
  const char* name = GENERATE("tiny", "tiny_min", "odd", "odd_4");
  const int in_flight = GENERATE(1, 2);
  INFO(name << ", in flight " << in_flight);
  const Chip& chip = chip_named(name);
  Bench b(chip);
  b.run_pair(chip.config.engine.plane_cols * 5 / 2, chip.config.engine.planes, in_flight);
  CHECK(b.desk.chip().launches() == b.tiles);
}

TEST_CASE("chip: a tiled pair at other clocks and phases") {
  const double mhz = GENERATE(60.0, 166.0, 300.0);
  for (const double phase : {0.0, 0.5}) {
    INFO(mhz << " MHz, phase " << phase);
    DeskSettings s = settings_for(chip_named("tiny"));
    s.clk_mhz = mhz;
    s.clk_phase = phase;
    s.rx_phase = 0;
    s.tx_phase = phase;  // 0: edges coincide
    s.rx_ppm = 100;
    s.tx_ppm = -100;
    Bench bench(chip_named("tiny"), s);
    bench.run_pair(40, 12);
    CHECK(bench.tiles > 4);
  }
}

namespace {

// 1 % and `more` of `rates` (0 or 1 each), buffers for whole tiles and the smallest ones.
void pair_with_faults(const FaultRates& rates, double more = 0.1) {
  const double rate = GENERATE_COPY(0.01, more);
  const char* name = GENERATE("tiny", "tiny_min");
  DeskSettings s = settings_for(chip_named(name));
  INFO(name << ", rate " << rate << ", seed " << s.seed);
  s.clk_mhz = 30;  // most of the time the host waits for what was lost: the fewer clocks, the better
  s.faults = rates;
  for (auto member : {&FaultRates::loss, &FaultRates::duplicate, &FaultRates::reorder, &FaultRates::delay,
                      &FaultRates::corrupt, &FaultRates::corrupt_fcs})
    s.faults.*member *= rate;
  Bench b(chip_named(name), s);
  b.run_pair(40, 12);
  uint64_t happened = 0;
  for (const FaultCounters& f : {b.desk.faults_to_chip(), b.desk.faults_from_chip()})
    happened += f.lost + f.duplicated + f.reordered + f.delayed + f.corrupted + f.corrupted_fcs;
  if (rate > 0.02) CHECK(happened > 0);
}

}  // namespace

TEST_CASE("chip: frames lost, the identical map") { pair_with_faults({1, 0, 0, 0, 0, 0}); }
TEST_CASE("chip: frames doubled, the identical map") { pair_with_faults({0, 1, 0, 0, 0, 0}); }
TEST_CASE("chip: frames reordered and late, the identical map") { pair_with_faults({0, 0, 1, 1, 0, 0}); }
TEST_CASE("chip: frames corrupted, with wrong and good FCS, the identical map") {
  pair_with_faults({0, 0, 0, 0, 1, 1});
}
// Six kinds at 3 % each touch every sixth frame, in both directions.
TEST_CASE("chip: all faults together, the identical map") { pair_with_faults({1, 1, 1, 1, 1, 1}, 0.03); }

TEST_CASE("chip: half duplex, with and without faults") {
  const int delay = GENERATE(0, 20);
  const double loss = GENERATE(0.0, 0.01);
  DeskSettings s = settings_for(chip_named("tiny"));
  s.half_duplex = true;
  s.medium_delay = delay;
  s.faults.loss = loss;
  INFO("delay " << delay << " nibbles, loss " << loss << ", seed " << s.seed);
  Bench b(chip_named("tiny"), s);
  b.run_pair(40, 12);
  CHECK(b.desk.link().late == 0);
  if (delay > 0) CHECK(b.desk.link().collisions > 0);
  net::Client client(b.transport, 1.0, 2);
  const auto counters = client.counters();
  CHECK(counters[net::kTxLate] == 0);
  if (delay > 0) CHECK(counters[net::kTxCollisions] > 0);
  // It takes two: each counts them once. One may hear the other's last nibble, and not the other way round.
  CHECK(counters[net::kTxCollisions] + 2 >= b.desk.link().collisions);
  CHECK(counters[net::kTxCollisions] <= b.desk.link().collisions + 2);
}

TEST_CASE("chip: cable out for a while, in the middle of a pair") {
  Bench b(chip_named("tiny"));
  // Shorter than the session's time.
  b.transport.events = {{2 * kMillisecond, [](Desk& d) { d.set_cable(false); }},
                        {15 * kMillisecond, [](Desk& d) { d.set_cable(true); }}};
  b.run_pair(64, 12);
  CHECK(b.transport.events.empty());
  CHECK(b.statistics.resent > 0);
}

TEST_CASE("chip: reset in the middle of a pair") {
  Bench b(chip_named("tiny"));
  b.transport.events = {{2 * kMillisecond, [](Desk& d) { d.reset_chip(); }}};
  b.cut_frames = 1;
  b.run_pair(64, 12);
  CHECK(b.transport.events.empty());
  CHECK(b.statistics.sessions == 2);
}

TEST_CASE("chip: clocks of the PHY stop for a while, in the middle of a pair") {
  Bench b(chip_named("tiny"));
  for (int at : {1, 2, 3})
    for (bool running : {false, true})
      b.transport.events.push_back({at * kMillisecond + running * 400 * kMicrosecond, [running](Desk& d) {
                                      d.set_cable(running);
                                      d.set_mii_clocks(running);
                                    }});
  b.run_pair(64, 12);
  CHECK(b.transport.events.empty());
  CHECK(b.statistics.sessions == 1);
}

TEST_CASE("chip: reset while the clocks of the PHY stand still, at power-on and later") {
  DeskSettings s = settings_for(chip_named("tiny"));
  s.half_duplex = GENERATE(false, true);
  s.mii_clocks = false;
  for (int frames = 0; frames < 5; ++frames) {  // the two slots of the transmitter are left in all states
    INFO("frames before the reset: " << frames);
    Bench b(chip_named("tiny"), s);
    b.desk.run_for(50 * kMicrosecond);
    b.desk.set_mii_clocks(true);
    REQUIRE(b.station.resolve(3));
    for (int i = 1; i < frames; ++i) CHECK(b.station.ping(100));
    if (frames > 0) {
      b.desk.set_mii_clocks(false);
      b.desk.reset_chip();
      b.desk.run_for(50 * kMicrosecond);
      b.desk.set_mii_clocks(true);
    }
    b.desk.run_for(50 * kMicrosecond);
    net::Client client(b.transport, 1.0, 1);
    const auto counters = client.counters();
    // At power-on the chip has answered ARP; else there was only the question for the counters.
    for (int i = 0; i < net::kCounterWords; ++i) {
      INFO("counter " << i);
      const bool arp = frames == 0 && (i == net::kArp || i == net::kTxFrames || i == net::kRxFrames);
      const bool question = i == net::kUdp || i == net::kRxFrames;
      CHECK(counters[static_cast<size_t>(i)] == static_cast<uint32_t>(arp + question));
    }
    CHECK(b.desk.link().violations() == 0);
  }
}

TEST_CASE("chip: another host is told that the chip is busy, and learns its counters all the same") {
  Bench b(chip_named("tiny"));
  const net::Header first = answer(b.station, request(net::kOpen, 0, {1, 2, 3, 4}));
  CHECK(first.flags == net::kOk);
  CHECK(first.token != 0);
  {
    Station other(b.desk, kOther, b.address.ip, b.address.port);
    CHECK(answer(other, request(net::kOpen, 0, {4, 3, 2, 1})).flags == net::kBusy);
    CHECK(answer(other, request(net::kStatus, first.token + 1)).flags == net::kBusy);
    CHECK(answer(other, request(net::kClose, first.token + 1)).flags == net::kBusy);
    CHECK(answer(other, request(net::kCounters)).flags == net::kOk);
    CHECK(other.ping(100));
  }
  Station again(b.desk, kHost, b.address.ip, b.address.port);
  CHECK(answer(again, request(net::kStatus, first.token)).flags == net::kOk);
  CHECK(b.desk.chip().session());
  CHECK(answer(again, request(net::kClose, first.token)).flags == net::kOk);
  b.desk.run_for(100 * kMicrosecond);
  CHECK_FALSE(b.desk.chip().session());
  CHECK(answer(again, request(net::kStatus, first.token)).flags == net::kNoSession);
}

TEST_CASE("chip: a session ends when its host falls silent, not before") {
  const Chip& chip = chip_named("odd");
  const Time silence = chip.config.session_ms * kMillisecond;
  Bench b(chip);
  const net::Header first = answer(b.station, request(net::kOpen, 0, {1, 2, 3, 4}));
  b.desk.run_for(silence / 2);
  CHECK(answer(b.station, request(net::kStatus, first.token)).flags == net::kOk);
  b.desk.run_for(silence - 2 * kMillisecond);
  CHECK(b.desk.chip().session());
  b.desk.run_for(4 * kMillisecond);
  CHECK_FALSE(b.desk.chip().session());
  CHECK(b.desk.idle());
}

TEST_CASE("chip: recording of the wire and waves of a tile") {
  TemporaryDir dir;
  const auto pcap = dir / "wire.pcap", wave = dir / "tile.fst";
  const Chip& chip = chip_named("tiny");
  Bench b(chip);
  b.desk.record(pcap.string());
  if (chip.waves) {
    WaveWindow window;
    window.file = wave.string();
    window.tile = 1;
    window.clocks = 3000;
    b.desk.watch(window);
  }
  b.run_pair(40, 12);
  b.desk.run_for(kMillisecond);
  b.desk.finish();
  CHECK(b.desk.recorded() == b.desk.link().sent + b.desk.link().received);
  CHECK(std::filesystem::file_size(pcap) > 24 + b.desk.recorded() * 76);
  if (chip.waves) {
    CHECK(b.desk.wave_written());
    CHECK(std::filesystem::file_size(wave) > 1000);
  }
}

TEST_CASE("chip: unknown names are refused with the known ones, waves where there are none") {
  CHECK_THROWS_WITH(chip_named("no_such_chip"), contains("tiny"));
  for (const Chip& chip : chips()) {
    if (chip.waves) continue;
    INFO(chip.name);
    CHECK_THROWS_AS(chip.make()->open_wave("/dev/null"), WaveError);
  }
  DeskSettings slow = settings_for(chip_named("tiny"));
  slow.clk_mhz = 29;
  CHECK_THROWS_AS(Desk(chip_named("tiny").make(), slow), InputError);
}
