// SPDX-License-Identifier: Apache-2.0
#include "net/link_bench.hpp"

#include <algorithm>
#include <deque>

namespace psweep::net {
namespace {

constexpr int kWindow = 32, kAnswerEvery = 8;  // WRITEs
constexpr uint16_t kSwept = 0, kOpened = 1;    // tiles

// Bytes of wire that a payload takes: headers, FCS, preamble, gap; short frames are filled up.
size_t on_wire(size_t payload) { return std::max<size_t>(payload + 42, 60) + 4 + 8 + 12; }

}  // namespace

LinkBench::LinkBench(Client& client, const Capabilities& chip) : client_(client), c_(chip.config) {
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
  const std::vector<Bytes> rows = row_chunks(c_, {job_, flat, flat});
  half_duplex_ = !client_.open(chip).has(kFlagFullDuplex);
  if (!write_table(client_, c_, {plane})) throw LinkError(client_.where() + ": the session was lost");
  Bytes start = start_payload(c_, job_, 1);
  repeat(kStart, kSwept, 0, start);
  for (size_t i = 0; i < rows.size(); ++i) repeat(kWrite, kSwept, static_cast<uint16_t>(i), rows[i], kFlagAnswer);
  const double begin = client_.now();
  while (!status().has(kFlagMapComplete)) {
    if (client_.now() - begin > client_.timeout()) {
      throw LinkError(client_.where() + ": the tile was not finished in time");
    }
  }
  // Whatever the window, the second tile has one chunk more than is ever sent of it: two at least.
  const auto chunks = std::max<uint32_t>(2, static_cast<uint32_t>(rows.size()));
  put32(start, 4, chunks * static_cast<uint32_t>(c_.chunk_pairs()));
  put32(start, 8, chunks);
  repeat(kStart, kOpened, 0, start);
  usable_ = std::min(chunks, static_cast<uint32_t>(std::max(2, c_.row_slots))) - 1;
  chunk_ = rows.front();
  const auto cells = static_cast<uint32_t>(job_.tile_cols * job_.tile_rows),
             per = static_cast<uint32_t>(c_.chunk_cells());
  map_chunks_ = (cells + per - 1) / per;
  for (uint32_t c = 0; c < map_chunks_; ++c) {
    map_wire_ += on_wire(kHeaderBytes + static_cast<size_t>(std::min(per, cells - c * per)) * c_.cell_bytes());
  }
  map_wire_ = std::max(map_wire_, 2 * on_wire(kHeaderBytes + chunk_.size()));
}

LinkRates LinkBench::measure(bool up, bool down, double seconds) {
  LinkRates rates;
  const uint64_t arrived = chunks_arrived();
  const double begin = client_.now(), end = begin + seconds;
  double up_end = begin, down_end = begin;
  // In half duplex the chip answers when this side is silent: one burst, one answer.
  const int window = half_duplex_ ? kAnswerEvery : kWindow;
  std::deque<uint64_t> asked;  // orders of flagged WRITEs, each for kAnswerEvery packets
  uint32_t next = 0;
  uint64_t read = 0;
  bool read_heard = false;
  uint64_t down_bytes = 0;
  double heard = begin, map_heard = begin;
  auto ask_map = [&] {
    read = client_.send(kRead, kSwept, 0, read_payload(static_cast<uint16_t>(map_chunks_), 0));
    read_heard = false;
    map_heard = client_.now();
  };
  if (down) ask_map();
  // Both at once: a READ waits behind the rows in this side's queue, so it goes in between them, one for as many of
  // them as take the time of a map. In half duplex the queue is short.
  const bool paced = up && down && !half_duplex_;
  size_t ahead = 0;
  while (client_.now() < end || !asked.empty()) {
    const bool sending = client_.now() < end;
    while (up && sending && static_cast<int>(asked.size() + 1) * kAnswerEvery <= window) {
      for (int i = 0; i < kAnswerEvery; ++i) {
        const bool flag = i == kAnswerEvery - 1;
        const uint64_t order =
            client_.send(kWrite, kOpened, static_cast<uint16_t>(next), chunk_, flag ? kFlagAnswer : 0);
        if (flag) asked.push_back(order);
        next = (next + 1) % usable_;
        ahead += on_wire(kHeaderBytes + chunk_.size());
        if (paced && ahead >= map_wire_) {
          ahead -= map_wire_;
          ask_map();
        }
      }
      rates.chunks_sent += kAnswerEvery;
    }
    const double patience = client_.patience();
    const auto event = client_.receive(sending ? std::min(patience, end - client_.now()) : patience);
    const double now = client_.now();
    if (!event) {
      client_.check_silence("the measurement");
      // Nothing is sent again for that: the rows may just be waiting in a queue of this side. The answer to one
      // question more says that nothing before it will be answered.
      if (now >= heard + patience) {
        client_.silence();
        heard = now;
        client_.send(kStatus);
      }
    } else if (const auto* m = std::get_if<MapChunk>(&*event)) {
      heard = map_heard = now;
      if (down && now <= end) {
        down_bytes += m->cells.size();
        ++rates.chunks_down;
        down_end = now;
      }
      // The next READ arrives while the end of this one is on its way.
      if (down && sending && !paced && m->order == read && uint32_t{m->index} + 2 >= map_chunks_) ask_map();
    } else {
      heard = now;
      const auto& reply = std::get<Reply>(*event);
      if (reply.code != kOk) {
        throw LinkError(client_.where() + ": " + type_name(reply.type) + " was refused: " + code_name(reply.code));
      }
      if (reply.order >= read && !read_heard) {
        read_heard = true;
        map_heard = now;
      }
      if (!asked.empty() && asked.front() <= reply.order) up_end = now;
      while (!asked.empty() && asked.front() <= reply.order) asked.pop_front();
    }
    // The chip knows of the READ, but the end of its map was lost.
    if (down && sending && read_heard && now > map_heard + std::max(patience, 4 * client_.rtt())) ask_map();
  }
  // What is still on its way.
  client_.request(kRead, kSwept, 0, read_payload(0, 0));
  while (client_.receive(std::max(0.001, client_.rtt()))) {
  }
  rates.chunks_up = chunks_arrived() - arrived;
  if (up && up_end > begin) {
    rates.up = 8e-6 * static_cast<double>(rates.chunks_up * chunk_.size()) / (up_end - begin);
  }
  if (down && down_end > begin) rates.down = 8e-6 * static_cast<double>(down_bytes) / (down_end - begin);
  return rates;
}

std::vector<double> LinkBench::latencies(double seconds) {
  std::vector<double> out;
  const double end = client_.now() + seconds;
  while (client_.now() < end || out.empty()) {
    const double begin = client_.now();
    status();
    out.push_back(client_.now() - begin);
  }
  std::sort(out.begin(), out.end());
  return out;
}

Reply LinkBench::repeat(Type type, uint16_t tile, uint16_t index, const Bytes& payload, uint8_t flags) {
  const double begin = client_.now();
  for (;;) {
    const Reply r = client_.request(type, tile, index, payload, flags);
    if (r.code == kOk) return r;
    if (r.code != kNotReady || client_.now() - begin > client_.timeout()) {
      throw LinkError(client_.where() + ": " + type_name(type) + " was refused: " + code_name(r.code));
    }
  }
}

Status LinkBench::status() {
  const Reply r = repeat(kStatus, 0, 0, {});
  return r.status.value();  // ok: so it is not bare
}

// Of the second tile, those that were there already included.
uint64_t LinkBench::chunks_arrived() { return uint64_t{status().received} + client_.counters()[kChunksRepeated]; }

}  // namespace psweep::net
