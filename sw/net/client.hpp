// SPDX-License-Identifier: Apache-2.0
// Client: one host's side of the protocol (docs/protocol.md) below the level of tiles: numbers requests, checks every
// packet that comes back, measures round trips (Jacobson's estimator, RFC 6298), repeats what was not answered.
// A packet is believed only if it answers a request of this client in this session: sequence, type, token, tile and
// index agree and the length is exact. Everything else is counted and dropped, whatever it holds.
// Errors: LinkError with host, port, what was asked and for how long; at once if the chip speaks another version of the
// protocol, or if its packets do not fit into what the network carries in one piece.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "contract/protocol.hpp"
#include "net/transport.hpp"

namespace psweep::net {

class LinkError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Words 0 .. of the reply to INFO. Nothing if they contradict each other or the protocol.
struct Capabilities {
  ArbiterConfig config;  // row_slots and map_depth are what the chip has, never 0
  uint64_t mac = 0;
  int counters = 0;
};
std::optional<Capabilities> parse_info(const std::vector<uint32_t>& words);
// Two chips that plan alike.
bool same_capabilities(const ArbiterConfig& a, const ArbiterConfig& b);

struct Status {
  uint16_t row_tile = 0, flags = 0, engine_tile = 0, map_tile = 0;
  uint32_t base = 0, received = 0;
  uint16_t table = 0;
  uint32_t table_words = 0, cells = 0;
  unsigned errors = 0, error_count = 0, tiles_done = 0, tiles_dropped = 0;
  uint32_t tile_clocks = 0;
  unsigned window_errors = 0;
  uint16_t failed_tile = 0;
  std::vector<uint32_t> bitmap;

  bool has(StatusFlag flag) const { return (flags & flag) != 0; }
  // Chunk of the tile in the row buffer: consumed or stored.
  bool chunk(uint32_t c) const {
    if (c < base) return true;
    const size_t at = c - base;
    return at / 32 < bitmap.size() && (bitmap[at / 32] >> (31 - at % 32) & 1) != 0;
  }
};
// Words behind the header of a reply; at least kStatusWords.
std::optional<Status> parse_status(const std::vector<uint32_t>& words);

const char* type_name(uint8_t type);
const char* code_name(uint8_t code);

struct LinkStatistics {
  uint64_t packets_sent = 0, packets_received = 0;
  uint64_t bytes_sent = 0, bytes_received = 0;  // UDP payload
  uint64_t resent = 0;                          // requests and chunks sent once more
  uint64_t lost = 0;                            // chunks of rows and map that had to be asked for again
  uint64_t duplicates = 0;                      // valid packets with nothing new
  uint64_t malformed = 0, foreign = 0;          // dropped: length or content wrong; answers to nobody's question
  uint64_t sessions = 0;
  uint64_t timeouts = 0;                     // waits that ended without an answer
  double rtt = 0, rtt_min = 0, rtt_max = 0;  // seconds: smoothed, extremes
};

struct Reply {
  uint8_t type = 0;  // of the request
  uint8_t code = 0;
  uint16_t tile = 0, index = 0;
  uint32_t token = 0;
  uint64_t order = 0;            // number of the request, counted from 1 over the client's life
  std::optional<Status> status;  // nothing: a bare header, as OPEN and refusals have it
  std::vector<uint32_t> words;   // INFO, COUNTERS
};
struct MapChunk {
  uint16_t tile = 0, index = 0;
  uint64_t order = 0;  // of the READ
  Bytes cells;         // whole cells, at least one
};
using Event = std::variant<Reply, MapChunk>;

// For Client: from std::random_device and the time, so that a machine where one of them is no good has the other.
uint64_t fresh_seed();

class Client {
 public:
  // timeout: seconds without any valid packet after which it gives up. seed: sequence numbers and nonces; who draws it
  // badly makes his own token easier to guess, nobody else's.
  Client(Transport& transport, double timeout, uint64_t seed);

  // Stop and wait: repeats until answered; other packets that come in between are dropped.
  Reply request(Type type, uint16_t tile = 0, uint16_t index = 0, const Bytes& payload = {}, uint8_t flags = 0);
  Capabilities info();
  std::vector<uint32_t> counters();
  // Opens a session and asks for its status. A busy chip is asked again, for as long as an older session of ours would
  // need to time out, and for the timeout at least.
  Status open(const Capabilities& c);
  // Ends it; says nothing if the chip is gone. If this host has got another address meanwhile, the session moves first.
  void close() noexcept;
  // With a timeout of a second (more where round trips are long); false if that was too short. For goodbyes.
  bool briefly(const std::function<void()>& call) noexcept;
  // The chip has counted fragments since the first counters() of this client: the words for it, else empty. Asks
  // briefly.
  std::string fragments() noexcept;

  // Event-driven: numbers and sends; returns its order.
  uint64_t send(Type type, uint16_t tile = 0, uint16_t index = 0, const Bytes& payload = {}, uint8_t flags = 0);
  // The next believable packet within this time.
  std::optional<Event> receive(double timeout_s);
  // Takes one packet apart; the body of receive().
  std::optional<Event> take(const Bytes& packet);

  double now() { return transport_.now(); }
  // Seconds to wait for an answer; grows with every silence() until something is heard.
  double patience() const;
  void silence();
  // The least patience once a round trip is known. At first 4 ms, for the host's own scheduling.
  void least_patience(double seconds) { least_patience_ = seconds; }
  // Seconds since the last valid packet, or since the first unanswered request.
  double silent_for() { return now() - std::max(heard_, asked_); }
  // Throws LinkError if that is longer than the timeout.
  void check_silence(const std::string& outstanding);
  std::string where() const { return "udp://" + transport_.peer(); }
  double timeout() const { return timeout_; }
  double rtt() const { return has_rtt_ ? statistics_.rtt : 0.05; }
  uint64_t order() const { return order_; }  // of the latest request
  LinkStatistics& statistics() { return statistics_; }

 private:
  struct Sent {
    uint64_t order = 0;  // 0: never used
    uint32_t token = 0;
    uint8_t type = 0;
    bool answered = false;
    uint16_t tile = 0, index = 0, count = 0;
    double time = 0;
  };
  std::optional<Event> take_map(const Bytes& packet, const Header& h, Sent& sent);
  void take_other_version(const Bytes& packet);
  void check_version();
  bool move();
  uint64_t random();

  Transport& transport_;
  double timeout_;
  uint64_t random_state_;
  uint32_t token_ = 0, nonce_ = 0;
  bool moving_ = false;
  std::optional<Capabilities> capabilities_;
  uint16_t sequence_ = 0;
  uint64_t order_ = 0;
  std::vector<Sent> sent_;        // by sequence
  double heard_ = 0, asked_ = 0;  // heard_: of what is asked now; latest_: of anything
  double latest_ = 0;
  bool ever_heard_ = false, brief_ = false;
  int other_version_ = 0, other_versions_ = 0;  // the latest, and how many packets
  std::vector<uint32_t> first_counters_;
  bool has_rtt_ = false;
  double rtt_variation_ = 0, backoff_ = 1, least_patience_ = 0.004;
  LinkStatistics statistics_;
};

}  // namespace psweep::net
