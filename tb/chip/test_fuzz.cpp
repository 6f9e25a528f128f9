// SPDX-License-Identifier: Apache-2.0
// Random and mutated frames into the whole chip: what it answers, byte for byte, against the models in series -
// golden::receive_frame (MAC), golden::PacketRx (stack), golden::Arbiter (protocol), golden::transmit (reply frame).
//   Frames  : messages that a good host would send next, chosen by the model's state, so that tiles go all the way;
//             among them messages of every type that are wrong in that state: without session, with another's token,
//             old and future tiles, hostile fields, rows of the tile in work once more with other content; ARP, ping,
//             fragments, IP options, bursts beyond the room for waiting frames, more unauthenticated messages than are
//             answered, sessions that move to another host. Then damage: cut, lengthened, bits
//             flipped with and without a right FCS, lengths and offsets overwritten, odd nibbles, rx_er, other
//             addresses
//   Number  : PSWEEP_FUZZ_FRAMES (2000) per configuration; PSWEEP_FUZZ_PROGRESS=1: a line on stderr now and then;
//             PSWEEP_FUZZ_CHIP: that configuration alone
//   Compared: after every frame all replies, their order and number, every byte of every map; every 500 frames a whole
//             good pair of three tiles goes through ('right afterwards') and the counters agree
//   Buffers : map cells come from the row buffer and through the map buffer; a byte written to a wrong place of either
//             appears as a wrong cell, a reply of wrong bytes or a wrong bitmap
//   Classes : what the models saw is counted by name; a class of kClasses without a single frame fails
//   Not compared: the token of a new session (learned from the chip, must differ from the one before); in a
//             reply that is made while the engine takes or gives up its rows or unloads, what moves then (status words
//             0 to 2, 4 to 6, 8 and the bitmap, but not the tile numbers, table or code); during a sweep error bits
//             and window errors, which the model knows only for whole tiles (and after the end of a session);
//             tile_clocks of a tile that had to wait (its stalls are those of the wire). Counters 24 and 25 (waiting,
//             in 256 clocks) have a tolerance of 10 and 2 more per begin or end of waiting: the model does not know
//             how long a message takes inside
//   Time    : frames come while the engine is at rest, held up or in the middle of a sweep; the model's clock is the
//             chip's. No frame is decided on in the clocks around a millisecond's tick, in which the answers that are
//             left may be one more or less
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <random>
#include <string>

#include "desk/desk.hpp"
#include "golden/arbiter.hpp"
#include "golden/mac_rx.hpp"
#include "golden/packet_rx.hpp"
#include "golden/packet_tx.hpp"
#include "net/client.hpp"
#include "scene/stimulus.hpp"
#include "support/catch.hpp"
#include "verilated/chips.hpp"

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

int64_t number_from(const char* variable, int64_t otherwise) {
  const char* text = std::getenv(variable);
  return text ? std::atoll(text) : otherwise;
}

// What has to happen in a run of 10,000 frames, in every configuration. 2,000 may miss ten of these.
constexpr const char* kClasses[] = {
    "frame: no delimiter", "frame: rx_fcs", "frame: rx_align", "frame: rx_short", "frame: rx_long", "frame: rx_error",
    "frame: rx_filtered", "frame: rx_other", "frame: ip_header", "frame: ip_fragment", "frame: checksum", "frame: arp",
    "frame: icmp", "frame: udp", "frame: bad_source", "port unreachable", "burst: answered", "burst: no room",
    // Type and code.
    "OPEN ok", "OPEN busy", "OPEN bad message", "CLOSE ok", "CLOSE busy", "INFO ok", "INFO bad message", "COUNTERS ok",
    "COUNTERS bad message", "STATUS ok", "STATUS no session", "STATUS busy", "TABLE ok", "TABLE no session",
    "TABLE busy", "TABLE bad message", "TABLE order", "TABLE not ready", "START ok", "START no session", "START busy",
    "START bad message", "START order", "START not ready", "WRITE ok", "WRITE no session", "WRITE busy",
    "WRITE bad message", "WRITE order", "WRITE not ready", "READ ok", "READ no session", "READ busy",
    "READ bad message", "RELEASE ok", "RELEASE no session", "RELEASE busy", "RELEASE order", "SET ok", "SET no session",
    "SET busy", "SET bad message",
    // In particular.
    "no message", "unknown type", "other version", "answer", "limited", "OPEN limited", "OPEN moves the session",
    "STATUS with the token from elsewhere", "START with other chunks", "OPEN again", "CLOSE without a session",
    "CLOSE in a sweep", "CLOSE while the map waits", "START again", "WRITE unanswered", "WRITE again",
    "WRITE beyond the slots", "WRITE of a tile that was taken", "READ before its map", "READ that keeps",
    "RELEASE again", "map packet", "message in a sweep", "tile done", "tile refused", "tile too short", "tile too long",
    "samples outside the window", "table beyond the engine's"};

class Fuzz {
 public:
  explicit Fuzz(const Chip& chip)
      : name_(chip.name),
        config_(chip.config),
        own_(chip.address),
        random_(test_seed()),
        maker_(config_.engine, test_seed()),
        model_(config_) {
    DeskSettings s;
    s.clk_mhz = 30;
    clk_ = std::llround(1e9 / s.clk_mhz);
    auto mangler = std::make_unique<Mangler>(chip.make());
    mangler_ = mangler.get();
    desk_ = std::make_unique<Desk>(std::move(mangler), s);
    desk_->on_frame = [this](const Bytes& f) { out_.push_back(f); };
    uint64_t mac = 0;
    for (const uint8_t b : own_.mac) mac = mac << 8 | b;
    model_.set_mac(mac);
    model_.set_tick_phase((static_cast<double>(desk_->released()) + 5) * 1e-3 / config_.clk_khz);
    for (int i = 0; i < 3; ++i) {
      const auto n = static_cast<uint8_t>(i + 1);
      hosts_[i] = {{2, 0, 0, 0, 0, n}, 0x0a050000u + 10 * n, static_cast<uint16_t>(40000 + i)};
    }
    new_table();
  }

  void run(int64_t frames) {
    const bool timer = config_.session_ms * config_.clk_khz <= 5000000;  // else minutes
    for (int64_t i = 0; i < frames; ++i) {
      place_ = "frame " + std::to_string(i);
      one();
      if (timer && i % 10000 == 600) wait_for_timeout();
      if (i % 500 == 499 || i + 1 == frames) round();
      if (progress_ && (i % 1000 == 999 || i + 1 == frames))
        std::fprintf(stderr, "%s: %lld of %lld frames, %lld tiles\n", name_.c_str(), static_cast<long long>(i + 1),
                     static_cast<long long>(frames), static_cast<long long>(classes_["tile done"]));
    }
    if (timer) CHECK(classes_["session timeout"] > 0);
    if (frames < 2000) return;
    std::vector<std::string> missing;
    for (const char* name : kClasses)
      if (classes_.count(name) == 0) missing.emplace_back(name);
    // What only buffers for less than a tile can show.
    for (const char* name : {"CLOSE while rows are taken", "RELEASE not ready"})
      if (config_.map_depth != 0 && classes_.count(name) == 0) missing.emplace_back(name);
    CAPTURE(missing);
    CHECK(missing.size() <= (frames < 10000 ? 10 : 0));
  }
  std::string report() const {
    std::string text;
    for (const auto& [name, count] : classes_) text += "  " + name + ": " + std::to_string(count) + "\n";
    return name_ + ": " + std::to_string(sent_) + " frames, " + std::to_string(replies_) + " replies, " +
           std::to_string(pairs_) + " pairs 'right afterwards', " + std::to_string(desk_->clocks()) + " clocks\n" +
           text;
  }
  int64_t replies() const { return replies_; }

 private:
  // Of a reply: what the model cannot know of its moment.
  enum class Moment { kRest, kSweep, kMoving };
  struct Expected {
    Bytes frame;
    Moment moment = Moment::kRest;
    bool clocks = false, at_least = false;  // tile_clocks: to be compared, is the least
  };
  struct State {
    uint32_t row_tile, flags, engine_tile, map_tile, base, received, table, words, cells, engine, done, dropped, errors;
    bool has(uint32_t flag) const { return (flags & flag) != 0; }
  };

  int below(int n) { return static_cast<int>(random_() % static_cast<uint32_t>(n)); }
  uint32_t any() { return static_cast<uint32_t>(random_()); }
  uint8_t bit() { return static_cast<uint8_t>(1 << below(8)); }
  bool one_in(int n) { return below(n) == 0; }
  void seen(const std::string& name) { ++classes_[name]; }

  uint32_t swapped(uint32_t token) const {
    return token == chip_token_ ? model_token_ : token == model_token_ ? chip_token_ : token;
  }

  State state() const {
    const auto w = model_.status();
    return {w[0] >> 16,    w[0] & 0xff, w[1] >> 16,    w[1] & 0xffff, w[2] >> 16,    w[2] & 0xffff, w[3] >> 16,
            w[3] & 0xffff, w[4],        w[0] >> 8 & 7, w[6] >> 16,    w[6] & 0xffff, w[5] >> 16};
  }

  // Time --------------------------------------------------------------------------------------------------------------
  double model_time() const { return static_cast<double>(desk_->clocks()) * 1e-3 / config_.clk_khz; }
  void run_clocks(double clocks) { desk_->run_for(static_cast<Time>(clocks * static_cast<double>(clk_)) + clk_); }
  void step() {
    const State before = state();
    model_.step(model_time());
    watch(before);
  }
  // Chip and model differ by less than this in when something happens inside.
  static constexpr double kSlack = 300;
  double settling() const {
    return kSlack + config_.engine.plane_cols * config_.engine.plane_rows + 2 * config_.slots();
  }
  // Until nothing moves, or into a sweep that lasts for more than `clocks` from now.
  void rest(double clocks = 0) {
    for (;;) {
      step();
      const auto event = model_.next_event();
      if (!event) break;
      dirty_ = true;
      const double left = (*event - model_time()) * config_.clk_khz * 1e3;
      if (model_.sweeping() && linger_ && left > clocks + 2 * kSlack) {
        if (sweep_since_ < 0) {
          run_clocks(kSlack);
          sweep_since_ = 0;
          continue;
        }
        gather();
        return;
      }
      if (!model_.sweeping()) sweep_since_ = -1;
      run_clocks(std::max(1.0, left));
    }
    sweep_since_ = -1;
    if (dirty_) run_clocks(settling());
    dirty_ = false;
    step();
    gather();
  }
  // Replies due, map packets among them, whose chunks may be made only while the ones before them leave.
  void gather() {
    while (auto packet = model_.map_packet()) {
      expected_.push_back({golden::transmit(golden::MessageKind::kUdp, own_, peers_[model_.map_peer()], *packet)});
      seen("map packet");
    }
    desk_->run_until([&] { return out_.size() >= expected_.size(); }, desk_->now() + 3 * kMillisecond);
    compare();
  }

  // Clocks that are short of the next tick by `before` or past one by `after` are passed, where the model and the chip
  // might not agree on what is left of the answers.
  void avoid_tick(double from, double to) {
    const double ms = config_.clk_khz, phase = static_cast<double>(desk_->released()) + 5;
    const double now = static_cast<double>(desk_->clocks());
    const double first = std::ceil((now + from - phase) / ms) * ms + phase;  // tick at or after `from`
    if (first <= now + to) run_clocks(first - (now + from) + 1);
  }
  bool tick_within(double clocks) const {
    const double ms = config_.clk_khz, phase = static_cast<double>(desk_->released()) + 5;
    const double now = static_cast<double>(desk_->clocks());
    return std::ceil((now - 2000 - phase) / ms) * ms + phase <= now + clocks;
  }
  // Waits for answers that are allowed again.
  void need(golden::Arbiter::Bucket bucket, int count = 1) {
    if (model_.left(bucket) >= count) return;
    linger_ = false;
    rest();
    while (model_.left(bucket) < count) {
      run_clocks(config_.clk_khz / 4.0);
      dirty_ = true;
      step();
    }
    rest();
  }
  // Who has the session.
  int speaker() const {
    if (!model_.session_open()) return 0;
    const net::Address& peer = peers_[model_.map_peer()];
    for (int i = 0; i < 3; ++i)
      if (hosts_[static_cast<size_t>(i)] == peer) return i;
    return 0;
  }

  // Frames ------------------------------------------------------------------------------------------------------------
  void transmit(Bytes frame, int64_t cut, int64_t bad) {
    mangler_->cut = cut;
    mangler_->bad = bad;
    mangler_->taken.clear();
    ++sent_;
    const size_t bytes = frame.size();
    // The responder does not look at what is behind the message.
    const size_t message = bytes > 18 ? std::min<size_t>(bytes, 14 + net::get16(frame, 16)) : bytes;
    const double wire = static_cast<double>(bytes + 8 + 14) * 80 * kNanosecond / static_cast<double>(clk_);
    const double inside = static_cast<double>(message) + 250;  // header and rows pass through the responder
    avoid_tick(wire - 300, wire + inside + 300);
    desk_->send_raw(std::move(frame));
    desk_->run_for(static_cast<Time>(bytes + 8 + 14) * 80 * kNanosecond);
    while (desk_->waiting() != 0) desk_->run_for(kMicrosecond);
    run_clocks(inside);
  }
  // Frame without FCS -> chip and models.
  void put(Bytes frame, bool fcs_wrong = false, int64_t cut = INT64_MAX, int64_t bad = -1, bool pad = true) {
    if (pad) {
      net::append_fcs(frame);
    } else {
      const uint32_t fcs = net::crc32(frame.data(), frame.size());
      for (int i = 0; i < 4; ++i) frame.push_back(static_cast<uint8_t>(fcs >> 8 * i));
    }
    if (fcs_wrong) frame[frame.size() - 1 - below(4)] ^= bit();
    // On the wire, in the responder, and its reply: of a ping as long, of a READ some map packets.
    const bool udp = frame.size() > 46 && frame[23] == net::kProtocolUdp;
    const bool read = udp && frame[45] == net::kRead;
    rest((udp ? 3.5 : 12.5) * static_cast<double>(frame.size()) + (read ? 6.0 * 4 * config_.chunk_bytes : 0.0) +
         (tick_within(8000) ? 4500 : 1300));
    latest_.clear();
    transmit(std::move(frame), cut, bad);
    step();
    judge();
    gather();
    rest();
  }

  // What the models say to the frame at the pins.
  void judge() {
    golden::ReceivedFrame frame;
    if (!golden::receive_frame(mangler_->taken, frame)) return seen("frame: no delimiter");
    const golden::PacketRx stack(own_, frame.bytes);
    const golden::Received r = stack.receive(frame.verdict, true, !model_.full_duplex());
    for (int i = 0; i < golden::kReceiveEvents; ++i) {
      if ((r.events >> i & 1) == 0) continue;
      const auto counter = i == golden::kEventBadSource  ? net::kBadSource
                           : i == golden::kEventFragment ? net::kRxFragment
                                                         : static_cast<net::Counter>(i);
      model_.count(counter);
      if (i != net::kRxFrames) seen(std::string("frame: ") + net::kCounterNames[counter]);
    }
    if (!r.message) return;
    const Bytes& f = frame.bytes;
    const auto length = static_cast<std::ptrdiff_t>(r.message->length);
    net::Address peer;
    const bool arp = r.message->kind == golden::MessageKind::kArp;
    std::copy(f.begin() + (arp ? 22 : 6), f.begin() + (arp ? 28 : 12), peer.mac.begin());
    peer.ip = net::get32(f, arp ? 28 : 26);
    peer.port = static_cast<uint16_t>(net::get16(f, 34));
    using Bucket = golden::Arbiter::Bucket;
    if (r.message->kind != golden::MessageKind::kUdp && !model_.allow(arp ? Bucket::kArp : Bucket::kOther)) {
      seen("limited");
    } else if (r.message->kind == golden::MessageKind::kClosed) {
      Bytes offender(4, 0);
      offender.insert(offender.end(), f.begin() + 14, f.begin() + 42);
      expected_.push_back({golden::transmit(r.message->kind, own_, peer, offender)});
      model_.count(net::kUnreachable);
      seen("port unreachable");
    } else if (arp) {
      expected_.push_back({golden::transmit(r.message->kind, own_, peer, {})});
    } else if (r.message->kind == golden::MessageKind::kIcmp) {
      expected_.push_back(
          {golden::transmit(r.message->kind, own_, peer, Bytes(f.begin() + 38, f.begin() + 34 + length))});
    } else {
      Bytes m(f.begin() + 42, f.begin() + 42 + length);
      if (m.size() >= 16) net::put32(m, 4, swapped(net::get32(m, 4)));
      const auto at = std::find(peers_.begin(), peers_.end(), peer);
      const auto number = static_cast<uint32_t>(at - peers_.begin());
      if (at == peers_.end()) peers_.push_back(peer);
      message_arrives(m, number);
    }
  }
  // tile_clocks shown are those of the latest tile that was done.
  void note_done(uint32_t done) {
    if (done > done_) shown_slow_ = slow_load_ || done > done_ + 1;
    done_ = done;
  }
  void message_arrives(const Bytes& m, uint32_t number) {
    const net::Address peer = peers_[number];
    const State before = state();
    note_done(before.done);
    const bool swept = model_.sweeping();
    const uint32_t limited = model_.counter(net::kLimited), other = model_.map_peer();
    const std::vector<Bytes> replies = model_.message(m, number);
    if (model_.counter(net::kLimited) != limited) seen(m[3] == net::kOpen ? "OPEN limited" : "limited");
    if (before.has(net::kFlagSession) && number != other && m.size() >= 16 && model_.latest_code()) {
      if (m[3] == net::kOpen && *model_.latest_code() == net::kOk) seen("OPEN moves the session");
      if (m[3] == net::kStatus && net::get32(m, 4) == model_.token()) seen("STATUS with the token from elsewhere");
    }
    const State after = state();
    note_done(after.done);
    watch(before);
    name_message(m, before, after, swept, !replies.empty());

    // Rows are taken, or a map that waited for room goes on.
    const bool moving = (model_.next_event() && !model_.sweeping()) ||
                        (before.engine == 4 && (after.cells != before.cells || after.flags != before.flags));
    if (moving) dirty_ = true;
    if (after.engine == 1) {
      // A reply that is read meanwhile holds up the row buffer.
      slow_load_ = (before.engine == 1 && slow_load_) || !replies.empty();
      linger_ = !in_round_ && !one_in(4);
    }
    for (const Bytes& reply : replies) {
      if (reply[3] == (net::kOpen | net::kReply) && reply[10] == net::kOk) {
        if (net::get32(reply, 4) != model_token_) learn_ = true;
        model_token_ = net::get32(reply, 4);
      }
      Expected e{golden::transmit(golden::MessageKind::kUdp, own_, peer, reply)};
      e.moment = moving ? Moment::kMoving : model_.sweeping() ? Moment::kSweep : Moment::kRest;
      e.clocks = after.engine == 0 && !moving && model_.clocks_exact();
      e.at_least = shown_slow_;
      expected_.push_back(std::move(e));
    }
  }
  void name_message(const Bytes& m, const State& before, const State& after, bool swept, bool answered) {
    const auto code = model_.latest_code();
    if (!code) {
      const bool no_message = m.size() < 16 || net::get16(m, 0) != net::kMagic;
      if (no_message || (m[3] & net::kReply) != 0) seen(no_message ? "no message" : "answer");
      return;
    }
    const uint8_t type = m[3];
    if (m[2] != net::kVersion) return seen("other version");
    if (type == 0 || type > net::kSet) return seen("unknown type");
    seen(std::string(net::type_name(type)) + " " + net::code_name(*code));
    if (swept) seen("message in a sweep");
    const uint32_t tile = net::get16(m, 12), index = net::get16(m, 14);
    const bool open = before.has(net::kFlagSession);
    if (type == net::kClose && *code == net::kOk) {
      if (!open) seen("CLOSE without a session");
      if (before.engine == 1) seen("CLOSE while rows are taken");
      if (before.engine == 2) seen("CLOSE in a sweep");
      if (before.engine == 4) seen("CLOSE while the map waits");
    }
    if (*code == net::kBadMessage && type == net::kStart && m.size() >= net::kHeaderBytes + net::kStartBytes &&
        net::get32(m, 20) >> 24 == 0 && net::get32(m, 24) >> 16 == 0 && net::get32(m, 20) * net::get32(m, 24) != 0)
      seen("START with other chunks");
    if (*code == net::kNotReady && type == net::kWrite) seen("WRITE beyond the slots");
    if (*code != net::kOk) return;
    if (type == net::kOpen && open) seen("OPEN again");
    if (type == net::kStart && after.row_tile == before.row_tile) seen("START again");
    if (type == net::kRelease && !before.has(net::kFlagMap)) seen("RELEASE again");
    if (type == net::kRead && tile != before.map_tile && tile == before.row_tile) seen("READ before its map");
    if (type == net::kRead && tile == before.map_tile && net::get16(m, 18) != 0) seen("READ that keeps");
    if (type == net::kTable && index + (m.size() - 16) / 4 > 8u * static_cast<uint32_t>(config_.engine.planes))
      seen("table beyond the engine's");
    if (type == net::kWrite) {
      if (!answered) seen("WRITE unanswered");
      if (!before.has(net::kFlagRows)) {
        seen("WRITE of a tile that was taken");
      } else if (after.received == before.received && after.has(net::kFlagRows)) {
        seen("WRITE again");
      }
    }
  }
  // Of the engine.
  void watch(const State& before) {
    const State now = state();
    if (now.done > before.done) seen("tile done");
    const struct {
      uint32_t error;
      const char* name;
    } names[] = {{golden::kErrorConfig, "tile refused"},
                 {golden::kErrorShort, "tile too short"},
                 {golden::kErrorLong, "tile too long"},
                 {golden::kErrorWindow, "samples outside the window"}};
    for (const auto& n : names)
      if ((now.errors & ~before.errors & n.error) != 0) seen(n.name);
    const auto waits = [](const State& x) { return x.engine == 4 || (x.engine == 0 && x.has(net::kFlagRows)); };
    if (waits(now) != waits(before)) ++waits_changed_;
  }

  void compare() {
    INFO(place_);
    CAPTURE(mangler_->taken.size(), desk_->clocks());
    const auto named = [](const Bytes& f) {
      return f.size() < 58 ? "short; "
                           : std::to_string(f[45]) + " tile " + std::to_string(net::get16(f, 54)) + " index " +
                                 std::to_string(net::get16(f, 56)) + "; ";
    };
    std::string sent, due;
    if (out_.size() != expected_.size()) {
      for (const Bytes& f : out_) sent += named(f);
      for (const Expected& e : expected_) due += named(e.frame);
    }
    CAPTURE(sent, due, model_.status());
    REQUIRE(out_.size() == expected_.size());
    for (size_t i = 0; i < out_.size(); ++i) {
      model_.count(net::kTxFrames);
      ++replies_;
      Bytes got = out_[i], want = expected_[i].frame;
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
        mask(got, want, expected_[i]);
        net::put16(got, 40, 0);
        net::put16(want, 40, 0);
      }
      for (size_t at = 0; at < got.size(); ++at) {
        if (got[at] == want[at]) continue;
        CAPTURE(at, int(want[43 + 2]), int(want[52]), static_cast<int>(expected_[i].moment));
        REQUIRE(int(got[at]) == int(want[at]));
      }
    }
    if (!out_.empty()) latest_ = std::move(out_);
    out_.clear();
    expected_.clear();
  }
  void mask(Bytes& got, Bytes& want, const Expected& e) {
    const uint8_t type = want[45];
    if (net::get16(want, 38) == 8 + net::kHeaderBytes) return;
    if (type == (net::kInfo | net::kReply) && want[52] == net::kOk) return;
    if (type == (net::kCounters | net::kReply) && want[52] == net::kOk) {
      for (size_t i = 0; i < 2; ++i) {
        const size_t at = 58 + 4 * (net::kEngineWaitRows + i);
        const auto difference = static_cast<int64_t>(net::get32(got, at)) - net::get32(want, at);
        const int64_t moved = std::abs(difference - waits_[i]);
        CAPTURE(net::get32(got, at), net::get32(want, at), waits_[i], waits_changed_);
        REQUIRE(moved <= 10 + 2 * waits_changed_);
        waits_[i] = difference;
        net::put32(got, at, net::get32(want, at));
      }
      waits_changed_ = 0;
      return;
    }
    if (type == net::kMap && want[52] == net::kOk) return;
    auto same = [&](size_t word, size_t first = 0, size_t last = 3, uint8_t bits = 0xff) {
      for (size_t i = first; i <= last; ++i) {
        const size_t at = 58 + 4 * word + i;
        got[at] = static_cast<uint8_t>((got[at] & ~bits) | (want[at] & bits));
      }
    };
    if (!e.clocks) {
      same(7);
    } else if (e.at_least) {
      REQUIRE(net::get32(got, 58 + 28) >= net::get32(want, 58 + 28));
      REQUIRE(net::get32(got, 58 + 28) <= net::get32(want, 58 + 28) + 2000);
      same(7);
    }
    // A sample that is outside the window in the very clock of the session's end counts, and the model knows no clocks.
    if (!(net::get32(want, 58) & net::kFlagSession)) {
      same(5);
      same(8, 0, 1);
    }
    if (e.moment == Moment::kSweep) {
      same(5);
      same(8, 0, 1);
    }
    if (e.moment == Moment::kMoving) {
      same(0, 2, 2);
      same(0, 3, 3, net::kFlagRows | net::kFlagEngine | net::kFlagMap | net::kFlagMapComplete | net::kFlagFailed);
      same(1, 0, 3);
      same(2, 0, 1);
      same(4), same(5), same(6), same(8);
      for (size_t word = net::kStatusWords; 58 + 4 * word < got.size(); ++word) same(word);
    }
  }

  // Messages ----------------------------------------------------------------------------------------------------------
  Bytes message(uint8_t type, uint32_t tile = 0, uint32_t index = 0, const Bytes& body = {}, uint8_t flags = 1) {
    net::Header h;
    h.type = type;
    h.token = chip_token_;
    h.sequence = static_cast<uint16_t>(random_());
    h.flags = flags;
    h.tile = static_cast<uint16_t>(tile);
    h.index = static_cast<uint16_t>(index);
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
  scene::Stimulus any_tile(int most_planes) {
    const golden::Config& c = config_.engine;
    if (one_in(8)) {
      return maker_.make(scene::Texture::kRandom, one_in(2) ? scene::Geometry::kInside : scene::Geometry::kSkewed,
                         c.plane_cols, c.plane_rows, most_planes);
    }
    const bool large = one_in(4);
    const int cols = 1 + below(large ? c.plane_cols : std::min(6, c.plane_cols));
    const int rows = 1 + below(large ? c.plane_rows : std::min(4, c.plane_rows));
    return maker_.make(static_cast<scene::Texture>(below(5)), static_cast<scene::Geometry>(below(4)), cols, rows,
                       1 + below(std::min(most_planes, large ? most_planes : 3)));
  }
  // Plane table for the tiles to come, and the next of them.
  void new_table() {
    tile_ = any_tile(config_.engine.planes);
    table_.clear();
    for (const auto& e : tile_.table)
      for (const uint32_t w : {uint32_t(e.x0_left), uint32_t(e.y0_left), uint32_t(e.x0_right), uint32_t(e.y0_right),
                               e.dx_left, e.dy_left, e.dx_right, e.dy_right})
        table_.push_back(w);
  }
  Bytes words(size_t first, size_t count) const {
    Bytes b;
    for (size_t i = first; i < std::min(first + count, table_.size()); ++i) net::append32(b, table_[i]);
    return b;
  }
  static uint32_t pixels(const scene::Stimulus& t) { return static_cast<uint32_t>(t.job.win_cols * t.job.win_rows); }
  uint32_t chunks(const scene::Stimulus& t) const {
    return (pixels(t) + config_.chunk_pairs() - 1) / config_.chunk_pairs();
  }
  Bytes start_bytes(const scene::Stimulus& t, uint32_t table) const {
    Bytes b;
    net::append16(b, table);
    net::append16(b, 0);
    net::append32(b, pixels(t));
    net::append32(b, chunks(t));
    for (const auto& w : golden::job_writes(t.job)) net::append32(b, w.value);
    return b;
  }
  // One or two fields are others.
  void spoil_start(Bytes& b) {
    const int kind = below(10);
    if (kind == 0) net::put16(b, 0, any());
    if (kind == 1) net::put32(b, 4, one_in(2) ? any() >> below(32) : 0);
    if (kind == 2) net::put32(b, 8, one_in(2) ? any() >> below(32) : 0);
    if (kind >= 3 && kind < 7) {  // too short or too long for the engine
      const uint32_t now = net::get32(b, 4);
      const uint32_t then = std::max<uint32_t>(1, now + static_cast<uint32_t>(below(120)) - (kind < 5 ? 120 : 0));
      const uint32_t count = then > 1u << 20 ? 1 : then;  // below 0
      net::put32(b, 4, count);
      net::put32(b, 8, (count + config_.chunk_pairs() - 1) / config_.chunk_pairs());
    }
    if (kind >= 7) {
      const size_t at = 12 + 4 * static_cast<size_t>(below(one_in(3) ? net::kJobWords : 6));
      net::put32(b, at, one_in(3) ? any() : one_in(2) ? 0 : net::get32(b, at) ^ (1u << below(32)));
    }
  }
  Bytes rows(const scene::Stimulus& t, uint32_t chunk) const {
    Bytes b;
    for (int i = 0; i < config_.chunk_pairs(); ++i) {
      const size_t at = static_cast<size_t>(chunk) * config_.chunk_pairs() + i;
      uint32_t value = 0;
      if (at < t.left.data.size()) value = net::pack_wire_pair(config_.engine, t.left.data[at], t.right.data[at]);
      for (int s = config_.pair_bytes() - 1; s >= 0; --s) b.push_back(static_cast<uint8_t>(value >> 8 * s));
    }
    return b;
  }
  size_t write_size() const { return static_cast<size_t>(config_.chunk_pairs()) * config_.pair_bytes(); }
  void say(const Bytes& m) { put(net::make_udp(hosts_[static_cast<size_t>(speaker())], own_, m)); }
  Bytes list_request(uint8_t type) {
    return message(
        type, 0, 0,
        Bytes((type == net::kInfo ? net::kInfoRequestBytes : net::kCountersRequestBytes) - net::kHeaderBytes));
  }

  // What a good host would do now.
  Bytes next_message() {
    const State s = state();
    if (!s.has(net::kFlagSession)) {
      if (!one_in(4)) return wrong_message();
      if (!one_in(4)) need(golden::Arbiter::Bucket::kOpen);
      return message(net::kOpen, 0, 0, number(static_cast<uint32_t>(below(2))));
    }
    if (one_in(model_.sweeping() ? 4 : 90)) return message(net::kClose);
    const bool idle = s.engine == 0 && !s.has(net::kFlagRows | net::kFlagEngine);
    if (idle && s.words >= table_.size() && one_in(25)) {
      new_table();
      return message(net::kTable, s.table + 1, 0, words(0, 8 + static_cast<size_t>(below(400))));
    }
    if (idle && one_in(50)) return message(net::kTable, s.table + 1, 0, noise(4 * 364));
    if (idle && s.words < table_.size()) {
      const size_t piece = static_cast<size_t>(one_in(2) ? 1 + below(40) : 364);
      const size_t most = std::min(piece, static_cast<size_t>(364));
      if (s.table == 0) return message(net::kTable, 1, 0, words(0, most));
      return message(net::kTable, s.table, s.words, words(s.words, most));
    }
    if (!s.has(net::kFlagRows) && !one_in(4)) {
      next_ = one_in(2) ? any_tile(static_cast<int>(std::max<uint32_t>(1, s.words / 8))) : tile_;
      for (auto* image : {&next_.left, &next_.right})
        if (one_in(2)) std::shuffle(image->data.begin(), image->data.end(), random_);
      // Bounds that matter, all of them.
      for (auto* bounds : {&next_.job.left, &next_.job.right})
        if (one_in(2))
          *bounds = {below(6) - 2, below(next_.job.win_cols + 2), below(6) - 2, below(next_.job.win_rows + 2)};
      Bytes body = start_bytes(next_, s.table);
      if (one_in(6)) spoil_start(body);
      return message(net::kStart, s.row_tile + 1, 0, body);
    }
    if (s.has(net::kFlagRows) && one_in(12))
      return message(net::kRead, s.row_tile, 0, number(static_cast<uint32_t>(1 + below(4)) << 16));
    if (s.has(net::kFlagRows) && !one_in(5)) {
      // A missing chunk of those that have a place.
      const auto w = model_.status();
      std::vector<uint32_t> missing;
      for (uint32_t i = 0; i < static_cast<uint32_t>(config_.slots()); ++i)
        if ((w[net::kStatusWords + i / 32] >> (31 - i % 32) & 1) == 0) missing.push_back(s.base + i);
      if (!missing.empty()) {
        const uint32_t c = missing[static_cast<size_t>(below(one_in(2) ? 1 : static_cast<int>(missing.size())))];
        return message(net::kWrite, s.row_tile, c, rows(next_, c), static_cast<uint8_t>(below(2)));
      }
    }
    if (s.has(net::kFlagMap)) {
      if (one_in(s.has(net::kFlagMapComplete) ? 3 : 8)) return message(net::kRelease, s.map_tile);
      const auto there = static_cast<int>(s.cells / static_cast<uint32_t>(config_.chunk_cells()));
      const int first = below(there + 2);
      return message(net::kRead, s.map_tile, static_cast<uint32_t>(first),
                     number(static_cast<uint32_t>(1 + below(4)) << 16 | static_cast<uint32_t>(below(first + 2))));
    }
    if (s.has(net::kFlagRows | net::kFlagEngine) && one_in(2))
      return message(net::kRead, s.row_tile, 0, number(static_cast<uint32_t>(1 + below(4)) << 16));
    return message(one_in(2) ? net::kStatus : net::kRelease, s.map_tile);
  }
  // Any type, with numbers close to the right ones.
  Bytes wrong_message() {
    const State s = state();
    const auto near = [this](uint32_t right) {
      return one_in(6) ? any() : right + static_cast<uint32_t>(below(4)) - 1;
    };
    const auto type = static_cast<uint8_t>(one_in(30) ? random_() : 1 + below(net::kSet));
    uint32_t tile = near(one_in(2) ? s.row_tile : s.map_tile), index = near(s.base);
    Bytes body;
    if (type == net::kOpen) body = number(static_cast<uint32_t>(below(3)));
    if (type == net::kInfo || type == net::kCounters) body.resize(list_request(type).size() - net::kHeaderBytes);
    if (type == net::kTable) {
      tile = one_in(2) ? s.table : near(s.table), index = one_in(3) ? 0 : near(s.words);
      body = one_in(3) ? noise(4 * static_cast<size_t>(1 + below(8))) : one_in(3) ? noise(4 * 364) : words(0, 364);
    }
    if (type == net::kStart) {
      body = start_bytes(tile_, one_in(3) ? near(s.table) : s.table);
      if (one_in(2)) spoil_start(body);
    }
    // Other rows for the tile in work.
    if (type == net::kWrite) {
      tile = one_in(3) ? near(s.row_tile) : s.row_tile;
      index = s.base + static_cast<uint32_t>(below(2 * config_.slots() + 2)) - 2;
      body = noise(write_size());
      if (s.has(net::kFlagRows) && tile == s.row_tile) next_is_noise(index, body);
    }
    if (type == net::kRead)
      body = number((one_in(10) ? any() << 16 : static_cast<uint32_t>(below(6)) << 16) |
                    (one_in(10) ? any() & 0xffff : static_cast<uint32_t>(below(4))));
    if (type == net::kSet) {
      index = static_cast<uint32_t>(one_in(4));
      body = number(one_in(3) ? any() >> below(32) : static_cast<uint32_t>(below(4)));
    }
    // Too short, while one in force may wait for its tile.
    if (one_in(12)) return message(net::kRead, tile, index, Bytes(static_cast<size_t>(below(4))));
    const bool foreign = one_in(6);
    if (type == net::kClose && !foreign && s.has(net::kFlagSession) && !one_in(8)) return message(net::kStatus);
    Bytes m = message(type, tile, index, body, static_cast<uint8_t>(below(4)));
    if (foreign) net::put32(m, 4, one_in(2) ? 0 : any());
    if (one_in(40)) m[2] ^= bit();
    if (one_in(12)) m[static_cast<size_t>(below(static_cast<int>(std::min<size_t>(m.size(), 36))))] ^= bit();
    if (one_in(8)) m.resize(static_cast<size_t>(below(static_cast<int>(m.size()) + 8)));
    if (one_in(type == net::kRead ? 3 : 8)) m.resize(net::kHeaderBytes + static_cast<size_t>(below(4)));
    return m;
  }
  // Noise goes only to places that are taken, mostly: the tile would be noise altogether.
  void next_is_noise(uint32_t chunk, Bytes& body) {
    const State s = state();
    const auto w = model_.status();
    const bool there =
        chunk < s.base || (chunk - s.base < static_cast<uint32_t>(config_.slots()) &&
                           (w[net::kStatusWords + (chunk - s.base) / 32] >> (31 - (chunk - s.base) % 32) & 1));
    if (!there && !one_in(4)) body = rows(next_, chunk & 0xffff);
  }

  static void fix_ip_sum(Bytes& f) {
    net::put16(f, 24, 0);
    net::put16(f, 24, net::internet_checksum(f.data() + 14, 20));
  }
  // Good to the last bit but for one thing.
  void spoil_packet(Bytes& f) {
    if (f[13] != 0 || f.size() < 42) {  // ARP
      f[static_cast<size_t>(14 + below(28))] ^= bit();
      return;
    }
    const int kind = below(9);
    if (kind == 0) net::put16(f, 20, one_in(2) ? 0x2000 : 1 + below(0x1fff));  // fragments
    if (kind == 1) {                                                           // an option
      f[14] = 0x46;
      net::put16(f, 16, net::get16(f, 16) + 4);
      f.insert(f.begin() + 34, 4, uint8_t{1});
    }
    if (kind == 2) net::put16(f, 16, any());
    if (kind == 3) net::put16(f, 16, net::get16(f, 16) - 1 - below(8));
    if (kind == 4) f[23] = static_cast<uint8_t>(random_());
    if (kind == 5) net::put32(f, 30, one_in(2) ? 0xffffffff : any());
    if (kind == 6) f[22] = 0, f[15] = static_cast<uint8_t>(random_());  // no matter
    if (kind == 7) net::put16(f, 38, one_in(2) ? any() : net::get16(f, 38) + 1);
    if (kind == 8) net::put16(f, 40, 0);  // UDP without a checksum; ICMP: other data
    fix_ip_sum(f);
  }

  void one() {
    if (model_.sweeping() && one_in(6)) return say(message(net::kClose));
    // Until none is answered.
    if (one_in(500))
      for (int i = 0; i <= net::kBucketAnswers + 1; ++i) say(message(net::kOpen, 0, 0, number(1)));
    const int kind = below(100);
    // With both ends sending, a chip in half duplex would see collisions that the model does not know.
    if (kind == 0 && model_.full_duplex()) return burst();
    Bytes f;
    if (kind < 6) {
      f = net::make_arp_request(hosts_[below(3)], one_in(4) ? any() : own_.ip);
    } else if (kind < 12) {
      f = net::make_icmp_echo(hosts_[below(3)], own_, 8, noise(static_cast<size_t>(4 + below(one_in(8) ? 1460 : 60))));
    } else {
      const Bytes m = kind < 68 ? next_message() : wrong_message();
      net::Address
          from = hosts_[static_cast<size_t>(one_in(m.size() > 3 && m[3] == net::kOpen ? 2 : 8) ? below(3) : speaker())],
          to = own_;
      if (one_in(30)) to.port = static_cast<uint16_t>(one_in(2) ? any() : to.port ^ (1u << below(16)));
      if (one_in(40)) {
        const uint32_t bad[] = {0, 0x00ffffff, 0x7f000001, 0xe0000001, 0xefffffff, 0xf0000000, 0xffffffff, own_.ip};
        const int which = below(10);
        if (which < 8) from.ip = bad[which];
        if (which == 8) from.mac = own_.mac;
        if (which == 9) from.mac[0] |= 1;
      }
      f = net::make_udp(from, to, m);
    }
    const int harm = below(48);
    if (harm == 0) return put(f, true);
    if (harm == 1) return put(f, false, 1 + below(one_in(3) ? 16 : static_cast<int>(2 * f.size())));
    if (harm == 2) return put(f, false, 16 + below(static_cast<int>(2 * f.size())) / 2 * 2 + 1);  // half a byte
    if (harm == 3) return put(f, false, INT64_MAX, 17 + below(static_cast<int>(2 * f.size())));
    if (harm == 4) f[static_cast<size_t>(below(static_cast<int>(std::min<size_t>(f.size(), 42))))] ^= bit();
    if (harm == 5) f.resize(static_cast<size_t>(14 + below(static_cast<int>(f.size()))));
    if (harm == 6) f.resize(f.size() + static_cast<size_t>(below(one_in(4) ? 600 : 30)));
    if (harm == 7) f.resize(static_cast<size_t>(1500 + below(one_in(4) ? 1000 : 30)));
    if (harm == 8) f[static_cast<size_t>(below(6))] ^= bit();
    if (harm == 9) std::fill_n(f.begin(), 6, uint8_t{0xff});
    if (harm == 10) net::put16(f, 12, one_in(2) ? any() : 0x8100);
    if (harm >= 11 && harm <= 15) spoil_packet(f);
    put(f, false, INT64_MAX, -1, !one_in(15));
  }

  // More at once than can wait: those that find room are answered, in order, and the others counted.
  void burst() {
    linger_ = false;
    rest();
    latest_.clear();
    std::vector<Bytes> answers;
    std::vector<bool> arp;
    using Bucket = golden::Arbiter::Bucket;
    // As many as are answered; less than full, so that a tick meanwhile is not lost.
    if (one_in(4) || classes_["burst: answered"] == 0) {
      need(Bucket::kArp, 3);
      need(Bucket::kOther, 6);
    }
    if (model_.left(Bucket::kArp) < 3 || model_.left(Bucket::kOther) < 6) return;
    if (model_.left(Bucket::kArp) == net::kBucketAnswers) put(net::make_arp_request(hosts_[0], own_.ip));
    if (model_.left(Bucket::kOther) == net::kBucketAnswers) put(net::make_icmp_echo(hosts_[0], own_, 8, noise(8)));
    latest_.clear();
    int pings = model_.left(Bucket::kOther), arps = model_.left(Bucket::kArp);
    const int count = 4 + below(14);
    const bool large = one_in(2);
    for (int i = 0; i < count; ++i) {
      Bytes id = noise(static_cast<size_t>(4 + below(large ? 1460 : 120)));
      net::put32(id, 0, static_cast<uint32_t>(i) << 16 | (any() & 0xffff));
      const net::Address& host = hosts_[below(3)];
      if (pings == 0 && arps == 0) break;
      arp.push_back(pings == 0 || (arps > 0 && one_in(4)));
      --(arp.back() ? arps : pings);
      Bytes f = arp.back() ? net::make_arp_request(host, own_.ip) : net::make_icmp_echo(host, own_, 8, id);
      answers.push_back(arp.back() ? golden::transmit(golden::MessageKind::kArp, own_, host, {})
                                   : golden::transmit(golden::MessageKind::kIcmp, own_, host, id));
      answers.back().resize(std::max<size_t>(answers.back().size(), net::kMinFrame));
      net::append_fcs(f);
      ++sent_;
      mangler_->cut = INT64_MAX;
      mangler_->bad = -1;
      desk_->send_raw(std::move(f));
    }
    while (desk_->waiting() != 0) desk_->run_for(kMicrosecond);
    size_t before;
    do {
      before = out_.size();
      desk_->run_for(kMillisecond);
    } while (out_.size() != before);
    INFO(place_ << ", a burst of " << count);
    size_t next = 0;
    for (size_t i = 0; i < answers.size(); ++i) {
      if (next < out_.size() && out_[next] == answers[i]) {
        ++next;
        ++replies_;
        for (const auto counter : {net::kRxFrames, arp[i] ? net::kArp : net::kIcmp, net::kTxFrames})
          model_.count(counter);
        REQUIRE(model_.allow(arp[i] ? Bucket::kArp : Bucket::kOther));
        seen("burst: answered");
      } else {
        model_.count(net::kRxNoSlot);
        seen("burst: no room");
      }
    }
    REQUIRE(next == out_.size());
    REQUIRE(next >= 2);
    out_.clear();
    say(list_request(net::kCounters));
  }

  // Silence for as long as a session lasts.
  void wait_for_timeout() {
    linger_ = false;
    need(golden::Arbiter::Bucket::kOpen);
    if (!model_.session_open()) say(message(net::kOpen, 0, 0, number(1)));
    say(message(net::kStatus));
    if (!model_.session_open()) return;
    const double ms = config_.clk_khz;  // clocks
    run_clocks((config_.session_ms - 1) * ms - 5000);
    REQUIRE(mangler_->session());
    run_clocks(ms + 10000);
    INFO(place_);
    REQUIRE_FALSE(mangler_->session());
    rest();
    REQUIRE_FALSE(model_.session_open());
    seen("session timeout");
    waits_changed_ += config_.clk_khz / 256;  // the chip counts whole milliseconds
    say(message(net::kStatus));
    say(list_request(net::kCounters));
  }

  // Everything must work now: counters, ARP, ping, a whole pair of tiles, the next one sent while the last is swept.
  void round() {
    in_round_ = true;
    linger_ = false;
    rest();
    need(golden::Arbiter::Bucket::kOpen);
    need(golden::Arbiter::Bucket::kArp);
    need(golden::Arbiter::Bucket::kOther, 3);
    say(message(net::kClose));
    REQUIRE_FALSE(model_.session_open());
    say(message(net::kOpen, 0, 0, number(77)));
    say(list_request(net::kCounters));
    say(list_request(net::kInfo));
    put(net::make_arp_request(hosts_[0], own_.ip));
    REQUIRE(latest_.size() == 1);
    put(net::make_icmp_echo(hosts_[1], own_, 8, noise(32)));
    REQUIRE(latest_.size() == 1);
    new_table();
    for (size_t at = 0; at < table_.size(); at += 32)
      say(message(net::kTable, 1, static_cast<uint32_t>(at), words(at, 32)));
    for (uint32_t number = 0; number < 3; ++number) {
      for (auto* image : {&tile_.left, &tile_.right}) std::shuffle(image->data.begin(), image->data.end(), random_);
      whole_tile(number);
    }
    say(message(net::kStatus));
    ++pairs_;
    in_round_ = false;
  }
  void whole_tile(uint32_t tile) {
    say(message(net::kStart, tile, 0, start_bytes(tile_, 1)));
    for (uint32_t c = 0; c < chunks(tile_); ++c) say(message(net::kWrite, tile, c, rows(tile_, c)));
    const auto cells = golden::run_tile(config_.engine, tile_.job, tile_.table, tile_.left, tile_.right).cells;
    const size_t per = static_cast<size_t>(config_.chunk_cells()), count = (cells.size() + per - 1) / per;
    INFO(place_ << ", tile " << tile << " afterwards");
    size_t compared = 0;
    for (size_t c = 0; c < count; ++c) {
      say(message(net::kRead, tile, static_cast<uint32_t>(c), number(1u << 16 | static_cast<uint32_t>(c))));
      REQUIRE_FALSE(latest_.empty());
      const Bytes& f = latest_.back();
      REQUIRE(f[45] == net::kMap);
      const auto width = static_cast<size_t>(config_.cell_bytes());
      for (size_t i = c * per; i < std::min(cells.size(), (c + 1) * per); ++i, ++compared) {
        uint64_t word = 0;
        for (size_t b = 0; b < width; ++b) word = word << 8 | f[58 + (i - c * per) * width + b];
        REQUIRE(word == net::pack_wire_cell(config_.engine, cells[i]));
      }
    }
    REQUIRE(compared == cells.size());
    say(message(net::kRelease, tile));
  }

  std::string name_;
  net::ArbiterConfig config_;
  net::Address own_;
  std::mt19937 random_;
  scene::StimulusMaker maker_;
  golden::Arbiter model_;
  Mangler* mangler_ = nullptr;
  std::unique_ptr<Desk> desk_;
  Time clk_ = 0;
  std::array<net::Address, 3> hosts_;
  std::vector<net::Address> peers_;
  std::vector<Expected> expected_;
  std::vector<Bytes> out_, latest_;  // since the last comparison; of the last one that had any
  scene::Stimulus tile_, next_;      // that the table was made for; in the row buffer
  std::vector<uint32_t> table_;
  std::array<int64_t, 2> waits_{};  // counters 24 and 25 at the latest COUNTERS: chip less model
  std::map<std::string, int64_t> classes_;
  std::string place_;
  uint32_t chip_token_ = 0x12345678, model_token_ = 0x9abcdef0;
  bool learn_ = false, linger_ = false, dirty_ = false, slow_load_ = false, shown_slow_ = false, in_round_ = false;
  uint32_t done_ = 0;
  double sweep_since_ = -1;
  int64_t sent_ = 0, replies_ = 0, pairs_ = 0, waits_changed_ = 0;
  const bool progress_ = number_from("PSWEEP_FUZZ_PROGRESS", 0) != 0;
};

}  // namespace

TEST_CASE("chip: random and mutated frames against the models") {
  const std::string name = GENERATE("tiny", "tiny_min", "odd");
  if (const char* only = std::getenv("PSWEEP_FUZZ_CHIP"); only != nullptr && name != only) return;
  const int64_t frames = number_from("PSWEEP_FUZZ_FRAMES", 2000);
  CAPTURE(name, test_seed());
  Fuzz fuzz(chip_named(name));
  fuzz.run(frames);
  CHECK(fuzz.replies() > 0);
  std::printf("%s", fuzz.report().c_str());
}
