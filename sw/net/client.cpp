// SPDX-License-Identifier: Apache-2.0
#include "net/client.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <random>

namespace psweep::net {
namespace {

constexpr double kFirstPatience = 0.03;  // before anything was measured
constexpr double kMostPatience = 0.5;    // so that a cable put back is noticed soon (or 4 round trips)
constexpr double kBusyPause = 0.25;      // between two OPEN at a busy chip
constexpr double kBrief = 1;             // seconds, or so many round trips:
constexpr double kBriefTrips = 8;
constexpr int kMostGone = 8;      // sessions that are gone before their first status
constexpr int kMostRefusals = 3;  // of INFO or COUNTERS: the request may have been damaged on its way

std::string seconds(double s) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f s", s);
  return text;
}

}  // namespace

const char* type_name(uint8_t type) {
  static const char* const names[] = {"-",     "OPEN",  "CLOSE", "INFO", "COUNTERS", "STATUS",
                                      "TABLE", "START", "WRITE", "READ", "RELEASE",  "SET"};
  return type < std::size(names) ? names[type] : type == kMap ? "MAP" : "-";
}

const char* code_name(uint8_t code) {
  static const char* const names[] = {"ok", "busy", "no session", "bad message", "order", "not ready"};
  return code < std::size(names) ? names[code] : "unknown code";
}

std::optional<Capabilities> parse_info(const std::vector<uint32_t>& w) {
  if (w.size() != kInfoWords || w[0] != (uint32_t{kVersion} << 16 | kInfoWords)) return std::nullopt;
  Capabilities c;
  golden::Config& e = c.config.engine;
  bool good = true;
  auto take = [&](const auto& table, auto& values) {
    for (const auto& field : table) {
      if (field.info == 0) continue;
      const uint32_t v = w[field.info];
      good = good && v <= 0x7fffffff && field.holds(static_cast<int>(v & 0x7fffffff));
      values.*field.value = static_cast<int>(v & 0x7fffffff);
    }
  };
  take(kEngineFields, e);
  take(kChipFields, c.config);
  if (!good || c.config.row_slots < 2 || c.config.map_depth < 1 || w[26] != kCounterWords) return std::nullopt;
  c.mac = uint64_t{w[14] & 0xffff} << 32 | w[15];
  c.counters = kCounterWords;
  // What follows from the others must follow: chip and host cut rows and cells into the same chunks.
  good =
      good && w[13] == static_cast<uint32_t>(c.config.cell_bits()) &&
      w[18] == static_cast<uint32_t>(c.config.pair_bytes()) && w[19] == static_cast<uint32_t>(c.config.chunk_pairs()) &&
      w[21] == static_cast<uint32_t>(c.config.cell_bytes()) && w[22] == static_cast<uint32_t>(c.config.chunk_cells());
  if (!good) return std::nullopt;
  return c;
}

bool same_capabilities(const ArbiterConfig& a, const ArbiterConfig& b) {
  // Sizes and formats; clock and session may differ.
  auto same = [](const auto& table, const auto& x, const auto& y) {
    return std::all_of(table.begin(), table.end(), [&](const auto& field) {
      return field.info == 0 || field.role == Role::build || x.*field.value == y.*field.value;
    });
  };
  return same(kEngineFields, a.engine, b.engine) && same(kChipFields, a, b) && a.engine.lanes == b.engine.lanes &&
         a.engine.rectified == b.engine.rectified;
}

std::optional<Status> parse_status(const std::vector<uint32_t>& w) {
  if (w.size() < kStatusWords) return std::nullopt;
  auto hi = [&](int i) { return static_cast<uint16_t>(w[i] >> 16); };
  auto lo = [&](int i) { return static_cast<uint16_t>(w[i]); };
  Status s;
  s.row_tile = hi(0), s.flags = lo(0);
  s.engine_tile = hi(1), s.map_tile = lo(1);
  s.base = hi(2), s.received = lo(2);
  s.table = hi(3), s.table_words = lo(3);
  s.cells = w[4];
  s.errors = hi(5), s.error_count = lo(5);
  s.tiles_done = hi(6), s.tiles_dropped = lo(6);
  s.tile_clocks = w[7];
  s.window_errors = hi(8), s.failed_tile = lo(8);
  s.bitmap.assign(w.begin() + kStatusWords, w.end());
  return s;
}

uint64_t fresh_seed() {
  uint64_t seed = 0;
  try {
    std::random_device random;
    seed = uint64_t{random()} << 32 | random();
  } catch (const std::exception&) {  // no source: the rest must do
  }
  auto mix = [&seed](uint64_t v) {
    seed = (seed ^ v) * 0x9e3779b97f4a7c15;
    seed ^= seed >> 29;
  };
  mix(static_cast<uint64_t>(std::chrono::system_clock::now().time_since_epoch().count()));
  mix(static_cast<uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count()));
  mix(static_cast<uint64_t>(::getpid()));
  return seed;
}

Client::Client(Transport& transport, double timeout, uint64_t seed)
    : transport_(transport), timeout_(timeout), random_state_(seed), sent_(65536) {
  sequence_ = static_cast<uint16_t>(random());
  heard_ = asked_ = now();
}

uint64_t Client::random() {  // splitmix64
  uint64_t z = random_state_ += 0x9e3779b97f4a7c15;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9;
  z = (z ^ z >> 27) * 0x94d049bb133111eb;
  return z ^ z >> 31;
}

double Client::patience() const {
  const double once = has_rtt_ ? std::max(least_patience_, statistics_.rtt + 4 * rtt_variation_) : kFirstPatience;
  return std::min(once * backoff_, std::max({once, kMostPatience, 4 * statistics_.rtt}));
}

void Client::silence() {
  ++statistics_.timeouts;
  backoff_ = std::min(backoff_ * 2, 1024.0);
}

void Client::check_silence(const std::string& outstanding) {
  const double silent = silent_for();
  if (silent <= timeout_) return;
  std::string text = where() + ": no valid answer for " + seconds(silent) + "; outstanding: " + outstanding;
  if (!transport_.complaint().empty()) text += " (" + transport_.complaint() + ")";
  if (other_versions_ > 0) text += "; answers came in version " + std::to_string(other_version_) + " of the protocol";
  // Small packets may get through when large ones do not.
  const std::string cut = now() - latest_ <= timeout_ ? fragments() : "";
  if (!cut.empty()) text += "; " + cut;
  throw LinkError(text);
}

void Client::check_version() {
  // One such packet may be a damaged one.
  if (ever_heard_ || other_versions_ < 2) return;
  throw LinkError(where() + ": the chip speaks version " + std::to_string(other_version_) +
                  " of the protocol, this host version " + std::to_string(kVersion) + ": " +
                  (other_version_ < kVersion ? "the chip needs newer contents, or this host an older program"
                                             : "this host needs a newer program"));
}

std::string Client::fragments() noexcept {
  try {
    if (first_counters_.empty() || brief_) return {};
    const uint32_t before = first_counters_[kIpFragment];
    uint32_t count = 0;
    briefly([&] { count = counters()[kIpFragment] - before; });
    if (count == 0) return {};
    return "the chip has received " + std::to_string(count) +
           " fragments (ip_fragment), which it does not take: something on the way has an MTU that is too small";
  } catch (...) {
    return {};
  }
}

uint64_t Client::send(Type type, uint16_t tile, uint16_t index, const Bytes& payload, uint8_t flags) {
  Sent& s = sent_[++sequence_];
  s = Sent{};
  s.order = ++order_;
  s.type = type;
  // INFO and COUNTERS need no token, but a host that shows one is answered while others are limited.
  s.token = type == kOpen && !moving_ ? 0 : token_;
  s.tile = tile;
  s.index = index;
  s.count = type == kRead && payload.size() >= 2 ? static_cast<uint16_t>(get16(payload, 0)) : 0;
  s.time = now();
  Header h;
  h.type = type;
  h.token = s.token;
  h.sequence = sequence_;
  h.flags = flags;
  h.tile = tile;
  h.index = index;
  Bytes packet = encode(h);
  packet.resize(kHeaderBytes + payload.size());
  // No answer is longer than its question.
  if (type == kInfo) packet.resize(std::max(packet.size(), kInfoRequestBytes));
  if (type == kCounters) packet.resize(std::max(packet.size(), kCountersRequestBytes));
  std::copy(payload.begin(), payload.end(), packet.begin() + static_cast<std::ptrdiff_t>(kHeaderBytes));
  ++statistics_.packets_sent;
  statistics_.bytes_sent += packet.size();
  transport_.send(packet);
  if (const auto most = transport_.largest(); most && packet.size() > most->payload) {
    throw LinkError(where() + ": " + most->why + ", but this " + type_name(type) + " needs " +
                    std::to_string(packet.size() + kIpUdpHeaders));
  }
  return s.order;
}

std::optional<Event> Client::receive(double timeout_s) {
  // A remainder shorter than the clock's step would let no time pass at all.
  const double until = now() + (timeout_s > 0 ? std::max(timeout_s, 1e-5) : 0);
  for (;;) {
    const auto packet = transport_.receive(std::max(0.0, until - now()));
    if (!packet) return std::nullopt;
    if (auto event = take(*packet)) return event;
    if (now() >= until) return std::nullopt;  // a flood of rubbish must not keep the caller from its timers
  }
}

std::optional<Event> Client::take(const Bytes& packet) {
  ++statistics_.packets_received;
  statistics_.bytes_received += packet.size();
  const auto h = decode(packet);
  if (!h || (h->type & kReply) == 0) {
    if (!h) take_other_version(packet);
    ++statistics_.malformed;
    return std::nullopt;
  }
  Sent& sent = sent_[h->sequence];
  if (sent.order == 0) {
    ++statistics_.foreign;
    return std::nullopt;
  }
  if (h->type == kMap) return take_map(packet, *h, sent);
  const bool opened = sent.type == kOpen && h->flags == kOk;
  if (h->type != (sent.type | kReply) || h->tile != sent.tile || h->index != sent.index ||
      (opened ? h->token == 0 : h->token != sent.token)) {
    ++statistics_.foreign;
    return std::nullopt;
  }
  Reply r;
  r.type = sent.type;
  r.code = h->flags;
  r.tile = sent.tile;
  r.index = sent.index;
  r.order = sent.order;
  r.token = h->token;
  if (packet.size() % 4 != 0 || h->flags > kNotReady) {
    ++statistics_.malformed;
    return std::nullopt;
  }
  r.words = words_of(packet, kHeaderBytes);
  const bool bare = r.words.empty();
  bool good;
  if (sent.type == kOpen) {
    good = bare && r.code <= kBadMessage && r.code != kNoSession;
  } else if (r.code == kBusy || r.code == kNoSession) {
    good = bare;  // to somebody whom the chip does not know
  } else if (bare) {
    good = r.code == kBadMessage || (sent.type == kClose && r.code == kOk);
  } else if (sent.type == kInfo) {
    good = r.code == kOk && parse_info(r.words).has_value();
  } else if (sent.type == kCounters) {
    good = r.code == kOk && r.words.size() == kCounterWords;
  } else {
    r.status = parse_status(r.words);
    good = r.status.has_value() &&
           (!capabilities_ || r.words.size() == static_cast<size_t>(kStatusWords) +
                                                    (static_cast<size_t>(capabilities_->config.row_slots) + 31) / 32);
  }
  if (!good) {
    ++statistics_.malformed;
    return std::nullopt;
  }
  if (sent.answered) {
    ++statistics_.duplicates;
    return std::nullopt;
  }
  sent.answered = true;
  const double trip = std::max(0.0, now() - sent.time);
  if (!has_rtt_) {
    statistics_.rtt = statistics_.rtt_min = statistics_.rtt_max = trip;
    rtt_variation_ = trip / 2;
    has_rtt_ = true;
  } else {
    rtt_variation_ += (std::abs(trip - statistics_.rtt) - rtt_variation_) / 4;
    statistics_.rtt += (trip - statistics_.rtt) / 8;
    statistics_.rtt_min = std::min(statistics_.rtt_min, trip);
    statistics_.rtt_max = std::max(statistics_.rtt_max, trip);
  }
  heard_ = latest_ = now();
  ever_heard_ = true;
  backoff_ = 1;
  return r;
}

// A chip refuses what is not of its version in a header of its own: the rest of it answers a request of ours.
void Client::take_other_version(const Bytes& p) {
  if (p.size() < kHeaderBytes || get16(p, 0) != kMagic || p[2] == kVersion || p[10] != kBadMessage) return;
  const Sent& sent = sent_[get16(p, 8)];
  if (sent.order == 0 || p[3] != (sent.type | kReply) || get32(p, 4) != sent.token || get16(p, 12) != sent.tile ||
      get16(p, 14) != sent.index) {
    return;
  }
  other_version_ = p[2];
  ++other_versions_;
}

std::optional<Event> Client::take_map(const Bytes& packet, const Header& h, Sent& sent) {
  // sent.type READ, this session's token, within the range asked for.
  if (sent.type != kRead || h.token != token_ || sent.token != token_ || token_ == 0 || h.tile != sent.tile ||
      h.index < sent.index || h.index - sent.index >= sent.count || h.flags != kOk) {
    ++statistics_.foreign;
    return std::nullopt;
  }
  const size_t body = packet.size() - kHeaderBytes;
  if (!capabilities_ || body == 0 || body % capabilities_->config.cell_bytes() != 0 ||
      body > static_cast<size_t>(capabilities_->config.chunk_cells()) * capabilities_->config.cell_bytes()) {
    ++statistics_.malformed;
    return std::nullopt;
  }
  heard_ = now();
  backoff_ = 1;
  return MapChunk{h.tile, h.index, sent.order,
                  Bytes(packet.begin() + static_cast<std::ptrdiff_t>(kHeaderBytes), packet.end())};
}

Reply Client::request(Type type, uint16_t tile, uint16_t index, const Bytes& payload, uint8_t flags) {
  asked_ = now();
  std::vector<uint64_t> orders;
  for (;;) {
    if (!orders.empty()) ++statistics_.resent;
    orders.push_back(send(type, tile, index, payload, flags));
    const double until = now() + patience();
    while (now() < until) {
      const auto event = receive(until - now());
      if (!event) break;
      if (const auto* reply = std::get_if<Reply>(&*event)) {
        // An answer to any of the repetitions will do.
        if (std::find(orders.begin(), orders.end(), reply->order) != orders.end()) return *reply;
      }
    }
    silence();
    check_version();
    // Packets that answer something else do not count here, or a chip that answers all but this would hold us for ever.
    if (now() - asked_ > timeout_) {
      heard_ = std::min(heard_, asked_);
      check_silence(type_name(type) + std::string(", sent ") + std::to_string(orders.size()) + " times");
    }
  }
}

Capabilities Client::info() {
  Reply r = request(kInfo);
  for (int i = 1; r.code != kOk && i < kMostRefusals; ++i) r = request(kInfo);
  if (r.code != kOk) throw LinkError(where() + ": INFO was refused: " + code_name(r.code));
  const auto c = parse_info(r.words);
  capabilities_ = *c;  // take() has checked
  // Both ways: what goes up is sent from here, and what comes down must fit as well.
  const ArbiterConfig& a = c->config;
  const size_t largest =
      kHeaderBytes + static_cast<size_t>(std::max(a.chunk_pairs() * a.pair_bytes(), a.chunk_cells() * a.cell_bytes()));
  if (const auto most = transport_.largest(); most && largest > most->payload) {
    throw LinkError(where() + ": " + most->why + ", but packets of this chip need " +
                    std::to_string(largest + kIpUdpHeaders));
  }
  return *c;
}

std::vector<uint32_t> Client::counters() {
  Reply r = request(kCounters);
  for (int i = 1; r.code != kOk && i < kMostRefusals; ++i) r = request(kCounters);
  if (r.code != kOk) throw LinkError(where() + ": COUNTERS was refused: " + code_name(r.code));
  if (first_counters_.empty()) first_counters_ = r.words;
  return r.words;
}

Status Client::open(const Capabilities& c) {
  capabilities_ = c;
  token_ = 0;
  nonce_ = static_cast<uint32_t>(random());
  Bytes nonce;
  append32(nonce, nonce_);
  const double start = now(), patient = std::max(1.1e-3 * c.config.session_ms + 1, timeout_);
  for (int gone = 0;;) {
    const Reply r = request(kOpen, 0, 0, nonce);
    if (r.code == kOk) {
      token_ = r.token;
      const Reply s = request(kStatus);
      if (s.status && s.code == kOk) {
        ++statistics_.sessions;
        return *s.status;
      }
      // It is gone already: the chip was reset, or that was not its answer.
      token_ = 0;
      if (++gone >= kMostGone) throw LinkError(where() + ": STATUS was refused: " + code_name(s.code));
      continue;
    }
    if (r.code != kBusy) throw LinkError(where() + ": OPEN was refused: " + code_name(r.code));
    if (now() - start > patient) {
      throw LinkError(where() + ": another host has the session (asked for " + seconds(now() - start) +
                      "; a silent one would have lost it after " + seconds(1e-3 * c.config.session_ms) + ")");
    }
    const double until = now() + kBusyPause;
    while (now() < until) receive(until - now());
  }
}

// From another address than the one that opened the session: nonce and token show whose it is.
bool Client::move() {
  Bytes nonce;
  append32(nonce, nonce_);
  moving_ = true;
  uint8_t code = kBusy;
  try {
    code = request(kOpen, 0, 0, nonce).code;
  } catch (...) {
    moving_ = false;
    throw;
  }
  moving_ = false;
  return code == kOk;
}

bool Client::briefly(const std::function<void()>& call) noexcept {
  const double patient = timeout_;
  const bool outer = brief_;
  bool good = true;
  timeout_ = std::min(timeout_, std::max(kBrief, kBriefTrips * rtt()));
  brief_ = true;
  try {
    call();
  } catch (...) {
    good = false;
  }
  brief_ = outer;
  timeout_ = patient;
  return good;
}

void Client::close() noexcept {
  if (token_ == 0) return;
  // If that fails the chip's silence timer does it, too.
  briefly([this] {
    if (request(kClose).code == kBusy && move()) request(kClose);
  });
  token_ = 0;
}

}  // namespace psweep::net
