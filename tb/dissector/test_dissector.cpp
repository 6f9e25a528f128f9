// SPDX-License-Identifier: Apache-2.0
// scripts/psweep.lua in tshark: every field of every message with its value and place, messages cut at every length,
// what links requests and replies, other ports, rubbish, and a session of the simulated chip. Numbers and bytes come
// from sw/net/protocol.hpp; what tshark shows comes from its PDML.
// Where tshark is not installed each case says SKIPPED.
#include <cstdio>
#include <fstream>
#include <random>

#include "chip/chip_transport.hpp"
#include "chip/pcap.hpp"
#include "dissector/messages.hpp"
#include "dissector/pdml.hpp"
#include "engine/stimulus.hpp"
#include "golden/registers.hpp"
#include "net/link_engine.hpp"
#include "support/catch.hpp"
#include "support/temporary_dir.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

bool skipped() {
  if (Tshark::installed()) return false;
  std::printf("SKIPPED: tshark is not installed\n");
  SUCCEED();
  return true;
}

const net::Address kHost{{0x02, 0x00, 0x00, 0x00, 0x00, 0x01}, 0x0a050001, 40000};
const net::Address kChip{{0x02, 0x00, 0x50, 0x53, 0x57, 0x01}, 0x0a050002, net::kUdpPort};

net::Address host_port(uint16_t port) { return {kHost.mac, kHost.ip, port}; }
net::Address chip_at(uint32_t ip, uint16_t port = net::kUdpPort) { return {kChip.mac, ip, port}; }

class Random {
 public:
  explicit Random(uint32_t seed) : engine_(seed) {}
  uint32_t bits(int n) { return static_cast<uint32_t>(engine_()) & static_cast<uint32_t>((uint64_t{1} << n) - 1); }
  int between(int lo, int hi) { return lo + static_cast<int>(engine_() % static_cast<uint32_t>(hi - lo + 1)); }
  bool coin() { return bits(1) != 0; }
  Bytes bytes(int n) {
    Bytes b(static_cast<size_t>(n));
    for (uint8_t& v : b) v = static_cast<uint8_t>(bits(8));
    return b;
  }
  std::vector<uint32_t> words(int n) {
    std::vector<uint32_t> w(static_cast<size_t>(n));
    for (uint32_t& v : w) v = bits(32);
    return w;
  }

 private:
  std::mt19937 engine_;
};

// A capture file in the making: frame i + 1 is packet i.
class Trace {
 public:
  // Returns the frame's number.
  long add(const net::Address& from, const net::Address& to, const Bytes& payload) {
    frames_.push_back(net::make_udp(from, to, payload));
    return static_cast<long>(frames_.size());
  }
  long add_frame(Bytes frame) {
    frames_.push_back(std::move(frame));
    return static_cast<long>(frames_.size());
  }
  long frames() const { return static_cast<long>(frames_.size()); }
  // One frame every 10 us and 1 ns. keep(frame) bytes of the UDP payload are captured; 0: all.
  std::string write(const TemporaryDir& dir, const std::function<size_t(long)>& keep = nullptr) const {
    const std::string name = (dir / "trace.pcap").string();
    chip::PcapWriter pcap(name);
    for (size_t i = 0; i < frames_.size(); ++i) pcap.write(frames_[i], time(static_cast<long>(i) + 1));
    pcap.close();
    if (!keep) return name;
    // The same with shorter records: bytes 8..11 of a record's header say how many bytes there are.
    std::ifstream in(name, std::ios::binary);
    const std::string whole((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    std::string cut = whole.substr(0, 24);
    size_t at = 24;
    for (size_t i = 0; i < frames_.size(); ++i) {
      const size_t size = frames_[i].size();
      const size_t kept = keep(static_cast<long>(i) + 1);
      const size_t n = kept == 0 ? size : std::min(size, kPayload + kept);
      std::string header = whole.substr(at, 16);
      for (size_t b = 0; b < 4; ++b) header[8 + b] = static_cast<char>(n >> 8 * b);
      cut += header + whole.substr(at + 16, n);
      at += 16 + size;
    }
    std::ofstream(name, std::ios::binary) << cut;
    return name;
  }
  static chip::Time time(long frame) { return frame * 10'001 * chip::kNanosecond; }

 private:
  std::vector<Bytes> frames_;
};

// Every expected field is there, with place and value, and no other; the bytes tshark took are the message's.
void check_frame(const Dissection& got, const Expectation& expected, const Bytes& payload, const std::string& what) {
  INFO("frame " << got.frame << ", " << what << ", " << payload.size() << " bytes: " << got.info);
  REQUIRE(got.psweep);
  std::multiset<std::string> missing, extra;
  for (const Field& f : expected.fields) missing.insert(f.text());
  for (const Field& f : got.fields) {
    if (f.at >= 0 && static_cast<size_t>(f.at + f.size) <= payload.size() && !f.raw.empty()) {
      std::string hex;
      char digits[3];
      for (long i = f.at; i < f.at + f.size; ++i) {
        std::snprintf(digits, sizeof digits, "%02x", payload[static_cast<size_t>(i)]);
        hex += digits;
      }
      if (f.raw != hex) {
        INFO(f.name);
        CHECK(f.raw == hex);
      }
    }
    auto hit = missing.find(f.text());
    if (hit == missing.end()) {  // groups and bytes: place and bytes only
      Field any = f;
      any.show = Message::kAny;
      hit = missing.find(any.text());
    }
    if (hit != missing.end()) {
      missing.erase(hit);
    } else {
      extra.insert(f.text());
    }
  }
  std::string differences;
  for (const std::string& text : missing) differences += "\n  not shown: " + text;
  for (const std::string& text : extra) differences += "\n  not expected: " + text;
  CHECK(differences == "");
  CHECK(std::multiset<std::string>(got.experts.begin(), got.experts.end()) == expected.experts);
}

net::ArbiterConfig random_config(Random& random) {
  net::ArbiterConfig a;
  golden::Config& c = a.engine;
  c.img_cols = random.between(1, 4096);
  c.img_rows = random.between(1, 4096);
  c.plane_cols = random.between(1, 4096);
  c.plane_rows = random.between(1, 4096);
  const int planes[] = {1, 2, 3, 4, 5, 12, 256, 257, 301, 512, 1023, 1024};
  c.planes = planes[random.between(0, 11)];
  c.window = 2 * random.between(1, 10) + 1;
  c.pix_bits = random.between(1, 12);
  c.weight_bits = random.between(1, 12);
  c.interp_frac = random.between(0, 8);
  c.mncc_bits = random.between(4, 16);
  c.frac_bits = random.between(2, 12);
  c.lanes = random.between(1, 64);
  a.clk_khz = random.between(30000, 400000);
  a.chunk_bytes = random.between(16, 1440);
  a.row_slots = random.between(2, 1024);
  a.map_depth = random.between(1, 1 << 23);
  a.rx_slots = random.coin() ? 2 : 4;
  a.session_ms = random.between(1, 65535);
  return a;
}

net::Header random_header(Random& random, uint8_t type, uint8_t code_or_flags) {
  net::Header h;
  h.type = type;
  h.token = random.bits(32);
  h.sequence = static_cast<uint16_t>(random.bits(16));
  h.flags = code_or_flags;
  h.tile = static_cast<uint16_t>(random.bits(16));
  h.index = static_cast<uint16_t>(random.bits(16));
  return h;
}

net::Status random_status(Random& random, int words) {
  net::Status s;
  auto u16 = [&] { return static_cast<uint16_t>(random.bits(16)); };
  s.row_tile = u16(), s.flags = u16(), s.engine_tile = u16(), s.map_tile = u16();
  s.base = u16(), s.received = u16();
  s.table = u16(), s.table_words = u16();
  s.cells = random.bits(32);
  s.errors = u16(), s.error_count = u16();
  s.tiles_done = u16(), s.tiles_dropped = u16();
  s.tile_clocks = random.bits(32);
  s.window_errors = u16(), s.failed_tile = u16();
  s.bitmap = random.words(words);
  for (uint32_t& w : s.bitmap) {
    if (random.coin()) w = random.coin() ? 0 : 0xffffffff;
  }
  return s;
}

std::vector<golden::MapCell> random_cells(Random& random, const golden::Config& c, int count) {
  std::vector<golden::MapCell> cells(static_cast<size_t>(count));
  for (golden::MapCell& cell : cells) {
    cell.plane = static_cast<uint16_t>(random.bits(c.plane_bits()));
    cell.frac = static_cast<uint16_t>(random.bits(c.frac_bits));
    cell.v = static_cast<uint16_t>(random.between(0, 3) == 0 ? 0 : random.bits(c.mncc_bits));
    cell.mask = random.coin() ? 8 : 0;
  }
  return cells;
}

// One message of every kind. Those of a chip that has told its layout, or not.
std::vector<Message> messages_of_all_kinds(Random& random, const Layout& layout, bool small) {
  std::vector<Message> all;
  const int most = small ? 3 : 40;
  // Flags, codes and the byte behind them are anything in requests.
  auto request = [&](uint8_t type) { return random_header(random, type, static_cast<uint8_t>(random.bits(8))); };
  auto reply = [&](uint8_t type, int code = -1) {
    return random_header(random, static_cast<uint8_t>(type | net::kReply),
                         static_cast<uint8_t>(code >= 0 ? code : random.between(0, 6)));
  };
  auto padded = [&](Message m) {
    m.padding(random.bytes(random.between(0, 5)));
    all.push_back(std::move(m));
  };
  padded(open_request(request(net::kOpen), random.bits(32)));
  for (const uint8_t type : {net::kClose, net::kInfo, net::kCounters, net::kStatus, net::kRelease})
    padded(Message("bare request", true, request(type), net::kVersion, static_cast<uint8_t>(random.bits(8))));
  {
    auto h = request(net::kTable);
    h.index = static_cast<uint16_t>(random.between(0, 8000));
    all.push_back(table_request(h, random.words(random.between(1, small ? 11 : 364))));
    if (!small) all.push_back(table_request(h, random.words(365)));
    all.push_back(table_request(h, random.words(2), 3));
  }
  {
    StartFields s;
    s.table = static_cast<uint16_t>(random.bits(16));
    s.zero = static_cast<uint16_t>(random.bits(16));
    for (uint32_t& w : s.words) w = random.bits(32);
    const bool consistent = small || random.coin();
    if (consistent) {
      s.words[2] = static_cast<uint32_t>(random.between(1, 4095));
      s.words[3] = static_cast<uint32_t>(random.between(1, 4095));
      s.pixels = s.words[2] * s.words[3];
      const int pairs = layout ? layout->chunk_pairs() : 4096;
      s.chunks = (s.pixels + static_cast<uint32_t>(pairs) - 1) / static_cast<uint32_t>(pairs);
      // With the smallest chunks of the widest pixels there are more than an index can count.
      if (s.chunks > 65535) {
        s.words[3] = 1;
        s.pixels = s.words[2];
        s.chunks = (s.pixels + static_cast<uint32_t>(pairs) - 1) / static_cast<uint32_t>(pairs);
      }
    } else {
      s.pixels = random.coin() ? random.bits(32) : 0;
      s.chunks = random.coin() ? random.bits(17) : 0;
    }
    padded(start_request(request(net::kStart), s, layout));
  }
  for (const uint8_t flags : {uint8_t{0}, net::kFlagAnswer}) {
    auto h = request(net::kWrite);
    h.flags = flags;
    const int exact = layout ? layout->chunk_pairs() * layout->pair_bytes() : 24;
    const int size = small ? 9 : random.coin() ? exact : random.between(1, 1456);
    all.push_back(write_request(h, random.bytes(size), layout));
  }
  padded(read_request(request(net::kRead), static_cast<uint16_t>(random.coin() ? random.bits(16) : random.bits(1)),
                      static_cast<uint16_t>(random.bits(16))));
  for (int i = 0; i < 2; ++i) {
    auto h = request(net::kSet);
    h.index = small ? 0 : static_cast<uint16_t>(random.bits(1));
    padded(set_request(h, small ? random.bits(1) : random.coin() ? random.bits(2) : random.bits(32)));
  }
  all.push_back(opaque("unknown request", true, request(0), net::kVersion, random.bytes(7)));
  all.push_back(opaque("unknown request", true, request(static_cast<uint8_t>(random.between(0x0c, 0xff))),
                       net::kVersion, random.bytes(random.between(0, 40))));
  const auto other_version = static_cast<uint8_t>(random.between(2, 255));
  all.push_back(opaque("other version", true, request(static_cast<uint8_t>(random.between(1, 11))), other_version,
                       random.bytes(6)));
  all.push_back(opaque("other version", false, reply(static_cast<uint8_t>(random.between(1, 11))), other_version,
                       random.bytes(6)));

  auto status = [&](const char* what, const net::Header& h) {
    const int words = layout ? (layout->row_slots + 31) / 32 : random.between(0, small ? 2 : 32);
    Message m = status_reply(h, random_status(random, words), layout);
    m.what = what;
    all.push_back(std::move(m));
  };
  for (const uint8_t type : {net::kOpen, net::kClose, net::kStatus, net::kTable, net::kStart, net::kWrite, net::kRead,
                             net::kRelease, net::kSet})
    status("status reply", reply(type));
  status("INFO refused", reply(net::kInfo, random.between(1, 5)));
  status("COUNTERS refused", reply(net::kCounters, random.between(1, 5)));
  status("unknown type refused", reply(0, net::kBadMessage));
  status("type 0x0c refused", reply(0x0c, net::kBadMessage));
  status("unknown type refused", reply(static_cast<uint8_t>(random.between(0x0d, 0x7f)), net::kBadMessage));
  all.push_back(opaque("unknown reply", false, reply(static_cast<uint8_t>(random.between(0x0d, 0x7f)), net::kOk),
                       net::kVersion, random.bytes(random.between(0, 9))));
  {
    net::Mac mac;
    for (uint8_t& b : mac) b = static_cast<uint8_t>(random.bits(8));
    all.push_back(info_reply(reply(net::kInfo, net::kOk), layout ? *layout : random_config(random), mac,
                             random.bits(32), random.words(5)));
  }
  all.push_back(counters_reply(reply(net::kCounters, net::kOk), random.words(net::kCounterWords)));
  {
    const int cells = layout ? random.between(1, std::min(most, layout->chunk_cells())) : most;
    const golden::Config format = layout ? layout->engine : golden::Config{};
    all.push_back(map_packet(reply(0x0c, net::kOk), random_cells(random, format, cells), layout, -1));
    if (layout && layout->cell_bytes() > 1)
      all.push_back(map_packet(reply(0x0c, net::kOk), random_cells(random, format, cells), layout, -1,
                               static_cast<size_t>(random.between(1, layout->cell_bytes() - 1))));
  }
  return all;
}

// Each message in a conversation of its own: nobody asked for a reply, nobody answers a request.
void expect_alone(Expectation& e, const Message& m, size_t n) {
  if (n < net::kHeaderBytes) return;
  if (!m.request) e.experts.insert("no_request");
  if (m.request && m.wanted) e.experts.insert("no_response");
}
void add_alone(Trace& trace, const Message& m, const net::Address& chip, const Bytes& bytes) {
  // An INFO reply tells its layout to all later conversations with its chip.
  const net::Address other = chip_at(chip.ip ^ 0x80);
  const net::Address& who = m.what == "INFO reply" ? other : chip;
  // Ports above the chip's, as Linux gives them: tshark asks the lower port's dissector first.
  const net::Address host = host_port(static_cast<uint16_t>(32768 + trace.frames()));
  REQUIRE(trace.frames() < 30000);
  if (m.request) {
    trace.add(host, who, bytes);
  } else {
    trace.add(who, host, bytes);
  }
}
void tell_layout(Trace& trace, std::vector<Message>& all, Random& random, const net::ArbiterConfig& a,
                 const net::Address& chip) {
  all.push_back(info_reply(random_header(random, net::kInfo | net::kReply, net::kOk), a, {}, net::kCounterWords,
                           {0, 0, 0, 0, 0}));
  trace.add(chip, host_port(65000), all.back().bytes);
}

}  // namespace

TEST_CASE("dissector: every field of every message, with and without the layout told before") {
  if (skipped()) return;
  Random random(test_seed());
  TemporaryDir dir;
  Trace trace;
  std::vector<Message> all;
  for (int round = 0; round < 16; ++round) {
    const net::Address chip = chip_at(0x0a050100 + static_cast<uint32_t>(round));
    Layout layout;
    if (round % 4 != 3) {
      layout = random_config(random);
      tell_layout(trace, all, random, *layout, chip);
    }
    for (Message& m : messages_of_all_kinds(random, layout, false)) {
      add_alone(trace, m, chip, m.bytes);
      all.push_back(std::move(m));
    }
    if (!layout) continue;
    // The mask of a cell takes the threshold of its tile's START.
    const net::Address host = host_port(65001);
    StartFields s;
    s.words[2] = s.words[3] = 1;
    s.pixels = s.chunks = 1;
    s.words[5] = random.bits(layout->engine.mncc_bits);
    auto h = random_header(random, net::kStart, 0);
    all.push_back(start_request(h, s, layout));
    trace.add(host, chip, all.back().bytes);
    h.type = net::kMap;
    ++h.sequence;  // not an answer to START
    all.push_back(map_packet(h, random_cells(random, layout->engine, std::min(50, layout->chunk_cells())), layout,
                             static_cast<int>(s.words[5])));
    trace.add(chip, host, all.back().bytes);
  }
  const auto got = Tshark(dir).dissect(trace.write(dir));
  REQUIRE(got.size() == all.size());
  for (size_t i = 0; i < all.size(); ++i) {
    Expectation e = all[i].expect();
    expect_alone(e, all[i], all[i].bytes.size());
    check_frame(got[i], e, all[i].bytes, all[i].what);
  }
}
