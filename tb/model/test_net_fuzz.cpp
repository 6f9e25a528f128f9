// SPDX-License-Identifier: Apache-2.0
// The host's parser against rubbish: packets that are random, cut, lengthened, mutated, old, or forged come between
// those of the modelled chip while a job runs.
//   Damaged : nothing of it says anything about a chunk in a form that the chip would send: the identical map, without
//             an error
//   Forged  : answers to the host's own latest questions, with its token, but any content - all but cells of the map,
//             which nothing could tell from true ones: the identical map, or an error that says what happened
//   Cells   : forged maps as well: some map or an error
//   Never   : a crash, a job without end (simulated time and packets are limited), an error without the chip's name
//   Number  : PSWEEP_FUZZ_PACKETS (100000) over the three
// Run it under the sanitizers with the preset `dev`.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <map>
#include <memory>
#include <random>
#include <string>

#include "contract/registers.hpp"
#include "model/link_scene.hpp"
#include "model/simulated_link.hpp"
#include "net/link_engine.hpp"
#include "support/catch.hpp"

using namespace psweep;
using net::Bytes;

namespace {

int64_t packets_wanted() {
  const char* text = std::getenv("PSWEEP_FUZZ_PACKETS");
  return text ? std::atoll(text) : 100000;
}

struct Endless : std::runtime_error {
  using std::runtime_error::runtime_error;
};

enum class Malice { kDamaged, kForged, kCells };

// Between the client and the simulated wire.
class HostileTransport : public net::Transport {
 public:
  HostileTransport(net::Transport& wire, const net::ArbiterConfig& chip, Malice malice, uint32_t seed)
      : wire_(wire), chip_(chip), malice_(malice), random_(seed) {}

  int64_t thrown = 0, limit = 400;  // then peace: whatever they did must not last
  std::map<std::string, int64_t> classes;

  void send(const Bytes& m) override {
    asked_.push_back(m);
    if (asked_.size() > 24) asked_.pop_front();
    wire_.send(m);
  }
  std::optional<Bytes> receive(double timeout_s) override {
    if (wire_.now() > 3000 || ++calls_ > 3000000) throw Endless("the job does not end");
    // The goodbye comes after the limit.
    const bool goodbye = !asked_.empty() && asked_.back()[3] == net::kClose && goodbyes_ < 20;
    if ((thrown < limit || goodbye) && !one_in(5)) {
      goodbyes_ += goodbye;
      if (auto m = rubbish()) {
        ++thrown;
        return m;
      }
    }
    auto m = wire_.receive(timeout_s);
    if (m) {
      heard_.push_back(*m);
      if (heard_.size() > 200) heard_.pop_front();
    }
    return m;
  }
  double now() override { return wire_.now(); }
  std::string peer() const override { return wire_.peer(); }

 private:
  int below(int n) { return static_cast<int>(random_() % static_cast<uint32_t>(n)); }
  bool one_in(int n) { return below(n) == 0; }
  uint8_t any() { return static_cast<uint8_t>(random_()); }
  Bytes& fill(Bytes& m, size_t from) {
    for (size_t i = from; i < m.size(); ++i) m[i] = any();
    return m;
  }
  std::optional<Bytes> named(const char* name, Bytes m) {
    ++classes[name];
    return m;
  }

  std::optional<Bytes> rubbish() {
    const int kind = malice_ != Malice::kDamaged && one_in(30) ? 8 : below(8);
    if (kind == 0) {
      Bytes m(static_cast<size_t>(below(one_in(3) ? 1600 : 40)));
      return named("noise", fill(m, 0));
    }
    if (kind == 1) {  // a message of its own, header by chance
      Bytes m = net::encode({});
      fill(m, 3);
      m.resize(net::kHeaderBytes + static_cast<size_t>(below(400)));
      m[3] = static_cast<uint8_t>(one_in(4) ? any() : net::kReply | (1 + below(net::kSet + 1)));
      return named("random message", fill(m, net::kHeaderBytes));
    }
    if (kind == 8) return forged();
    if (heard_.empty()) return std::nullopt;
    Bytes m = heard_[static_cast<size_t>(below(static_cast<int>(heard_.size())))];
    if (kind == 2) return named("again", m);
    if (kind == 3) {
      m.resize(static_cast<size_t>(below(static_cast<int>(m.size()))));
      return named("cut", m);
    }
    if (kind == 4) {
      const size_t size = m.size();
      m.resize(size + 1 + static_cast<size_t>(below(one_in(4) ? 1400 : 12)));
      return named("lengthened", fill(m, size));
    }
    if (kind == 5) {  // of the fields that say what it answers
      m[static_cast<size_t>(below(10))] ^= static_cast<uint8_t>(1 << below(8));
      return named("header", m);
    }
    if (kind == 6) {
      net::put32(m, 4, net::get32(m, 4) ^ (1u << below(32)));
      return named("token", fill(m, net::kHeaderBytes));
    }
    m[0] = any(), m[1] = any();
    return named("no magic", m);
  }

  // An answer to one of the latest questions.
  std::optional<Bytes> forged() {
    if (malice_ == Malice::kDamaged || asked_.empty()) return std::nullopt;
    // CLOSE comes once a job, and nothing behind it: it is not left to chance.
    const bool last = asked_.back()[3] == net::kClose;
    const Bytes& question =
        asked_[last ? asked_.size() - 1 : static_cast<size_t>(below(static_cast<int>(asked_.size())))];
    const auto h = net::decode(question);
    if (!h) return std::nullopt;
    Bytes m(question.begin(), question.begin() + net::kHeaderBytes);
    m[3] |= net::kReply;
    m[10] = static_cast<uint8_t>(one_in(8) ? below(8) : 0);
    m[11] = 0;
    if (one_in(6)) return named("forged header alone", m);
    if (h->type == net::kRead && one_in(2)) {
      if (malice_ != Malice::kCells) return std::nullopt;
      m[3] = net::kMap;
      net::put16(m, 14, h->index + static_cast<uint32_t>(below(4)));
      m[10] = 0;
      const size_t cells = static_cast<size_t>(one_in(3) ? below(40) : chip_.chunk_cells());
      m.resize(net::kHeaderBytes + cells * static_cast<size_t>(chip_.cell_bytes()) + static_cast<size_t>(one_in(6)));
      fill(m, net::kHeaderBytes);
      // No bits above the cell, and a small plane, now and then.
      if (one_in(2))
        for (size_t i = net::kHeaderBytes; i < m.size(); i += static_cast<size_t>(chip_.cell_bytes())) m[i] = 0;
      return named("forged MAP", m);
    }
    // The latest true answer of this type, with some words changed; else words by chance.
    const bool list = h->type == net::kInfo || h->type == net::kCounters;
    for (auto old = heard_.rbegin(); old != heard_.rend(); ++old) {
      if (old->size() <= net::kHeaderBytes || !same_content((*old)[3], m[3]) || one_in(4)) continue;
      m.insert(m.end(), old->begin() + net::kHeaderBytes, old->end());
      for (int i = below(5); i > 0 && m.size() > net::kHeaderBytes; --i) {
        const size_t at =
            net::kHeaderBytes + static_cast<size_t>(below(static_cast<int>(m.size() - net::kHeaderBytes)));
        m[at] = one_in(2) ? any() : static_cast<uint8_t>(m[at] ^ 1 << below(8));
      }
      // A word about an error ends the job.
      if (!list && !one_in(16)) {
        m[net::kHeaderBytes + 3] &= static_cast<uint8_t>(~net::kFlagFailed);
        std::fill(m.begin() + net::kHeaderBytes + 20, m.begin() + net::kHeaderBytes + 24, uint8_t{0});
      }
      return named(name_of(h->type), m);
    }
    m.resize(net::kHeaderBytes +
             4 * (one_in(8) ? static_cast<size_t>(below(60))
                  : list    ? static_cast<size_t>(h->type == net::kInfo ? net::kInfoWords : net::kCounterWords)
                            : net::kStatusWords + (static_cast<size_t>(chip_.slots()) + 31) / 32));
    return named(name_of(h->type), fill(m, net::kHeaderBytes));
  }
  // Status blocks are alike.
  static bool same_content(uint8_t a, uint8_t b) {
    const auto status = [](uint8_t type) {
      return type != net::kMap && type != (net::kInfo | net::kReply) && type != (net::kCounters | net::kReply);
    };
    return a == b || (status(a) && status(b));
  }
  static const char* name_of(uint8_t type) {
    static const std::array<std::string, 12> names = [] {
      std::array<std::string, 12> n;
      for (uint8_t i = 0; i < n.size(); ++i) n[i] = std::string("forged answer to ") + net::type_name(i);
      return n;
    }();
    return names[type < names.size() ? type : 0].c_str();
  }

  net::Transport& wire_;
  net::ArbiterConfig chip_;
  Malice malice_;
  std::mt19937 random_;
  std::deque<Bytes> asked_, heard_;
  int64_t calls_ = 0;
  int goodbyes_ = 0;
};

// What the engine computes, remembered: most jobs are the same.
golden::Arbiter::Compute remembering(const golden::Config& c) {
  auto results = std::make_shared<std::map<std::vector<uint32_t>, golden::TileResult>>();
  return [c, results](const golden::TileJob& t, const std::vector<golden::PlaneEntry>& table,
                      const golden::Pixels& left, const golden::Pixels& right) {
    std::vector<uint32_t> key;
    for (const auto& w : golden::job_writes(t)) key.push_back(w.value);
    for (const auto& w : golden::table_writes(table)) key.push_back(w.value);
    for (const auto* image : {&left, &right}) key.insert(key.end(), image->data.begin(), image->data.end());
    const auto found = results->find(key);
    if (found != results->end()) return found->second;
    return (*results)[key] = golden::run_tile(c, t, table, left, right);
  };
}

struct Outcome {
  int64_t packets = 0;
  int jobs = 0, maps = 0, compared = 0, errors = 0;
  uint64_t repeated = 0;  // tiles
  std::map<std::string, int64_t> classes, messages;
};

net::ArbiterConfig true_capabilities(golden::Arbiter& chip) {
  net::Header ask;
  ask.type = net::kInfo;
  Bytes question = net::encode(ask);
  question.resize(net::kInfoRequestBytes);
  const Bytes info = chip.message(question, 1).at(0);
  std::vector<uint32_t> words;
  for (size_t i = net::kHeaderBytes; i < info.size(); i += 4) words.push_back(net::get32(info, i));
  return net::parse_info(words).value().config;
}

Outcome run(Malice malice, int64_t packets) {
  Outcome out;
  const net::ArbiterConfig base = small_chip();
  const Scene scene(base);
  const auto compute = remembering(base.engine);
  for (uint32_t job = 0; out.packets < packets; ++job) {
    const uint32_t seed = test_seed() * 100000 + job;
    INFO("job " << job << ", seed " << seed);
    net::ArbiterConfig c = base;
    if (job % 3 == 1) c.row_slots = 4, c.map_depth = 60;
    golden::Arbiter chip(c);
    chip.set_compute(compute);
    LinkFaults faults;
    if (job % 4 == 3) faults.loss = faults.reordering = 0.02;
    SimulatedLink link(chip, faults, seed);
    HostileTransport hostile(link, c, malice, seed);
    net::LinkOptions options;
    options.in_flight = 1 + static_cast<int>(job % 2);
    if (job % 5 == 2) options.window = 2;
    std::vector<std::vector<golden::MapCell>> cells(scene.plan.tiles.size());
    size_t done = 0;
    try {
      net::Client client(hostile, 5, seed);
      const net::Capabilities capabilities = client.info();
      const auto figures = net::run_link_tiles(
          client, capabilities, scene.plan.table, static_cast<int>(cells.size()), options,
          [&](int i) { return scene.tile(i); },
          [&](int i, std::vector<golden::MapCell> tile) {
            cells[static_cast<size_t>(i)] = std::move(tile);
            ++done;
          },
          [](uint64_t) {});
      REQUIRE(done == cells.size());
      ++out.maps;
      out.repeated += figures.tiles_repeated;
      // A forged INFO may have said that pixels have other bits: nothing could tell that from a true one.
      if (malice != Malice::kCells && net::same_capabilities(capabilities.config, true_capabilities(chip))) {
        const auto map = assemble(scene.setup.rig, scene.plan, cells);
        const bool identical = map.data == scene.expected.data;
        REQUIRE(identical);
        ++out.compared;
      }
    } catch (const net::LinkError& e) {
      const std::string text = e.what();
      INFO(text);
      CHECK(malice != Malice::kDamaged);
      CHECK(text.rfind("udp://simulated:20563: ", 0) == 0);
      ++out.errors;
      ++out.messages[text.substr(23, 40)];
    }
    ++out.jobs;
    out.packets += hostile.thrown;
    for (const auto& [name, count] : hostile.classes) out.classes[name] += count;
  }
  for (const auto& [name, count] : out.classes)
    std::printf("  %s: %lld\n", name.c_str(), static_cast<long long>(count));
  for (const auto& [name, count] : out.messages)
    std::printf("  '%s..': %lld\n", name.c_str(), static_cast<long long>(count));
  std::printf("%lld packets between those of %d jobs: %d maps, %d errors, %llu tiles repeated\n",
              static_cast<long long>(out.packets), out.jobs, out.maps, out.errors,
              static_cast<unsigned long long>(out.repeated));
  return out;
}

}  // namespace

TEST_CASE("host fuzz: damaged packets change nothing", "[net]") {
  const Outcome o = run(Malice::kDamaged, packets_wanted() * 6 / 10);
  CHECK(o.compared == o.jobs);
  CHECK(o.repeated == 0);
  for (const char* name : {"noise", "random message", "again", "cut", "lengthened", "header", "token", "no magic"})
    CHECK(o.classes.count(name) == 1);
}

TEST_CASE("host fuzz: forged answers bring the identical map or an error", "[net]") {
  const Outcome o = run(Malice::kForged, packets_wanted() * 3 / 10);
  for (uint8_t type = net::kOpen; type <= net::kRelease; ++type)
    CHECK(o.classes.count(std::string("forged answer to ") + net::type_name(type)) == 1);
  CHECK(o.classes.count("forged header alone") == 1);
  CHECK(o.errors + o.repeated > 0);
  CHECK(o.compared > 0);
}

TEST_CASE("host fuzz: forged maps bring a map or an error", "[net]") {
  const Outcome o = run(Malice::kCells, packets_wanted() / 10);
  CHECK(o.classes.count("forged MAP") == 1);
}

// Without a job around them: content of any kind and length.
TEST_CASE("host fuzz: parsers of single packets", "[net]") {
  std::mt19937 random(test_seed());
  const net::ArbiterConfig c = small_chip();
  golden::TileJob job;
  job.tile_cols = 17, job.tile_rows = 11, job.planes = 9, job.threshold = 100;
  int infos = 0, statuses = 0, headers = 0, chunks = 0;
  golden::Arbiter chip(c);
  net::Header ask;
  ask.type = net::kInfo;
  Bytes question = net::encode(ask);
  question.resize(net::kInfoRequestBytes);
  const Bytes info = chip.message(question, 1).at(0);
  std::vector<uint32_t> good;
  for (size_t i = net::kHeaderBytes; i < info.size(); i += 4) good.push_back(net::get32(info, i));
  REQUIRE(net::parse_info(good));
  for (int i = 0; i < 100000; ++i) {
    Bytes bytes(random() % (i % 4 ? 64 : 1600));
    for (uint8_t& b : bytes) b = static_cast<uint8_t>(random());
    if (i % 3 == 0 && bytes.size() > 2) bytes[0] = 0x50, bytes[1] = 0x53, bytes[2] = net::kVersion;
    headers += net::decode(bytes).has_value();
    std::vector<uint32_t> words(random() % 48);
    for (uint32_t& w : words) w = static_cast<uint32_t>(random()) >> random() % 32;
    if (const auto status = net::parse_status(words)) {
      ++statuses;
      for (const uint32_t chunk : {0u, 31u, 32u, 1023u, 65535u, status->base, status->base + 33})
        (void)status->chunk(chunk);
    }
    auto spoilt = good;
    for (size_t k = 1 + random() % 3; k > 0; --k)
      spoilt[random() % spoilt.size()] = static_cast<uint32_t>(random()) >> random() % 32;
    if (const auto capabilities = net::parse_info(i % 2 ? spoilt : words)) {
      ++infos;
      const net::ArbiterConfig& a = capabilities->config;
      CHECK((a.chunk_pairs() >= 1 && a.chunk_cells() >= 1 && a.row_slots >= 2 && a.map_depth >= 1));
      CHECK((a.engine.img_cols >= 1 && a.engine.planes >= 1 && a.cell_bytes() <= 8 && a.pair_bytes() <= 3));
    }
    std::vector<golden::MapCell> cells(17 * 11);
    if (net::decode_cells(c, job, bytes, random() % 250, cells)) {
      ++chunks;
      for (const auto& cell : cells)
        if (cell.plane >= job.planes) FAIL("a plane beyond the job's");
    }
  }
  CHECK(headers > 0);
  CHECK(statuses > 0);
  CHECK(infos > 0);
  CHECK(chunks > 0);
}
