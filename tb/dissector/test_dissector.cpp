// SPDX-License-Identifier: Apache-2.0
// sw/wireshark/psweep.lua in tshark: every field of every message with its value and place, messages cut at every
// length, what links requests and replies, other ports, rubbish, and a session of the simulated chip. Numbers and bytes
// come from sw/contract/protocol.hpp; what tshark shows comes from its PDML. Where there is no tshark that runs Lua
// scripts each case says SKIPPED and why.
#include <cstdio>
#include <fstream>
#include <iterator>
#include <random>

#include "contract/registers.hpp"
#include "desk/chip_transport.hpp"
#include "desk/pcap.hpp"
#include "dissector/messages.hpp"
#include "dissector/pdml.hpp"
#include "net/link_engine.hpp"
#include "scene/stimulus.hpp"
#include "support/catch.hpp"
#include "support/temporary_dir.hpp"
#include "verilated/chips.hpp"

using namespace psweep;
using namespace psweep::tb;

namespace {

bool skipped() {
  TemporaryDir dir;
  const std::string obstacle = Tshark(dir).obstacle();
  if (obstacle.empty()) return false;
  std::printf("SKIPPED: %s\n", obstacle.c_str());
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

// The bytes that tshark took for a field are the message's at this place.
void check_bytes(const Dissection& got, const Bytes& payload) {
  std::string differences;
  for (const Field& f : got.fields) {
    if (f.at < 0 || f.raw.empty()) continue;
    std::string hex;
    if (static_cast<size_t>(f.at + f.size) <= payload.size()) {
      char digits[3];
      for (long i = f.at; i < f.at + f.size; ++i) {
        std::snprintf(digits, sizeof digits, "%02x", payload[static_cast<size_t>(i)]);
        hex += digits;
      }
    }
    if (f.raw != hex) differences += "\n  " + f.text() + ": bytes " + f.raw + ", in the message " + hex;
  }
  CHECK(differences == "");
}

// Every expected field is there, with place and value, and no other.
void check_frame(const Dissection& got, const Expectation& expected, const Bytes& payload, const std::string& what) {
  INFO("frame " << got.frame << ", " << what << ", " << payload.size() << " bytes: " << got.info);
  REQUIRE(got.psweep);
  check_bytes(got, payload);
  std::multiset<std::string> missing, extra;
  for (const Field& f : expected.fields) missing.insert(f.text());
  for (const Field& f : got.fields) {
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
  c.rectified = random.between(0, 1);
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
class AllKinds {
 public:
  AllKinds(Random& random, const Layout& layout, bool small) : random_(random), layout_(layout), small_(small) {}

  std::vector<Message> messages() {
    padded(open_request(request(net::kOpen), random_.bits(32)));
    bare_requests();
    table_requests();
    padded(start_request(request(net::kStart), start_fields(), layout_));
    write_requests();
    padded(read_request(request(net::kRead), static_cast<uint16_t>(random_.coin() ? random_.bits(16) : random_.bits(1)),
                        static_cast<uint16_t>(random_.bits(16))));
    set_requests();
    strangers();
    status_replies();
    other_replies();
    map_packets();
    return std::move(all_);
  }

 private:
  // Flags, codes and the byte behind them are anything in requests.
  net::Header request(uint8_t type) { return random_header(random_, type, static_cast<uint8_t>(random_.bits(8))); }
  net::Header reply(uint8_t type, int code = -1) {
    return random_header(random_, static_cast<uint8_t>(type | net::kReply),
                         static_cast<uint8_t>(code >= 0 ? code : random_.between(0, 6)));
  }
  void padded(Message m) {
    m.padding(random_.bytes(random_.between(0, 5)));
    all_.push_back(std::move(m));
  }

  void bare_requests() {
    for (const uint8_t type : {net::kClose, net::kInfo, net::kCounters, net::kStatus, net::kRelease})
      padded(bare_request(request(type), static_cast<uint8_t>(random_.bits(8))));
    // As the host sends them.
    for (const uint8_t type : {net::kInfo, net::kCounters}) {
      Message m = bare_request(request(type));
      const size_t least = type == net::kInfo ? net::kInfoRequestBytes : net::kCountersRequestBytes;
      m.padding(Bytes(least - net::kHeaderBytes + random_.bits(2), 0));
      all_.push_back(std::move(m));
    }
  }
  void table_requests() {
    auto h = request(net::kTable);
    h.index = static_cast<uint16_t>(random_.between(0, 8000));
    all_.push_back(table_request(h, random_.words(random_.between(1, small_ ? 11 : 364))));
    if (!small_) all_.push_back(table_request(h, random_.words(365)));
    all_.push_back(table_request(h, random_.words(2), 3));
  }
  StartFields start_fields() {
    StartFields s;
    s.table = static_cast<uint16_t>(random_.bits(16));
    s.zero = static_cast<uint16_t>(random_.bits(16));
    for (uint32_t& w : s.words) w = random_.bits(32);
    const bool consistent = small_ || random_.coin();
    if (consistent) {
      s.words[2] = static_cast<uint32_t>(random_.between(1, 4095));
      s.words[3] = static_cast<uint32_t>(random_.between(1, 4095));
      s.pixels = s.words[2] * s.words[3];
      const int pairs = layout_ ? layout_->chunk_pairs() : 4096;
      s.chunks = (s.pixels + static_cast<uint32_t>(pairs) - 1) / static_cast<uint32_t>(pairs);
      // With the smallest chunks of the widest pixels there are more than an index can count.
      if (s.chunks > 65535) {
        s.words[3] = 1;
        s.pixels = s.words[2];
        s.chunks = (s.pixels + static_cast<uint32_t>(pairs) - 1) / static_cast<uint32_t>(pairs);
      }
    } else {
      s.pixels = random_.coin() ? random_.bits(32) : 0;
      s.chunks = random_.coin() ? random_.bits(17) : 0;
    }
    return s;
  }
  void write_requests() {
    for (const uint8_t flags : {uint8_t{0}, net::kFlagAnswer}) {
      auto h = request(net::kWrite);
      h.flags = flags;
      const int exact = layout_ ? layout_->chunk_pairs() * layout_->pair_bytes() : 24;
      const int size = small_ ? 9 : random_.coin() ? exact : random_.between(1, 1456);
      all_.push_back(write_request(h, random_.bytes(size), layout_));
    }
  }
  void set_requests() {
    for (int i = 0; i < 2; ++i) {
      auto h = request(net::kSet);
      h.index = small_ ? 0 : static_cast<uint16_t>(random_.bits(1));
      padded(set_request(h, small_ ? random_.bits(1) : random_.coin() ? random_.bits(2) : random_.bits(32)));
    }
  }
  // Of unknown types and other versions.
  void strangers() {
    all_.push_back(opaque("unknown request", true, request(0), net::kVersion, random_.bytes(7)));
    all_.push_back(opaque("unknown request", true, request(static_cast<uint8_t>(random_.between(0x0c, 0xff))),
                          net::kVersion, random_.bytes(random_.between(0, 40))));
    const auto version = static_cast<uint8_t>(random_.coin() ? 1 : random_.between(3, 255));
    all_.push_back(opaque("other version", true, request(static_cast<uint8_t>(random_.between(1, 11))), version,
                          random_.bytes(6)));
    all_.push_back(
        opaque("other version", false, reply(static_cast<uint8_t>(random_.between(1, 11))), version, random_.bytes(6)));
  }

  void status(const char* what, const net::Header& h) {
    const int words = layout_ ? (layout_->row_slots + 31) / 32 : random_.between(0, small_ ? 2 : 32);
    if (may_be_bare(h)) {
      Message m = bare_reply(h);
      m.what = what;
      if (always_bare(h)) m.padding(random_.bytes(random_.between(0, 9)));  // not of this chip
      all_.push_back(std::move(m));
    }
    if (always_bare(h)) return;
    Message m = status_reply(h, random_status(random_, words), layout_);
    m.what = what;
    all_.push_back(std::move(m));
  }
  void status_replies() {
    for (const uint8_t type : {net::kOpen, net::kClose, net::kStatus, net::kTable, net::kStart, net::kWrite, net::kRead,
                               net::kRelease, net::kSet})
      for (int code = 0; code <= 6; ++code) status("status reply", reply(type, code));
    status("INFO refused", reply(net::kInfo, random_.between(1, 5)));
    status("COUNTERS refused", reply(net::kCounters, random_.between(1, 5)));
    status("unknown type refused", reply(0, net::kBadMessage));
    status("type 0x0c refused", reply(0x0c, net::kBadMessage));
    status("unknown type refused", reply(static_cast<uint8_t>(random_.between(0x0d, 0x7f)), net::kBadMessage));
  }
  void other_replies() {
    all_.push_back(opaque("unknown reply", false, reply(static_cast<uint8_t>(random_.between(0x0d, 0x7f)), net::kOk),
                          net::kVersion, random_.bytes(random_.between(0, 9))));
    net::Mac mac;
    for (uint8_t& b : mac) b = static_cast<uint8_t>(random_.bits(8));
    all_.push_back(info_reply(reply(net::kInfo, net::kOk), layout_ ? *layout_ : random_config(random_), mac,
                              random_.bits(32), random_.words(4)));
    all_.push_back(counters_reply(reply(net::kCounters, net::kOk), random_.words(net::kCounterWords)));
  }
  void map_packets() {
    const int most = small_ ? 3 : 40;
    const int cells = layout_ ? random_.between(1, std::min(most, layout_->chunk_cells())) : most;
    const golden::Config format = layout_ ? layout_->engine : golden::Config{};
    all_.push_back(map_packet(reply(0x0c, net::kOk), random_cells(random_, format, cells), layout_, -1));
    if (layout_ && layout_->cell_bytes() > 1)
      all_.push_back(map_packet(reply(0x0c, net::kOk), random_cells(random_, format, cells), layout_, -1,
                                static_cast<size_t>(random_.between(1, layout_->cell_bytes() - 1))));
  }

  Random& random_;
  const Layout& layout_;
  const bool small_;
  std::vector<Message> all_;
};
std::vector<Message> messages_of_all_kinds(Random& random, const Layout& layout, bool small) {
  return AllKinds(random, layout, small).messages();
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
  all.push_back(
      info_reply(random_header(random, net::kInfo | net::kReply, net::kOk), a, {}, net::kCounterWords, {0, 0, 0, 0}));
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

TEST_CASE("dissector: messages cut at every length, by the sender and by the capture") {
  if (skipped()) return;
  const bool captured = GENERATE(false, true);
  Random random(test_seed());
  TemporaryDir dir;
  Trace trace;
  struct Cut {
    size_t message, size;
  };
  std::vector<Cut> cuts;
  std::vector<Message> all;
  for (const bool told : {true, false}) {
    const net::Address chip = chip_at(told ? 0x0a050002 : 0x0a050003);
    Layout layout;
    if (told) {
      layout = random_config(random);
      layout->row_slots = 40;
      tell_layout(trace, all, random, *layout, chip);
      cuts.push_back({0, all[0].bytes.size()});
    }
    for (Message& m : messages_of_all_kinds(random, layout, true)) {
      // A capture that lost a little of everything says enough with every third length.
      for (size_t n = m.bytes.size(); n >= 2; n -= captured && n > 20 ? 3 : 1) {
        add_alone(trace, m, chip, captured ? m.bytes : Bytes(m.bytes.begin(), m.bytes.begin() + static_cast<long>(n)));
        cuts.push_back({all.size(), n});
      }
      all.push_back(std::move(m));
    }
  }
  std::function<size_t(long)> keep;
  if (captured) keep = [&](long frame) { return cuts[static_cast<size_t>(frame) - 1].size; };
  const auto got = Tshark(dir).dissect(trace.write(dir, keep));
  REQUIRE(got.size() == cuts.size());
  size_t truncated = 0;
  for (size_t i = 0; i < cuts.size(); ++i) {
    const Message& m = all[cuts[i].message];
    const size_t n = cuts[i].size;
    Expectation e = m.expect(n);
    truncated += e.experts.count("truncated");
    if (captured && n < m.bytes.size()) {
      // Whether the message was long enough cannot be told.
      e.experts.erase("truncated");
      e.experts.erase("length");
      e.experts.insert("cut");
      e.fields.erase(std::remove_if(e.fields.begin(), e.fields.end(),
                                    [](const Field& f) {
                                      return f.name == "psweep.write.pairs" || f.name == "psweep.write.first_pair";
                                    }),
                     e.fields.end());
    }
    expect_alone(e, m, n);
    check_frame(got[i], e, Bytes(m.bytes.begin(), m.bytes.begin() + static_cast<long>(n)), m.what);
  }
  CHECK(truncated > 500);
}

namespace {

// A conversation written by hand.
class Script {
 public:
  struct Want {
    long request_in = 0, response_in = 0, repeats = 0;
    std::multiset<std::string> experts;
    std::string info;
  };
  Trace trace;
  std::map<long, Want> wanted;  // frames not in here are not looked at
  uint32_t token = 0xcafe0001;
  net::Address host = host_port(40000), chip = kChip;

  long ask(uint8_t type, uint16_t sequence, uint16_t tile, uint16_t index, const Bytes& payload, uint8_t flags = 0) {
    return send(host, chip, type, sequence, flags, tile, index, payload);
  }
  long answer(uint8_t type, uint16_t sequence, uint8_t code, uint16_t tile = 0, uint16_t index = 0) {
    return send(chip, host, static_cast<uint8_t>(type | net::kReply), sequence, code, tile, index,
                type == net::kOpen ? Bytes() : Bytes(4 * net::kStatusWords, 0));
  }
  long map(uint16_t sequence, uint16_t tile, uint16_t index) {
    return send(chip, host, net::kMap, sequence, net::kOk, tile, index, Bytes(8, 0));
  }
  Want& want(long frame) { return wanted[frame]; }
  // A request and its reply; of those that were sent already, or now one after the other.
  void exchange(uint8_t type, uint16_t sequence, const Bytes& payload = {}) {
    const long request = ask(type, sequence, 0, 0, payload);
    pair(request, answer(type, sequence, net::kOk));
  }
  void pair(long request, long reply) {
    wanted[request].response_in = reply;
    wanted[reply].request_in = request;
  }

  void check(const TemporaryDir& dir, bool two_passes, const std::string& options = "") {
    const auto got = Tshark(dir).dissect(trace.write(dir), options, two_passes);
    REQUIRE(got.size() == static_cast<size_t>(trace.frames()));
    for (const auto& [frame, want] : wanted) {
      const Dissection& g = got[static_cast<size_t>(frame) - 1];
      INFO("frame " << frame << ": " << g.info << (two_passes ? "" : ", one pass"));
      auto text = [](long number) { return number == 0 ? std::string() : std::to_string(number); };
      CHECK(g.show("psweep.request_in") == text(want.request_in));
      CHECK(g.show("psweep.repeats") == text(want.repeats));
      std::string time;
      if (want.request_in != 0) {
        const chip::Time t = Trace::time(frame) - Trace::time(want.request_in);
        char digits[32];
        std::snprintf(digits, sizeof digits, "0.%09d", static_cast<int>(t / chip::kNanosecond));
        time = digits;
      }
      CHECK(g.show("psweep.response_time") == time);
      if (!want.info.empty()) CHECK(g.info == want.info);
      std::multiset<std::string> experts = want.experts;
      if (two_passes) {
        CHECK(g.show("psweep.response_in") == text(want.response_in));
      } else {
        experts.erase("no_response");  // not known yet
      }
      CHECK(std::multiset<std::string>(g.experts.begin(), g.experts.end()) == experts);
    }
  }

 private:
  long send(const net::Address& from, const net::Address& to, uint8_t type, uint16_t sequence, uint8_t flags,
            uint16_t tile, uint16_t index, const Bytes& payload) {
    net::Header h;
    h.type = type;
    h.token = token;
    h.sequence = sequence;
    h.flags = flags;
    h.tile = tile;
    h.index = index;
    Bytes b = net::encode(h);
    std::copy(payload.begin(), payload.end(), std::back_inserter(b));
    const long frame = trace.add(from, to, b);
    wanted[frame];
    return frame;
  }
};

Bytes number(uint32_t v) {
  Bytes b;
  net::append32(b, v);
  return b;
}
Bytes start_bytes(uint32_t threshold = 0) {
  golden::TileJob job;
  job.tile_cols = 16, job.tile_rows = 12, job.win_cols = 36, job.win_rows = 26, job.planes = 12;
  job.threshold = static_cast<int>(threshold);
  return net::start_payload(net::ArbiterConfig{}, job, 1);
}

}  // namespace

namespace {

// One conversation and what the dissector has to say of it.
struct Conversation {
  Script s;
  static constexpr uint16_t tile = 3;

  void repeated(long frame, long first, const char* expert) {
    s.want(frame).repeats = first;
    s.want(frame).experts.insert(expert);
  }
  void unanswered(long frame) { s.want(frame).experts.insert("no_response"); }

  void session() {
    const long open = s.ask(net::kOpen, 1, 0, 0, number(5));
    s.want(open).info = "OPEN nonce 0x00000005";
    s.pair(open, s.answer(net::kOpen, 1, net::kOk));
    const long open_again = s.ask(net::kOpen, 2, 0, 0, number(5));
    repeated(open_again, open, "repeated");
    s.pair(open_again, s.answer(net::kOpen, 2, net::kOk));
    unanswered(s.ask(net::kOpen, 3, 0, 0, number(6)));  // another nonce is another request

    // STATUS is asked all the time; it is repeated where the one before is still open.
    s.exchange(net::kStatus, 4);
    const long first_status = s.ask(net::kStatus, 5, 0, 0, {});
    const long second_status = s.ask(net::kStatus, 6, 0, 0, {});
    repeated(second_status, first_status, "repeated");
    s.want(second_status).info = "STATUS [repeated]";
    s.pair(second_status, s.answer(net::kStatus, 6, net::kOk));
    s.pair(first_status, s.answer(net::kStatus, 5, net::kOk));  // overtaken
  }
  void one_tile() {
    const long start = s.ask(net::kStart, 7, tile, 0, start_bytes());
    s.want(start).info = "START tile 3 table 1: 16x12 cells, window 36x26 in 2 chunks, 12 planes";
    const long not_ready = s.answer(net::kStart, 7, net::kNotReady, tile);
    s.pair(start, not_ready);
    s.want(not_ready).experts.insert("code");
    s.want(not_ready).info = "START not ready: no session";

    const long silent = s.ask(net::kWrite, 8, tile, 0, Bytes(8, 1));  // nobody waits for an answer
    s.want(silent).info = "WRITE tile 3 chunk 0";
    const long write = s.ask(net::kWrite, 9, tile, 1, Bytes(8, 1), net::kFlagAnswer);
    s.want(write).info = "WRITE tile 3 chunk 1, answer";
    // The same packet twice on the wire: both replies belong to the first.
    repeated(s.ask(net::kWrite, 9, tile, 1, Bytes(8, 1), net::kFlagAnswer), write, "repeated");
    const long written = s.answer(net::kWrite, 9, net::kOk, tile, 1);
    s.pair(write, written);
    const long written_again = s.answer(net::kWrite, 9, net::kOk, tile, 1);
    s.want(written_again).request_in = write;
    repeated(written_again, written, "repeated_reply");

    const long read = s.ask(net::kRead, 10, tile, 0, net::read_payload(40, 0));
    s.want(read).info = "READ tile 3 chunks 0..39 keep 0";
    s.pair(read, s.answer(net::kRead, 10, net::kOk, tile));
    s.want(s.map(10, tile, 0)).request_in = read;
    const long chunk = s.map(10, tile, 1);
    s.want(chunk).request_in = read;
    s.want(chunk).info = "MAP tile 3 chunk 1: 8 bytes";
    const long chunk_again = s.map(10, tile, 1);
    s.want(chunk_again).request_in = read;
    repeated(chunk_again, chunk, "repeated_chunk");
    const long rest = s.ask(net::kRead, 11, tile, 2, net::read_payload(38, 0));
    unanswered(rest);
    s.want(s.map(11, tile, 2)).request_in = rest;
    const long rest_again = s.ask(net::kRead, 12, tile, 2, net::read_payload(8, 0));
    repeated(rest_again, rest, "repeated");
    s.pair(rest_again, s.answer(net::kRead, 12, net::kOk, tile, 2));
  }
  void release_and_set() {
    const long release = s.ask(net::kRelease, 13, tile, 0, {});
    s.pair(release, s.answer(net::kRelease, 13, net::kOk, tile));
    const long release_again = s.ask(net::kRelease, 14, tile, 0, {});
    repeated(release_again, release, "repeated");
    const long refused = s.answer(net::kRelease, 14, net::kOrder, tile);
    s.pair(release_again, refused);
    s.want(refused).experts.insert("code");

    const long half = s.ask(net::kSet, 15, 0, 0, number(net::kDuplexHalf));
    s.want(half).info = "SET duplex half";
    s.pair(half, s.answer(net::kSet, 15, net::kOk));
    const long full = s.ask(net::kSet, 16, 0, 0, number(net::kDuplexFull));  // another value
    s.pair(full, s.answer(net::kSet, 16, net::kOk));
    const long full_again = s.ask(net::kSet, 17, 0, 0, number(net::kDuplexFull));
    repeated(full_again, full, "repeated");
    unanswered(full_again);
  }
  void strangers() {
    // Answers to nobody: no such sequence, another type, a map packet to what was no READ.
    for (const long frame :
         {s.answer(net::kStatus, 99, net::kOk), s.answer(net::kStatus, 16, net::kOk), s.map(13, tile, 9)})
      s.want(frame).experts.insert("no_request");

    // A packet doubled on the wire, of those that are asked all the time.
    const Bytes zeros(net::kInfoRequestBytes - net::kHeaderBytes, 0);
    const long info = s.ask(net::kInfo, 20, 0, 0, zeros);
    repeated(s.ask(net::kInfo, 20, 0, 0, zeros), info, "repeated");
    const long told = s.answer(net::kInfo, 20, net::kBadMessage);
    s.pair(info, told);
    s.want(told).experts.insert("code");
    const long later = s.ask(net::kInfo, 21, 0, 0, zeros);
    const long told_later = s.answer(net::kInfo, 21, net::kBadMessage);
    s.pair(later, told_later);
    s.want(told_later).experts.insert("code");

    // Another session, another host: the same numbers are other requests.
    s.token = 0xcafe0002;
    unanswered(s.ask(net::kStart, 30, tile, 0, start_bytes()));
    s.token = 0xcafe0001;
    s.host = host_port(40001);
    const long other = s.ask(net::kStart, 7, tile, 0, start_bytes());
    s.pair(other, s.answer(net::kStart, 7, net::kOk, tile));
    s.want(other + 1).info = "START ok: no session";
    s.host = host_port(40000);
    // Half of all tile numbers later this one is new.
    unanswered(s.ask(net::kStart, 31, static_cast<uint16_t>(tile + 32768), 0, start_bytes()));
    unanswered(s.ask(net::kStart, 32, tile, 0, start_bytes()));

    // Long after it, the same number is another request, not the same packet twice.
    const long early = s.ask(net::kSet, 40, 0, 0, number(net::kDuplexByPin));
    s.pair(early, s.answer(net::kSet, 40, net::kOk));
    for (uint16_t i = 0; i < 300; ++i) {
      const auto n = static_cast<uint16_t>(1000 + i);
      s.ask(net::kWrite, n, tile, n, {0});
    }
    const long late = s.ask(net::kSet, 40, 0, 0, number(net::kDuplexByPin));
    repeated(late, early, "repeated");
    s.pair(late, s.answer(net::kSet, 40, net::kOk));
  }
};

}  // namespace

TEST_CASE("dissector: replies find their requests, repetitions the first of them") {
  if (skipped()) return;
  TemporaryDir dir;
  Conversation c;
  c.session();
  c.one_tile();
  c.release_and_set();
  c.strangers();
  c.s.check(dir, true);
  c.s.check(dir, true, "-Y psweep");
  c.s.check(dir, false);
}

TEST_CASE("dissector: an INFO reply helps packets before it in two passes, those of its own chip only") {
  if (skipped()) return;
  TemporaryDir dir;
  Random random(test_seed());
  const net::ArbiterConfig a = random_config(random);
  net::Header h;
  h.type = net::kMap;
  const Message map = map_packet(h, random_cells(random, a.engine, 5), a, -1);
  h.type = net::kInfo | net::kReply;
  const Message info = info_reply(h, a, {}, net::kCounterWords, {0, 0, 0, 0});
  Trace trace;
  trace.add(kChip, host_port(40000), map.bytes);
  trace.add(chip_at(kChip.ip + 1), host_port(40000), map.bytes);
  trace.add(kChip, host_port(40001), info.bytes);
  trace.add(kChip, host_port(40002), map.bytes);
  const auto pcap = trace.write(dir);
  for (const bool two_passes : {true, false}) {
    const auto got = Tshark(dir).dissect(pcap, "", two_passes);
    REQUIRE(got.size() == 4);
    CHECK(got[0].show("psweep.map.cells") == (two_passes ? "5" : ""));
    CHECK(got[1].show("psweep.map.cells") == "");
    CHECK(got[3].show("psweep.map.cells") == "5");
  }
}

TEST_CASE("dissector: random and mutated messages raise no error, and headers stay what they are") {
  if (skipped()) return;
  Random random(test_seed());
  TemporaryDir dir;
  Trace trace;
  std::vector<Bytes> sent;
  std::vector<Message> seeds;
  const net::ArbiterConfig config = random_config(random);
  for (const Layout& layout : {Layout(config), Layout()})
    for (Message& m : messages_of_all_kinds(random, layout, true)) seeds.push_back(std::move(m));
  for (int i = 0; i < 2500; ++i) {
    const Message& m = seeds[static_cast<size_t>(random.between(0, static_cast<int>(seeds.size()) - 1))];
    Bytes b = m.bytes;
    if (random.between(0, 9) == 0) b = random.bytes(random.between(2, 200));
    for (int flips = random.between(0, 8); flips > 0; --flips)
      b[random.bits(31) % b.size()] ^= static_cast<uint8_t>(1 << random.bits(3));
    if (random.between(0, 3) == 0) b.resize(static_cast<size_t>(random.between(2, static_cast<int>(b.size()) + 9)));
    net::put16(b, 0, net::kMagic);
    // All of them in two conversations, so that what spans packets gets its share.
    const net::Address chip = chip_at(0x0a050002 + random.bits(1));
    if (m.request) {
      trace.add(kHost, chip, b);
    } else {
      trace.add(chip, kHost, b);
    }
    sent.push_back(std::move(b));
  }
  const auto got = Tshark(dir).dissect(trace.write(dir));
  REQUIRE(got.size() == sent.size());
  for (size_t i = 0; i < got.size(); ++i) {
    const Bytes& b = sent[i];
    INFO("frame " << i + 1 << ": " << got[i].info);
    REQUIRE(got[i].psweep);
    check_bytes(got[i], b);
    CHECK(got[i].expert("truncated") >= (b.size() < net::kHeaderBytes));
    if (b.size() < net::kHeaderBytes) continue;
    CHECK(got[i].show("psweep.type") == std::to_string(b[3]));
    CHECK(got[i].show("psweep.sequence") == std::to_string(net::get16(b, 8)));
    CHECK(got[i].show("psweep.index") == std::to_string(net::get16(b, 14)));
    CHECK(got[i].expert("version") == (b[2] != net::kVersion));
  }
}

TEST_CASE("dissector: other bytes on its port, its messages on other ports, and in ICMP errors") {
  if (skipped()) return;
  TemporaryDir dir;
  net::Header h;
  h.type = net::kStatus;
  h.token = 0xcafe0001;
  const Bytes request = net::encode(h);
  auto changed = [&](size_t at, uint8_t value) {
    Bytes b = request;
    b[at] = value;
    return b;
  };
  Trace trace;
  std::vector<bool> shown, with_preference;
  auto add = [&](const net::Address& from, const net::Address& to, const Bytes& b, bool is, bool is_with_preference) {
    trace.add(from, to, b);
    shown.push_back(is);
    with_preference.push_back(is_with_preference);
  };
  // On the chip's port: what begins with the magic.
  add(kHost, kChip, request, true, true);
  add(kHost, kChip, changed(0, 'Q'), false, false);
  add(kHost, kChip, changed(1, 's'), false, false);
  add(kHost, kChip, {'P'}, false, false);
  add(kHost, kChip, {'P', 'S'}, true, false);
  add(kHost, kChip, changed(2, 9), true, false);
  // Elsewhere: whole headers that make sense.
  const net::Address chip = chip_at(kChip.ip, 30123);
  Bytes reply = changed(3, net::kStatus | net::kReply);
  add(kHost, chip, request, true, true);
  add(chip, kHost, reply, true, true);
  add(kHost, chip, {'P', 'S'}, false, true);
  add(kHost, chip, Bytes(request.begin(), request.end() - 1), false, true);
  add(kHost, chip, changed(2, 9), false, true);
  add(kHost, chip, changed(3, 0x0c), false, true);
  reply[10] = 6;
  add(chip, kHost, reply, false, true);
  reply[10] = 5;
  reply[11] = 1;
  add(chip, kHost, reply, false, true);
  const auto pcap = trace.write(dir);
  for (const bool preference : {false, true}) {
    const auto got = Tshark(dir).dissect(pcap, preference ? "-o psweep.port:30123" : "");
    REQUIRE(got.size() == shown.size());
    for (size_t i = 0; i < got.size(); ++i) {
      INFO("frame " << i + 1 << ", preference " << preference);
      CHECK(got[i].psweep == (preference ? with_preference[i] : shown[i]));
    }
    // Who asks and who answers shows on either port.
    CHECK(got[6].find("psweep.flags") != nullptr);
    CHECK(got[7].show("psweep.request_in") == "7");
  }

  // A request that came back as unreachable is neither a request nor a repetition. (Wireshark 4.0 shows it, 4.4 not.)
  Script s;
  const long first = s.ask(net::kRelease, 1, 0, 0, {});
  const Bytes original = net::make_udp(s.host, s.chip, net::encode(h));
  Bytes error = {3, 3, 0, 0, 0, 0, 0, 0};
  error.insert(error.end(), original.begin() + 14, original.end());
  net::put16(error, 2, net::internet_checksum(error.data(), error.size()));
  s.trace.add_frame(net::make_ip(s.chip, s.host, net::kProtocolIcmp, error));
  s.pair(first, s.answer(net::kRelease, 1, net::kOk));
  s.exchange(net::kStatus, 0);
  s.check(dir, true);
}

namespace {

struct Recorded {
  Bytes frame;
  uint64_t ns;
};
std::vector<Recorded> read_pcap(const std::string& name) {
  std::ifstream in(name, std::ios::binary);
  const std::string all((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  auto word = [&](size_t at) {
    uint32_t v = 0;
    for (size_t i = 4; i-- > 0;) v = v << 8 | static_cast<uint8_t>(all.at(at + i));
    return v;
  };
  REQUIRE(word(0) == 0xa1b23c4d);
  std::vector<Recorded> frames;
  for (size_t at = 24; at < all.size();) {
    const size_t size = word(at + 8);
    frames.push_back({Bytes(all.begin() + static_cast<long>(at) + 16, all.begin() + static_cast<long>(at + 16 + size)),
                      word(at) * uint64_t{1'000'000'000} + word(at + 4)});
    at += 16 + size;
  }
  return frames;
}

// The bytes taken apart by the host's library and put together again by messages.hpp.
Message rebuilt(const Bytes& b, bool request, const Layout& layout, int threshold) {
  const auto decoded = net::decode(b);
  REQUIRE(decoded);
  const net::Header& h = *decoded;
  std::vector<uint32_t> words;
  for (size_t at = net::kHeaderBytes; at + 4 <= b.size(); at += 4) words.push_back(net::get32(b, at));
  auto padded = [&](Message m) {
    REQUIRE(b.size() >= m.bytes.size());
    m.padding(Bytes(b.begin() + static_cast<long>(m.bytes.size()), b.end()));
    return m;
  };
  if (request) {
    switch (h.type) {
      case net::kOpen:
        return padded(open_request(h, words.at(0)));
      case net::kTable:
        return table_request(h, words);
      case net::kStart: {
        StartFields s;
        s.table = static_cast<uint16_t>(words.at(0) >> 16);
        s.zero = static_cast<uint16_t>(words.at(0));
        s.pixels = words.at(1);
        s.chunks = words.at(2);
        for (size_t i = 0; i < net::kJobWords; ++i) s.words[i] = words.at(3 + i);
        return padded(start_request(h, s, layout));
      }
      case net::kWrite:
        return write_request(h, Bytes(b.begin() + net::kHeaderBytes, b.end()), layout);
      case net::kRead:
        return padded(
            read_request(h, static_cast<uint16_t>(words.at(0) >> 16), static_cast<uint16_t>(words.at(0) & 0xffff)));
      case net::kSet:
        return padded(set_request(h, words.at(0)));
      default:
        return padded(bare_request(h));
    }
  }
  if (h.type == net::kMap && h.flags == net::kOk) {
    REQUIRE(layout);
    const auto width = static_cast<size_t>(layout->cell_bytes());
    std::vector<golden::MapCell> cells;
    for (size_t at = net::kHeaderBytes; at + width <= b.size(); at += width) {
      uint64_t word = 0;
      for (size_t i = 0; i < width; ++i) word = word << 8 | b[at + i];
      cells.push_back(net::unpack_wire_cell(layout->engine, word, 0));
      cells.back().mask = word >> (layout->cell_bits() - 1) & 1 ? 8 : 0;
    }
    return map_packet(h, cells, layout, threshold);
  }
  if (h.type == (net::kInfo | net::kReply) && h.flags == net::kOk) {
    const auto c = net::parse_info(words);
    REQUIRE(c);
    net::Mac mac;
    for (size_t i = 0; i < 6; ++i) mac[i] = static_cast<uint8_t>(c->mac >> (40 - 8 * i));
    return info_reply(h, c->config, mac, static_cast<uint32_t>(c->counters), {0, 0, 0, 0});
  }
  if (h.type == (net::kCounters | net::kReply) && h.flags == net::kOk) return counters_reply(h, words);
  if (always_bare(h) || (may_be_bare(h) && words.empty())) return padded(bare_reply(h));
  const auto s = net::parse_status(words);
  REQUIRE(s);
  return status_reply(h, *s, layout);
}

}  // namespace

namespace {

// What one host's conversation with sequence numbers that do not come again makes of requests and replies.
class Bookkeeping {
 public:
  Bookkeeping(const net::ArbiterConfig& chip, int threshold) : chip_(chip), job_threshold_(threshold) {}

  void add(long frame, uint64_t ns, const Bytes& b, bool request) {
    INFO("frame " << frame);
    Message m = rebuilt(b, request, layout_, threshold_);
    REQUIRE(m.bytes == b);
    const net::Header& h = m.header;
    types.insert(h.type);
    payloads[frame] = b;
    times_[frame] = ns;
    Expectation& e = expected[frame] = m.expect();
    std::string key = std::to_string(h.token) + "/" + std::to_string(h.type) + "/" + std::to_string(h.tile) + "/" +
                      std::to_string(h.index);
    if (h.type == net::kOpen || h.type == net::kSet) key += "/" + std::to_string(net::get32(b, net::kHeaderBytes));
    const long repeats = request ? asked(frame, m, key) : told(frame, h, key, e);
    if (repeats == 0) return;
    e.generated("psweep.repeats", std::to_string(repeats));
    if (request) e.experts.insert("repeated");
  }
  // At the end: which reply came, and which did not.
  void close() {
    for (const Sent& q : sent) {
      if (q.reply != 0) {
        expected[q.frame].generated("psweep.response_in", std::to_string(q.reply));
      } else if (q.wanted) {
        expected[q.frame].experts.insert("no_response");
        ++unanswered;
      }
    }
  }

  struct Sent {
    long frame;
    bool wanted;
    net::Header h;
    long reply = 0;
  };
  std::vector<Sent> sent;
  std::map<long, Expectation> expected;
  std::map<long, Bytes> payloads;
  std::set<uint8_t> types;
  int unanswered = 0;

 private:
  // The frame that a request repeats, or 0.
  long asked(long frame, const Message& m, const std::string& key) {
    const net::Header& h = m.header;
    const bool polled = h.type == net::kInfo || h.type == net::kCounters || h.type == net::kStatus;
    long repeats = 0;
    const auto same = by_sequence_.find(h.sequence);
    if (same != by_sequence_.end()) {
      if (polled) repeats = sent[same->second].frame;
    } else {
      by_sequence_[h.sequence] = sent.size();
      sent.push_back({frame, m.wanted, h});
      const auto before = latest_.find(h.type);
      if (polled && before != latest_.end() && sent[before->second].reply == 0) repeats = sent[before->second].frame;
      latest_[h.type] = sent.size() - 1;
    }
    if (!polled) {
      const auto [hit, is_new] = first_.insert({key, frame});
      if (!is_new) repeats = hit->second;
    }
    if (h.type == net::kStart) threshold_ = job_threshold_;
    return repeats;
  }
  // The frame that a reply repeats, or 0.
  long told(long frame, const net::Header& h, const std::string& key, Expectation& e) {
    const auto hit = by_sequence_.find(h.sequence);
    REQUIRE(hit != by_sequence_.end());  // everything the chip says answers something
    Sent& question = sent[hit->second];
    const bool map = h.type == net::kMap;
    REQUIRE(h.type == (map ? net::kMap : question.h.type | net::kReply));
    if (map) REQUIRE(question.h.type == net::kRead);
    e.generated("psweep.request_in", std::to_string(question.frame));
    const uint64_t ns = times_[frame] - times_[question.frame];
    char time[40];
    std::snprintf(time, sizeof time, "%d.%09d", static_cast<int>(ns / 1'000'000'000),
                  static_cast<int>(ns % 1'000'000'000));
    e.generated("psweep.response_time", time);
    if (h.type == (net::kInfo | net::kReply)) layout_ = chip_;
    if (map) {
      const auto [chunk, is_new] = first_.insert({key, frame});
      if (!is_new) e.experts.insert("repeated_chunk");
      return is_new ? 0 : chunk->second;
    }
    if (question.reply != 0) {
      e.experts.insert("repeated_reply");
      return question.reply;
    }
    question.reply = frame;
    return 0;
  }

  const net::ArbiterConfig chip_;
  const int job_threshold_;
  std::map<uint16_t, size_t> by_sequence_;
  std::map<std::string, long> first_;  // of a request or map chunk, by what makes it itself
  std::map<uint8_t, size_t> latest_;
  std::map<long, uint64_t> times_;
  Layout layout_;
  int threshold_ = -1;
};

// Six tiles through the simulated chip, recorded; the capabilities that it told, and the tiles' threshold.
std::pair<net::ArbiterConfig, int> record_session(const chip::Chip& chip, bool faults, const std::string& pcap) {
  chip::DeskSettings settings;
  settings.clk_mhz = 30;  // the fewer clocks, the sooner it is over
  settings.seed = test_seed();
  settings.faults.reorder = faults ? 0.1 : 0;  // no loss: its waits take long to simulate
  settings.faults.duplicate = faults ? 0.2 : 0;
  chip::Desk desk(chip.make(), settings);
  desk.record(pcap);
  chip::Station station(desk, kHost, chip.address.ip, chip.address.port);
  chip::ChipTransport transport(station, chip.address);
  net::Client client(transport, 1.0, test_seed());
  const auto capabilities = client.info();
  const golden::Config& engine = chip.config.engine;
  scene::StimulusMaker maker(engine, test_seed());
  const scene::Stimulus s = maker.make(scene::Texture::kStereo, scene::Geometry::kInside, engine.plane_cols,
                                       engine.plane_rows, engine.planes);
  int done = 0;
  net::run_link_tiles(
      client, capabilities, s.table, 6, {},
      [&](int) {
        return golden::TileInput{s.job, s.left, s.right};
      },
      [&](int, const std::vector<golden::MapCell>&) { ++done; }, [](uint64_t) {});
  REQUIRE(done == 6);
  desk.run_for(chip::kMillisecond);
  desk.finish();
  return {capabilities.config, s.job.threshold};
}

}  // namespace

TEST_CASE("dissector: a session of the simulated chip, every field of every packet, every request and its reply") {
  if (skipped()) return;
  const bool faults = GENERATE(false, true);
  TemporaryDir dir;
  const std::string pcap = (dir / "wire.pcap").string();
  const chip::Chip& chip = chip::chip_named("tiny");
  const auto [config, threshold] = record_session(chip, faults, pcap);

  const auto frames = read_pcap(pcap);
  const auto got = Tshark(dir).dissect(pcap);
  REQUIRE(got.size() == frames.size());
  Bookkeeping book(config, threshold);
  for (size_t i = 0; i < frames.size(); ++i) {
    const auto packet = net::parse_udp(frames[i].frame);
    if (packet) {
      book.add(static_cast<long>(i) + 1, frames[i].ns, packet->payload, packet->to.port == chip.address.port);
    } else {
      CHECK_FALSE(got[i].psweep);
    }
  }
  book.close();
  int repeated = 0;
  for (const auto& [frame, e] : book.expected) {
    repeated += e.experts.count("repeated") != 0;
    check_frame(got[static_cast<size_t>(frame) - 1], e, book.payloads[frame],
                "type " + std::to_string(book.payloads[frame][3]));
  }
  INFO(book.sent.size() << " requests, " << book.unanswered << " without a reply, " << repeated << " repeated");
  CHECK(book.sent.size() > 30);
  CHECK(book.types.size() >= 17);
  if (faults) CHECK(repeated > 0);
  if (!faults) CHECK(book.unanswered == 0);
}
