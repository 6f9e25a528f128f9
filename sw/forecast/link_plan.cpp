// SPDX-License-Identifier: Apache-2.0
#include "forecast/link_plan.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <optional>
#include <queue>
#include <random>
#include <string>

#include "core/error.hpp"
#include "golden/control.hpp"
#include "golden/ethernet.hpp"

namespace psweep {
namespace {

using Time = int64_t;                                    // ps
constexpr Time kNibble = 40'000;                         // 100 Mbit/s
constexpr int kAroundPayload = 42;                       // Ethernet, IP and UDP headers
constexpr int kPreamble = 8, kFcs = 4;                   // bytes
constexpr int kLeastFrame = 60;                          // without FCS
constexpr double kLeastPause = 1e-3, kMostPause = 0.25;  // of the host, link_engine.cpp
constexpr uint32_t kAnswerEvery = 8;                     // likewise

// Clocks of the chip's parts (headers of responder.vhd, packet_tx.vhd and scheduler.vhd).
constexpr int kHeaderClocks = 62;    // a message until it is obeyed: whose it is, too
constexpr int kDivideClocks = 26;    // START: its chunks against its pixels
constexpr int kPeerClocks = 62;      // who asked, before a reply
constexpr int kReplyByteClocks = 6;  // a byte of a reply or of a map packet's header
constexpr int kFrameClocks = 170;    // headers and checksums, when the payload is there
constexpr int kBaseByte = 16;        // of a reply: from here on the status block stands still
constexpr int kLaunchClocks = 22;    // the scheduler

struct Event {
  Time at;
  uint64_t order;
  std::function<void()> action;
  bool operator<(const Event& o) const { return at != o.at ? at > o.at : order > o.order; }
};

class Agenda {
 public:
  Time now() const { return now_; }
  void at(Time time, std::function<void()> action) {
    events_.push({std::max(time, now_), ++order_, std::move(action)});
  }
  void after(Time delay, std::function<void()> action) { at(now_ + delay, std::move(action)); }
  bool step() {
    if (events_.empty()) return false;
    const Event e = events_.top();
    events_.pop();
    now_ = e.at;
    e.action();
    return true;
  }

 private:
  std::priority_queue<Event> events_;
  Time now_ = 0;
  uint64_t order_ = 0;
};

// Two stations, each with frames in order.
class Wire {
 public:
  enum Side { kHost, kChip };

  Wire(Agenda& agenda, bool half_duplex, int delay, uint32_t seed)
      : agenda_(agenda), half_duplex_(half_duplex), delay_(delay), random_(seed) {}

  // delivered: with the last byte of the FCS.
  void send(Side side, int payload, std::function<void()> delivered) {
    const int bytes = kPreamble + std::max(payload + kAroundPayload, kLeastFrame) + kFcs;
    end_[side].waiting.push_back({2 * bytes * kNibble, std::move(delivered)});
    contend(side);
  }
  uint64_t frames[2] = {0, 0}, collisions = 0;

 private:
  static constexpr Time kGap = golden::kGapNibbles * kNibble, kSlot = golden::kSlotNibbles * kNibble;
  struct Frame {
    Time length;
    std::function<void()> delivered;
  };
  struct End {
    std::deque<Frame> waiting;
    bool sending = false, backing_off = false;
    int attempts = 0;
    bool ready() const { return !waiting.empty() && !sending && !backing_off; }
  };

  void contend(Side side) {
    if (!half_duplex_) {
      if (end_[side].ready()) transmit(side);
      return;
    }
    if (end_[kHost].sending || end_[kChip].sending || medium_busy_) return;
    if (end_[kHost].ready() && end_[kChip].ready()) {
      collide();
    } else if (end_[kHost].ready()) {
      transmit(kHost);
    } else if (end_[kChip].ready()) {
      transmit(kChip);
    }
  }

  void transmit(Side side) {
    End& e = end_[side];
    e.sending = true;
    e.attempts = 0;
    ++frames[side];
    agenda_.after(e.waiting.front().length, [this, side] {
      const auto delivered = std::move(end_[side].waiting.front().delivered);
      end_[side].waiting.pop_front();
      delivered();
    });
    agenda_.after(e.waiting.front().length + kGap, [this, side] {
      end_[side].sending = false;
      contend(side);
    });
  }

  // Both began when the gap was over. Preamble, jam, and the way there and back.
  void collide() {
    ++collisions;
    medium_busy_ = true;
    const Time over = (2 * kPreamble + golden::kJamNibbles + 2 * delay_) * kNibble;
    for (const Side side : {kHost, kChip}) {
      End& e = end_[side];
      e.attempts = std::min(e.attempts + 1, golden::kAttempts - 1);
      e.backing_off = true;
      const auto slots = static_cast<Time>(random_() % (1u << std::min(e.attempts, golden::kBackoffLimit)));
      agenda_.after(over + kGap + slots * kSlot, [this, side] {
        end_[side].backing_off = false;
        contend(side);
      });
    }
    agenda_.after(over + kGap, [this] {
      medium_busy_ = false;
      contend(kHost);
    });
  }

  Agenda& agenda_;
  const bool half_duplex_;
  const int delay_;
  std::mt19937 random_;
  End end_[2];
  bool medium_busy_ = false;
};

struct Message {
  net::Type type = net::kStatus;
  int tile = 0;
  uint32_t index = 0, count = 0, keep = 0;
  bool answer = true;
  uint64_t order = 0;
};

struct Answer {
  Message to;
  bool accepted = true;
  int row_tile = -1, map_tile = -1;
  bool rows = false, map_complete = false;
  uint32_t base = 0;
  std::vector<bool> there;
};

class Simulation {
 public:
  Simulation(const net::ArbiterConfig& chip, const std::vector<golden::TileJob>& tiles, const LinkPlanOptions& options)
      : c_(chip),
        tiles_(tiles),
        o_(options),
        wire_(agenda_, options.half_duplex, options.medium_delay, options.seed),
        slots_(static_cast<uint32_t>(std::max(2, chip.slots()))),
        pairs_(static_cast<uint32_t>(chip.chunk_pairs())),
        cells_(static_cast<uint32_t>(chip.chunk_cells())) {
    const int most = chip.engine.plane_cols * chip.engine.plane_rows;
    if (chip.map_depth > 0 && chip.map_depth < most)
      ring_ = static_cast<uint32_t>(std::max(2, (chip.map_depth + chip.chunk_cells() - 1) / chip.chunk_cells()));
    while ((1u << slot_bits_) < slots_) ++slot_bits_;
  }

  LinkForecast run() {
    act();
    set_timer();
    while (wanted_ < count()) agenda_.step();
    result_.end = seconds(agenda_.now());
    result_.frames_up = wire_.frames[Wire::kHost];
    result_.frames_down = wire_.frames[Wire::kChip];
    result_.collisions = wire_.collisions;
    const uint64_t clocks = clocks_of(last_beat_ - first_launch_);
    result_.launch = seconds(first_launch_);
    result_.last_beat = seconds(last_beat_);
    const uint64_t known = result_.engine_clocks + result_.stall_load + result_.stall_unload;
    result_.stall_idle = clocks - std::min(clocks, known);
    return result_;
  }

 private:
  int count() const { return static_cast<int>(tiles_.size()); }
  Time clk(uint64_t clocks) const { return std::llround(1e6 * static_cast<double>(clocks) / o_.clk_mhz); }
  uint64_t clocks_of(Time t) const {
    return static_cast<uint64_t>(std::llround(1e-6 * o_.clk_mhz * static_cast<double>(t)));
  }
  static double seconds(Time t) { return 1e-12 * static_cast<double>(t); }
  static Time time(double s) { return std::llround(1e12 * s); }
  uint32_t row_chunks(int tile) const {
    return static_cast<uint32_t>((golden::load_clocks(tiles_[tile]) + pairs_ - 1) / pairs_);
  }
  uint32_t map_chunks(int tile) const {
    return static_cast<uint32_t>((golden::unload_clocks(tiles_[tile]) + cells_ - 1) / cells_);
  }
  uint32_t cells_in(int tile, uint32_t chunk) const {
    return static_cast<uint32_t>(
        std::min<uint64_t>(cells_, golden::unload_clocks(tiles_[tile]) - uint64_t{chunk} * cells_));
  }

  // Chip: messages ---------------------------------------------------------------------------------------------------
  void arrive(const Message& m) {
    inbox_.push_back(m);
    respond();
  }

  // One thing at a time: a message, or between messages a map packet. After an answer it is the turn of a chunk that is
  // there, even if it has to wait for the transmitter.
  void respond() {
    if (responding_) return;
    const bool map_due =
        reading_left_ > 0 && map_tile_ == reading_tile_ && reading_next_ < finished_ && reading_next_ >= kept_;
    if (!inbox_.empty() && !(map_turn_ && map_due)) {
      responding_ = true;
      const Message m = inbox_.front();
      const bool rows = m.type == net::kWrite;
      agenda_.after(clk(kHeaderClocks + (rows ? c_.chunk_bytes : 0) + (m.type == net::kStart ? kDivideClocks : 0)),
                    [this, m] { obey(m); });
    } else if (map_due && frames_ < 2) {
      map_turn_ = false;
      responding_ = true;
      ++frames_;
      const int tile = map_tile_;
      const uint32_t chunk = reading_next_, n = cells_in(tile, chunk);
      const uint64_t order = reading_order_;
      const uint64_t clocks = net::kHeaderBytes * kReplyByteClocks + n * (c_.cell_bytes() + 1ull) + kFrameClocks;
      agenda_.after(clk(clocks), [this, tile, chunk, n, order] {
        ++reading_next_;
        --reading_left_;
        ++result_.map_packets;
        transmit(static_cast<int>(net::kHeaderBytes + n * static_cast<uint32_t>(c_.cell_bytes())),
                 [this, tile, chunk, order] { on_map(tile, chunk, order); });
        responding_ = false;
        respond();
      });
    }
  }

  void obey(const Message& m) {
    bool accepted = true;
    if (m.type == net::kStart) {
      accepted = m.tile == row_tile_ || !row_busy_;
      if (m.tile != row_tile_ && accepted) open_rows(m.tile);
    } else if (m.type == net::kWrite) {
      if (m.tile == row_tile_ && row_open_ && m.index >= base_ && m.index < base_ + slots_ && !stored_[m.index]) {
        stored_[m.index] = true;
        ++received_;
        launch();
        consume();
      }
    } else if (m.type == net::kRead) {
      reading_tile_ = m.tile;
      reading_next_ = m.index;
      reading_left_ = m.count;
      reading_order_ = m.order;
      if (m.tile == map_tile_ && ring_ > 0) kept_ = std::max(kept_, m.keep);
      unload();
    } else if (m.type == net::kRelease) {
      if (m.tile == map_tile_ && complete_) {
        map_tile_ = -1;
        complete_ = false;
        finished_ = kept_ = 0;
        unload();
      }
    }
    if (!m.answer) {
      message_done();
      return;
    }
    if (frames_ < 2) {
      reply(m, accepted);
    } else {
      blocked_ = [this, m, accepted] { reply(m, accepted); };
    }
  }

  void message_done() {
    inbox_.pop_front();
    responding_ = false;
    respond();
  }

  void reply(const Message& m, bool accepted) {
    ++frames_;
    const int payload =
        static_cast<int>(net::kHeaderBytes) + 4 * (net::kStatusWords + (static_cast<int>(slots_) + 31) / 32);
    agenda_.after(clk(kPeerClocks + kReplyByteClocks * kBaseByte), [this, m, accepted, payload] {
      Answer a;
      a.to = m;
      a.accepted = accepted;
      a.row_tile = row_tile_;
      a.rows = row_busy_;
      a.base = base_;
      a.there = stored_;
      a.map_tile = map_tile_;
      a.map_complete = complete_;
      const int rest = kReplyByteClocks * (payload - kBaseByte) + kFrameClocks;
      agenda_.after(clk(static_cast<uint64_t>(rest)), [this, a, payload] {
        transmit(payload, [this, a] { on_answer(a); });
        map_turn_ = true;
        message_done();
      });
    });
  }

  // The frame's slot is free with the end of the frame.
  void transmit(int payload, const std::function<void()>& received) {
    wire_.send(Wire::kChip, payload, [this, received] {
      agenda_.after(time(o_.turnaround), [this, received] {
        received();
        act();
        set_timer();
      });
      --frames_;
      if (blocked_) {
        const auto waiting = std::move(blocked_);
        blocked_ = nullptr;
        waiting();
      } else {
        respond();
      }
    });
  }

  // Chip: rows, engine, map ------------------------------------------------------------------------------------------
  void open_rows(int tile) {
    row_tile_ = tile;
    row_busy_ = row_open_ = staged_ = true;
    base_ = received_ = 0;
    stored_.assign(row_chunks(tile), false);
  }

  void launch() {
    if (!staged_ || launching_ || engine_busy_ || (received_ < row_chunks(row_tile_) && received_ < slots_)) return;
    launching_ = true;
    agenda_.after(clk(kLaunchClocks), [this] {
      launching_ = staged_ = false;
      engine_busy_ = loading_ = true;
      engine_tile_ = row_tile_;
      load_began_ = agenda_.now();
      if (first_launch_ < 0) first_launch_ = agenda_.now();
      const golden::TileJob& t = tiles_[engine_tile_];
      const auto lanes = static_cast<uint64_t>(o_.lanes);
      sweep_ = (golden::sweep_clocks(c_.engine, t) + lanes - 1) / lanes + golden::fill_clocks(c_.engine);
      result_.engine_clocks += golden::load_clocks(t) + sweep_ + golden::unload_clocks(t);
      consume();
    });
  }

  void consume() {
    if (!loading_ || consuming_ || !stored_[base_]) return;
    consuming_ = true;
    const uint64_t left = golden::load_clocks(tiles_[engine_tile_]) - uint64_t{base_} * pairs_;
    agenda_.after(clk(std::min<uint64_t>(left, pairs_)), [this] {
      consuming_ = false;
      if (++base_ < stored_.size()) {
        consume();
        return;
      }
      loading_ = row_open_ = false;
      const uint64_t took = clocks_of(agenda_.now() - load_began_), need = golden::load_clocks(tiles_[engine_tile_]);
      result_.stall_load += took - std::min(took, need);
      agenda_.after(clk(1ull << slot_bits_), [this] { row_busy_ = false; });
      agenda_.after(clk(sweep_), [this] {
        unloading_ = true;
        unload_began_ = agenda_.now();
        unload();
      });
    });
  }

  void unload() {
    if (!unloading_ || unloading_chunk_) return;
    if (map_tile_ >= 0 && map_tile_ != engine_tile_) return;  // the map before is still there
    if (map_tile_ == engine_tile_ && ring_ > 0 && finished_ >= kept_ + ring_) return;
    map_tile_ = engine_tile_;
    unloading_chunk_ = true;
    agenda_.after(clk(cells_in(engine_tile_, finished_)), [this] {
      unloading_chunk_ = false;
      if (++finished_ == map_chunks(engine_tile_)) {
        complete_ = true;
        unloading_ = engine_busy_ = false;
        last_beat_ = agenda_.now();
        const uint64_t took = clocks_of(last_beat_ - unload_began_), need = golden::unload_clocks(tiles_[engine_tile_]);
        result_.stall_unload += took - std::min(took, need);
        launch();
      }
      unload();
      respond();
    });
  }

  // Host -------------------------------------------------------------------------------------------------------------
  uint64_t ask(Message m) {
    m.order = ++order_;
    const bool rows = m.type == net::kWrite;
    if (m.answer) {
      asked_ = m.order;
      asked_at_ = agenda_.now();
      sent_at_[m.order % kRemembered] = agenda_.now();
    }
    int payload = static_cast<int>(net::kHeaderBytes);
    if (rows) payload += c_.chunk_pairs() * c_.pair_bytes();
    if (m.type == net::kStart) payload += net::kStartBytes;
    if (m.type == net::kRead) payload += 4;
    wire_.send(Wire::kHost, payload, [this, m] { arrive(m); });
    return m.order;
  }
  Message message(net::Type type, int tile = 0, uint32_t index = 0) const {
    Message m;
    m.type = type;
    m.tile = tile;
    m.index = index;
    return m;
  }
  bool waiting() const { return asked_ > answered_; }
  bool uploaded() const { return known_ == up_there_.size(); }

  void act() {
    if (!reading_ && !releasing_ && wanted_ < next_) read();
    const bool may = agenda_.now() >= start_after_ && (o_.in_flight > 1 || wanted_ == next_);
    if (!starting_ && !releasing_ && !read_unanswered_ && next_ < count() && uploaded() && may) {
      starting_ = true;
      ask(message(net::kStart, next_));
    }
    send_rows();
  }

  void send_rows() {
    const auto window = static_cast<size_t>(o_.half_duplex ? std::min<int>(o_.window, kAnswerEvery) : o_.window);
    if (o_.half_duplex && (!flying_.empty() || waiting())) return;
    auto more = [this] { return up_next_ < up_there_.size() && up_next_ < up_base_ + slots_; };
    while (flying_.size() < window && more()) {
      Message m = message(net::kWrite, next_ - 1, up_next_++);
      m.answer = (++writes_ % kAnswerEvery == 0 && !o_.half_duplex) || !more() || flying_.size() + 1 == window;
      flying_.push_back(ask(m));
    }
  }

  void read() {
    const uint32_t missing = down_missing_;
    uint32_t end = map_chunks(wanted_);
    if (ring_ > 0) end = std::min(end, missing + ring_);
    Message m = message(net::kRead, wanted_, missing);
    m.count = end - missing;
    m.keep = ring_ > 0 ? missing : 0;
    read_began_ = missing;
    read_end_ = end;
    reading_ = true;
    read_unanswered_ = read_order_ = ask(m);
  }

  void on_answer(const Answer& a) {
    const double trip = seconds(agenda_.now() - sent_at_[a.to.order % kRemembered]);
    rtt_ = rtt_ < 0 ? trip : rtt_ + (trip - rtt_) / 8;
    rtt_min_ = std::min(rtt_min_, trip);
    answered_ = std::max(answered_, a.to.order);
    if (a.to.type == net::kStart) {
      starting_ = false;
      if (a.accepted) {
        start_after_ = 0;
        up_there_.assign(row_chunks(next_), false);
        known_ = up_next_ = up_base_ = 0;
        ++next_;
      } else {
        start_after_ = agenda_.now() + time(std::clamp(2 * rtt_min_, kLeastPause, kMostPause));
      }
    } else if (a.to.type == net::kRelease) {
      releasing_ = false;
    } else if (a.to.type == net::kRead && a.to.order == read_unanswered_) {
      read_unanswered_ = 0;
    }
    if (a.row_tile == next_ - 1 && !uploaded()) {
      up_base_ = std::max(up_base_, a.base);
      for (uint32_t i = 0; i < up_there_.size(); ++i) {
        if (up_there_[i] || !(a.there[i] || !a.rows)) continue;
        up_there_[i] = true;
        ++known_;
      }
      while (!flying_.empty() && flying_.front() <= a.to.order) flying_.pop_front();
    }
    if (a.map_complete && a.map_tile == wanted_) {
      checked_ = true;
      if (down_missing_ == map_chunks(wanted_) && reading_) finish();
    }
  }

  void on_map(int tile, uint32_t chunk, uint64_t order) {
    if (tile != wanted_) return;
    const uint32_t total = map_chunks(wanted_);
    if (chunk == down_missing_) {
      ++down_missing_;
    } else {
      ++result_.map_repeated;
    }
    if (order == read_unanswered_) read_unanswered_ = 0;
    if (down_missing_ == total) {
      if (checked_) {
        finish();
      } else {
        ask(message(net::kStatus));
      }
      return;
    }
    if (!checked_ && down_missing_ == total / 2) ask(message(net::kStatus));
    if (order != read_order_) return;
    if (chunk + 1 == read_end_ || (ring_ > 0 && read_end_ < total &&
                                   down_missing_ >= read_began_ + std::max(1u, (read_end_ - read_began_) / 2))) {
      read();
    }
  }

  void finish() {
    releasing_ = true;
    ask(message(net::kRelease, wanted_));
    ++wanted_;
    down_missing_ = 0;
    reading_ = checked_ = false;
    read_unanswered_ = 0;
  }

  // START again, or a question, when nothing else makes the host look.
  void set_timer() {
    Time next = waiting() ? agenda_.now() + time(kMostPause) : asked_at_ + pause();
    if (start_after_ > agenda_.now() && !starting_ && next_ < count()) next = std::min(next, start_after_);
    const uint64_t mine = ++timer_;
    agenda_.at(next, [this, mine] {
      if (mine != timer_) return;
      act();
      if (!waiting() && agenda_.now() >= asked_at_ + pause()) ask(message(net::kStatus));
      set_timer();
    });
  }
  Time pause() const { return time(std::clamp(2 * rtt_, kLeastPause, kMostPause)); }

  const net::ArbiterConfig c_;
  const std::vector<golden::TileJob>& tiles_;
  const LinkPlanOptions o_;
  Agenda agenda_;
  Wire wire_;
  const uint32_t slots_, pairs_, cells_;
  uint32_t ring_ = 0;  // chunks, 0: the whole map has room
  int slot_bits_ = 0;
  LinkForecast result_;
  Time first_launch_ = -1, last_beat_ = 0;

  // responder and packet_tx
  std::deque<Message> inbox_;
  bool responding_ = false, map_turn_ = false;
  int frames_ = 0;  // in the making, waiting or on the wire; there are two places
  std::function<void()> blocked_;
  int reading_tile_ = -1;
  uint32_t reading_next_ = 0, reading_left_ = 0;
  uint64_t reading_order_ = 0;
  // row_buffer
  int row_tile_ = -1;
  bool row_busy_ = false, row_open_ = false, staged_ = false;
  uint32_t base_ = 0, received_ = 0;
  std::vector<bool> stored_;
  // engine
  bool launching_ = false, engine_busy_ = false, loading_ = false, consuming_ = false, unloading_ = false;
  bool unloading_chunk_ = false;
  int engine_tile_ = -1;
  uint64_t sweep_ = 0;
  Time load_began_ = 0, unload_began_ = 0;
  // map_buffer
  int map_tile_ = -1;
  uint32_t finished_ = 0, kept_ = 0;
  bool complete_ = false;

  // host
  static constexpr uint64_t kRemembered = 256;
  int wanted_ = 0, next_ = 0;  // below wanted_ all received, below next_ all started
  uint64_t order_ = 0, asked_ = 0, answered_ = 0, writes_ = 0;
  Time asked_at_ = 0, sent_at_[kRemembered] = {};
  double rtt_ = -1, rtt_min_ = 1;
  bool starting_ = false, releasing_ = false, reading_ = false, checked_ = false;
  Time start_after_ = 0;
  std::vector<bool> up_there_;
  std::deque<uint64_t> flying_;
  uint32_t known_ = 0, up_next_ = 0, up_base_ = 0;
  uint32_t down_missing_ = 0, read_began_ = 0, read_end_ = 0;
  uint64_t read_order_ = 0, read_unanswered_ = 0;
  uint64_t timer_ = 0;
};

}  // namespace

LinkForecast forecast_link(const net::ArbiterConfig& chip, const std::vector<golden::TileJob>& tiles,
                           const LinkPlanOptions& o) {
  if (tiles.empty()) throw InputError("link plan: no tiles");
  auto check = [](const char* name, double value, double lo, double hi) {
    if (!(value >= lo && value <= hi))
      throw InputError(std::string("link plan: ") + name + " = " + std::to_string(value) + " is outside " +
                       std::to_string(lo) + " .. " + std::to_string(hi));
  };
  check("clk_mhz", o.clk_mhz, 1, 1000);
  check("lanes", o.lanes, 1, 64);
  check("in_flight", o.in_flight, 1, 2);
  check("turnaround", o.turnaround, 0, 1);
  check("window", o.window, 1, 64);
  check("medium_delay", o.medium_delay, 0, 40);
  return Simulation(chip, tiles, o).run();
}

// Columns of one shape of block RAM, stacked as deep as need be, and a column of another shape, but the same block, for
// the bits that are left: what is cheapest. Prices in LUTs: a block, and a third of a LUT for each bit that has to be
// chosen from a stack. Small memories are cheaper in LUTs. Prices found by comparing with Yosys
// (tb/model/test_link_plan.cpp).
double ram36(int width, int depth) {
  struct Shape {
    int bits, words;
    double blocks;
  };
  constexpr Shape kShapes[] = {{1, 16384, 0.5}, {2, 8192, 0.5}, {4, 4096, 0.5}, {9, 2048, 0.5}, {18, 1024, 0.5},
                               {36, 512, 0.5},  {1, 32768, 1},  {2, 16384, 1},  {4, 8192, 1},   {9, 4096, 1},
                               {18, 2048, 1},   {36, 1024, 1},  {72, 512, 1}};
  constexpr int kNine = 9;  // narrower shapes have no ninth bits
  constexpr double kBlockPrice = 130, kChoicePrice = 1.0 / 3;
  if (width < 1 || depth < 1)
    throw InputError("link plan: a memory of " + std::to_string(width) + " x " + std::to_string(depth));
  struct Cost {
    double price, blocks;
    bool operator<(const Cost& o) const { return price < o.price; }
  };
  auto column = [&](const Shape& s, int bits) {
    const int stack = (depth + s.words - 1) / s.words;
    return Cost{kBlockPrice * s.blocks * stack + kChoicePrice * bits * (stack - 1), s.blocks * stack};
  };
  std::optional<Cost> best;
  for (const Shape& s : kShapes) {
    const int columns = width / s.bits, left = width % s.bits;
    Cost c = column(s, s.bits);
    c = {c.price * columns, c.blocks * columns};
    std::optional<Cost> last;
    for (const Shape& t : kShapes) {
      const bool may = t.bits >= left && t.blocks == s.blocks && (t.bits >= kNine || s.bits < kNine);
      if (left > 0 && may && (!last || column(t, left) < *last)) last = column(t, left);
    }
    if (left > 0 && !last) continue;
    if (last) c = {c.price + last->price, c.blocks + last->blocks};
    if (!best || c < *best) best = c;
  }
  // RAM64M: three bits, two ports, 64 words in four LUTs; RAM32M: six bits, 32 words.
  const int stack = depth <= 32 ? 1 : (depth + 63) / 64, bits = depth <= 32 ? 6 : 3;
  const double in_luts = 4.0 * ((width + bits - 1) / bits) * stack + kChoicePrice * width * (stack - 1);
  return in_luts < best->price ? 0 : best->blocks;
}

// ram_deep.vhd: parts of a power of two words, the deep ones with a memory of their own for `nines` bits.
double ram_deep36(int width, int depth, int nines) {
  constexpr int kMost = 4, kGrain = 2048, kLeast = 512, kSplit = 8192;
  double blocks = 0;
  for (int part = 0, left = depth; left > 0; ++part) {
    int size = left;
    if (part > 0 || left > kGrain) {
      for (size = kLeast; size < left;) size *= 2;
      if (size - left >= kGrain && part < kMost - 1) size /= 2;
    }
    if (nines > 0 && nines < width && size >= kSplit) {
      blocks += ram36(nines, size) + ram36(width - nines, size);
    } else {
      blocks += ram36(width, size);
    }
    left -= size;
  }
  return blocks;
}

// As arbiter.vhd derives the generics of both buffers, and these their memories.
BufferRam buffer_ram(const net::ArbiterConfig& c) {
  BufferRam r;
  const int slots = std::max(2, c.slots()), most = c.engine.plane_cols * c.engine.plane_rows;
  int bits = 1;
  while (1 << bits < slots) ++bits;
  r.rows = ram_deep36(2 * c.engine.pix_bits, slots * c.chunk_pairs(), 0) + 3 * ram36(1, 1 << bits);
  int depth = most;
  if (c.map_depth > 0 && c.map_depth < most)
    depth = std::min(most, std::max(2, (c.map_depth + c.chunk_cells() - 1) / c.chunk_cells()) * c.chunk_cells());
  r.map = ram_deep36(c.cell_bits(), depth, c.cell_bits() / 9 * 9);
  return r;
}

}  // namespace psweep
