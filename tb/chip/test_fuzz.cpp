// SPDX-License-Identifier: Apache-2.0
// Random and mutated frames into the whole chip: what it answers, byte for byte, against the models in series -
// golden::receive_frame (MAC), golden::PacketRx (stack), golden::Arbiter (protocol), golden::transmit (reply frame).
//   Frames  : ARP, ping and UDP, good and damaged: cut, lengthened, bits flipped with and without a right FCS, lengths
//             and offsets overwritten, odd nibbles, rx_er, other addresses; messages of every type in every state:
//             without session, wrong token, hostile fields. PSWEEP_FUZZ_FRAMES (2000): frames per configuration
//   Compared: after every frame all replies, their order and number; every 500 frames counters, and a whole good tile.
//   Not compared: the token of a new session (learned from the chip), counters 24 and 25 (waiting times), tile_clocks;
//             while the engine holds a tile also what moves then: engine state, flags 1 to 4, tile in the map buffer,
//             base, received, cells, tiles_done, bitmap
//   Time    : the chip comes to rest after every frame, the model's clock is the chip's
#include <array>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "chip/chips.hpp"
#include "chip/desk.hpp"
#include "engine/stimulus.hpp"
#include "golden/arbiter.hpp"
#include "golden/mac_rx.hpp"
#include "golden/packet_rx.hpp"
#include "golden/packet_tx.hpp"
#include "support/catch.hpp"

using namespace psweep;
using namespace psweep::chip;
using net::Bytes;

namespace {

// Cuts the frame under way after some nibbles, or marks one of them with rx_er.
class Mangler : public ChipModel {
 public:
  explicit Mangler(std::unique_ptr<ChipModel> chip) : chip_(std::move(chip)) {}
  void set_pins(const StaticPins& pins) override { chip_->set_pins(pins); }
  void set_reset(bool active) override { chip_->set_reset(active); }
  void set_medium(bool carrier, bool collision) override { chip_->set_medium(carrier, collision); }
  void clk_edges(int64_t count, Time first, Time period) override { chip_->clk_edges(count, first, period); }
  void rx_edge(const MiiSample& pins, Time at) override {
    MiiSample p = pins;
    at_ = pins.valid ? at_ + 1 : 0;
    if (p.valid && at_ > cut) p = {};
    if (p.valid && at_ == bad) p.error = true;
    if (p.valid) taken.push_back({true, p.error, p.data});
    chip_->rx_edge(p, at);
  }
  MiiSample tx_edge(Time at) override { return chip_->tx_edge(at); }
  bool session() const override { return chip_->session(); }
  bool busy() const override { return chip_->busy(); }
  int64_t launches() const override { return chip_->launches(); }
  int64_t busy_clocks() const override { return chip_->busy_clocks(); }
  void open_wave(const std::string& file) override { chip_->open_wave(file); }
  void close_wave() override { chip_->close_wave(); }

  int64_t cut = INT64_MAX, bad = -1;     // nibbles, preamble included
  std::vector<golden::MiiSample> taken;  // what the chip's pins saw

 private:
  std::unique_ptr<ChipModel> chip_;
  int64_t at_ = 0;
};

int64_t frames_wanted() {
  const char* text = std::getenv("PSWEEP_FUZZ_FRAMES");
  return text ? std::atoll(text) : 2000;
}

class Fuzz {
 public:
  explicit Fuzz(const Chip& chip)
      : config_(chip.config),
        own_(chip.address),
        random_(test_seed()),
        maker_(config_.engine, test_seed()),
        model_(config_) {
    DeskSettings s;
    s.clk_mhz = 30;
    auto mangler = std::make_unique<Mangler>(chip.make());
    mangler_ = mangler.get();
    desk_ = std::make_unique<Desk>(std::move(mangler), s);
    desk_->on_frame = [this](const Bytes& f) { out_.push_back(f); };
    uint64_t mac = 0;
    for (const uint8_t b : own_.mac) mac = mac << 8 | b;
    model_.set_mac(mac);
    for (int i = 0; i < 3; ++i) {
      const auto n = static_cast<uint8_t>(i + 1);
      hosts_[i] = {{2, 0, 0, 0, 0, n}, 0x0a050000u + 10 * n, static_cast<uint16_t>(40000 + i)};
    }
    new_tile();
  }

  void run(int64_t frames) {
    for (int64_t i = 0; i < frames; ++i) {
      place_ = "frame " + std::to_string(i);
      one();
      if (i % 500 == 499 || i + 1 == frames) round();
    }
  }
  std::string report() const {
    std::string text;
    for (int i = 0; i < net::kCounterWords; ++i)
      if (net::kCounterNames[i] && counters_[i])
        text += std::string(net::kCounterNames[i]) + " " + std::to_string(counters_[i]) + ", ";
    return text + std::to_string(sent_) + " frames, " + std::to_string(replies_) + " replies, " +
           std::to_string(tiles_) + " good tiles, " + std::to_string(desk_->clocks()) + " clocks";
  }
  int64_t replies() const { return replies_; }

 private:
  int below(int n) { return static_cast<int>(random_() % static_cast<uint32_t>(n)); }
  uint32_t any() { return static_cast<uint32_t>(random_()); }
  uint8_t bit() { return static_cast<uint8_t>(1 << below(8)); }
  bool one_in(int n) { return below(n) == 0; }

  uint32_t swapped(uint32_t token) const {
    return token == chip_token_ ? model_token_ : token == model_token_ ? chip_token_ : token;
  }

  // Frame without FCS -> chip and models.
  void put(Bytes frame, bool fcs_wrong = false, int64_t cut = INT64_MAX, int64_t bad = -1, bool pad = true) {
    if (pad) {
      net::append_fcs(frame);
    } else {
      const uint32_t fcs = net::crc32(frame.data(), frame.size());
      for (int i = 0; i < 4; ++i) frame.push_back(static_cast<uint8_t>(fcs >> 8 * i));
    }
    if (fcs_wrong) frame[frame.size() - 1 - below(4)] ^= static_cast<uint8_t>(1 << below(8));
    mangler_->cut = cut;
    mangler_->bad = bad;
    mangler_->taken.clear();
    out_.clear();
    ++sent_;
    const size_t bytes = frame.size();
    desk_->send_raw(std::move(frame));
    desk_->run_for(static_cast<Time>(bytes + 8 + 14) * 80 * kNanosecond);
    while (desk_->waiting() != 0) desk_->run_for(kMicrosecond);

    model_.step(model_time());
    std::vector<Bytes> expected = judge();
    settle();
    // Map packets, whose chunks may be made only while the ones before them leave.
    collect(expected);
    wait_for(expected.size());
    settle();
    collect(expected);
    wait_for(expected.size());
    compare(expected);
  }
  double model_time() const { return static_cast<double>(desk_->clocks()) * 1e-3 / config_.clk_khz; }

  void wait_for(size_t count) {
    desk_->run_until([&] { return out_.size() >= count; }, desk_->now() + 2 * kMillisecond);
  }
  // The engine at rest, or held up for longer than any tile of these engines takes.
  void settle() {
    desk_->run_for(4 * kMicrosecond);
    const Time end = desk_->now() + kMillisecond;
    if (mangler_->launches() != launches_ || desk_->chip().busy()) {
      desk_->run_until([&] { return !desk_->chip().busy(); }, end);
      desk_->run_for(20 * kMicrosecond);
      launches_ = mangler_->launches();
    }
    model_.step(model_time());
  }

  std::vector<Bytes> judge() {
    std::vector<Bytes> expected;
    golden::ReceivedFrame frame;
    if (!golden::receive_frame(mangler_->taken, frame)) return expected;
    const golden::PacketRx stack(own_, frame.bytes);
    const golden::Received r = stack.receive(frame.verdict, true);
    for (int i = 0; i < 16; ++i)
      if (r.events >> i & 1) model_.count(static_cast<net::Counter>(i));
    if (!r.message) return expected;
    const Bytes& f = frame.bytes;
    const auto length = static_cast<std::ptrdiff_t>(r.message->length);
    net::Address peer;
    std::copy(f.begin() + 6, f.begin() + 12, peer.mac.begin());
    peer.ip = net::get32(f, r.message->kind == golden::MessageKind::kArp ? 28 : 26);
    peer.port = static_cast<uint16_t>(net::get16(f, 34));
    if (r.message->kind == golden::MessageKind::kArp) {
      expected.push_back(golden::transmit(r.message->kind, own_, peer, {}));
    } else if (r.message->kind == golden::MessageKind::kIcmp) {
      expected.push_back(golden::transmit(r.message->kind, own_, peer, Bytes(f.begin() + 38, f.begin() + 34 + length)));
    } else {
      Bytes m(f.begin() + 42, f.begin() + 42 + length);
      if (m.size() >= 16) net::put32(m, 4, swapped(net::get32(m, 4)));
      peers_.push_back(peer);
      for (Bytes& reply : model_.message(m, static_cast<uint32_t>(peers_.size() - 1))) {
        if (reply[3] == (net::kOpen | net::kReply) && reply[10] == net::kOk) {
          if (net::get32(reply, 4) != model_token_) learn_ = true;
          model_token_ = net::get32(reply, 4);
        }
        expected.push_back(golden::transmit(golden::MessageKind::kUdp, own_, peer, reply));
      }
    }
    return expected;
  }
  void collect(std::vector<Bytes>& expected) {
    while (auto packet = model_.map_packet())
      expected.push_back(golden::transmit(golden::MessageKind::kUdp, own_, peers_[model_.map_peer()], *packet));
  }

  void compare(std::vector<Bytes> expected) {
    INFO(place_);
    CAPTURE(mangler_->taken.size(), desk_->clocks());
    REQUIRE(out_.size() == expected.size());
    for (size_t i = 0; i < out_.size(); ++i) {
      model_.count(net::kTxFrames);
      ++replies_;
      Bytes got = out_[i], want = expected[i];
      if (want.size() < net::kMinFrame) want.resize(net::kMinFrame);
      CAPTURE(i);
      REQUIRE(got.size() == want.size());
      const bool message = want[12] == 8 && want[13] == 0 && want[23] == net::kProtocolUdp && want.size() >= 58;
      if (message) {
        if (learn_) {
          learn_ = false;
          REQUIRE(net::get32(got, 46) != chip_token_);
          chip_token_ = net::get32(got, 46);
        }
        // As the model would say it, and the UDP checksum made right again.
        REQUIRE(net::parse_udp(got));
        net::put32(want, 46, swapped(net::get32(want, 46)));
        mask(got, want);
        net::put16(got, 40, 0);
        net::put16(want, 40, 0);
      }
      for (size_t at = 0; at < got.size(); ++at) {
        CAPTURE(at, int(want[43 + 2]), int(want[52]));
        if (got[at] != want[at]) REQUIRE(int(got[at]) == int(want[at]));
      }
    }
  }
  void mask(Bytes& got, Bytes& want) {
    const uint8_t type = want[45];
    if (type == (net::kInfo | net::kReply) && want[44] == net::kVersion && want[52] == 0) return;
    if (type == (net::kCounters | net::kReply) && want[52] == 0) {
      for (int i = 0; i < net::kCounterWords; ++i) counters_[i] = net::get32(got, 58 + 4 * i);
      for (const int i : {net::kEngineWaitRows, net::kEngineWaitMap})
        net::put32(got, 58 + 4 * i, net::get32(want, 58 + 4 * i));
      return;
    }
    if (type == net::kMap) return;
    auto same = [&](size_t at, uint8_t bits = 0xff) {
      got[at] = static_cast<uint8_t>((got[at] & ~bits) | (want[at] & bits));
    };
    for (size_t i = 0; i < 4; ++i) same(58 + 4 * 7 + i);
    if (((want[61] | got[61]) & net::kFlagEngine) == 0) return;
    same(60);
    same(61, net::kFlagRows | net::kFlagEngine | net::kFlagMap | net::kFlagMapComplete);
    for (const size_t at : {64, 65, 66, 67, 68, 69, 74, 75, 76, 77, 82, 83}) same(at);
    for (size_t at = 58 + 36; at < got.size(); ++at) same(at);
  }

  // Messages ----------------------------------------------------------------------------------------------------------
  Bytes message(uint8_t type, uint16_t tile = 0, uint16_t index = 0, const Bytes& body = {}, uint8_t flags = 1) {
    net::Header h;
    h.type = type;
    h.token = chip_token_;
    h.sequence = static_cast<uint16_t>(random_());
    h.flags = flags;
    h.tile = tile;
    h.index = index;
    Bytes b = net::encode(h);
    net::append_bytes(b, body.data(), body.size());
    return b;
  }
  static Bytes number(uint32_t value) {
    Bytes b;
    net::append32(b, value);
    return b;
  }
  Bytes noise(size_t size) {
    Bytes b(size);
    for (uint8_t& x : b) x = static_cast<uint8_t>(random_());
    return b;
  }
  void new_tile() {
    const golden::Config& c = config_.engine;
    tile_ = maker_.make(tb::Texture::kRandom, one_in(2) ? tb::Geometry::kInside : tb::Geometry::kBorder,
                        1 + below(std::min(6, c.plane_cols)), 1 + below(std::min(4, c.plane_rows)), 1 + below(3));
  }
  uint32_t pixels() const { return static_cast<uint32_t>(tile_.job.win_cols * tile_.job.win_rows); }
  uint32_t chunks() const { return (pixels() + config_.chunk_pairs() - 1) / config_.chunk_pairs(); }
  Bytes table_bytes() const {
    Bytes b;
    for (const auto& e : tile_.table)
      for (const uint32_t w : {uint32_t(e.x0_left), uint32_t(e.y0_left), uint32_t(e.x0_right), uint32_t(e.y0_right),
                               e.dx_left, e.dy_left, e.dx_right, e.dy_right})
        net::append32(b, w);
    return b;
  }
  Bytes start_bytes() const {
    Bytes b;
    net::append16(b, table_id_);
    net::append16(b, 0);
    net::append32(b, pixels());
    net::append32(b, chunks());
    for (const auto& w : golden::job_writes(tile_.job)) net::append32(b, w.value);
    return b;
  }
  Bytes chunk_bytes(uint32_t chunk) {
    Bytes b;
    for (int i = 0; i < config_.chunk_pairs(); ++i) {
      const size_t at = static_cast<size_t>(chunk) * config_.chunk_pairs() + i;
      uint32_t value = 0;
      if (at < tile_.left.data.size())
        value = uint32_t{tile_.left.data[at]} << config_.engine.pix_bits | tile_.right.data[at];
      for (int s = config_.pair_bytes() - 1; s >= 0; --s) b.push_back(static_cast<uint8_t>(value >> 8 * s));
    }
    return b;
  }
  void say(const Bytes& m, int host = 0) { put(net::make_udp(hosts_[host], own_, m)); }

  Bytes any_message() {
    const auto near = [this](int most) { return static_cast<uint16_t>(one_in(4) ? random_() : below(most) - 1); };
    const auto type = static_cast<uint8_t>(one_in(30) ? random_() : 1 + below(net::kSet));
    Bytes body;
    if (type == net::kOpen) body = number(static_cast<uint32_t>(below(2)));
    if (type == net::kTable) body = one_in(3) ? noise(4 * static_cast<size_t>(1 + below(8))) : table_bytes();
    if (type == net::kStart) body = start_bytes();
    if (type == net::kWrite) body = noise(static_cast<size_t>(config_.chunk_pairs()) * config_.pair_bytes());
    if (type == net::kRead) body = number(static_cast<uint32_t>(below(6)) << 16 | static_cast<uint32_t>(below(4)));
    if (type == net::kSet) body = number(one_in(3) ? any() : 2u * static_cast<uint32_t>(below(2)));
    if (type == net::kClose && !one_in(4)) return message(net::kStatus);
    Bytes m = message(type, near(5), near(40), body, static_cast<uint8_t>(below(4)));
    if (one_in(8)) net::put32(m, 4, one_in(2) ? 0 : any());
    if (one_in(10)) m[static_cast<size_t>(below(static_cast<int>(std::min<size_t>(m.size(), 36))))] ^= bit();
    if (one_in(12)) m.resize(static_cast<size_t>(below(static_cast<int>(m.size()) + 8)));
    return m;
  }
  void one() {
    const int kind = below(10);
    Bytes f;
    if (kind == 0) {
      f = net::make_arp_request(hosts_[below(3)], one_in(4) ? any() : own_.ip);
    } else if (kind == 1) {
      f = net::make_icmp_echo(hosts_[below(3)], own_, 8, noise(static_cast<size_t>(4 + below(one_in(8) ? 1400 : 60))));
    } else {
      f = net::make_udp(hosts_[below(3)], own_, any_message());
    }
    const int harm = below(20);
    if (harm == 0) return put(f, true);
    if (harm == 1) return put(f, false, 16 + below(static_cast<int>(2 * f.size())));
    if (harm == 2) return put(f, false, INT64_MAX, 17 + below(static_cast<int>(2 * f.size())));
    if (harm == 3) f[static_cast<size_t>(below(static_cast<int>(std::min<size_t>(f.size(), 42))))] ^= bit();
    if (harm == 4) f.resize(static_cast<size_t>(14 + below(static_cast<int>(f.size()))));
    if (harm == 5) f.resize(f.size() + static_cast<size_t>(below(one_in(4) ? 600 : 30)));
    if (harm == 6) f[static_cast<size_t>(16 + below(2))] = static_cast<uint8_t>(random_());
    if (harm == 7 && f.size() > 40) f[static_cast<size_t>(38 + below(2))] = static_cast<uint8_t>(random_());
    if (harm == 8) f[static_cast<size_t>(below(6))] ^= bit();
    put(f, false, INT64_MAX, -1, !one_in(10));
  }
  // Everything must work now: counters, ARP, ping, a whole tile.
  void round() {
    say(message(net::kClose));
    say(message(net::kOpen, 0, 0, number(77)));
    say(message(net::kCounters));
    say(message(net::kInfo));
    put(net::make_arp_request(hosts_[0], own_.ip));
    REQUIRE(out_.size() == 1);
    put(net::make_icmp_echo(hosts_[0], own_, 8, noise(32)));
    REQUIRE(out_.size() == 1);
    new_tile();
    table_id_ = 1;
    const Bytes table = table_bytes();
    for (size_t at = 0; at < table.size(); at += 32)
      say(message(net::kTable, 1, static_cast<uint16_t>(at / 4), Bytes(table.begin() + at, table.begin() + at + 32)));
    say(message(net::kStart, 0, 0, start_bytes()));
    for (uint32_t c = 0; c < chunks(); ++c) say(message(net::kWrite, 0, static_cast<uint16_t>(c), chunk_bytes(c)));
    const auto cells = golden::run_tile(config_.engine, tile_.job, tile_.table, tile_.left, tile_.right).cells;
    const size_t per = static_cast<size_t>(config_.chunk_cells()), count = (cells.size() + per - 1) / per;
    size_t compared = 0;
    for (size_t c = 0; c < count; ++c) {
      say(message(net::kRead, 0, static_cast<uint16_t>(c), number(1u << 16 | static_cast<uint32_t>(c))));
      REQUIRE(out_.size() == 2);
      const Bytes& f = out_[1];
      const auto width = static_cast<size_t>(config_.cell_bytes());
      for (size_t i = c * per; i < std::min(cells.size(), (c + 1) * per); ++i, ++compared) {
        uint64_t word = 0;
        for (size_t b = 0; b < width; ++b) word = word << 8 | f[58 + (i - c * per) * width + b];
        REQUIRE(word == net::pack_wire_cell(config_.engine, cells[i]));
      }
    }
    REQUIRE(compared == cells.size());
    say(message(net::kRelease, 0));
    say(message(net::kStatus));
    ++tiles_;
  }

  net::ArbiterConfig config_;
  net::Address own_;
  std::mt19937 random_;
  tb::StimulusMaker maker_;
  golden::Arbiter model_;
  Mangler* mangler_ = nullptr;
  std::unique_ptr<Desk> desk_;
  std::array<net::Address, 3> hosts_;
  std::vector<net::Address> peers_;
  std::vector<Bytes> out_;
  tb::Stimulus tile_;
  std::array<uint32_t, net::kCounterWords> counters_{};
  std::string place_;
  uint32_t chip_token_ = 0x12345678, model_token_ = 0x9abcdef0;
  uint16_t table_id_ = 0;
  bool learn_ = false;
  int64_t launches_ = 0, sent_ = 0, replies_ = 0, tiles_ = 0;
};

}  // namespace

TEST_CASE("chip: random and mutated frames against the models") {
  const std::string name = GENERATE("tiny", "tiny_min");
  CAPTURE(name, test_seed());
  Fuzz fuzz(chip_named(name));
  fuzz.run(frames_wanted());
  CHECK(fuzz.replies() > 0);
  std::printf("%s: %s\n", name.c_str(), fuzz.report().c_str());
}
