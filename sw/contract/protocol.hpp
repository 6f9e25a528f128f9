// SPDX-License-Identifier: Apache-2.0
// Messages between host and chip: constants, and the fields of a message as bytes. Prose: docs/protocol.md.
// Everything is big endian. No I/O here; used by the host, by the chip's model and by the bench.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "contract/config.hpp"

namespace psweep::net {

using Bytes = std::vector<uint8_t>;

constexpr uint16_t kUdpPort = 20563;
constexpr uint16_t kMagic = 0x5053;
constexpr uint8_t kVersion = 2;
constexpr size_t kHeaderBytes = 16;
constexpr uint8_t kReply = 0x80;
constexpr uint8_t kFlagAnswer = 1;  // of WRITE

enum Type : uint8_t {
  kOpen = 0x01,
  kClose = 0x02,
  kInfo = 0x03,
  kCounters = 0x04,
  kStatus = 0x05,
  kTable = 0x06,
  kStart = 0x07,
  kWrite = 0x08,
  kRead = 0x09,
  kRelease = 0x0a,
  kSet = 0x0b,
  kMap = 0x8c,
};

enum Code : uint8_t { kOk = 0, kBusy = 1, kNoSession = 2, kBadMessage = 3, kOrder = 4, kNotReady = 5 };

enum Duplex : uint32_t { kDuplexByPin = 0, kDuplexHalf = 1, kDuplexFull = 2 };

constexpr int kJobWords = 18;  // engine registers in START, in this order
constexpr uint16_t kJobRegisters[kJobWords] = {0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x08, 0x09, 0x0a,
                                               0x0b, 0x10, 0x11, 0x12, 0x13, 0x14, 0x15, 0x16, 0x17};
constexpr int kStartBytes = 12 + 4 * kJobWords;
constexpr int kStatusWords = 9;  // without the bitmap
constexpr int kInfoWords = 32;
constexpr int kCounterWords = 40;
// INFO and COUNTERS must be as long as their answers, filled up with zeros, so that no answer is longer than its
// request.
constexpr size_t kInfoRequestBytes = kHeaderBytes + size_t{4} * kInfoWords;
constexpr size_t kCountersRequestBytes = kHeaderBytes + size_t{4} * kCounterWords;
// Unauthenticated messages: three buckets of so many answers (OPEN, ARP, everything else), refilled by one a
// millisecond.
constexpr int kBucketAnswers = 15;

enum StatusFlag : uint16_t {
  kFlagSession = 1 << 0,
  kFlagRows = 1 << 1,
  kFlagEngine = 1 << 2,
  kFlagMap = 1 << 3,
  kFlagMapComplete = 1 << 4,
  kFlagFailed = 1 << 5,
  kFlagFullDuplex = 1 << 6,
  kFlagSpeed100 = 1 << 7,
};

enum Counter : int {
  kRxFrames,
  kRxFcs,
  kRxAlign,
  kRxShort,
  kRxLong,
  kRxError,
  kRxFiltered,
  kRxNoSlot,
  kRxOverflow,
  kRxOther,
  kIpHeader,
  kIpFragment,
  kChecksum,
  kArp,
  kIcmp,
  kUdp,
  kBadMessages,
  kForeign,
  kTxFrames,
  kTxCollisions,
  kTxLate,
  kTxExcessive,
  kSessions,
  kTimeouts,
  kEngineWaitRows,
  kEngineWaitMap,
  kChunksRepeated,
  kChunksRefused,
  kMapPackets,
  kBadSource,
  kLimited,
  kAnswers,
  kRxFragment,
  kTxDeferred,
  kUnreachable,
  kRecovered,
  kResynchronised,
  kRxClockLost,
  kTxClockLost,
  kTilesFailed,
};

// What a tile takes longer in the chip than engine_clocks(): the row buffer's first pair comes 3 clocks after the
// start, the engine could take it after two.
constexpr uint64_t kFirstPairClocks = 1;

// Names of the counters in their order.
constexpr const char* kCounterNames[kCounterWords] = {"rx_frames",
                                                      "rx_fcs",
                                                      "rx_align",
                                                      "rx_short",
                                                      "rx_long",
                                                      "rx_error",
                                                      "rx_filtered",
                                                      "rx_no_slot",
                                                      "rx_overflow",
                                                      "rx_other",
                                                      "ip_header",
                                                      "ip_fragment",
                                                      "checksum",
                                                      "arp",
                                                      "icmp",
                                                      "udp",
                                                      "bad_message",
                                                      "foreign",
                                                      "tx_frames",
                                                      "tx_collisions",
                                                      "tx_late",
                                                      "tx_excessive",
                                                      "sessions",
                                                      "timeouts",
                                                      "engine_wait_rows",
                                                      "engine_wait_map",
                                                      "chunks_repeated",
                                                      "chunks_refused",
                                                      "map_packets",
                                                      "bad_source",
                                                      "limited",
                                                      "answers",
                                                      "rx_fragment",
                                                      "tx_deferred",
                                                      "unreachable",
                                                      "recovered",
                                                      "resynchronised",
                                                      "rx_clock_lost",
                                                      "tx_clock_lost",
                                                      "tiles_failed"};

// Generics of the arbiter; sizes that follow from them and from the engine's.
struct ArbiterConfig : ChipFields {
  golden::Config engine;

  int pair_bytes() const { return (2 * engine.pix_bits + 7) / 8; }
  int chunk_pairs() const { return chunk_bytes / pair_bytes(); }
  int cell_bits() const { return 1 + engine.plane_bits() + engine.frac_bits + engine.mncc_bits; }
  int cell_bytes() const { return (cell_bits() + 7) / 8; }
  int chunk_cells() const { return chunk_bytes / cell_bytes(); }
  int slots() const {
    return row_slots > 0 ? row_slots : (engine.img_cols * engine.img_rows + chunk_pairs() - 1) / chunk_pairs();
  }
  int largest_map() const { return engine.plane_cols * engine.plane_rows; }  // cells
  // Of the map buffer, in cells: whole chunks, or the largest map.
  int depth() const {
    if (map_depth <= 0 || map_depth >= largest_map()) return largest_map();
    return std::max(2, (map_depth + chunk_cells() - 1) / chunk_cells()) * chunk_cells();
  }
};

inline void put16(Bytes& b, size_t at, uint32_t v) {
  b[at] = static_cast<uint8_t>(v >> 8);
  b[at + 1] = static_cast<uint8_t>(v);
}
inline void put32(Bytes& b, size_t at, uint32_t v) {
  put16(b, at, v >> 16);
  put16(b, at + 2, v & 0xffff);
}
inline uint32_t get16(const Bytes& b, size_t at) { return uint32_t{b[at]} << 8 | b[at + 1]; }
inline uint32_t get32(const Bytes& b, size_t at) { return get16(b, at) << 16 | get16(b, at + 2); }
inline void append16(Bytes& b, uint32_t v) {
  b.push_back(static_cast<uint8_t>(v >> 8));
  b.push_back(static_cast<uint8_t>(v));
}
inline void append32(Bytes& b, uint32_t v) {
  append16(b, v >> 16);
  append16(b, v & 0xffff);
}

// The 32-bit words from a byte on; what is left behind the last whole one does not count.
inline std::vector<uint32_t> words_of(const Bytes& b, size_t from) {
  std::vector<uint32_t> words((b.size() - from) / 4);
  for (size_t i = 0; i < words.size(); ++i) words[i] = get32(b, from + 4 * i);
  return words;
}

struct Header {
  uint8_t type = 0;
  uint32_t token = 0;
  uint16_t sequence = 0;
  uint8_t flags = 0;  // requests: flags, replies: Code
  uint16_t tile = 0, index = 0;
};

inline Bytes encode(const Header& h) {
  Bytes b(kHeaderBytes, 0);
  put16(b, 0, kMagic);
  b[2] = kVersion;
  b[3] = h.type;
  put32(b, 4, h.token);
  put16(b, 8, h.sequence);
  b[10] = h.flags;
  put16(b, 12, h.tile);
  put16(b, 14, h.index);
  return b;
}

// Nothing if the bytes are no message of this version.
inline std::optional<Header> decode(const Bytes& b) {
  if (b.size() < kHeaderBytes || get16(b, 0) != kMagic || b[2] != kVersion) return std::nullopt;
  Header h;
  h.type = b[3];
  h.token = get32(b, 4);
  h.sequence = static_cast<uint16_t>(get16(b, 8));
  h.flags = b[10];
  h.tile = static_cast<uint16_t>(get16(b, 12));
  h.index = static_cast<uint16_t>(get16(b, 14));
  return h;
}

// Pair of pixels on the wire: left in the upper bits.
inline uint32_t pack_wire_pair(const golden::Config& c, unsigned left, unsigned right) {
  return left << c.pix_bits | right;
}

// Map cell on the wire: the mask bits but "not local" follow from the others.
inline uint64_t pack_wire_cell(const golden::Config& c, const golden::MapCell& cell) {
  uint64_t word = cell.mask >> 3 & 1;
  word = word << c.plane_bits() | cell.plane;
  word = word << c.frac_bits | cell.frac;
  return word << c.mncc_bits | cell.v;
}
inline golden::MapCell unpack_wire_cell(const golden::Config& c, uint64_t word, int threshold) {
  auto take = [&word](int bits) {
    const uint64_t value = word & ((uint64_t{1} << bits) - 1);
    word >>= bits;
    return static_cast<uint16_t>(value);
  };
  golden::MapCell cell;
  cell.v = take(c.mncc_bits);
  cell.frac = take(c.frac_bits);
  cell.plane = take(c.plane_bits());
  const bool not_local = take(1) != 0;
  if (cell.v == 0 && (cell.frac & 1) == 0) {
    cell.mask = 1;
  } else if (cell.v == 0 && (cell.frac & 2) == 0) {
    cell.mask = 2;
  } else {
    cell.mask = static_cast<uint8_t>((cell.v < threshold ? 4 : 0) | (not_local ? 8 : 0));
  }
  return cell;
}

}  // namespace psweep::net
