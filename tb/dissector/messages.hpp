// SPDX-License-Identifier: Apache-2.0
// Messages with what a dissector has to say of them: every encoder writes the bytes and notes each field's filter name,
// place and value, from the numbers it was given and never from the bytes.
//   expect(n): what is left of it when only the first n bytes are there. A field is shown if all of its bytes are; a
//   group (Box) if its first byte is, and is then as long as the rest.
// Layout: what an INFO reply has told; without it bitmap and cells have no known size.
#pragma once
#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "contract/protocol.hpp"
#include "dissector/pdml.hpp"
#include "net/client.hpp"

namespace psweep::tb {

using net::Bytes;

struct Expectation {
  std::vector<Field> fields;
  std::multiset<std::string> experts;

  void add(const std::string& name, long at, long size, const std::string& show) {
    fields.push_back({name, at, size, show, ""});
  }
  void generated(const std::string& name, const std::string& show) { add(name, -1, 0, show); }
};

class Message {
 public:
  std::string what;
  Bytes bytes;
  size_t needed = 0;    // shorter is truncated
  bool request = true;  // direction
  bool wanted = true;   // somebody waits for an answer
  bool bare = false;    // the header alone is no less
  bool other_version = false;
  net::Header header;

  // `tail`: what depends on the length; called for those that reach the payload.
  std::function<void(Expectation&, size_t)> tail;

  Message(const std::string& name, bool is_request, const net::Header& h, uint8_t version = net::kVersion,
          uint8_t reserved = 0)
      : what(name), bytes(net::encode(h)), needed(net::kHeaderBytes), request(is_request), header(h) {
    bytes[2] = version;
    bytes[11] = reserved;
    leaf("magic", 0, 2, net::kMagic);
    leaf("version", 2, 1, version);
    leaf("type", 3, 1, h.type);
    leaf("token", 4, 4, h.token);
    leaf("sequence", 8, 2, h.sequence);
    if (is_request) {
      leaf("flags", 10, 1, h.flags);
      leaf("flags.answer", 10, 1, h.flags & net::kFlagAnswer ? 1 : 0);
      wanted = h.type != net::kWrite || (h.flags & net::kFlagAnswer) != 0;
    } else {
      leaf("code", 10, 1, h.flags);
    }
    leaf("reserved", 11, 1, reserved);
    leaf("tile", 12, 2, h.tile);
    leaf("index", 14, 2, h.index);
    const uint8_t type = is_request ? h.type : static_cast<uint8_t>(h.type - net::kReply);
    const bool map = !is_request && h.type == net::kMap && h.flags == net::kOk;
    other_version = version != net::kVersion;
    if (!map && (type == 0 || type > net::kSet)) header_experts.insert("type");
    if (!is_request && h.flags != net::kOk) header_experts.insert("code");
  }

  // Appended numbers.
  void u16(const std::string& name, uint32_t v) {
    leaf(name, bytes.size(), 2, v);
    net::append16(bytes, v);
    needed = bytes.size();
  }
  void u32(const std::string& name, uint32_t v) {
    leaf(name, bytes.size(), 4, v);
    net::append32(bytes, v);
    needed = bytes.size();
  }
  void s32(const std::string& name, int32_t v) {
    leaf(name, bytes.size(), 4, v);
    net::append32(bytes, static_cast<uint32_t>(v));
    needed = bytes.size();
  }
  // One more look at the two bytes written last.
  void bits(const std::string& name, uint32_t v) { leaf(name, bytes.size() - 2, 2, v); }
  void raw(const std::string& name, const Bytes& b) {
    if (b.empty()) return;
    leaves_.push_back({"psweep." + name, static_cast<long>(bytes.size()), static_cast<long>(b.size()), kAny, ""});
    bytes.insert(bytes.end(), b.begin(), b.end());
    needed = bytes.size();
  }
  // Group from here on, of `size` bytes, or all that follows.
  void box(const std::string& name, size_t size = 1 << 20, const std::string& show = kAny) {
    boxes_.push_back({"psweep." + name, static_cast<long>(bytes.size()), static_cast<long>(size), show, ""});
  }
  // What nobody reads, behind the message.
  void padding(const Bytes& b, const std::string& name = "padding") {
    padding_at_ = bytes.size();
    padding_name_ = name;
    bytes.insert(bytes.end(), b.begin(), b.end());
  }

  Expectation expect() const { return expect(bytes.size()); }
  Expectation expect(size_t n) const {
    Expectation e;
    const auto left = static_cast<long>(n);
    for (const Field& f : leaves_)
      if (f.at + f.size <= left) e.fields.push_back(f);
    for (Field f : boxes_) {
      if (f.at >= left) continue;
      f.size = std::min(f.size, left - f.at);
      e.fields.push_back(f);
    }
    if (padding_at_ != 0 && n > padding_at_)
      e.add("psweep." + padding_name_, static_cast<long>(padding_at_), static_cast<long>(n - padding_at_), kAny);
    if (n < needed && !(bare && n == net::kHeaderBytes)) e.experts.insert("truncated");
    if (n > 2 && other_version) e.experts.insert("version");
    if (n >= net::kHeaderBytes) {
      e.experts.insert(header_experts.begin(), header_experts.end());
      if (n == bytes.size()) e.experts.insert(whole_experts.begin(), whole_experts.end());
      if (tail) tail(e, n);
    }
    return e;
  }

  std::multiset<std::string> header_experts, whole_experts;

  inline static const std::string kAny = "*";

 private:
  template <class T>
  void leaf(const std::string& name, size_t at, long size, T v) {
    leaves_.push_back({"psweep." + name, static_cast<long>(at), size, std::to_string(v), ""});
  }
  std::vector<Field> leaves_, boxes_;
  size_t padding_at_ = 0;
  std::string padding_name_;
};

using Layout = std::optional<net::ArbiterConfig>;

// Requests -----------------------------------------------------------------------------------------------------------

// Without a payload; INFO and COUNTERS have to be as long as their replies.
inline Message bare_request(const net::Header& h, uint8_t reserved = 0) {
  Message m("bare request", true, h, net::kVersion, reserved);
  const size_t least = h.type == net::kInfo       ? net::kInfoRequestBytes
                       : h.type == net::kCounters ? net::kCountersRequestBytes
                                                  : 0;
  m.tail = [least](Expectation& e, size_t n) {
    if (n < least) e.experts.insert("length");
  };
  return m;
}

inline Message open_request(const net::Header& h, uint32_t nonce) {
  Message m("OPEN", true, h);
  m.u32("nonce", nonce);
  return m;
}

inline Message table_request(const net::Header& h, const std::vector<uint32_t>& words, size_t extra = 0) {
  static const char* const names[] = {"x0_left", "y0_left", "x0_right", "y0_right",
                                      "dx_left", "dy_left", "dx_right", "dy_right"};
  Message m("TABLE", true, h);
  m.box("table");
  const size_t first = net::kHeaderBytes;
  for (size_t i = 0; i < words.size(); ++i) {
    const size_t number = h.index + i;
    const std::string name = std::string("table.") + names[number % 8];
    if (number % 8 < 4) {
      m.s32(name, static_cast<int32_t>(words[i]));
    } else {
      m.u32(name, words[i]);
    }
  }
  for (size_t i = 0; i < extra; ++i) m.bytes.push_back(0xee);
  m.needed = first + 1;  // a shorter table is another table, or one of a wrong length
  m.tail = [first, h](Expectation& e, size_t n) {
    const size_t count = (n - first) / 4;
    for (size_t i = 0; i < count; ++i) {
      const size_t number = h.index + i;
      if (i != 0 && number % 8 != 0) continue;
      e.add("psweep.table.plane", static_cast<long>(first + 4 * i),
            static_cast<long>(4 * std::min(8 - number % 8, count - i)), std::to_string(number / 8));
    }
    if ((n - first) % 4 != 0) {
      e.add("psweep.data", static_cast<long>(first + 4 * count), static_cast<long>((n - first) % 4), Message::kAny);
    }
    if (n > first && ((n - first) % 4 != 0 || count > 364)) e.experts.insert("length");
  };
  return m;
}

struct StartFields {
  uint16_t table = 0, zero = 0;
  uint32_t pixels = 0, chunks = 0;
  uint32_t words[net::kJobWords] = {};
};
inline Message start_request(const net::Header& h, const StartFields& s, const Layout& layout) {
  static const char* const names[net::kJobWords] = {"tile_cols",  "tile_rows",  "win_cols",  "win_rows",  "planes",
                                                    "threshold",  "tx_left",    "ty_left",   "tx_right",  "ty_right",
                                                    "left_x_lo",  "left_x_hi",  "left_y_lo", "left_y_hi", "right_x_lo",
                                                    "right_x_hi", "right_y_lo", "right_y_hi"};
  Message m("START", true, h);
  m.box("start", net::kStartBytes);
  m.u16("start.table", s.table);
  m.u16("start.zero", s.zero);
  m.u32("start.pixels", s.pixels);
  m.u32("start.chunks", s.chunks);
  for (int i = 0; i < net::kJobWords; ++i) {
    const std::string name = std::string("start.") + names[i];
    if (i < 6) {
      m.u32(name, s.words[i]);
    } else {
      m.s32(name, static_cast<int32_t>(s.words[i]));
    }
  }
  const bool pixels_out = s.pixels == 0 || s.pixels >> 24 != 0;
  if (pixels_out || s.pixels != uint64_t{s.words[2]} * s.words[3]) m.whole_experts.insert("value");
  const bool chunks_out = s.chunks == 0 || s.chunks >> 16 != 0;
  if (chunks_out || (layout && s.chunks != (uint64_t{s.pixels} + layout->chunk_pairs() - 1) / layout->chunk_pairs()))
    m.whole_experts.insert("value");
  return m;
}

inline Message write_request(const net::Header& h, const Bytes& pixels, const Layout& layout) {
  Message m("WRITE", true, h);
  m.box("write.pixels");
  m.bytes.insert(m.bytes.end(), pixels.begin(), pixels.end());
  m.needed = net::kHeaderBytes + 1;
  if (!layout) return m;
  m.tail = [h, a = *layout](Expectation& e, size_t n) {
    const size_t body = n - net::kHeaderBytes;
    if (body == 0) return;
    e.generated("psweep.write.first_pair", std::to_string(h.index * a.chunk_pairs()));
    e.generated("psweep.write.pairs", std::to_string(body / a.pair_bytes()));
    if (body != size_t(a.chunk_pairs()) * a.pair_bytes()) e.experts.insert("length");
  };
  return m;
}

inline Message read_request(const net::Header& h, uint16_t count, uint16_t keep) {
  Message m("READ", true, h);
  m.u16("read.count", count);
  m.u16("read.keep", keep);
  return m;
}

inline Message set_request(const net::Header& h, uint32_t value) {
  Message m("SET", true, h);
  m.u32("set.value", value);
  if (h.index != 0 || value > net::kDuplexFull) m.whole_experts.insert("value");
  return m;
}

// Replies ------------------------------------------------------------------------------------------------------------

// Numbers of the set bits, first and last of a run.
inline std::string runs(const std::vector<bool>& set, uint32_t base) {
  std::string text;
  for (size_t i = 0; i < set.size();) {
    size_t end = i;
    while (end < set.size() && set[end]) ++end;
    if (end == i) {
      ++i;
      continue;
    }
    if (!text.empty()) text += ", ";
    text += std::to_string(base + i);
    if (end - i > 1) text += "-" + std::to_string(base + end - 1);
    i = end;
  }
  return text.empty() ? "none" : text;
}

// Of OPEN, and to those whom the chip does not know; others may be longer.
inline bool always_bare(const net::Header& h) {
  return h.type == (net::kOpen | net::kReply) || h.flags == net::kBusy || h.flags == net::kNoSession;
}
inline bool may_be_bare(const net::Header& h) {
  return always_bare(h) || h.flags == net::kBadMessage ||
         (h.flags == net::kOk && h.type == (net::kClose | net::kReply));
}
inline Message bare_reply(const net::Header& h) { return Message("bare reply", false, h); }

inline Message status_reply(const net::Header& h, const net::Status& s, const Layout& layout) {
  Message m("status block", false, h);
  m.bare = may_be_bare(h);
  m.box("status");
  m.u16("status.row_tile", s.row_tile);
  m.u16("status.flags", s.flags);
  auto flag = [&](const char* name, net::StatusFlag f) { m.bits(std::string("status.flags.") + name, s.has(f)); };
  flag("session", net::kFlagSession);
  flag("rows", net::kFlagRows);
  flag("engine", net::kFlagEngine);
  flag("map", net::kFlagMap);
  flag("map_complete", net::kFlagMapComplete);
  flag("failed", net::kFlagFailed);
  flag("full_duplex", net::kFlagFullDuplex);
  flag("speed_100", net::kFlagSpeed100);
  m.bits("status.flags.engine_state", s.flags >> 8 & 7);
  m.u16("status.engine_tile", s.engine_tile);
  m.u16("status.map_tile", s.map_tile);
  m.u16("status.base", s.base);
  m.u16("status.received", s.received);
  m.u16("status.table", s.table);
  m.u16("status.table_words", s.table_words);
  m.u32("status.cells", s.cells);
  m.u16("status.errors", s.errors);
  static const char* const errors[] = {"config", "table", "short", "long", "window", "address", "busy", "upset"};
  for (int i = 0; i < 8; ++i) m.bits(std::string("status.errors.") + errors[i], s.errors >> i & 1);
  m.u16("status.error_count", s.error_count);
  m.u16("status.tiles_done", s.tiles_done);
  m.u16("status.tiles_dropped", s.tiles_dropped);
  m.u32("status.tile_clocks", s.tile_clocks);
  m.u16("status.window_errors", s.window_errors);
  m.u16("status.failed_tile", s.failed_tile);
  const size_t first = m.bytes.size();
  for (const uint32_t word : s.bitmap) net::append32(m.bytes, word);
  const size_t told = layout ? (static_cast<size_t>(layout->row_slots) + 31) / 32 : 0;
  m.needed = first + 4 * told;
  m.tail = [first, told, has_layout = layout.has_value(), s](Expectation& e, size_t n) {
    if (n < first) return;
    size_t words = (n - first) / 4;
    if (has_layout) words = std::min(words, told);
    if (words > 0) {
      std::vector<bool> set;
      for (size_t i = 0; i < 32 * words; ++i) set.push_back((s.bitmap[i / 32] >> (31 - i % 32) & 1) != 0);
      const auto at = static_cast<long>(first), size = static_cast<long>(4 * words);
      e.add("psweep.status.bitmap", at, size, Message::kAny);
      e.add("psweep.status.chunks", at, size, runs(set, s.base));
      e.add("psweep.status.stored", at, size, std::to_string(std::count(set.begin(), set.end(), true)));
    }
    // A piece of a word, where nobody told how many there are.
    const size_t shown = first + 4 * words;
    if (n > shown && !(has_layout && words < told))
      e.add("psweep.padding", static_cast<long>(shown), static_cast<long>(n - shown), Message::kAny);
  };
  return m;
}

inline Message info_reply(const net::Header& h, const net::ArbiterConfig& a, const net::Mac& mac, uint32_t counters,
                          const std::vector<uint32_t>& reserved) {
  std::map<int, std::pair<const char*, int>> words = {{13, {"cell_bits", a.cell_bits()}},
                                                      {18, {"pair_bytes", a.pair_bytes()}},
                                                      {19, {"chunk_pairs", a.chunk_pairs()}},
                                                      {21, {"cell_bytes", a.cell_bytes()}},
                                                      {22, {"chunk_cells", a.chunk_cells()}}};
  for (const auto& field : kEngineFields) words[field.info] = {field.key, a.engine.*field.value};
  for (const auto& field : kChipFields) words[field.info] = {field.key, a.*field.value};
  words.erase(0);  // fields without a word
  Message m("INFO reply", false, h);
  m.box("info");
  m.u16("info.version", net::kVersion);
  m.u16("info.words", net::kInfoWords);
  for (int i = 1; i <= 27; ++i) {
    if (i == 14) {
      m.u16("info.mac_zero", 0);
      m.raw("info.mac", Bytes(mac.begin(), mac.end()));
    } else if (i == 26) {
      m.u32("info.counters", counters);
    } else if (i != 15) {
      m.u32(std::string("info.") + words.at(i).first, static_cast<uint32_t>(words.at(i).second));
    }
  }
  for (const uint32_t w : reserved) m.u32("info.reserved", w);
  return m;
}

inline Message counters_reply(const net::Header& h, const std::vector<uint32_t>& values) {
  Message m("COUNTERS reply", false, h);
  m.box("counters");
  for (size_t i = 0; i < net::kCounterWords; ++i) {
    m.u32(std::string("counters.") + net::kCounterNames[i], values.at(i));
  }
  return m;
}

// threshold: of the START of this tile; -1 if there was none.
inline Message map_packet(const net::Header& h, const std::vector<golden::MapCell>& cells, const Layout& layout,
                          int threshold, size_t extra = 0) {
  Message m("MAP", false, h);
  m.box("map");
  if (!layout) {
    for (const golden::MapCell& cell : cells) net::append32(m.bytes, cell.v);  // any bytes
    m.needed = net::kHeaderBytes + 1;
    return m;
  }
  const net::ArbiterConfig a = *layout;
  const int width = a.cell_bytes();
  // Which bytes hold bits low .. low + count - 1 of a cell.
  auto part = [width](long at, int low, int count) {
    const long last = at + width - 1 - low / 8, first = at + width - 1 - (low + count - 1) / 8;
    return std::pair<long, long>{first, last - first + 1};
  };
  struct Shown {
    std::string name;
    long at, size;
    std::string show;
  };
  auto shown = std::make_shared<std::vector<std::vector<Shown>>>();
  for (const golden::MapCell& cell : cells) {
    const auto at = static_cast<long>(m.bytes.size());
    const uint64_t word = net::pack_wire_cell(a.engine, cell);
    for (int b = width - 1; b >= 0; --b) m.bytes.push_back(static_cast<uint8_t>(word >> 8 * b));
    const int v = a.engine.mncc_bits, f = a.engine.frac_bits, p = a.engine.plane_bits();
    std::vector<Shown> s{{"cell", at, width, Message::kAny}};
    auto add = [&](const char* name, int low, int count, int value) {
      const auto [first, size] = part(at, low, count);
      s.push_back({std::string("cell.") + name, first, size, std::to_string(value)});
    };
    add("v", 0, v, cell.v);
    add("frac", v, f, cell.frac);
    add("plane", v + f, p, cell.plane);
    add("not_local", v + f + p, 1, cell.mask >> 3);
    if (threshold >= 0) {
      const auto mask = net::unpack_wire_cell(a.engine, word, threshold).mask;
      s.push_back({"cell.mask", at, width, std::to_string(mask)});
    }
    shown->push_back(std::move(s));
  }
  for (size_t i = 0; i < extra; ++i) m.bytes.push_back(0xee);
  m.needed = net::kHeaderBytes + 1;
  m.tail = [a, h, shown](Expectation& e, size_t n) {
    const size_t body = n - net::kHeaderBytes, count = body / a.cell_bytes();
    if (body == 0) return;
    e.generated("psweep.map.first_cell", std::to_string(h.index * a.chunk_cells()));
    e.generated("psweep.map.cells", std::to_string(count));
    for (size_t i = 0; i < count; ++i)
      for (const Shown& s : (*shown)[i]) e.add("psweep." + s.name, s.at, s.size, s.show);
    if (body % a.cell_bytes() != 0 || count > static_cast<size_t>(a.chunk_cells())) e.experts.insert("length");
  };
  return m;
}

// Types that do not exist, and versions that this one is not: the header, then bytes.
inline Message opaque(const std::string& what, bool request, const net::Header& h, uint8_t version, const Bytes& body) {
  Message m(what, request, h, version);
  m.padding(body, "data");
  return m;
}

}  // namespace psweep::tb
