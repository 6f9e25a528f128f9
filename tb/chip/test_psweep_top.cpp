// SPDX-License-Identifier: Apache-2.0
// The whole chip from the pins on, over the in-process link, in simulated time: ARP, ping, capabilities, whole tiled
// pairs by the host library, cell by cell equal to the model, without and with faults, in half duplex, at several
// clocks, with the smallest buffers; cable pulled, chip reset, a second host, a host that falls silent; hostile and
// unlucky traffic: answers answered, tokens guessed, sessions of others, amplification, floods, a transmitter that
// stands still; recordings.
#include <algorithm>
#include <bitset>
#include <cstdio>
#include <filesystem>
#include <random>
#include <set>

#include "contract/registers.hpp"
#include "core/error.hpp"
#include "desk/chip_transport.hpp"
#include "golden/control.hpp"
#include "golden/psweep.hpp"
#include "net/link_engine.hpp"
#include "plan/planner.hpp"
#include "scene/scene.hpp"
#include "scene/stimulus.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/temporary_dir.hpp"
#include "verilated/chips.hpp"

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
  // A frame of somebody else, again and again: every so often, or as soon as the wire is free.
  net::Bytes flood;
  Time flood_period = 0;
  uint64_t flooded = 0;

  std::optional<net::Bytes> receive(double timeout_s) override {
    const Time end = desk->now() + to_time(timeout_s);
    for (;;) {
      while (!events.empty() && events.front().first <= desk->now()) {
        events.front().second(*desk);
        events.erase(events.begin());
      }
      Time until = events.empty() ? end : std::min(end, events.front().first);
      if (!flood.empty()) {
        if (flood_period == 0 ? desk->waiting() < 2 : desk->now() >= next_flood_) {
          desk->send(flood);
          ++flooded;
          next_flood_ = std::max(next_flood_, desk->now() - flood_period) + flood_period;
        }
        until = std::min(until, desk->now() + kMicrosecond);
      }
      auto packet = ChipTransport::receive(static_cast<double>(std::max<Time>(0, until - desk->now())) / kSecond);
      if (packet) look_at(*packet);
      if (packet || until == end) return packet;
    }
  }

 private:
  Time next_flood_ = 0;
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
      return golden::TileInput{t.job, cut_window(scene.left, t.left_x, t.left_y, t.job.win_cols, t.job.win_rows),
                               cut_window(scene.right, t.right_x, t.right_y, t.job.win_cols, t.job.win_rows)};
    };
    Scoreboard board("cell");
    std::set<int> done;
    uint64_t clocks = 0;  // of the engine, if nothing stalls it
    net::Client client(transport, 1.0, test_seed());
    const auto capabilities = client.info();
    begun = desk.now();
    transport.flood = flood;
    net::LinkOptions options;
    options.in_flight = in_flight;
    figures = net::run_link_tiles(
        client, capabilities, plan.table, count, options, input,
        [&](int i, const std::vector<golden::MapCell>& cells) {
          const golden::TileInput in = input(i);
          if (done.insert(i).second) clocks += golden::engine_clocks(format, in.job) + net::kFirstPairClocks;
          const auto model = golden::run_tile(format, in.job, plan.table, in.left, in.right);
          REQUIRE(cells.size() == model.cells.size());
          last_map = desk.now();
          if (static_cast<int>(done.size()) == count) transport.flood.clear();
          for (size_t at = 0; at < cells.size(); ++at)
            board.compare(golden::pack_cell(format, cells[at]), golden::pack_cell(format, model.cells[at]),
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
  net::Bytes flood;  // from the first OPEN to the last map: questions without a token are the flood's own kind
  Time begun = 0, last_map = 0;
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
  const Chip& chip = chip_named("odd");
  DeskSettings s = settings_for(chip);
  const bool fast = GENERATE(true, false);
  s.speed_100 = fast;
  s.straps = fast ? 0x00 : 0x9b;  // inverts ones of both addresses, too
  Bench b(chip, s);
  REQUIRE(b.station.resolve(3));
  CHECK(*b.station.chip_mac() == b.address.mac);
  for (size_t size = 0; size <= 1468; size += fast && (size < 40 || size > 1440) ? 1 : fast ? 29 : 367) {
    INFO("size " << size << (fast ? ", 100" : ", 10") << " Mbit/s");
    b.desk.run_for(kMillisecond);  // one ping a millisecond is answered
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
    const net::Bytes filled(net::kCountersRequestBytes - net::kHeaderBytes);
    CHECK(answer(other, request(net::kCounters, 0, filled)).flags == net::kOk);
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
  // Any authentic message is a sign of life, and so is the OPEN again, whose answer was lost.
  const bool open_again = GENERATE(false, true);
  CHECK(
      answer(b.station, open_again ? request(net::kOpen, 0, {1, 2, 3, 4}) : request(net::kStatus, first.token)).flags ==
      net::kOk);
  b.desk.run_for(silence - 2 * kMillisecond);
  CHECK(b.desk.chip().session());
  b.desk.run_for(4 * kMillisecond);
  CHECK_FALSE(b.desk.chip().session());
  CHECK(b.desk.idle());
}

namespace {

// Hosts at the end of the wire that need no stack: the chip's address is known.
struct Crowd {
  Crowd(Desk& d, const net::Address& c) : desk(d), chip(c) {
    desk.on_frame = [this](const net::Bytes& f) { frames.push_back(f); };
  }
  ~Crowd() { desk.on_frame = nullptr; }
  Crowd(const Crowd&) = delete;
  Crowd& operator=(const Crowd&) = delete;

  void send(const net::Address& from, const net::Bytes& m) { desk.send(net::make_udp(from, chip, m)); }
  // Payloads for this host that have arrived; all frames are forgotten.
  std::vector<net::Bytes> take(const net::Address& host) {
    std::vector<net::Bytes> payloads;
    for (const net::Bytes& f : frames) {
      const auto packet = net::parse_udp(f);
      if (packet && packet->to == host) payloads.push_back(packet->payload);
    }
    frames.clear();
    return payloads;
  }
  // The one answer.
  net::Bytes ask(const net::Address& from, const net::Bytes& m) {
    take(from);
    send(from, m);
    desk.run_until([this] { return !frames.empty(); }, desk.now() + kMillisecond);
    const auto got = take(from);
    REQUIRE(got.size() == 1);
    return got[0];
  }
  net::Header header(const net::Address& from, const net::Bytes& m) {
    const auto h = net::decode(ask(from, m));
    REQUIRE(h);
    return *h;
  }
  uint32_t open(const net::Address& host, const net::Bytes& nonce = {1, 2, 3, 4}) {
    const net::Header h = header(host, request(net::kOpen, 0, nonce));
    REQUIRE(h.flags == net::kOk);
    REQUIRE(h.token != 0);
    return h.token;
  }
  uint32_t flags(const net::Address& host, uint32_t token) {
    const net::Bytes reply = ask(host, request(net::kStatus, token));
    REQUIRE(reply.size() > net::kHeaderBytes + 4);
    return net::get16(reply, net::kHeaderBytes + 2);
  }
  uint32_t counter(net::Counter c) {
    desk.run_for(10 * kMicrosecond);
    const net::Bytes body(net::kCountersRequestBytes - net::kHeaderBytes);
    const net::Bytes reply = ask(kThird, request(net::kCounters, 0, body));
    REQUIRE(reply.size() == net::kCountersRequestBytes);
    return net::get32(reply, net::kHeaderBytes + size_t{4} * static_cast<size_t>(c));
  }

  static constexpr net::Address kThird{{0x02, 0x00, 0x00, 0x00, 0x00, 0x03}, 0x0a050004, 40002};
  Desk& desk;
  net::Address chip;
  std::vector<net::Bytes> frames;
};

// Small tile of a configuration as messages.
struct TileMessages {
  explicit TileMessages(const Chip& chip)
      : config(chip.config),
        maker(config.engine, 5),
        tile(maker.make(scene::Texture::kRandom, scene::Geometry::kInside, 4, 3, 2)) {}
  uint32_t pixels() const { return static_cast<uint32_t>(tile.job.win_cols * tile.job.win_rows); }
  uint32_t chunks() const { return (pixels() + config.chunk_pairs() - 1) / config.chunk_pairs(); }
  net::Bytes table(uint32_t token) const {
    net::Bytes body;
    for (const auto& e : tile.table)
      for (const uint32_t w : {uint32_t(e.x0_left), uint32_t(e.y0_left), uint32_t(e.x0_right), uint32_t(e.y0_right),
                               e.dx_left, e.dy_left, e.dx_right, e.dy_right})
        net::append32(body, w);
    return numbered(net::kTable, token, 1, 0, body);
  }
  net::Bytes start(uint32_t token, uint32_t number, uint32_t chunk_count) const {
    net::Bytes body;
    net::append16(body, 1);
    net::append16(body, 0);
    net::append32(body, pixels());
    net::append32(body, chunk_count);
    for (const auto& w : golden::job_writes(tile.job)) net::append32(body, w.value);
    return numbered(net::kStart, token, number, 0, body);
  }
  net::Bytes write(uint32_t token, uint32_t number, uint32_t chunk) const {
    net::Bytes body;
    for (int i = 0; i < config.chunk_pairs(); ++i) {
      const size_t at = size_t{chunk} * static_cast<size_t>(config.chunk_pairs()) + static_cast<size_t>(i);
      uint32_t value = 0;
      if (at < tile.left.data.size())
        value = net::pack_wire_pair(config.engine, tile.left.data[at], tile.right.data[at]);
      for (int b = config.pair_bytes() - 1; b >= 0; --b) body.push_back(static_cast<uint8_t>(value >> 8 * b));
    }
    return numbered(net::kWrite, token, number, chunk, body, net::kFlagAnswer);
  }
  static net::Bytes read(uint32_t token, uint32_t number, uint32_t count) {
    net::Bytes body;
    net::append16(body, count);
    net::append16(body, 0);
    return numbered(net::kRead, token, number, 0, body);
  }
  static net::Bytes numbered(uint8_t type, uint32_t token, uint32_t tile, uint32_t index, const net::Bytes& body,
                             uint8_t flags = 0) {
    net::Bytes m = request(type, token, body);
    m[10] = flags;
    net::put16(m, 12, tile);
    net::put16(m, 14, index);
    return m;
  }
  // Table and rows of tile 0 from `host`; when its map is complete.
  void run(Crowd& crowd, const net::Address& host, uint32_t token) const {
    CHECK(crowd.header(host, table(token)).flags == net::kOk);
    CHECK(crowd.header(host, start(token, 0, chunks())).flags == net::kOk);
    for (uint32_t c = 0; c < chunks(); ++c) CHECK(crowd.header(host, write(token, 0, c)).flags == net::kOk);
    for (int i = 0; i < 100 && (crowd.flags(host, token) & net::kFlagMapComplete) == 0; ++i)
      crowd.desk.run_for(50 * kMicrosecond);
    REQUIRE((crowd.flags(host, token) & net::kFlagMapComplete) != 0);
  }

  const net::ArbiterConfig& config;
  scene::StimulusMaker maker;
  scene::Stimulus tile;
};

int maps(const std::vector<net::Bytes>& payloads) {
  return static_cast<int>(
      std::count_if(payloads.begin(), payloads.end(), [](const auto& m) { return m[3] == net::kMap; }));
}

DeskSettings slow_settings(const Chip& chip) {  // fewer clocks a frame; a millisecond of the chip is longer then
  DeskSettings s = settings_for(chip);
  s.clk_mhz = 30;
  return s;
}

}  // namespace

TEST_CASE("chip: answers are not answered: two chips and one spoofed frame, a frame from the chip itself") {
  const Chip& chip = chip_named("tiny");
  const auto type = static_cast<uint8_t>(GENERATE(0x05, 0x85, 0x8c, 0x7f, 0xff));
  INFO("type " << int(type));
  {
    DeskSettings s = slow_settings(chip);
    Bench a(chip, s);
    s.straps = 1;
    Bench b(chip, s);
    int crossed = 0;
    a.desk.on_frame = [&](const net::Bytes& f) { ++crossed, b.desk.send(f); };
    b.desk.on_frame = [&](const net::Bytes& f) { ++crossed, a.desk.send(f); };
    a.desk.send(net::make_udp(b.address, a.address, request(type)));
    for (int i = 0; i < 60; ++i) {
      a.desk.run_for(20 * kMicrosecond);
      b.desk.run_for(20 * kMicrosecond);
    }
    CHECK(crossed <= 1);
    a.desk.on_frame = b.desk.on_frame = nullptr;
  }
  Bench b(chip, slow_settings(chip));
  int looped = 0;
  b.desk.on_frame = [&](const net::Bytes& f) { ++looped, b.desk.send(f); };
  b.desk.send(net::make_udp(b.address, b.address, request(type)));
  b.desk.run_for(1200 * kMicrosecond);
  CHECK(looped <= 1);
  b.desk.on_frame = nullptr;
}

TEST_CASE("chip: who watches his own tokens cannot close another's session") {
  const Chip& chip = chip_named("tiny");
  Bench b(chip, slow_settings(chip));
  Crowd crowd(b.desk, b.address);
  const uint32_t own = crowd.open(kOther);
  const int64_t then = b.desk.clocks();
  CHECK(crowd.header(kOther, request(net::kClose, own)).flags == net::kOk);
  const uint32_t token = crowd.open(kHost, {9, 8, 7, 6});
  const int64_t distance = b.desk.clocks() - then;
  // Both answers take as long, so that the clocks between the tokens are known but for the wire's phase. One step of
  // the register a clock, as it was once, and eight, as it is; each from the watcher's address and from a forged one.
  const auto once = [](uint32_t s) { return s << 1 | ((s >> 31 ^ s >> 21 ^ s >> 1 ^ s) & 1); };
  const auto eight = [](uint32_t s) {
    for (int i = 0; i < 8; ++i) s = s << 1 | ((s >> 31 ^ s >> 30 ^ s >> 29 ^ s >> 9) & 1);
    return s;
  };
  uint32_t old_way = own, new_way = own;
  bool predicted = false;
  for (int64_t i = 1; i <= distance + 200; ++i) {
    old_way = once(old_way);
    new_way = eight(new_way);
    if (i < distance - 200) continue;
    for (const uint32_t guess : {old_way, new_way | 1}) {
      predicted = predicted || guess == token;
      for (const net::Address& from : {kOther, kHost}) crowd.send(from, request(net::kClose, guess));
    }
  }
  b.desk.run_for(10 * kMicrosecond);
  REQUIRE(b.desk.run_until([&] { return b.desk.waiting() == 0; }, b.desk.now() + 100 * kMillisecond));
  b.desk.run_for(100 * kMicrosecond);
  crowd.frames.clear();
  CHECK_FALSE(predicted);
  CHECK(b.desk.chip().session());
  // The right token, too, from elsewhere.
  crowd.send(kOther, request(net::kClose, token));
  b.desk.run_for(200 * kMicrosecond);
  CHECK(b.desk.chip().session());
  CHECK((crowd.frames.clear(), crowd.header(kHost, request(net::kClose, token)).flags) == net::kOk);
}

TEST_CASE("chip: a session belongs to who opened it, wrong tokens and strangers learn nothing") {
  const Chip& chip = chip_named("tiny");
  Bench b(chip, slow_settings(chip));
  Crowd crowd(b.desk, b.address);
  const uint32_t token = crowd.open(kHost);
  const auto refused = [&](const net::Address& from, const net::Bytes& m) {
    const net::Bytes reply = crowd.ask(from, m);
    CHECK(reply.size() == net::kHeaderBytes);
    CHECK(reply[10] == net::kBusy);
    CHECK(net::get32(reply, 4) == net::get32(m, 4));
  };
  net::Address ip = kHost, port = kHost, mac = kHost;
  ip.ip += 0x100, ++port.port, ++mac.mac[5];
  for (const net::Address& stranger : {ip, port, mac}) refused(stranger, request(net::kStatus, token));
  refused(kHost, request(net::kStatus, token + 1));
  refused(kHost, request(net::kStatus, token ^ 0x80000000));
  // To move it takes nonce and token.
  refused(kOther, request(net::kOpen, 0, {1, 2, 3, 4}));
  refused(kOther, request(net::kOpen, token ^ 0x100, {1, 2, 3, 4}));
  refused(kOther, request(net::kOpen, token, {1, 2, 3, 5}));
  refused(kHost, request(net::kOpen, token, {0, 2, 3, 4}));
  CHECK(crowd.flags(kHost, token) & net::kFlagSession);
  CHECK(crowd.open(kHost) == token);  // the answer was lost
  const net::Bytes moved = crowd.ask(kOther, request(net::kOpen, token, {1, 2, 3, 4}));
  CHECK(moved.size() == net::kHeaderBytes);
  CHECK(moved[10] == net::kOk);
  CHECK(net::get32(moved, 4) == token);
  refused(kHost, request(net::kStatus, token));
  CHECK(crowd.flags(kOther, token) & net::kFlagSession);
  CHECK(crowd.counter(net::kForeign) == 10);
  CHECK(crowd.counter(net::kSessions) == 1);
}

TEST_CASE("chip: strangers do not keep a session alive") {
  const Chip& chip = chip_named("odd");
  Bench b(chip);
  Crowd crowd(b.desk, b.address);
  const uint32_t token = crowd.open(kHost);
  const Time opened = b.desk.now();
  while (b.desk.now() < opened + (chip.config.session_ms - 3) * kMillisecond) {
    crowd.send(kOther, request(net::kStatus, token));
    crowd.send(kHost, request(net::kStatus, token + 1));
    crowd.send(kOther, request(net::kOpen, 0, {1, 2, 3, 4}));
    b.desk.run_for(3 * kMillisecond);
  }
  CHECK(b.desk.chip().session());
  b.desk.run_for(4 * kMillisecond);
  CHECK_FALSE(b.desk.chip().session());
}

TEST_CASE("chip: a map goes to the session's host only, and moves with it") {
  const Chip& chip = chip_named("tiny");
  Bench b(chip, slow_settings(chip));
  Crowd crowd(b.desk, b.address);
  const uint32_t token = crowd.open(kHost);
  const TileMessages tile(chip);
  tile.run(crowd, kHost, token);
  crowd.send(kOther, tile.read(token, 0, 1));
  b.desk.run_for(300 * kMicrosecond);
  CHECK(crowd.frames.size() == 1);
  CHECK(maps(crowd.take(kOther)) == 0);
  crowd.send(kHost, tile.read(token, 0, 1));
  b.desk.run_for(300 * kMicrosecond);
  CHECK(maps(crowd.take(kHost)) == 1);
  CHECK(crowd.header(kOther, request(net::kOpen, token, {1, 2, 3, 4})).flags == net::kOk);
  crowd.send(kHost, tile.read(token, 0, 1));
  b.desk.run_for(300 * kMicrosecond);
  CHECK(maps(crowd.take(kHost)) == 0);
  crowd.send(kOther, tile.read(token, 0, 1));
  b.desk.run_for(300 * kMicrosecond);
  const auto got = crowd.take(kOther);
  REQUIRE(maps(got) == 1);
  // Header of the READ.
  const auto h = net::decode(got.back());
  REQUIRE(h);
  CHECK(h->sequence == 7);
  CHECK(h->token == token);
  CHECK(h->tile == 0);
  CHECK(h->index == 0);
}

TEST_CASE("chip: START says as many chunks as the pixels need") {
  const char* name = GENERATE("tiny", "tiny_min", "odd");
  const Chip& chip = chip_named(name);
  Bench b(chip, slow_settings(chip));
  Crowd crowd(b.desk, b.address);
  const uint32_t token = crowd.open(kHost);
  const TileMessages tile(chip);
  CHECK(crowd.header(kHost, tile.table(token)).flags == net::kOk);
  const net::Bytes good = tile.start(token, 0, tile.chunks());
  const auto per = static_cast<uint32_t>(chip.config.chunk_pairs());
  std::mt19937 random(test_seed());
  // Around all multiples of a chunk that are near 2^n, and any.
  std::vector<uint32_t> counts{1, per - 1, per, per + 1, 65535 * per, 0xffffff};
  for (int bit = 1; bit < 24; ++bit)
    for (uint32_t chunks : {(1u << bit) / per, (1u << bit) / per + 1})
      for (uint32_t more : {0u, 1u, 2u}) counts.push_back(chunks * per + more - 1);
  for (int i = 0; i < 40; ++i) counts.push_back(static_cast<uint32_t>(random()) >> (8 + random() % 16));
  int bad = 0;
  for (const uint32_t pixels : counts) {
    if (pixels == 0 || pixels > 0xffffff) continue;
    const uint32_t right = (pixels + per - 1) / per;
    if (right > 65535) continue;
    for (const uint32_t wrong : {right - 1, right + 1, right ^ 0x8000, right ^ (1u << random() % 16)}) {
      if (wrong == right || wrong == 0 || wrong > 65535 || (pixels + wrong) % 5 != 0) continue;
      net::Bytes m = good;
      net::put32(m, 20, pixels);
      net::put32(m, 24, wrong);
      INFO(name << ": pixels " << pixels << " chunks " << wrong);
      REQUIRE(crowd.header(kHost, m).flags == net::kBadMessage);
      ++bad;
    }
  }
  CHECK(crowd.counter(net::kBadMessages) == static_cast<uint32_t>(bad));
  CHECK(bad > 20);
  // The right ones: a session each, since the tile stays in the row buffer.
  uint32_t now = token;
  for (int i = 0; i < 12; ++i) {
    const uint32_t pixels = counts[static_cast<size_t>(random() % counts.size())];
    const uint32_t right = (pixels + per - 1) / per;
    if (pixels == 0 || pixels > 0xffffff || right > 65535) continue;
    net::Bytes m = good;
    net::put32(m, 4, now);
    net::put32(m, 20, pixels);
    net::put32(m, 24, right);
    INFO(name << ": pixels " << pixels << " chunks " << right);
    REQUIRE(crowd.header(kHost, m).flags == net::kOk);
    CHECK(crowd.header(kHost, request(net::kClose, now)).flags == net::kOk);
    now = crowd.open(kHost);
    CHECK(crowd.header(kHost, tile.table(now)).flags == net::kOk);
  }
}

TEST_CASE("chip: no stranger's message has an answer longer than itself") {
  const Chip& chip = chip_named("odd");
  const bool open = GENERATE(false, true);
  Bench b(chip);
  Crowd crowd(b.desk, b.address);
  uint32_t token = open ? crowd.open(kHost) : 0x12345679;
  int asked = 0, answered = 0;
  for (const uint8_t version : {uint8_t{1}, uint8_t{2}}) {
    for (const size_t length : {16, 20, 143, 144, 175, 176}) {
      for (int type = 0; type <= 13; ++type) {
        if (version == 1 && (length > 20 || type > 5)) continue;
        if (length > 20 && type != net::kInfo && type != net::kCounters) continue;
        if (!open && type == net::kOpen) continue;  // it would open one
        net::Bytes m = request(static_cast<uint8_t>(type == 13 ? 0x7f : type), token, net::Bytes(length - 16));
        m[2] = version;
        crowd.frames.clear();
        crowd.send(kOther, m);
        b.desk.run_for(kMillisecond + 50 * kMicrosecond);
        ++asked;
        INFO("version " << int(version) << " type " << type << " length " << length << " open " << open);
        for (const net::Bytes& reply : crowd.take(kOther)) {
          ++answered;
          CHECK(reply.size() <= m.size());
          CHECK(reply[2] == net::kVersion);
          if (version == 1) CHECK(reply[10] == net::kBadMessage);
          if (reply[3] == (net::kInfo | net::kReply) && length >= net::kInfoRequestBytes && version == 2)
            CHECK(reply.size() == net::kInfoRequestBytes);
        }
        // The session is kept.
        if (open && asked % 16 == 0) CHECK(crowd.flags(kHost, token) & net::kFlagSession);
      }
    }
  }
  CHECK(answered == asked);
}

TEST_CASE("chip: strangers are answered fifteen times at once and once a millisecond, each kind by itself") {
  const Chip& chip = chip_named("odd");
  Bench b(chip);
  Crowd crowd(b.desk, b.address);
  const auto answers = [&](const net::Bytes& frame, int count) {
    crowd.frames.clear();
    for (int i = 0; i < count; ++i) {
      b.desk.send(frame);
      b.desk.run_for(20 * kMicrosecond);
    }
    b.desk.run_for(30 * kMicrosecond);
    return static_cast<int>(crowd.frames.size());
  };
  const net::Bytes arp = net::make_arp_request(kOther, b.address.ip);
  const net::Bytes ping = net::make_icmp_echo(kOther, b.address, 8, net::Bytes(20));
  const net::Bytes status = net::make_udp(kOther, b.address, request(net::kStatus, 1));
  const net::Bytes open = net::make_udp(kHost, b.address, request(net::kOpen, 0, {1, 2, 3, 4}));
  const auto once = [](int n) { return n == 15 || n == 16; };  // a tick in between
  CHECK(once(answers(ping, 30)));
  CHECK(answers(status, 10) <= 1);
  CHECK(once(answers(arp, 30)));
  CHECK(once(answers(open, 30)));
  CHECK(b.desk.chip().session());
  b.desk.run_for(5 * kMillisecond);
  const int later = answers(ping, 30);
  CHECK((later >= 5 && later <= 8));
  b.desk.run_for(3 * kMillisecond);
  crowd.frames.clear();
  const uint32_t limited = crowd.counter(net::kLimited);
  CHECK((limited >= 14 + 9 + 14 + 14 + 22 && limited <= 15 + 10 + 15 + 15 + 25));
  CHECK(crowd.counter(net::kForeign) <= 10);
}

TEST_CASE("chip: a host of version 1 is told") {
  Bench b(chip_named("tiny"), slow_settings(chip_named("tiny")));
  Crowd crowd(b.desk, b.address);
  for (const uint8_t type : {net::kInfo, net::kOpen, net::kStatus}) {
    net::Bytes m = request(type, 0, {1, 2, 3, 4});
    m[2] = 1;
    const net::Bytes reply = crowd.ask(kHost, m);
    CHECK(reply.size() == net::kHeaderBytes);
    CHECK(reply[2] == 2);
    CHECK(reply[3] == (type | net::kReply));
    CHECK(reply[10] == net::kBadMessage);
  }
  CHECK(crowd.counter(net::kBadMessages) == 3);
  CHECK_FALSE(b.desk.chip().session());
}

TEST_CASE("chip: duplex by SET ends with the session") {
  const Chip& chip = chip_named("odd");
  const bool silence = GENERATE(false, true);
  Bench b(chip);
  Crowd crowd(b.desk, b.address);
  uint32_t token = crowd.open(kHost);
  CHECK(crowd.flags(kHost, token) & net::kFlagFullDuplex);

  net::Bytes set = request(net::kSet, token, {0, 0, 0, 1});
  net::put16(set, 14, 0);
  CHECK(crowd.header(kHost, set).flags == net::kOk);
  CHECK_FALSE(crowd.flags(kHost, token) & net::kFlagFullDuplex);
  if (silence) {
    b.desk.run_for((chip.config.session_ms + 1) * kMillisecond);
    CHECK_FALSE(b.desk.chip().session());
  } else {
    CHECK(crowd.header(kHost, request(net::kClose, token)).flags == net::kOk);
  }
  token = crowd.open(kHost);
  CHECK(crowd.flags(kHost, token) & net::kFlagFullDuplex);
}

TEST_CASE("chip: a host that asks without a pause gets its map all the same") {
  const Chip& chip = chip_named("tiny_min");
  Bench b(chip);
  Crowd crowd(b.desk, b.address);
  const uint32_t token = crowd.open(kHost);
  TileMessages tile(chip);
  tile.tile = tile.maker.make(scene::Texture::kRandom, scene::Geometry::kInside, 6, 5, 2);
  tile.run(crowd, kHost, token);
  const auto chunks = static_cast<uint32_t>((30 + chip.config.chunk_cells() - 1) / chip.config.chunk_cells());
  REQUIRE(chunks >= 2);
  crowd.frames.clear();
  crowd.send(kHost, tile.read(token, 0, chunks));
  for (int i = 0; i < 40; ++i) crowd.send(kHost, request(net::kStatus, token));
  b.desk.run_for(2 * kMillisecond);
  const auto got = crowd.take(kHost);
  REQUIRE(maps(got) == static_cast<int>(chunks));
  // After READ's answer a chunk, an answer, a chunk ..
  for (size_t i = 0; i < 2 * chunks; ++i) {
    INFO(i);
    CHECK((got[i][3] == net::kMap) == (i % 2 == 1));
  }
}

TEST_CASE("chip: a transmitter that stands still or finds no gap does not hold the session, nor the chip") {
  const Chip& chip = chip_named("odd");
  const bool carrier = GENERATE(false, true);
  DeskSettings s = settings_for(chip);
  s.half_duplex = carrier;
  Bench b(chip, s);
  Crowd crowd(b.desk, b.address);
  const uint32_t token = crowd.open(kHost);
  const auto stop = [&](bool stopped) {
    if (carrier) {
      b.desk.hold_carrier(stopped);
    } else {
      b.desk.set_tx_clock(!stopped);
    }
  };
  stop(true);
  for (int i = 0; i < 4; ++i) crowd.send(kHost, request(net::kStatus, token));
  b.desk.run_for(kMillisecond);
  CHECK(b.desk.chip().session());
  // Silence, since nothing more is heard; the frame is given up with the session.
  b.desk.run_for((chip.config.session_ms + 3) * kMillisecond);
  CHECK_FALSE(b.desk.chip().session());
  stop(false);
  b.desk.run_for(2 * kMillisecond);
  crowd.frames.clear();
  const uint32_t next = crowd.open(kHost);
  CHECK(next != token);
  CHECK(crowd.flags(kHost, next) & net::kFlagSession);
  if (carrier) {  // mac_tx gives the frames up before the watchdog has to
    CHECK(crowd.counter(net::kTxDeferred) >= 4);
  } else {
    CHECK(crowd.counter(net::kRecovered) >= 1);
  }
  CHECK(b.desk.link().violations() == 0);
}

TEST_CASE("chip: a flood of a stranger's questions costs the session's host little") {
  const char* name = GENERATE("tiny", "tiny_min");
  const Chip& chip = chip_named(name);
  struct Run {
    Time time;
    uint64_t lost, flooded;
  };
  const auto run = [&](const net::Bytes& flood, Time period) {
    Bench b(chip);
    b.flood = flood;
    b.transport.flood_period = period;
    b.run_pair(40, 12);
    CHECK(b.statistics.sessions == 1);
    return Run{b.last_map - b.begun, b.statistics.lost, b.transport.flooded};
  };
  const net::Address address = strapped(chip.address, 0);
  const net::Bytes small = net::make_udp(kOther, address, request(net::kInfo));
  const net::Bytes padded =
      net::make_udp(kOther, address, request(net::kInfo, 0, net::Bytes(net::kInfoRequestBytes - net::kHeaderBytes)));
  const Run quiet = run({}, 0);
  const Time period = kSecond / 57700;
  const struct {
    const char* name;
    const net::Bytes& frame;
    Time period;
    double most;
  } floods[] = {{"57,700 short INFO a second", small, period, 1.3},
                {"short INFO at wire rate", small, 0, 2},
                {"padded INFO at wire rate", padded, 0, 2}};
  for (const auto& f : floods) {
    const Run r = run(f.frame, f.period);
    const double slower = static_cast<double>(r.time) / static_cast<double>(quiet.time);
    std::printf("%s, %s: %llu in %.2f ms, first OPEN to last map %.2f times as long, %llu packets lost (quiet %llu)\n",
                name, f.name, static_cast<unsigned long long>(r.flooded), static_cast<double>(r.time) / kMillisecond,
                slower, static_cast<unsigned long long>(r.lost), static_cast<unsigned long long>(quiet.lost));
    INFO(name << ": " << f.name);
    CHECK(r.flooded > 50);
    CHECK(slower < f.most);
  }
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
