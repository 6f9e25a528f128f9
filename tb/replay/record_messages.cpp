// SPDX-License-Identifier: Apache-2.0
// record_messages CHIP FILE GENERIC=VALUE ..: as record_chip, for the lines that a well-behaved host never reaches:
// every message that has to be refused, each for each of its reasons, frames that the stack drops, collisions, a tile
// that the engine refuses. What the chip answers is checked where the answer is certain. For scripts/coverage.sh: GHDL
// needs too long for it to be a test of every day. Exit code 1 if an answer was missing or another one.
#include <cstdio>
#include <exception>
#include <random>
#include <stdexcept>

#include "desk/station.hpp"
#include "net/link_engine.hpp"
#include "replay/chip_recorder.hpp"
#include "verilated/chips.hpp"

using namespace psweep;
using namespace psweep::chip;

namespace {

class Host {
 public:
  Host(Desk& desk, const Chip& chip)
      : chip_(chip),
        own_{{2, 0, 0, 0, 0, 9}, chip.address.ip ^ 3, 4000},
        station_(desk, own_, chip.address.ip, chip.address.port) {
    if (!station_.resolve()) throw std::runtime_error("no answer to ARP");
  }
  Station& station() { return station_; }
  const net::Address& own() const { return own_; }
  net::Address chip_address() const { return {*station_.chip_mac(), chip_.address.ip, chip_.address.port}; }

  net::Bytes message(uint8_t type, uint16_t tile, uint16_t index, const net::Bytes& payload, uint8_t flags = 0) {
    net::Header h;
    h.type = type;
    h.token = token;
    h.sequence = ++sequence_;
    h.flags = flags;
    h.tile = tile;
    h.index = index;
    net::Bytes b = net::encode(h);
    b.insert(b.end(), payload.begin(), payload.end());
    return b;
  }
  void send(const net::Bytes& b) { station_.send_udp(b); }
  // Sends it and waits for the answer, whose code has to be this one.
  net::Header ask(const net::Bytes& b, net::Code code, const char* what) {
    send(b);
    for (int i = 0; i < 40; ++i) {
      const auto answer = station_.receive_udp(3 * kMillisecond);
      if (!answer) break;
      const auto h = net::decode(*answer);
      if (!h || h->type == net::kMap || h->sequence != sequence_) continue;
      if (h->flags != code)
        throw std::runtime_error(std::string(what) + ": code " + std::to_string(h->flags) + " instead of " +
                                 std::to_string(code));
      return *h;
    }
    throw std::runtime_error(std::string(what) + ": no answer");
  }
  net::Header ask(uint8_t type, uint16_t tile, uint16_t index, const net::Bytes& payload, net::Code code,
                  const char* what, uint8_t flags = 0) {
    return ask(message(type, tile, index, payload, flags), code, what);
  }

  uint32_t token = 0;

 private:
  const Chip& chip_;
  net::Address own_;
  Station station_;
  uint16_t sequence_ = 0;
};

net::Bytes word(uint32_t value) {
  net::Bytes b(4);
  net::put32(b, 0, value);
  return b;
}

// Frames that the stack drops, each for another reason.
void broken_frames(Host& host, Desk& desk) {
  const net::Address to = host.chip_address();
  const net::Bytes payload = host.message(net::kInfo, 0, 0, {});
  const net::Bytes good = net::make_udp(host.own(), to, payload);
  for (const auto& [at, value] :
       {std::pair<size_t, uint8_t>{20, 0x20}, {36, 0x11}, {41, 0x55}, {14, 0x46}, {12, 0x86}}) {
    net::Bytes frame = good;
    frame[at] ^= value;
    if (at == 20) {  // a fragment, with the right sum
      net::put16(frame, 24, 0);
      net::put16(frame, 24, net::internet_checksum(frame.data() + 14, 20));
    }
    desk.send(frame);
  }
  net::Address other = to;
  other.port ^= 1;
  desk.send(net::make_udp(host.own(), other, payload));
  desk.send_raw(net::Bytes(1600, 0x5a));
  desk.run_for(500 * kMicrosecond);
  // More at once than the slots hold.
  for (int i = 0; i < 12; ++i) desk.send(net::make_udp(host.own(), to, host.message(net::kStatus, 0, 0, {})));
  desk.run_for(1500 * kMicrosecond);
}

void run(const Chip& chip, const std::string& file, const std::vector<std::string>& generics) {
  DeskSettings settings;
  settings.clk_mhz = 30.7;  // near the lowest, so that few clocks have to be replayed
  Desk desk(std::make_unique<ChipRecorder>(chip.make(), file, generics), settings);
  Host host(desk, chip);
  const net::ArbiterConfig& c = chip.config;

  // No message, another version, no such type, none for this state.
  net::Bytes b = host.message(net::kInfo, 0, 0, {});
  b[0] ^= 1;
  host.send(b);
  host.send(net::Bytes(9, 0x50));
  b = host.message(net::kInfo, 0, 0, {});
  b[2] = 2;
  host.send(b);
  desk.run_for(100 * kMicrosecond);
  host.ask(0x40, 0, 0, {}, net::kBadMessage, "unknown type");
  host.ask(net::kStatus, 0, 0, {}, net::kNoSession, "no session");
  broken_frames(host, desk);

  host.ask(net::kOpen, 0, 0, {}, net::kBadMessage, "OPEN without nonce");
  host.token = host.ask(net::kOpen, 0, 0, word(4711), net::kOk, "OPEN").token;
  host.ask(net::kOpen, 0, 0, word(4711), net::kOk, "OPEN again");
  host.ask(net::kOpen, 0, 0, word(4712), net::kBusy, "OPEN of another");
  host.token ^= 1;
  host.ask(net::kStatus, 0, 0, {}, net::kBusy, "another's token");
  host.token ^= 1;
  host.ask(net::kSet, 0, 0, {}, net::kBadMessage, "SET without value");
  host.ask(net::kSet, 0, 0, word(3), net::kBadMessage, "SET of an unknown duplex");
  host.ask(net::kRead, 0, 0, {}, net::kBadMessage, "READ without count");

  host.ask(net::kTable, 1, 0, {}, net::kBadMessage, "TABLE without words");
  host.ask(net::kTable, 9, 0, word(0), net::kOrder, "TABLE of a far number");
  host.ask(net::kTable, 1, 0, net::Bytes(4 * 8, 0), net::kOk, "TABLE");
  host.ask(net::kTable, 1, 8, net::Bytes(4 * 8, 0), net::kOk, "TABLE, more of it");
  host.ask(net::kTable, 1, 17, word(0), net::kOrder, "TABLE with a gap");

  golden::TileJob job;
  job.tile_cols = c.engine.plane_cols + 1;  // for the engine to refuse
  job.tile_rows = 1;
  job.win_cols = job.win_rows = 4;
  job.planes = 1;
  const auto start = [&] { return net::start_payload(c, job, 1); };
  host.ask(net::kStart, 0, 0, word(0), net::kBadMessage, "START too short");
  host.ask(net::kStart, 7, 0, start(), net::kOrder, "START of a far tile");
  b = start();
  b[1] ^= 2;
  host.ask(net::kStart, 0, 0, b, net::kOrder, "START with another table");
  b = start();
  net::put32(b, 4, 0);
  host.ask(net::kStart, 0, 0, b, net::kBadMessage, "START without pixels");
  job.planes = 3;
  host.ask(net::kStart, 0, 0, start(), net::kOrder, "START with too many planes");
  job.planes = 1;
  host.ask(net::kStart, 0, 0, start(), net::kOk, "START");
  host.ask(net::kStart, 1, 0, start(), net::kNotReady, "START behind a tile that waits");
  host.ask(net::kTable, 1, 0, word(0), net::kNotReady, "TABLE while a tile waits");
  host.ask(net::kTable, 2, 0, word(0), net::kNotReady, "next TABLE while a tile waits");

  const net::Bytes chunk(static_cast<size_t>(c.chunk_pairs()) * static_cast<size_t>(c.pair_bytes()), 0x33);
  host.ask(net::kWrite, 0, 0, word(0), net::kBadMessage, "WRITE too short", net::kFlagAnswer);
  host.ask(net::kWrite, 5, 0, chunk, net::kOrder, "WRITE of another tile", net::kFlagAnswer);
  host.ask(net::kWrite, 0, 900, chunk, net::kNotReady, "WRITE beyond the tile", net::kFlagAnswer);
  host.ask(net::kWrite, 0, 0, chunk, net::kOk, "WRITE", net::kFlagAnswer);  // the engine begins, and refuses
  host.ask(net::kStatus, 0, 0, {}, net::kOk, "STATUS");

  // Two chunks of rows: one twice; a map that is not complete when it shall be released.
  job.tile_cols = c.engine.plane_cols;
  job.tile_rows = 4;
  job.win_cols = c.engine.img_cols;
  job.win_rows = c.engine.img_rows;
  host.ask(net::kStart, 1, 0, start(), net::kOk, "second START");
  host.ask(net::kWrite, 1, 0, chunk, net::kOk, "first WRITE", net::kFlagAnswer);
  host.ask(net::kWrite, 1, 0, chunk, net::kOk, "the same WRITE", net::kFlagAnswer);
  const int chunks = (job.win_cols * job.win_rows + c.chunk_pairs() - 1) / c.chunk_pairs();
  for (int i = 1; i < chunks; ++i) host.send(host.message(net::kWrite, 1, static_cast<uint16_t>(i), chunk));
  for (int i = 0; i < 12; ++i) {
    host.send(host.message(net::kRelease, 1, 0, {}));
    desk.run_for(30 * kMicrosecond);
  }
  desk.run_for(2 * kMillisecond);

  // Collisions: both want the wire.
  host.ask(net::kSet, 0, 0, word(net::kDuplexHalf), net::kOk, "half duplex");
  for (int i = 0; i < 12; ++i) {
    desk.send(net::make_udp(host.own(), host.chip_address(), host.message(net::kStatus, 0, 0, {})));
    desk.run_for((17 + i) * kMicrosecond);
  }
  desk.run_for(3 * kMillisecond);
  host.send(host.message(net::kClose, 0, 0, {}));
  desk.run_for(200 * kMicrosecond);
  desk.finish();
  std::printf("%s: %lld clocks\n", file.c_str(), static_cast<long long>(desk.clocks()));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: record_messages CHIP FILE GENERIC=VALUE ..\n");
    return 2;
  }
  try {
    run(chip_named(argv[1]), argv[2], std::vector<std::string>(argv + 3, argv + argc));
  } catch (const std::exception& e) {
    std::fprintf(stderr, "record_messages: %s\n", e.what());
    return 1;
  }
  return 0;
}
