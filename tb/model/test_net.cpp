// SPDX-License-Identifier: Apache-2.0
// The host's side of the link against the model of the chip: the map over the link is the map of the bit-true model,
// whatever happens on the wire, or there is an error that says what happened. All in simulated time.
#include <net/if.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <thread>

#include "core/error.hpp"
#include "golden/control.hpp"
#include "golden/psweep.hpp"
#include "model/link_scene.hpp"
#include "model/simulated_link.hpp"
#include "net/link_engine.hpp"
#include "net/udp_transport.hpp"
#include "plan/planner.hpp"
#include "support/catch.hpp"

using namespace psweep;
using net::Bytes;

namespace {

struct Transfer {
  std::vector<std::vector<golden::MapCell>> cells;
  net::LinkFigures figures;
  net::LinkStatistics statistics;
  int repeated = 0;  // tiles handed out more than once
};

Transfer transfer(SimulatedLink& link, const Scene& scene, const net::LinkOptions& options = {}, double timeout = 10,
                  uint64_t seed = 7) {
  net::Client client(link, timeout, seed);
  const net::Capabilities chip = client.info();
  Transfer out;
  out.cells.resize(scene.plan.tiles.size());
  int highest = -1;
  uint64_t progress = 0;
  out.figures = net::run_link_tiles(
      client, chip, scene.plan.table, static_cast<int>(scene.plan.tiles.size()), options,
      [&](int i) {
        out.repeated += i <= highest;
        highest = std::max(highest, i);
        return scene.tile(i);
      },
      [&](int i, std::vector<golden::MapCell> cells) { out.cells[i] = std::move(cells); },
      [&](uint64_t cells) { progress = cells; });
  out.statistics = client.statistics();
  uint64_t all = 0;
  for (const auto& t : scene.plan.tiles) all += golden::unload_clocks(t.job);
  CHECK(progress == all);
  return out;
}

void check_map(const Scene& scene, const Transfer& t) {
  const auto map = assemble(scene.setup.rig, scene.plan, t.cells);
  REQUIRE(map.data.size() == scene.expected.data.size());
  size_t wrong = 0;
  for (size_t i = 0; i < map.data.size(); ++i) wrong += map.data[i] != scene.expected.data[i];
  CHECK(wrong == 0);
}

std::string failure(const std::function<void()>& call) {
  try {
    call();
  } catch (const net::LinkError& e) {
    return e.what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("a perfect link brings the map of the model, with no packet sent twice", "[net]") {
  net::ArbiterConfig c = small_chip();
  struct Variant {
    int chunk_bytes, row_slots, map_depth, in_flight, pix_bits;
  };
  const auto v = GENERATE(values<Variant>({{90, 0, 0, 2, 8},
                                           {90, 0, 0, 1, 8},
                                           {1408, 0, 0, 2, 8},
                                           {1440, 2, 40, 2, 8},
                                           {90, 2, 0, 2, 8},
                                           {90, 3, 50, 2, 8},
                                           {16, 33, 11, 1, 8},
                                           {61, 5, 64, 2, 9},
                                           {90, 0, 0, 2, 12}}));
  CAPTURE(v.chunk_bytes, v.row_slots, v.map_depth, v.in_flight, v.pix_bits);
  c.chunk_bytes = v.chunk_bytes;
  c.row_slots = v.row_slots;
  c.map_depth = v.map_depth;
  c.engine.pix_bits = v.pix_bits;
  const Scene scene(c);
  REQUIRE(scene.plan.tiles.size() >= 4);
  golden::Arbiter chip(c);
  SimulatedLink link(chip, {}, 1);
  net::LinkOptions options;
  options.in_flight = v.in_flight;
  const Transfer t = transfer(link, scene, options);
  check_map(scene, t);
  CHECK(t.repeated == 0);
  CHECK(t.statistics.lost == 0);
  CHECK(t.statistics.malformed == 0);
  CHECK(t.statistics.foreign == 0);
  CHECK(t.statistics.sessions == 1);
  CHECK(t.statistics.rtt > 0);
  CHECK_FALSE(chip.session_open());
  uint64_t clocks = 0;
  // The row buffer's first pair comes two clocks later than the engine could take it.
  for (const auto& tile : scene.plan.tiles) clocks += golden::engine_clocks(c.engine, tile.job) + net::kFirstPairClocks;
  CHECK(t.figures.engine_clocks == clocks);
  if (v.map_depth == 0) {  // a ring is asked for in pieces, which may overlap
    CHECK(t.statistics.duplicates == 0);
    CHECK(chip.counter(net::kChunksRepeated) == 0);
  }
  CHECK(chip.counter(net::kChunksRefused) == 0);
}

TEST_CASE("faults on the wire: the identical map", "[net]") {
  const net::ArbiterConfig c = small_chip();
  const Scene scene(c);
  const double rate = GENERATE(0.01, 0.1);
  const std::string kind =
      GENERATE(as<std::string>{}, "loss", "duplication", "reordering", "delay", "corruption", "all");
  const bool one_way = kind == "all";
  LinkFaults f;
  if (kind == "loss" || one_way) f.loss = rate;
  if (kind == "duplication" || one_way) f.duplication = rate;
  if (kind == "reordering" || one_way) f.reordering = rate;
  if (kind == "delay" || one_way) f.delay = rate;
  if (kind == "corruption" || one_way) f.corruption = rate;
  uint64_t faults = 0;
  for (uint32_t run = 0; run < 6; ++run) {
    const uint32_t seed = test_seed() * 1000 + run;
    INFO(kind << " " << rate << ", seed " << seed);
    net::ArbiterConfig variant = c;
    if (run % 3 == 1) variant.row_slots = 4, variant.map_depth = 60;
    golden::Arbiter chip(variant);
    SimulatedLink link(chip, f, seed);
    net::LinkOptions options;
    options.in_flight = run % 2 ? 1 : 2;
    const Transfer t = transfer(link, scene, options, 10, seed);
    check_map(scene, t);
    CHECK(t.statistics.malformed == 0);
    CHECK(t.repeated == 0);
    faults += link.dropped + link.corrupted + t.statistics.duplicates + t.statistics.foreign;
  }
  CAPTURE(faults);
  if (kind == "loss" || kind == "corruption" || kind == "all") CHECK(faults > 0);
}

TEST_CASE("40 % of all packets lost", "[net]") {
  const Scene scene(small_chip());
  golden::Arbiter chip(small_chip());
  LinkFaults f;
  f.loss = 0.4;
  SimulatedLink link(chip, f, test_seed());
  const Transfer t = transfer(link, scene);
  check_map(scene, t);
  CHECK(link.dropped > link.sent / 4);
  CHECK(t.statistics.resent > 0);
}

TEST_CASE("the link is kept full, and so is the engine", "[net]") {
  const net::ArbiterConfig c;  // the 256x130 tile at 166 MHz
  golden::Arbiter chip(c);
  chip.set_compute([](const golden::TileJob& t, const auto&, const auto&, const auto&) {
    return golden::TileResult{std::vector<golden::MapCell>(golden::unload_clocks(t), {0, 0, 0, 1}), 0};
  });
  golden::TileJob job;
  job.tile_cols = 256, job.tile_rows = 130, job.win_cols = 340, job.win_rows = 144, job.planes = 1;
  const golden::TileInput tile{job, golden::Pixels(340, 144), golden::Pixels(340, 144)};
  const int count = 20, in_flight = GENERATE(1, 2);
  const double sweep = GENERATE(0.0, 0.07);  // the second: 301 planes take longer
  CAPTURE(in_flight, sweep);
  chip.set_sweep_time(sweep);
  SimulatedLink link(chip, {}, 1);
  net::Client client(link, 10, 1);
  net::LinkOptions options;
  options.in_flight = in_flight;
  int received = 0;
  const net::LinkFigures f = net::run_link_tiles(
      client, client.info(), {golden::PlaneEntry{}}, count, options, [&](int) { return tile; },
      [&](int, const std::vector<golden::MapCell>& cells) { received += cells.size() == 256 * 130; }, [](uint64_t) {});
  CHECK(received == count);
  CHECK(client.statistics().resent == 0);
  CHECK(client.statistics().lost == 0);
  CHECK(f.cell_bytes == uint64_t{count} * 256 * 130 * 4);
  const double down = 8e-6 * static_cast<double>(f.cell_bytes) / f.seconds;
  // Of the time from the first launch to the last map, without the first upload and the last download.
  const double load = 340 * 144 / 166e6, work = count * (load + sweep);
  const double busy = work / (f.seconds - 0.0083 - 0.0114);
  CAPTURE(down, busy, f.seconds);
  // With the real chip: tb/chip/test_goodput.cpp. Here RELEASE and READ, one after the other, wait behind rows.
  if (in_flight == 2 && sweep == 0) CHECK(down > 80);
  if (in_flight == 2 && sweep > 0) CHECK(busy > 0.99);
  if (in_flight == 1) CHECK(down < 60);
}

TEST_CASE("a pulled cable: the transfer goes on", "[net]") {
  const Scene scene(small_chip());
  golden::Arbiter chip(small_chip());
  chip.set_sweep_time(0.02);
  const double begin = GENERATE(0.0, 0.003, 0.011, 0.028, 0.05);
  const double length = GENERATE(0.5, 4.0);  // below the chip's silence timer
  CAPTURE(begin, length);
  SimulatedLink link(chip, {}, 1);
  link.unplugged = {{begin, begin + length}};
  const Transfer t = transfer(link, scene);
  check_map(scene, t);
  CHECK(link.dropped > 0);
  CHECK(link.now() < begin + length + 3);
  CHECK(t.statistics.sessions == 1);
}

TEST_CASE("a pulled cable for longer than the chip's silence timer: new session, only the missing tiles", "[net]") {
  const Scene scene(small_chip());
  golden::Arbiter chip(small_chip());
  chip.set_sweep_time(0.02);
  SimulatedLink link(chip, {}, 1);
  link.unplugged = {{0.07, 8.5}};
  const Transfer t = transfer(link, scene);
  check_map(scene, t);
  CHECK(t.statistics.sessions == 2);
  CHECK(chip.counter(net::kTimeouts) == 1);
  CHECK(t.repeated >= 1);
  CHECK(t.repeated <= 3);
}

TEST_CASE("a chip that is reset: new session, only the missing tiles", "[net]") {
  const Scene scene(small_chip());
  golden::Arbiter chip(small_chip());
  chip.set_sweep_time(0.02);
  SimulatedLink link(chip, {}, 1);
  link.resets = GENERATE(values<std::vector<double>>({{0.001}, {0.009}, {0.02}, {0.045}, {0.03, 0.031, 0.07, 0.11}}));
  const size_t resets = link.resets.size();
  const Transfer t = transfer(link, scene);
  check_map(scene, t);
  CHECK(t.statistics.sessions >= 2);
  CHECK(t.statistics.sessions <= 1 + resets);
  CHECK(t.repeated <= static_cast<int>(3 * resets));
}

TEST_CASE("resets, pulled cables and faults together", "[net]") {
  const Scene scene(small_chip());
  LinkFaults f;
  f.loss = f.duplication = f.reordering = f.delay = 0.05;
  int several = 0;
  for (uint32_t run = 0; run < 8; ++run) {
    const uint32_t seed = test_seed() * 1000 + run;
    INFO("seed " << seed);
    std::mt19937 random(seed);
    auto moment = [&random] { return 1e-4 * static_cast<double>(random() % 3000); };
    golden::Arbiter chip(small_chip());
    chip.set_sweep_time(0.02);
    SimulatedLink link(chip, f, seed);
    link.resets = {moment(), moment()};
    std::sort(link.resets.begin(), link.resets.end());
    const double pulled = moment();
    link.unplugged = {{pulled, pulled + 6}};
    const Transfer t = transfer(link, scene, {}, 10, seed);
    check_map(scene, t);
    several += t.statistics.sessions > 1;
  }
  CHECK(several > 4);
}

TEST_CASE("nobody answers: an error that says who, what and for how long", "[net]") {
  const Scene scene(small_chip());
  golden::Arbiter chip(small_chip());
  SimulatedLink link(chip, {}, 1);
  SECTION("from the start") {
    link.unplugged = {{0, 1e9}};
    const std::string text = failure([&] { transfer(link, scene, {}, 3); });
    CHECK_THAT(text, contains("udp://simulated:20563: no valid answer for 3.") && contains("INFO"));
    CHECK(link.now() < 4);
  }
  SECTION("in the middle") {
    chip.set_sweep_time(0.02);
    link.unplugged = {{0.05, 1e9}};
    const std::string text = failure([&] { transfer(link, scene, {}, 3); });
    CHECK_THAT(text, contains("udp://simulated:20563: no valid answer for 3.") && contains("map of tile"));
    CHECK(link.now() < 5.5);
  }
}

TEST_CASE("another host has the session", "[net]") {
  const net::ArbiterConfig c = small_chip();
  const Scene scene(c);
  golden::Arbiter chip(c);
  SimulatedLink link(chip, {}, 1);
  net::Header h;
  h.type = net::kOpen;
  Bytes open = net::encode(h);
  net::append32(open, 0x12345678);
  const auto opened = link.foreign(open);
  REQUIRE(opened.size() == 1);
  REQUIRE(opened[0][10] == net::kOk);
  SECTION("and keeps it") {
    double last = 0;
    link.meddle = [&](double now, std::vector<Bytes>&) {
      if (now < last + 1) return;
      last = now;
      h.type = net::kStatus;
      h.token = net::get32(opened[0], 4);
      const auto reply = chip.message(net::encode(h), 2);
      CHECK(reply.size() == 1);
    };
    const std::string text = failure([&] { transfer(link, scene); });
    CHECK_THAT(text, contains("another host has the session"));
    // As long as --link-timeout, which is more than a silent host's session would last here (5 s).
    CHECK(link.now() > 9.9);
    CHECK(link.now() < 12);
  }
  SECTION("and falls silent") {
    const Transfer t = transfer(link, scene);
    check_map(scene, t);
    CHECK(link.now() > 4.9);
    CHECK(link.now() < 7);
  }
}

TEST_CASE("a tile that fails is an error with its number and the engine's bits", "[net]") {
  const net::ArbiterConfig c = small_chip();
  Scene scene(c);
  golden::Arbiter chip(c);
  SimulatedLink link(chip, {}, 1);
  SECTION("refused") {
    scene.plan.tiles[2].job.tile_cols = c.engine.plane_cols + 1;
    const std::string text = failure([&] { transfer(link, scene); });
    CHECK_THAT(text, contains("tile 2") && contains("config") && contains("3 times"));
    CHECK(chip.counter(net::kSessions) == 3);
  }
  SECTION("samples outside the window") {
    const size_t tile = GENERATE(0, 2);
    scene.plan.tiles[tile].job.tx_left += 3 << golden::kPosFrac;
    const std::string text = failure([&] { transfer(link, scene); });
    CHECK_THAT(text, contains("window") && contains("samples outside the loaded window") && contains("3 times"));
    CHECK(chip.counter(net::kSessions) >= 3);
  }
}

namespace {

// Between client and link: what either sends may be changed or dropped.
struct Between : net::Transport {
  net::Transport& link;
  std::function<bool(Bytes&)> up, down;  // false: it is lost
  std::optional<net::Largest> most;
  explicit Between(net::Transport& l) : link(l) {}
  void send(const Bytes& m) override {
    Bytes changed = m;
    if (!up || up(changed)) link.send(changed);
  }
  std::optional<Bytes> receive(double timeout) override {
    const double until = link.now() + timeout;
    for (;;) {
      auto m = link.receive(std::max(0.0, until - link.now()));
      if (!m || !down || down(*m)) return m;
    }
  }
  double now() override { return link.now(); }
  std::string peer() const override { return link.peer(); }
  std::optional<net::Largest> largest() const override { return most; }
};

Transfer transfer_between(Between& link, const Scene& scene, double timeout = 10,
                          const std::function<void(int)>& on_tile = nullptr) {
  net::Client client(link, timeout, 7);
  const net::Capabilities chip = client.info();
  Transfer out;
  out.cells.resize(scene.plan.tiles.size());
  out.figures = net::run_link_tiles(
      client, chip, scene.plan.table, static_cast<int>(scene.plan.tiles.size()), {},
      [&](int i) { return scene.tile(i); },
      [&](int i, std::vector<golden::MapCell> cells) {
        out.cells[static_cast<size_t>(i)] = std::move(cells);
        if (on_tile) on_tile(i);
      },
      [](uint64_t) {});
  out.statistics = client.statistics();
  return out;
}

}  // namespace

TEST_CASE("a tile that fails is sent again in a new session, and counted", "[net]") {
  const net::ArbiterConfig c = small_chip();
  const Scene scene(c);
  golden::Arbiter chip(c);
  SimulatedLink link(chip, {}, 1);
  Between between(link);
  const int failures = GENERATE(1, 2);
  SECTION("refused or dropped") {
    // On its way START gets a number of columns that the engine refuses: of the third tile, and of the first one of the
    // session that follows.
    between.up = [&](Bytes& m) {
      const uint32_t session = chip.counter(net::kSessions), tile = net::get16(m, 12);
      const bool spoilt = (session == 1 && tile == 2) || (failures == 2 && session == 2 && tile == 0);
      if (m[3] == net::kStart && spoilt) net::put32(m, net::kHeaderBytes + 12, 4095);
      return true;
    };
    const Transfer t = transfer_between(between, scene);
    check_map(scene, t);
    CHECK(t.figures.tiles_repeated == static_cast<uint64_t>(failures));
    CHECK(t.figures.repeated_by_error[0] == static_cast<uint64_t>(failures));  // config
    CHECK(t.statistics.sessions == static_cast<uint64_t>(1 + failures));
    CHECK(t.figures.tiles_unconfirmed == 0);
  }
  SECTION("a map that ends with another number of cells than the tile has") {
    between.down = [&](Bytes& m) {
      const uint32_t session = chip.counter(net::kSessions);
      const int type = m[3] & 0x7f;
      const bool status = type >= net::kStatus && type <= net::kRelease && m.size() > net::kHeaderBytes + 20;
      if (status && session <= static_cast<uint32_t>(failures) &&
          (net::get16(m, net::kHeaderBytes + 2) & net::kFlagMapComplete) != 0)
        net::put32(m, net::kHeaderBytes + 16, net::get32(m, net::kHeaderBytes + 16) ^ 8);
      return true;
    };
    const Transfer t = transfer_between(between, scene);
    check_map(scene, t);
    CHECK(t.figures.tiles_repeated == static_cast<uint64_t>(failures));
  }
  SECTION("samples outside the window that do not come again") {
    int left = failures;
    chip.set_compute([&](const golden::TileJob& t, const std::vector<golden::PlaneEntry>& table,
                         const golden::Pixels& l, const golden::Pixels& r) {
      auto result = golden::run_tile(c.engine, t, table, l, r);
      if (left > 0) {
        --left;
        result.window_errors = 3;
      }
      return result;
    });
    const Transfer t = transfer_between(between, scene);
    check_map(scene, t);
    CHECK(t.figures.tiles_repeated == static_cast<uint64_t>(failures));
    CHECK(t.figures.repeated_by_error[4] == static_cast<uint64_t>(failures));  // window
  }
}

TEST_CASE("a finished map is not thrown away: the chip is gone when it is said goodbye", "[net]") {
  const Scene scene(small_chip());
  golden::Arbiter chip(small_chip());
  SimulatedLink link(chip, {}, 1);
  Between between(link);
  const int last = static_cast<int>(scene.plan.tiles.size()) - 1;
  bool gone = false;
  double finished = 0;
  between.up = [&](Bytes&) { return !gone; };
  between.down = [&](Bytes&) { return !gone; };
  SECTION("after the last tile was accepted") {
    const Transfer t = transfer_between(between, scene, 10, [&](int i) {
      gone = i == last;
      finished = link.now();
    });
    check_map(scene, t);
    CHECK(t.figures.counters_after.empty());
    CHECK(t.figures.tiles_unconfirmed == 0);
    CHECK(link.now() < finished + 3);
  }
  SECTION("when all cells were there, but not the word that no error came up") {
    // Nothing but map packets of the last tile comes through once its START was answered.
    int started = -1;
    between.down = [&](Bytes& m) {
      if (m[3] == (net::kStart | net::kReply) && m[10] == net::kOk) started = static_cast<int>(net::get16(m, 12));
      const bool complete = m.size() > net::kHeaderBytes + 4 && m[3] != net::kMap &&
                            (net::get16(m, net::kHeaderBytes + 2) & net::kFlagMapComplete) != 0 &&
                            net::get16(m, net::kHeaderBytes + 6) == static_cast<uint32_t>(last);
      gone = gone || complete;
      return m[3] == net::kMap || !gone;
    };
    between.up = nullptr;
    const Transfer t = transfer_between(between, scene, 3);
    CHECK(started == last);
    CHECK(gone);
    check_map(scene, t);
    CHECK(t.figures.tiles_unconfirmed == 1);
    CHECK(t.figures.counters_after.empty());
  }
  SECTION("one tile earlier it is an error") {
    CHECK_THAT(failure([&] { transfer_between(between, scene, 3, [&](int i) { gone = i == last - 1; }); }),
               contains("no valid answer for 3."));
  }
}

TEST_CASE("a chip of another version of the protocol is named, and so is this host's", "[net]") {
  struct Other : net::Transport {
    uint8_t version = 1;
    int answers = 1000;
    double time = 0;
    std::vector<Bytes> queue;
    void send(const Bytes& m) override {
      if (answers-- <= 0) return;
      Bytes reply(m.begin(), m.begin() + net::kHeaderBytes);
      reply[2] = version;
      reply[3] |= net::kReply;
      reply[10] = net::kBadMessage;
      if (version == 1) reply.resize(net::kHeaderBytes + 4 * net::kStatusWords + 4);  // version 1: the status block
      queue.push_back(reply);
    }
    std::optional<Bytes> receive(double timeout) override {
      if (!queue.empty()) {
        const Bytes m = queue.back();
        queue.pop_back();
        return m;
      }
      time += timeout;
      return std::nullopt;
    }
    double now() override { return time; }
    std::string peer() const override { return "other"; }
  } other;
  SECTION("an older chip") {
    net::Client client(other, 5, 1);
    const std::string text = failure([&] { client.info(); });
    CHECK_THAT(text, contains("udp://other: the chip speaks version 1 of the protocol, this host version 2") &&
                         contains("newer contents"));
    CHECK(other.time < 0.5);
  }
  SECTION("a newer chip") {
    other.version = 3;
    net::Client client(other, 5, 1);
    CHECK_THAT(failure([&] { client.info(); }),
               contains("the chip speaks version 3 of the protocol, this host version 2") && contains("newer program"));
  }
  SECTION("one packet of another version proves nothing") {
    other.answers = 1;
    net::Client client(other, 5, 1);
    CHECK_THAT(failure([&] { client.info(); }), contains("no valid answer for 5.") && contains("version 1"));
  }
  SECTION("an old host gets a header of this version that says bad message") {
    golden::Arbiter chip(small_chip());
    net::Header h;
    h.type = net::kInfo;
    h.sequence = 77;
    Bytes ask = net::encode(h);
    ask[2] = 1;
    const auto reply = chip.message(ask, 1);
    REQUIRE(reply.size() == 1);
    CHECK(reply[0].size() == net::kHeaderBytes);
    CHECK(reply[0][2] == 2);
    CHECK(reply[0][3] == (net::kInfo | net::kReply));
    CHECK(reply[0][10] == net::kBadMessage);
    CHECK(net::get16(reply[0], 8) == 77);
  }
}

TEST_CASE("requests that are answered at length are as long as their answers", "[net]") {
  golden::Arbiter chip(small_chip());
  SimulatedLink link(chip, {}, 1);
  Between between(link);
  std::map<uint8_t, size_t> asked, answered;
  between.up = [&](Bytes& m) {
    asked[m[3]] = m.size();
    return true;
  };
  between.down = [&](Bytes& m) {
    answered[m[3] & 0x7f] = m.size();
    return true;
  };
  net::Client client(between, 2, 3);
  const auto capabilities = client.info();
  client.counters();
  client.open(capabilities);
  for (const uint8_t type : {net::kInfo, net::kCounters, net::kOpen}) {
    INFO(net::type_name(type));
    CHECK(asked.at(type) >= answered.at(type));
  }
  CHECK(answered[net::kOpen] == net::kHeaderBytes);
  CHECK(asked.count(net::kStatus) == 1);
  client.close();
  CHECK_FALSE(chip.session_open());
}

TEST_CASE("a host that gets another address takes its session along", "[net]") {
  const Scene scene(small_chip());
  golden::Arbiter chip(small_chip());
  SimulatedLink link(chip, {}, 1);
  Between between(link);
  int tiles = 0;
  const Transfer t = transfer_between(between, scene, 10, [&](int) {
    if (++tiles == 2) link.host = 9;
  });
  check_map(scene, t);
  CHECK(t.statistics.sessions == 2);
  CHECK(chip.counter(net::kTimeouts) == 0);
  CHECK(link.now() < 2);  // the silence timer would take 5 s
  CHECK_FALSE(chip.session_open());
}

TEST_CASE("seeds are not drawn twice", "[net]") {
  std::set<uint64_t> seeds;
  for (int i = 0; i < 1000; ++i) seeds.insert(net::fresh_seed());
  CHECK(seeds.size() == 1000);
}

TEST_CASE("an MTU that is too small is named at once", "[net]") {
  net::ArbiterConfig c = small_chip();
  c.chunk_bytes = 1408;
  const Scene scene(c);
  golden::Arbiter chip(c);
  SimulatedLink link(chip, {}, 1);
  Between between(link);
  SECTION("the interface's, before anything large is sent") {
    between.most = net::Largest{1372, "interface psweep0 has an MTU of 1400"};
    CHECK_THAT(failure([&] { transfer_between(between, scene); }),
               contains("interface psweep0 has an MTU of 1400, but packets of this chip need 1452"));
    CHECK(link.now() < 0.1);
  }
  SECTION("enough of it") {
    between.most = net::Largest{1424, "interface psweep0 has an MTU of 1452"};
    check_map(scene, transfer_between(between, scene));
  }
  SECTION("of a way that has shrunk in the middle of the run") {
    const std::string text = failure([&] {
      transfer_between(between, scene, 10, [&](int) {
        between.most = net::Largest{1300, "the way to the chip has an MTU of 1328"};
      });
    });
    CHECK_THAT(text, contains("the way to the chip has an MTU of 1328, but this WRITE needs 1452"));
    CHECK(link.now() < 1);
  }
  SECTION("of a way that cuts packets all the same: the chip counts the pieces") {
    between.up = [&](Bytes& m) {
      if (m.size() <= 1300) return true;
      chip.count(net::kIpFragment);
      chip.count(net::kIpFragment);
      return false;
    };
    const std::string text = failure([&] { transfer_between(between, scene); });
    CHECK_THAT(text, contains("fragments (ip_fragment)") && contains("MTU"));
    CHECK(link.now() < 12);
  }
}

// The kernel's word for it, in a network namespace of this thread where the loopback interface has a small MTU.
TEST_CASE("the MTU of a real interface is named", "[net]") {
  std::string skipped, largest, error;
  size_t payload = 0;
  std::thread([&] {
    if (::unshare(CLONE_NEWNET) != 0) {
      skipped = "no right to make a network namespace";
      return;
    }
    const int s = ::socket(AF_INET, SOCK_DGRAM, 0);
    ifreq r{};
    std::string("lo").copy(r.ifr_name, sizeof r.ifr_name - 1);
    r.ifr_mtu = 1400;
    bool good = ::ioctl(s, SIOCSIFMTU, &r) == 0;
    r.ifr_flags = IFF_UP | IFF_RUNNING;
    good = good && ::ioctl(s, SIOCSIFFLAGS, &r) == 0;
    ::close(s);
    if (!good) {
      skipped = "no right to set up an interface";
      return;
    }
    const auto transport = net::connect_udp({"127.0.0.1", 20563});
    if (const auto l = transport->largest()) {
      largest = l->why;
      payload = l->payload;
    }
    transport->send(Bytes(1424));
    error = transport->complaint();
  }).join();
  if (!skipped.empty()) {
    std::printf("SKIPPED: %s\n", skipped.c_str());
    SUCCEED();
    return;
  }
  CHECK(largest == "interface lo has an MTU of 1400");
  CHECK(payload == 1372);
  CHECK_THAT(error, contains("too long"));  // not sent in pieces
}

TEST_CASE("an older session's errors are not ours", "[net]") {
  const net::ArbiterConfig c = small_chip();
  const Scene good(c);
  Scene bad(c);
  golden::Arbiter chip(c);
  SimulatedLink link(chip, {}, 1);
  bad.plan.tiles[0].job.tx_left += 3 << golden::kPosFrac;
  CHECK_THAT(failure([&] { transfer(link, bad); }), contains("window"));
  check_map(good, transfer(link, good));
}

TEST_CASE("foreign, stale and malformed packets are counted, not believed", "[net]") {
  const net::ArbiterConfig c = small_chip();
  const Scene scene(c);
  golden::Arbiter chip(c);
  chip.set_sweep_time(0.005);
  SimulatedLink link(chip, {}, 1);
  std::mt19937 random(test_seed());
  // Somebody who sees nothing of the traffic, but knows the protocol and the chip; he cannot know the token.
  uint64_t thrown = 0;
  double last = 0;
  link.meddle = [&](double now, std::vector<Bytes>& extra) {
    if (now < last + 20e-6) return;
    last = now;
    for (int i = 0; i < 3; ++i) {
      net::Header h;
      const uint8_t types[] = {net::kMap,
                               net::kWrite | net::kReply,
                               net::kStatus | net::kReply,
                               net::kRead | net::kReply,
                               net::kStart | net::kReply,
                               static_cast<uint8_t>(random())};
      h.type = types[random() % 6];
      h.token = static_cast<uint32_t>(random());
      h.sequence = static_cast<uint16_t>(random());
      h.flags = static_cast<uint8_t>(random() % 6);
      h.tile = static_cast<uint16_t>(random() % 4);
      h.index = static_cast<uint16_t>(random() % 10);
      Bytes m = net::encode(h);
      m.resize(net::kHeaderBytes + (random() % 2 ? 88 : random() % 200));
      for (size_t k = net::kHeaderBytes; k < m.size(); ++k) m[k] = static_cast<uint8_t>(random());
      if (random() % 8 == 0) m.resize(random() % net::kHeaderBytes);
      extra.push_back(m);
      ++thrown;
    }
  };
  const Transfer t = transfer(link, scene);
  check_map(scene, t);
  CHECK(thrown > 1000);
  CHECK(t.statistics.malformed + t.statistics.foreign >= thrown / 2);
}

TEST_CASE("100,000 random and mutated packets: an identical or refused transfer, never a crash or a hang", "[net]") {
  const net::ArbiterConfig c = small_chip();
  const Scene scene(c);
  std::mt19937 random(test_seed());
  uint64_t thrown = 0;
  int finished = 0, refused = 0;
  // Mutations of true replies with true tokens: more than the checksums of a real network let through, so a wrong cell
  // may be believed; but nothing may be read or written outside, and it must end.
  while (thrown < 100000) {
    golden::Arbiter chip(c);
    chip.set_sweep_time(0.002);
    SimulatedLink link(chip, {}, static_cast<uint32_t>(random()));
    net::Client client(link, 2, random());
    const net::Capabilities capabilities = client.info();
    Bytes latest;
    struct Spy : net::Transport {
      SimulatedLink& link;
      std::mt19937& random;
      uint64_t& thrown;
      Bytes latest;
      Spy(SimulatedLink& l, std::mt19937& r, uint64_t& t) : link(l), random(r), thrown(t) {}
      void send(const Bytes& m) override { link.send(m); }
      double now() override { return link.now(); }
      std::string peer() const override { return link.peer(); }
      std::optional<Bytes> receive(double timeout) override {
        if (random() % 2 == 0 && !latest.empty()) {
          ++thrown;
          Bytes m = latest;
          switch (random() % 5) {
            case 0:
              m.resize(random() % (m.size() + 1));
              break;
            case 1:
              m.resize(random() % 1600, static_cast<uint8_t>(random()));
              break;
            case 2:
              m[random() % std::min<size_t>(m.size(), 16)] = static_cast<uint8_t>(random());
              break;
            case 3:
              for (auto& b : m) b = static_cast<uint8_t>(random());
              break;
            default:
              for (int i = 0; i < 4; ++i) m[random() % m.size()] ^= static_cast<uint8_t>(1 << random() % 8);
          }
          return m;
        }
        auto m = link.receive(timeout);
        if (m && !m->empty()) latest = *m;
        return m;
      }
    } spy(link, random, thrown);
    net::Client fuzzed(spy, 2, random());
    try {
      net::run_link_tiles(
          fuzzed, capabilities, scene.plan.table, static_cast<int>(scene.plan.tiles.size()), {},
          [&](int i) { return scene.tile(i); }, [](int, const std::vector<golden::MapCell>&) {}, [](uint64_t) {});
      ++finished;
    } catch (const net::LinkError&) {
      ++refused;
    }
    REQUIRE(link.now() < 600);
  }
  CAPTURE(finished, refused);
  CHECK(finished + refused > 0);
  CHECK(thrown >= 100000);
}

TEST_CASE("capabilities that contradict themselves are not believed", "[net]") {
  const net::ArbiterConfig c = small_chip();
  golden::Arbiter chip(c);
  net::Header h;
  h.type = net::kInfo;
  Bytes ask = net::encode(h);
  ask.resize(net::kInfoRequestBytes);
  const auto reply = chip.message(ask, 1);
  REQUIRE(reply.size() == 1);
  std::vector<uint32_t> words;
  for (size_t at = net::kHeaderBytes; at < reply[0].size(); at += 4) words.push_back(net::get32(reply[0], at));
  const auto good = net::parse_info(words);
  REQUIRE(good.has_value());
  CHECK(good->config.engine.planes == 16);
  CHECK(good->config.chunk_pairs() == 45);
  CHECK(good->config.row_slots == c.slots());
  CHECK(good->config.map_depth == 17 * 11);
  CHECK(good->mac == 0x020000000001);
  net::ArbiterConfig built = c;
  built.row_slots = c.slots();
  built.map_depth = 17 * 11;
  CHECK(net::same_capabilities(good->config, built));
  for (const int word : {0, 1, 5, 6, 7, 10, 11, 13, 16, 17, 18, 19, 20, 21, 22, 23, 24, 26}) {
    INFO("word " << word);
    auto w = words;
    w[word] = 0xffffffff;
    CHECK_FALSE(net::parse_info(w).has_value());
    w[word] = 0;
    CHECK_FALSE(net::parse_info(w).has_value());
  }
  words.pop_back();
  CHECK_FALSE(net::parse_info(words).has_value());
}

TEST_CASE("addresses on the command line", "[net]") {
  CHECK(net::parse_endpoint("--engine", "udp://10.0.0.2").host == "10.0.0.2");
  CHECK(net::parse_endpoint("--engine", "udp://10.0.0.2").port == net::kUdpPort);
  CHECK(net::parse_endpoint("--engine", "udp://rover.local:1234").port == 1234);
  for (const char* text : {"udp://", "udp://:5", "udp://a:", "udp://a:0", "udp://a:65536", "udp://a:1x", "tcp://a", "a",
                           "udp://a/b", "udp://a:123456"}) {
    INFO(text);
    CHECK_THROWS_AS(net::parse_endpoint("--engine", text), InputError);
  }
}

TEST_CASE("the client believes an answer only if every field fits", "[net]") {
  const net::ArbiterConfig c = small_chip();
  golden::Arbiter chip(c);
  SimulatedLink link(chip, {}, 1);
  net::Client client(link, 2, 3);
  client.open(client.info());
  // An answer held back: sent by the chip, not yet seen by the client.
  struct Capture : net::Transport {
    SimulatedLink& link;
    Bytes latest;
    explicit Capture(SimulatedLink& l) : link(l) {}
    void send(const Bytes& m) override {
      latest = m;
      link.send(m);
    }
    std::optional<Bytes> receive(double timeout) override { return link.receive(timeout); }
    double now() override { return link.now(); }
    std::string peer() const override { return link.peer(); }
  } capture(link);
  client.close();
  net::Client spied(capture, 2, 4);
  spied.open(spied.info());

  spied.send(net::kRelease, 5, 0);
  const auto reply = link.receive(1);
  REQUIRE(reply.has_value());
  auto refused = [&](size_t at, uint8_t flip) {
    Bytes m = *reply;
    m[at] ^= flip;
    return !spied.take(m).has_value();
  };
  for (const size_t at : {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 12, 13, 14, 15}) {  // 10: code, 11: not used
    INFO("byte " << at);
    CHECK(refused(at, 0x04));
  }
  CHECK(refused(10, 0x20));
  for (const size_t size : {0ul, 15ul, 16ul, reply->size() - 4, reply->size() + 4, reply->size() - 1}) {
    INFO("size " << size);
    Bytes m = *reply;
    m.resize(size);
    CHECK_FALSE(spied.take(m).has_value());
  }
  CHECK(spied.take(*reply).has_value());
  CHECK_FALSE(spied.take(*reply).has_value());  // once only
  CHECK(spied.statistics().duplicates == 1);

  spied.send(net::kRead, 3, 2, net::read_payload(4, 0));  // chunks 2 .. 5 of tile 3
  net::Header h = *net::decode(capture.latest);
  h.type = net::kMap;
  auto believed = [&](const net::Header& header, size_t bytes) {
    Bytes m = net::encode(header);
    m.resize(m.size() + bytes, 0);
    return spied.take(m).has_value();
  };
  const size_t full = static_cast<size_t>(c.chunk_cells()) * c.cell_bytes();
  for (uint16_t index = 0; index < 9; ++index) {
    INFO("chunk " << index);
    net::Header map = h;
    map.index = index;
    CHECK(believed(map, full) == (index >= 2 && index <= 5));
  }
  CHECK(believed(h, c.cell_bytes()));
  CHECK_FALSE(believed(h, 0));
  CHECK_FALSE(believed(h, full + c.cell_bytes()));
  CHECK_FALSE(believed(h, full - 1));
  net::Header other = h;
  other.token ^= 1;
  CHECK_FALSE(believed(other, full));
  other = h;
  other.tile ^= 1;
  CHECK_FALSE(believed(other, full));
  other = h;
  other.sequence ^= 0x4000;
  CHECK_FALSE(believed(other, full));
}

TEST_CASE("cells that cannot be are not believed", "[net]") {
  net::ArbiterConfig c = small_chip();  // 1 + 4 + 8 + 13 bits in 4 bytes
  golden::TileJob job;
  job.planes = 9;
  job.threshold = 100;
  std::vector<golden::MapCell> cells(3);
  auto one = [&](uint64_t word, size_t first) {
    const Bytes b = {static_cast<uint8_t>(word >> 24), static_cast<uint8_t>(word >> 16),
                     static_cast<uint8_t>(word >> 8), static_cast<uint8_t>(word)};
    return net::decode_cells(c, job, b, first, cells);
  };
  golden::MapCell cell;
  cell.plane = 8, cell.frac = 77, cell.v = 5000;
  CHECK(one(net::pack_wire_cell(c.engine, cell), 2));
  CHECK(cells[2] == cell);
  CHECK_FALSE(one(net::pack_wire_cell(c.engine, cell), 3));
  cell.plane = 9;
  CHECK_FALSE(one(net::pack_wire_cell(c.engine, cell), 0));
  CHECK_FALSE(one(uint64_t{1} << 26, 0));
  CHECK(cells[0] == golden::MapCell{});
}
