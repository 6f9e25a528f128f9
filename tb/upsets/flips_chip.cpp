// SPDX-License-Identifier: Apache-2.0
// flips_chip [--short] [--seed N] [--count N] [--part K/N] [--only SITE:BIT:CLOCK] [--sites]: single-event upsets in
// the whole chip while tiles run over its link. One bit of one register is changed at one edge of its clock; a host
// that does what docs/host.md says goes on: repeats what is not answered, opens its session again when it is lost or
// nothing moves, and sends a tile again that has failed. scripts/tools.py upsets makes the circuit that can be changed.
//   masked     both maps are right in the first session; perhaps a message had to be repeated
//   repeated   the chip said that the tile had failed or that there were errors; sent again, both maps are right
//   session    the session was lost, or nothing moved and the host opened it again; both maps are right
//   error      the host gave up after three tries of a tile, or nine sessions without one, and says so
//   silent     a map is wrong and nothing says so
//   hang       no valid answer for longer than the session timeout and a tile, or the host never comes to an end
// Every upset begins with the same chip in the same state: a run without an upset is recorded once, and copied back to
// the clock before the upset. As soon as all registers, RAMs and the host are as in that run, nothing can follow.
// Exit code 1 if anything hangs, or if nothing was changed.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <random>
#include <sstream>
#include <tuple>

#include "Vflips_chip.h"
#include "Vflips_chip__Syms.h"
#include "contract/frames.hpp"
#include "contract/registers.hpp"
#include "golden/psweep.hpp"
#include "net/link_engine.hpp"
#include "scene/stimulus.hpp"

using namespace psweep;
using net::Bytes;

namespace {

struct Site {
  const char* entity;
  const char* name;
  int bits, clock;
};
const std::vector<Site> kSites = {
#include "flips_chip.inc"
};

// Of tb/upsets/CMakeLists.txt.
net::ArbiterConfig chip_config() {
  net::ArbiterConfig a;
  golden::Config& c = a.engine;
  c.img_cols = 36, c.img_rows = 26, c.plane_cols = 16, c.plane_rows = 12, c.planes = 12, c.window = 5;
  c.pix_bits = 8, c.weight_bits = 8, c.interp_frac = 2, c.mncc_bits = 13, c.frac_bits = 8, c.lanes = 1;
  c.rectified = 0;
  a.clk_khz = FLIPS_CLK_KHZ, a.chunk_bytes = FLIPS_CHUNK_BYTES, a.session_ms = FLIPS_SESSION_MS;
  return a;
}

// All times in clocks of clk.
constexpr int64_t kPatience = 4000;  // before a message is repeated
constexpr int64_t kStill = 16000;    // without progress, then the session is opened again
constexpr int64_t kSession = int64_t{FLIPS_CLK_KHZ} * FLIPS_SESSION_MS;
constexpr int kTries = 3, kSessions = 9;
constexpr int64_t kStep = 64;  // between two states that are kept

// What is to be done; the same for all runs.
struct Tile {
  Bytes start;
  std::vector<Bytes> rows, map;
  uint32_t cells = 0;
};
struct Work {
  net::ArbiterConfig config;
  Bytes table;
  std::vector<Tile> tiles;
};

// Nibbles to and from the chip at 100 Mbit/s, full duplex.
struct Wire {
  std::deque<Bytes> queue;  // with preamble and FCS
  size_t nibble = 0;        // of the first one
  int gap = 0;
  bool receiving = false;
  size_t heard = 0;  // nibbles
  Bytes frame;

  void send(Bytes bytes) {
    Bytes whole = {0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0xd5};
    if (bytes.size() < net::kMinFrame) bytes.resize(net::kMinFrame);
    net::append_fcs(bytes);
    whole.insert(whole.end(), bytes.begin(), bytes.end());
    queue.push_back(std::move(whole));
  }
  bool sending() const { return !queue.empty() && gap == 0; }
  uint8_t next() {
    const uint8_t byte = queue.front()[nibble / 2];
    const uint8_t value = nibble % 2 == 0 ? byte & 15 : byte >> 4;
    if (++nibble == 2 * queue.front().size()) {
      queue.pop_front();
      nibble = 0;
      gap = 24;
    }
    return value;
  }
  // True if a frame has ended: frame holds it, without preamble and FCS; empty if it was not whole.
  bool hear(bool enable, uint8_t value) {
    if (enable) {
      if (!receiving) {
        receiving = true;
        heard = 0;
        frame.clear();
      }
      if (heard < 8192) {
        if (heard % 2 == 0) {
          frame.push_back(value);
        } else {
          frame.back() = static_cast<uint8_t>(frame.back() | value << 4);
        }
      }
      ++heard;
      return false;
    }
    if (!receiving) return false;
    receiving = false;
    const bool good = heard % 2 == 0 && heard < 8192 && frame.size() > 8 + net::kMinFrame && frame[7] == 0xd5;
    frame.erase(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(std::min<size_t>(8, frame.size())));
    if (!good || !net::fcs_good(frame)) {
      frame.clear();
    } else {
      frame.resize(frame.size() - 4);
    }
    return true;
  }
  bool operator==(const Wire& o) const {
    return std::tie(queue, nibble, gap, receiving, heard, frame) ==
           std::tie(o.queue, o.nibble, o.gap, o.receiving, o.heard, o.frame);
  }
};

enum class Phase { kOpen, kLook, kTable, kStart, kRows, kRead, kMap, kCheck, kRelease, kClose, kDone, kGaveUp };

// One question at a time, but for the rows; the next tile is sent while the map of this one is awaited.
struct Host {
  const Work* work = nullptr;
  Phase phase = Phase::kOpen;
  uint32_t token = 0, nonce = 0x1234567;
  uint16_t sequence = 0, first_sequence = 0;  // latest; first one of this phase
  int wanted = 0, upload = 0, first = 0;      // tiles: first is number 0 of the session
  bool last_close = false;
  int closes = 0;
  unsigned errors = 0, error_count = 0;
  uint32_t base = 0;
  std::vector<bool> known;  // rows of `upload`
  std::vector<std::vector<Bytes>> maps;
  int64_t asked = 0, heard = 0, progress = 0, map_heard = 0, longest = 0;
  int tries = 0, sessions = 0, fruitless = 0;       // of this tile; lost; since the latest tile
  int repeated = 0, resent = 0, sessions_lost = 0;  // in all

  bool operator==(const Host& o) const {
    return std::tie(phase, token, nonce, sequence, first_sequence, wanted, upload, first, last_close, closes, errors,
                    error_count, base, known, maps, asked, heard, progress, map_heard, tries, sessions, fruitless,
                    repeated, resent, sessions_lost) ==
           std::tie(o.phase, o.token, o.nonce, o.sequence, o.first_sequence, o.wanted, o.upload, o.first, o.last_close,
                    o.closes, o.errors, o.error_count, o.base, o.known, o.maps, o.asked, o.heard, o.progress,
                    o.map_heard, o.tries, o.sessions, o.fruitless, o.repeated, o.resent, o.sessions_lost);
  }

  static net::Address own() { return {{0x02, 0, 0, 0, 0, 0x11}, 0x0a050001, 40000}; }
  static net::Address chip() { return {{0x02, 0x00, 0x50, 0x53, 0x57, 0x01}, 0x0a050002, net::kUdpPort}; }

  bool over() const { return phase == Phase::kDone || phase == Phase::kGaveUp; }
  size_t count() const { return work->tiles.size(); }
  uint16_t number(int tile) const { return static_cast<uint16_t>(tile - first); }

  void begin(int64_t now, Wire& wire) {
    maps.resize(count());
    heard = now;
    enter(Phase::kOpen, now, wire);
  }
  void tick(int64_t now, Wire& wire) {
    if (over()) return;
    longest = std::max(longest, now - heard);
    if (now - progress > kStill && phase != Phase::kOpen && phase != Phase::kClose) {
      lost(now, wire);
      return;
    }
    if (now - asked <= kPatience) return;
    if (phase == Phase::kClose && closes >= 2) {
      if (last_close) {
        phase = Phase::kDone;
      } else {
        enter(Phase::kOpen, now, wire);
      }
      return;
    }
    ++resent;
    if (phase == Phase::kMap) {
      send(net::kStatus, number(wanted), 0, {}, 0, now, wire);
    } else {
      ask(now, wire);
    }
  }
  void on_frame(const Bytes& frame, int64_t now, Wire& wire) {
    if (over()) return;
    const auto packet = net::parse_udp(frame);
    if (!packet || !std::equal(frame.begin(), frame.begin() + 6, own().mac.begin()) || packet->to.ip != own().ip ||
        packet->to.port != own().port || packet->from.ip != chip().ip)
      return;
    const auto h = net::decode(packet->payload);
    if (!h || (h->type & net::kReply) == 0) return;
    if (h->type == net::kMap) {
      on_map(*h, packet->payload, now, wire);
      return;
    }
    // Of this phase?
    const auto age = static_cast<uint16_t>(h->sequence - first_sequence);
    if (age > static_cast<uint16_t>(sequence - first_sequence)) return;
    if (h->flags > net::kNotReady) return;
    heard = now;
    on_reply(*h, packet->payload, now, wire);
  }

 private:
  void send(net::Type type, uint16_t tile, uint16_t index, const Bytes& payload, uint8_t flags, int64_t now,
            Wire& wire) {
    net::Header h;
    h.type = type;
    h.token = type == net::kOpen ? 0 : token;
    h.sequence = ++sequence;
    h.flags = flags;
    h.tile = tile;
    h.index = index;
    Bytes message = net::encode(h);
    message.insert(message.end(), payload.begin(), payload.end());
    wire.send(net::make_udp(own(), chip(), message));
    asked = now;
  }
  void enter(Phase next, int64_t now, Wire& wire) {
    phase = next;
    progress = now;
    first_sequence = static_cast<uint16_t>(sequence + 1);
    ask(now, wire);
  }
  void ask(int64_t now, Wire& wire) {
    Bytes b;
    switch (phase) {
      case Phase::kOpen:
        net::append32(b, nonce);
        send(net::kOpen, 0, 0, b, 0, now, wire);
        break;
      case Phase::kLook:
      case Phase::kCheck:
        send(net::kStatus, 0, 0, {}, 0, now, wire);
        break;
      case Phase::kTable: {
        const size_t per = static_cast<size_t>(work->config.chunk_bytes) / 4 * 4;
        const size_t from = std::min(static_cast<size_t>(base) * 4, work->table.size());
        const size_t to = std::min(from + per, work->table.size());
        b.assign(work->table.begin() + static_cast<std::ptrdiff_t>(from),
                 work->table.begin() + static_cast<std::ptrdiff_t>(to));
        send(net::kTable, 1, static_cast<uint16_t>(base), b, 0, now, wire);
        break;
      }
      case Phase::kStart:
        send(net::kStart, number(upload), 0, tile(upload).start, 0, now, wire);
        break;
      case Phase::kRows: {
        std::vector<size_t> due;
        for (size_t i = 0; i < known.size(); ++i)
          if (!known[i] && i < base + static_cast<size_t>(work->config.slots())) due.push_back(i);
        for (size_t i : due)
          send(net::kWrite, number(upload), static_cast<uint16_t>(i), tile(upload).rows[i],
               i == due.back() ? net::kFlagAnswer : 0, now, wire);
        if (due.empty()) send(net::kStatus, 0, 0, {}, 0, now, wire);
        break;
      }
      case Phase::kRead: {
        const size_t from = missing();
        map_heard = now;
        send(net::kRead, number(wanted), static_cast<uint16_t>(from),
             net::read_payload(static_cast<uint16_t>(tile(wanted).map.size() - from), 0), 0, now, wire);
        break;
      }
      case Phase::kRelease:
        send(net::kRelease, number(wanted), 0, {}, 0, now, wire);
        break;
      case Phase::kClose:
        ++closes;
        send(net::kClose, 0, 0, {}, 0, now, wire);
        break;
      case Phase::kMap:
      case Phase::kDone:
      case Phase::kGaveUp:
        break;
    }
  }
  const Tile& tile(int n) const { return work->tiles[static_cast<size_t>(n)]; }
  std::vector<Bytes>& map() { return maps[static_cast<size_t>(wanted)]; }
  size_t missing() {
    size_t i = 0;
    while (i < map().size() && !map()[i].empty()) ++i;
    return i;
  }

  void lost(int64_t now, Wire& wire) {
    ++sessions_lost;
    again(now, wire);
  }
  void failed(int64_t now, Wire& wire) {
    ++repeated;
    if (++tries > kTries) {
      phase = Phase::kGaveUp;
      return;
    }
    again(now, wire);
  }
  void again(int64_t now, Wire& wire) {
    if (++fruitless > kSessions) {
      phase = Phase::kGaveUp;
      return;
    }
    closes = 0;
    enter(Phase::kClose, now, wire);
  }

  void on_reply(const net::Header& h, const Bytes& message, int64_t now, Wire& wire) {
    if (phase == Phase::kOpen) {
      on_opened(h, now, wire);
    } else if (phase == Phase::kClose) {
      on_closed(h, now, wire);
    } else if (h.token == token) {
      on_status(h, message, now, wire);
    }
  }
  void on_opened(const net::Header& h, int64_t now, Wire& wire) {
    if (h.type != (net::kOpen | net::kReply)) return;
    if (h.flags != net::kOk || h.token == 0) return;  // asked again
    token = h.token;
    ++sessions;
    enter(Phase::kLook, now, wire);
  }
  void on_closed(const net::Header& h, int64_t now, Wire& wire) {
    if (h.type != (net::kClose | net::kReply)) return;
    if (last_close) {
      phase = Phase::kDone;
    } else {
      nonce = nonce * 69069 + 1;
      enter(Phase::kOpen, now, wire);
    }
  }
  void on_status(const net::Header& h, const Bytes& message, int64_t now, Wire& wire) {
    if (h.flags == net::kBusy || h.flags == net::kNoSession) {
      lost(now, wire);
      return;
    }
    if (h.flags == net::kBadMessage) return;  // something made it so; asked again
    if ((message.size() - net::kHeaderBytes) % 4 != 0) return;
    const auto s = net::parse_status(net::words_of(message, net::kHeaderBytes));
    if (!s || s->bitmap.size() != (static_cast<size_t>(work->config.slots()) + 31) / 32) return;
    if (phase == Phase::kLook) {
      on_look(*s, now, wire);
      return;
    }
    if (s->error_count < error_count) {
      error_count = s->error_count;
      errors = s->errors;
    }
    if (s->has(net::kFlagFailed) || s->error_count > error_count || (s->errors & ~errors) != 0) {
      failed(now, wire);
      return;
    }
    on_phase(h, *s, now, wire);
  }
  void on_look(const net::Status& s, int64_t now, Wire& wire) {
    errors = s.errors;
    error_count = s.error_count;
    first = wanted;
    base = 0;
    for (size_t i = static_cast<size_t>(wanted); i < count(); ++i) maps[i].assign(work->tiles[i].map.size(), Bytes{});
    enter(Phase::kTable, now, wire);
  }
  void on_phase(const net::Header& h, const net::Status& s, int64_t now, Wire& wire) {
    const int type = h.type & 0x7f;
    switch (phase) {
      case Phase::kTable:
        if (type == net::kTable) on_table(h, now, wire);
        break;
      case Phase::kStart:
        if (type == net::kStart) on_start(h, now, wire);
        break;
      case Phase::kRows:
        on_rows(h, s, now, wire);
        break;
      case Phase::kRead:
        if (type == net::kRead) after_read(now, wire);
        break;
      case Phase::kMap:
        // Cells are there, and none come.
        if (type == net::kStatus && now - map_heard > kPatience && s.has(net::kFlagMap) &&
            s.map_tile == number(wanted)) {
          ++resent;
          phase = Phase::kRead;
          ask(now, wire);
          phase = Phase::kMap;
        }
        break;
      case Phase::kCheck:
        if (type != net::kStatus || !s.has(net::kFlagMapComplete)) return;
        if (s.cells == tile(wanted).cells) {
          enter(Phase::kRelease, now, wire);
        } else {
          failed(now, wire);
        }
        break;
      case Phase::kRelease:
        if (type == net::kRelease && (h.flags == net::kOk || h.flags == net::kOrder)) on_released(now, wire);
        break;
      default:
        break;
    }
  }
  void on_table(const net::Header& h, int64_t now, Wire& wire) {
    if (h.flags == net::kOrder) {
      lost(now, wire);
    } else if (h.flags == net::kOk) {
      base += static_cast<uint32_t>(work->config.chunk_bytes) / 4;
      if (static_cast<size_t>(base) * 4 < work->table.size()) {
        enter(Phase::kTable, now, wire);
      } else {
        upload = wanted;
        enter(Phase::kStart, now, wire);
      }
    }
  }
  void on_start(const net::Header& h, int64_t now, Wire& wire) {
    if (h.flags == net::kOrder) {
      lost(now, wire);
    } else if (h.flags == net::kOk) {
      known.assign(tile(upload).rows.size(), false);
      base = 0;
      enter(Phase::kRows, now, wire);
    }
  }
  void on_rows(const net::Header& h, const net::Status& s, int64_t now, Wire& wire) {
    if (h.flags == net::kOrder) {
      lost(now, wire);
      return;
    }
    if (s.row_tile != number(upload)) return;
    base = std::max<uint32_t>(base, s.base);
    bool more = false, all = true;
    for (size_t i = 0; i < known.size(); ++i) {
      if (!known[i] && (!s.has(net::kFlagRows) || s.chunk(static_cast<uint32_t>(i)))) known[i] = more = true;
      all = all && known[i];
    }
    if (all) {
      enter(upload == wanted ? Phase::kRead : Phase::kMap, now, wire);
      arrived(now, wire);
    } else if (more) {
      enter(Phase::kRows, now, wire);
    }
  }
  void on_released(int64_t now, Wire& wire) {
    ++wanted;
    tries = fruitless = 0;
    if (static_cast<size_t>(wanted) == count()) {
      last_close = true;
      closes = 0;
      enter(Phase::kClose, now, wire);
    } else {
      enter(Phase::kRead, now, wire);
    }
  }
  void after_read(int64_t now, Wire& wire) {
    if (upload == wanted && static_cast<size_t>(wanted) + 1 < count()) {
      upload = wanted + 1;
      enter(Phase::kStart, now, wire);
    } else {
      enter(Phase::kMap, now, wire);
      arrived(now, wire);
    }
  }
  void on_map(const net::Header& h, const Bytes& message, int64_t now, Wire& wire) {
    if (static_cast<size_t>(wanted) >= count() || h.token != token || h.tile != number(wanted) ||
        phase == Phase::kOpen || phase == Phase::kClose || phase == Phase::kLook || phase == Phase::kTable ||
        h.index >= map().size() || message.size() - net::kHeaderBytes != tile(wanted).map[h.index].size())
      return;
    heard = map_heard = now;
    Bytes& place = map()[h.index];
    if (place.empty()) {
      place.assign(message.begin() + static_cast<std::ptrdiff_t>(net::kHeaderBytes), message.end());
      progress = now;
    }
    arrived(now, wire);
  }
  void arrived(int64_t now, Wire& wire) {
    if (phase == Phase::kMap && missing() == map().size()) enter(Phase::kCheck, now, wire);
  }
};

struct World {
  Wire wire;
  Host host;
  int64_t next_clk = 4000, next_rx = 13000, next_tx = 29000;  // picoseconds
  int64_t clocks = 0;
};

struct Upset {
  int site = 0, bit = 0;  // site 0: none
  int64_t clock = 0;
};

class Chip {
 public:
  Chip() {
    context_.randReset(2);
    context_.randSeed(1);
    dut_ = std::make_unique<Vflips_chip>(&context_);
    // Inputs begin with random values, too.
    dut_->clk = dut_->mii_rx_clk = dut_->mii_tx_clk = 0;
    dut_->mii_rxd = dut_->mii_rx_dv = dut_->mii_rx_er = dut_->mii_crs = dut_->mii_col = 0;
    dut_->straps = 0;
    dut_->flip_site = 0;
    dut_->flip_mask = 0;
    for (int i = 0; i < 16; ++i) dut_->flip_wide[i] = 0;
    dut_->phy_full_duplex = 1;
    dut_->phy_speed_100 = 1;
    dut_->arst_n = 0;
    dut_->eval();
  }
  ~Chip() { dut_->final(); }

  World world;

  void set_reset(bool active) { dut_->arst_n = !active; }
  void upset(const Upset& u) {
    upset_ = u;
    pending_ = u.site > 0;
  }
  bool pending() const { return pending_; }
  void run_to(int64_t clocks) {
    while (world.clocks < clocks) step();
  }
  void keep(std::vector<uint8_t>& to) const {
    to.resize(sizeof(Vflips_chip__Syms));
    std::memcpy(to.data(), state(), to.size());
  }
  void put_back(const std::vector<uint8_t>& from) { std::memcpy(state(), from.data(), from.size()); }
  bool same(const std::vector<uint8_t>& other) const { return std::memcmp(state(), other.data(), other.size()) == 0; }

 private:
  // Everything that Verilator keeps is in one object, at a place that does not change; pointers in it do not either.
  void* state() const { return static_cast<void*>(dut_->rootp->vlSymsp); }

  bool due(int clock) const {
    return pending_ && world.clocks >= upset_.clock && kSites[static_cast<size_t>(upset_.site) - 1].clock == clock;
  }
  void edge(int clock) {
    const bool now = due(clock);
    if (now) {
      dut_->flip_site = static_cast<SData>(upset_.site);
      dut_->flip_mask = upset_.bit < 64 ? uint64_t{1} << upset_.bit : 0;
      dut_->flip_wide[upset_.bit / 32] = 1u << upset_.bit % 32;
    }
    dut_->eval();
    if (now) {
      dut_->flip_site = 0;
      dut_->flip_mask = 0;
      dut_->flip_wide[upset_.bit / 32] = 0;
      pending_ = false;
    }
  }
  void step() {
    World& w = world;
    const int64_t next = std::min({w.next_clk, w.next_rx, w.next_tx});
    if (next == w.next_clk) {
      w.next_clk += 33333;
      dut_->clk = !dut_->clk;
      edge(0);
      if (++w.clocks % 16 == 0 && w.host.work) w.host.tick(w.clocks, w.wire);
    } else if (next == w.next_rx) {
      w.next_rx += 40000;
      const bool sending = w.wire.sending();
      dut_->mii_rx_dv = sending;
      dut_->mii_rxd = sending ? w.wire.next() : 0;
      if (!sending && w.wire.gap > 0) --w.wire.gap;
      dut_->mii_crs = sending || dut_->mii_tx_en;
      dut_->mii_rx_clk = !dut_->mii_rx_clk;
      edge(1);
    } else {
      w.next_tx += 40000;
      const bool enable = dut_->mii_tx_en;
      const uint8_t value = dut_->mii_txd;
      dut_->mii_tx_clk = !dut_->mii_tx_clk;
      edge(2);
      if (w.wire.hear(enable, value) && w.host.work && !w.wire.frame.empty()) {
        const Bytes frame = w.wire.frame;
        w.host.on_frame(frame, w.clocks, w.wire);
      }
    }
  }

  VerilatedContext context_;
  std::unique_ptr<Vflips_chip> dut_;
  Upset upset_;
  bool pending_ = false;
};

enum Verdict { kMasked, kRepeated, kLost, kError, kSilent, kHang, kVerdicts };
constexpr const char* kNames[kVerdicts] = {"masked", "repeated", "session", "error", "silent", "hang"};

struct Count {
  uint64_t flips = 0, resent = 0;
  uint64_t verdict[kVerdicts] = {};
  int64_t worst = 0;    // clocks that the host's work took longer than without an upset
  int64_t silence = 0;  // clocks without a valid answer
};

struct Options {
  bool brief = false, lines = false;
  uint32_t seed = 1;
  int64_t count = 20000;
  int part = 0, parts = 1;
  std::string only;
};

class Campaign {
 public:
  explicit Campaign(const Options& options) : options_(options), maker_(chip_config().engine, 7) {
    work_.config = chip_config();
    const golden::Config& c = work_.config.engine;
    scene::Stimulus a = maker_.make(scene::Texture::kStereo, scene::Geometry::kInside, 8, 5, 6);
    scene::Stimulus b = maker_.make(scene::Texture::kStereo, scene::Geometry::kInside, 7, 5, 6);
    b.table = a.table;
    b.job.tx_left = a.job.tx_left, b.job.ty_left = a.job.ty_left;
    b.job.tx_right = a.job.tx_right, b.job.ty_right = a.job.ty_right;
    for (const auto& w : golden::table_writes(a.table)) net::append32(work_.table, w.value);
    for (const scene::Stimulus* s : {&a, &b}) {
      Tile tile;
      const golden::TileInput pixels{s->job, s->left, s->right};
      tile.start = net::start_payload(work_.config, s->job, 1);
      tile.rows = net::row_chunks(work_.config, pixels);
      const auto cells = golden::run_tile(c, s->job, s->table, s->left, s->right).cells;
      const auto per = static_cast<size_t>(work_.config.chunk_cells());
      tile.cells = static_cast<uint32_t>(cells.size());
      for (size_t i = 0; i < cells.size(); ++i) {
        if (i % per == 0) tile.map.emplace_back();
        const uint64_t word = net::pack_wire_cell(c, cells[i]);
        for (int k = work_.config.cell_bytes() - 1; k >= 0; --k)
          tile.map.back().push_back(static_cast<uint8_t>(word >> 8 * k));
      }
      work_.tiles.push_back(std::move(tile));
    }
  }

  bool run() {
    if (!record()) return false;
    if (!options_.only.empty()) return one();
    const auto begun = std::chrono::steady_clock::now();
    std::vector<Upset> upsets = choose();
    double told = 0;
    size_t n = 0;
    for (const Upset& u : upsets) {
      experiment(u);
      ++n;
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
      if (seconds > told + 10) {
        told = seconds;
        std::fprintf(stderr, "flips_chip: %zu of %zu, %.0f s left\n", n, upsets.size(),
                     seconds / static_cast<double>(n) * static_cast<double>(upsets.size() - n));
      }
    }
    return report();
  }

 private:
  // The run without an upset, all states of it.
  bool record() {
    chip_.set_reset(true);
    chip_.run_to(64);
    chip_.set_reset(false);
    chip_.run_to(2048);
    chip_.world.host.work = &work_;
    chip_.world.host.begin(chip_.world.clocks, chip_.world.wire);
    begin_ = chip_.world.clocks;
    while (!chip_.world.host.over() && chip_.world.clocks < begin_ + 400000) {
      states_.emplace_back();
      chip_.keep(states_.back().chip);
      states_.back().world = chip_.world;
      chip_.run_to(chip_.world.clocks + kStep);
      if (window_end_ == 0 && chip_.world.host.wanted == 1) window_end_ = chip_.world.clocks;
    }
    const Host& h = chip_.world.host;
    end_ = chip_.world.clocks;
    std::printf("flips_chip: %zu registers; without an upset: %lld clocks, %d sessions, %d repeated, %d resent\n",
                kSites.size(), static_cast<long long>(end_ - begin_), h.sessions, h.repeated, h.resent);
    if (h.phase != Phase::kDone || !right(h) || h.sessions != 1 || h.repeated != 0 || h.sessions_lost != 0) {
      std::printf("flips_chip: the chip without an upset is wrong (phase %d, tile %d)\n", static_cast<int>(h.phase),
                  h.wanted);
      return false;
    }
    return true;
  }
  bool right(const Host& h) const {
    for (size_t i = 0; i < work_.tiles.size(); ++i)
      if (h.maps[i] != work_.tiles[i].map) return false;
    return true;
  }

  // Every bit of every register between the pins and the engine, and of control, so often that there are `count`
  // upsets; every bit of the rest of the engine once.
  static bool engine(const Site& s) {
    return std::strncmp(s.name, "u_engine.", 9) == 0 && s.entity != std::string("control");
  }
  std::vector<Upset> choose() {
    std::vector<Upset> all;
    int64_t inner = 0, outer = 0;
    for (const Site& s : kSites) (engine(s) ? inner : outer) += s.bits;
    const int64_t times = options_.brief ? 1 : std::max<int64_t>(1, (options_.count - inner + outer - 1) / outer);
    std::mt19937 random(options_.seed);
    auto draw = [&](int64_t n) { return static_cast<int64_t>(random() % static_cast<uint64_t>(n)); };
    for (size_t n = 0; n < kSites.size(); ++n) {
      for (int bit = 0; bit < kSites[n].bits; ++bit) {
        for (int64_t i = 0; i < (engine(kSites[n]) ? 1 : times); ++i) {
          Upset u;
          u.site = static_cast<int>(n) + 1;
          u.bit = bit;
          u.clock = begin_ + 16 + draw(window_end_ - begin_ - 16);
          if (options_.brief && draw(engine(kSites[n]) ? 40 : 8) != 0) continue;
          all.push_back(u);
        }
      }
    }
    // In random order: what is done when the campaign is stopped stands for all of it.
    std::shuffle(all.begin(), all.end(), random);
    std::vector<Upset> mine;
    for (size_t i = 0; i < all.size(); ++i)
      if (static_cast<int>(i) % options_.parts == options_.part) mine.push_back(all[i]);
    return mine;
  }

  Verdict experiment(const Upset& u) {
    const Site& site = kSites[static_cast<size_t>(u.site) - 1];
    Host& h = chip_.world.host;
    const Verdict v = run_with(u);
    const bool over = h.over();
    const int64_t later = over ? std::max<int64_t>(0, chip_.world.clocks - end_) : 0;
    Count& count = counts_[group(site)];
    ++count.flips;
    ++count.verdict[v];
    count.resent += v == kMasked && h.resent > 0;
    count.worst = std::max(count.worst, later);
    count.silence = std::max(count.silence, h.longest);
    if (options_.lines) {
      std::printf("upset\t%s\t%s\t%s\t%d\t%d\t%lld\t%s\t%d\t%lld\t%lld\n", group(site).c_str(), site.entity, site.name,
                  u.site, u.bit, static_cast<long long>(u.clock), kNames[v], h.resent, static_cast<long long>(later),
                  static_cast<long long>(h.longest));
    } else if (v == kHang || !options_.only.empty()) {
      std::printf(
          "flips_chip: %s: %s %s bit %d, clock %lld (phase %d, tile %d, %d sessions lost, %d repeated, %d resent, "
          "silent for %lld); again: --only %d:%d:%lld\n",
          kNames[v], site.entity, site.name, u.bit, static_cast<long long>(u.clock), static_cast<int>(h.phase),
          h.wanted, h.sessions_lost, h.repeated, h.resent, static_cast<long long>(h.longest), u.site, u.bit,
          static_cast<long long>(u.clock));
    }
    if (v == kSilent || v == kHang || v == kError) ++found_[v][std::string(site.entity) + " " + site.name];
    return v;
  }
  Verdict run_with(const Upset& u) {
    size_t at = static_cast<size_t>((u.clock - begin_) / kStep);
    chip_.put_back(states_[at].chip);
    chip_.world = states_[at].world;
    chip_.upset(u);
    const int64_t limit = u.clock + 12 * kSession;
    const Host& h = chip_.world.host;
    while (!h.over() && chip_.world.clocks < limit) {
      chip_.run_to(chip_.world.clocks + kStep);
      ++at;
      if (chip_.pending() || at >= states_.size()) continue;
      if (h == states_[at].world.host && chip_.world.wire == states_[at].world.wire && chip_.same(states_[at].chip))
        return kMasked;
    }
    if (!h.over() || h.longest > kSession + (end_ - begin_) / 2 + kPatience) return kHang;
    if (h.phase == Phase::kGaveUp) return kError;
    if (!right(h)) return kSilent;
    if (h.sessions_lost > 0) return kLost;
    return h.repeated > 0 ? kRepeated : kMasked;
  }
  static std::string group(const Site& s) {
    const std::string entity = s.entity, name = s.name;
    if (entity == "cdc_sync" || entity == "reset_sync" || entity == "async_fifo") return "crossings and resets";
    if (name.rfind("u_engine.", 0) == 0) return entity == "control" ? "engine: control" : "engine: rest";
    if (entity.rfind("ram_", 0) == 0) {
      // Words that are read belong to the unit that reads them.
      const size_t unit = name.find(".u_");
      const size_t next = name.find('.', unit + 1);
      return "words read from RAMs of " + name.substr(unit + 3, next - unit - 3);
    }
    return entity;
  }

  bool one() {
    std::istringstream text(options_.only);
    Upset u;
    char colon = 0;
    text >> u.site >> colon >> u.bit >> colon >> u.clock;
    if (u.site < 1 || u.site > static_cast<int>(kSites.size())) throw std::runtime_error("--only: no such site");
    return experiment(u) != kHang;
  }

  bool report() const {
    if (options_.lines) return true;
    std::printf("%-34s %7s", "upset in", "flips");
    for (const char* name : kNames) std::printf(" %8s", name);
    std::printf(" %8s %8s %8s\n", "resent", "clocks", "silence");
    Count all;
    auto line = [](const std::string& what, const Count& c) {
      std::printf("%-34s %7llu", what.c_str(), static_cast<unsigned long long>(c.flips));
      for (uint64_t v : c.verdict) std::printf(" %8llu", static_cast<unsigned long long>(v));
      std::printf(" %8llu %8lld %8lld\n", static_cast<unsigned long long>(c.resent), static_cast<long long>(c.worst),
                  static_cast<long long>(c.silence));
    };
    for (const auto& [what, c] : counts_) {
      line(what, c);
      all.flips += c.flips, all.resent += c.resent, all.worst = std::max(all.worst, c.worst);
      all.silence = std::max(all.silence, c.silence);
      for (int v = 0; v < kVerdicts; ++v) all.verdict[v] += c.verdict[v];
    }
    line("all", all);
    for (int v : {kError, kSilent, kHang})
      for (const auto& [what, times] : found_[v]) std::printf("%s: %s: %d\n", kNames[v], what.c_str(), times);
    return all.flips > 0 && all.verdict[kHang] == 0;
  }

  struct State {
    std::vector<uint8_t> chip;
    World world;
  };
  Options options_;
  scene::StimulusMaker maker_;
  Work work_;
  Chip chip_;
  std::vector<State> states_;
  int64_t begin_ = 0, end_ = 0, window_end_ = 0;
  std::map<std::string, Count> counts_;
  std::map<std::string, int> found_[kVerdicts];
};

}  // namespace

int main(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string arg = argv[i];
    const bool more = i + 1 < argc;
    if (arg == "--short") {
      options.brief = true;
    } else if (arg == "--lines") {
      options.lines = true;
    } else if (arg == "--seed" && more) {
      options.seed = static_cast<uint32_t>(std::atoi(argv[++i]));
    } else if (arg == "--count" && more) {
      options.count = std::atoll(argv[++i]);
    } else if (arg == "--part" && more && std::sscanf(argv[++i], "%d/%d", &options.part, &options.parts) == 2 &&
               options.part >= 1 && options.part <= options.parts) {
      --options.part;
    } else if (arg == "--only" && more) {
      options.only = argv[++i];
    } else if (arg == "--sites") {
      int n = 0;
      for (const Site& s : kSites) std::printf("%d %s %s %d %d\n", ++n, s.entity, s.name, s.bits, s.clock);
      return 0;
    } else {
      std::fprintf(
          stderr,
          "usage: flips_chip [--short] [--seed N] [--count N] [--part K/N] [--only SITE:BIT:CLOCK] [--sites]\n");
      return 2;
    }
  }
  try {
    return Campaign(options).run() ? 0 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "flips_chip: %s\n", e.what());
    return 2;
  }
}
