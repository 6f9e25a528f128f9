// SPDX-License-Identifier: Apache-2.0
// psweep bench-link: goodput up (rows), down (map), both at once, and the time of a question and its answer.
// One tile is swept over a single plane and its map read again and again; a second tile is opened, and its rows are
// sent again and again, all but one, so that it never starts. Goodput counts pixels and cells that arrived.
#include <algorithm>
#include <cstdio>
#include <deque>
#include <nlohmann/json.hpp>
#include <random>

#include "app/options.hpp"
#include "net/link_engine.hpp"
#include "net/udp_transport.hpp"

namespace psweep {
namespace {

using nlohmann::ordered_json;

constexpr int kWindow = 32, kAnswerEvery = 8;

class Bench {
 public:
  Bench(net::Client& client, const net::Capabilities& chip) : client_(client), c_(chip.config) {
    const golden::Config& e = c_.engine;
    // As large as the map buffer holds at once.
    job_.tile_cols = std::min(e.plane_cols, c_.map_depth);
    job_.tile_rows = std::clamp(c_.map_depth / job_.tile_cols, 1, e.plane_rows);
    job_.win_cols = std::min(e.img_cols, job_.tile_cols + e.window);
    job_.win_rows = std::min(e.img_rows, job_.tile_rows + e.window);
    job_.planes = 1;
    job_.left = job_.right = {0, job_.win_cols - 1, 0, job_.win_rows - 1};
    golden::PlaneEntry plane;  // pixel for pixel
    plane.dx_left = plane.dy_left = plane.dx_right = plane.dy_right = 1u << golden::kPosFrac;
    const golden::Pixels flat(job_.win_cols, job_.win_rows);
    rows_ = net::row_chunks(c_, {job_, flat, flat});
    client_.open(chip);
    if (!net::write_table(client_, c_, {plane})) throw net::LinkError(client_.where() + ": the session was lost");
    start(0);
    for (size_t i = 0; i < rows_.size(); ++i) {
      repeat(net::kWrite, 0, static_cast<uint16_t>(i), rows_[i], net::kFlagAnswer);
    }
    const double begin = client_.now();
    while (!client_.request(net::kStatus).status->has(net::kFlagMapComplete)) {
      if (client_.now() - begin > client_.timeout()) {
        throw net::LinkError(client_.where() + ": the tile was not finished in time");
      }
    }
    start(1);
    cells_ = static_cast<size_t>(job_.tile_cols) * job_.tile_rows;
    map_chunks_ = static_cast<uint32_t>((cells_ + c_.chunk_cells() - 1) / c_.chunk_cells());
  }

  struct Rates {
    double up = 0, down = 0;  // Mbit/s
  };
  Rates measure(bool up, bool down, double seconds) {
    const double begin = client_.now(), end = begin + seconds;
    uint64_t up_bytes = 0, down_bytes = 0;
    std::deque<uint64_t> asked;  // orders of flagged WRITEs, each for kAnswerEvery packets
    int flying = 0;
    uint32_t next = 0;
    // All but one of the chunks that the chip can hold, so that the tile is never complete.
    const uint32_t usable = std::max<uint32_t>(
        1, std::min<uint32_t>(static_cast<uint32_t>(rows_.size()), static_cast<uint32_t>(c_.row_slots)) - 1);
    uint64_t read = 0;
    double heard = begin;
    auto ask_map = [&] {
      read = client_.send(net::kRead, 0, 0, net::read_payload(static_cast<uint16_t>(map_chunks_), 0));
    };
    if (down) ask_map();
    while (client_.now() < end) {
      while (up && flying + kAnswerEvery <= kWindow) {
        for (int i = 0; i < kAnswerEvery; ++i) {
          const bool flag = i == kAnswerEvery - 1;
          const uint64_t order =
              client_.send(net::kWrite, 1, static_cast<uint16_t>(next), rows_[next], flag ? net::kFlagAnswer : 0);
          if (flag) asked.push_back(order);
          next = (next + 1) % usable;
        }
        flying += kAnswerEvery;
      }
      const auto event = client_.receive(std::min(client_.patience(), std::max(0.0, end - client_.now())));
      if (!event) {
        client_.check_silence("the measurement");
        if (client_.now() < heard + client_.patience()) continue;
        // Lost: begin afresh.
        heard = client_.now();
        client_.silence();
        asked.clear();
        flying = 0;
        if (down) ask_map();
        continue;
      }
      heard = client_.now();
      if (const auto* m = std::get_if<net::MapChunk>(&*event)) {
        down_bytes += m->cells.size();
        // The next READ arrives while the end of this one is on its way.
        if (m->order == read && uint32_t{m->index} + 2 >= map_chunks_) ask_map();
      } else {
        const auto& reply = std::get<net::Reply>(*event);
        if (reply.code != net::kOk) {
          throw net::LinkError(client_.where() + ": " + net::type_name(reply.type) +
                               " was refused: " + net::code_name(reply.code));
        }
        while (!asked.empty() && asked.front() <= reply.order) {
          // An answer that got lost, and with it perhaps its packets, is not counted.
          if (reply.type == net::kWrite && asked.front() == reply.order) {
            up_bytes += kAnswerEvery * static_cast<uint64_t>(c_.chunk_pairs()) * c_.pair_bytes();
          }
          asked.pop_front();
          flying -= kAnswerEvery;
        }
      }
    }
    const double took = client_.now() - begin;
    // What is still on its way.
    client_.request(net::kRead, 0, 0, net::read_payload(0, 0));
    while (client_.receive(0.05)) {
    }
    return {8e-6 * static_cast<double>(up_bytes) / took, 8e-6 * static_cast<double>(down_bytes) / took};
  }

  // Seconds, sorted.
  std::vector<double> latencies(double seconds) {
    std::vector<double> out;
    const double end = client_.now() + seconds;
    while (client_.now() < end || out.empty()) {
      const double begin = client_.now();
      client_.request(net::kStatus);
      out.push_back(client_.now() - begin);
    }
    std::sort(out.begin(), out.end());
    return out;
  }

 private:
  void repeat(net::Type type, uint16_t tile, uint16_t index, const net::Bytes& payload, uint8_t flags = 0) {
    const double begin = client_.now();
    for (;;) {
      const net::Reply r = client_.request(type, tile, index, payload, flags);
      if (r.code == net::kOk) return;
      if (r.code != net::kNotReady || client_.now() - begin > client_.timeout()) {
        throw net::LinkError(client_.where() + ": " + net::type_name(type) + " was refused: " + net::code_name(r.code));
      }
    }
  }
  void start(uint16_t tile) { repeat(net::kStart, tile, 0, net::start_payload(c_, job_, 1)); }

  net::Client& client_;
  const net::ArbiterConfig c_;
  golden::TileJob job_;
  std::vector<net::Bytes> rows_;
  size_t cells_ = 0;
  uint32_t map_chunks_ = 0;
};

}  // namespace

void bench_link_command(const BenchLinkOptions& o) {
  const auto transport = net::connect_udp(net::parse_endpoint("CHIP", o.target));
  std::random_device random;
  net::Client client(*transport, o.link_timeout, uint64_t{random()} << 32 | random());
  ordered_json j;
  try {
    const net::Capabilities chip = client.info();
    Bench bench(client, chip);
    const auto up = bench.measure(true, false, o.seconds), down = bench.measure(false, true, o.seconds),
               both = bench.measure(true, true, o.seconds);
    const auto latency = bench.latencies(o.seconds);
    auto at = [&](double share) {
      return 1e6 * latency[static_cast<size_t>(share * static_cast<double>(latency.size() - 1))];
    };
    j = {{"chip", transport->peer()},
         {"seconds_each", o.seconds},
         {"up_Mbit_per_s", up.up},
         {"down_Mbit_per_s", down.down},
         {"both_up_Mbit_per_s", both.up},
         {"both_down_Mbit_per_s", both.down},
         {"latency_us",
          {{"questions", latency.size()},
           {"min", at(0)},
           {"median", at(0.5)},
           {"p90", at(0.9)},
           {"p99", at(0.99)},
           {"max", at(1)}}}};
  } catch (...) {
    client.close();
    throw;
  }
  client.close();
  if (o.json) {
    std::printf("%s\n", j.dump(2).c_str());
    return;
  }
  const auto& l = j["latency_us"];
  auto number = [](const ordered_json& v) { return v.get<double>(); };
  std::printf("link to %s, %g s each\n", transport->peer().c_str(), o.seconds);
  std::printf("  up alone      %8.2f Mbit/s\n", number(j["up_Mbit_per_s"]));
  std::printf("  down alone    %8.2f Mbit/s\n", number(j["down_Mbit_per_s"]));
  std::printf("  both at once  %8.2f Mbit/s up, %.2f Mbit/s down\n", number(j["both_up_Mbit_per_s"]),
              number(j["both_down_Mbit_per_s"]));
  std::printf("  latency, us   min %.0f, median %.0f, 90 %% %.0f, 99 %% %.0f, max %.0f of %zu\n", number(l["min"]),
              number(l["median"]), number(l["p90"]), number(l["p99"]), number(l["max"]), l["questions"].get<size_t>());
}

}  // namespace psweep
