// SPDX-License-Identifier: Apache-2.0
// packet_rx: pulses of the counters, messages and stored frames equal the model clock by clock and byte by byte. All
// lengths of UDP and ICMP, every bit of every header flipped, all faults alone and in pairs, checksums at their
// corners, a full ring, random and mutated frames, garbage of any length; what waits in the ring stays as it is. Frames
// come from contract/frames.hpp, and the outcome of the fault pairs is written down here: neither is the model's
// opinion. Upsets of every bit of every register: what waits is empty soon, and then all is right again.
#include <algorithm>
#include <deque>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "Vpacket_rx_2.h"
#include "Vpacket_rx_4.h"
#include "Vpacket_rx_upset.h"
#include "golden/packet_rx.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"
#include "support/upset.hpp"

using namespace psweep;
using namespace psweep::tb;
using net::Bytes;

namespace {

// Granules and G_UDP_PORT of the models.
template <class Dut>
struct Traits;
template <>
struct Traits<Vpacket_rx_2> {
  static constexpr size_t kGranules = 8;
  static constexpr uint16_t kPort = 20563;
};
template <>
struct Traits<Vpacket_rx_4> {
  static constexpr size_t kGranules = 16;
  static constexpr uint16_t kPort = 0x01fe;
};

constexpr uint64_t kEventLatency = 2;    // verdict to pulse
constexpr uint64_t kMessageLatency = 3;  // verdict to m_valid

template <class Dut>
struct Bench : Agent {
  static constexpr size_t kGranules = Traits<Dut>::kGranules;

  struct Frame {
    Bytes bytes;
    uint8_t verdict;
    int number;
    uint32_t want;  // events; 0: what the model says
  };
  struct Waiting {
    golden::Message message;
    Bytes bytes;
    uint64_t clock;  // from which on it is shown, if it is the oldest
    int number;
    size_t granules;
  };

  Sim<Dut> sim{400000000, test_seed()};
  Dut& dut = sim.dut();
  std::mt19937 random{test_seed() + 17};
  Scoreboard events{"events"}, shown{"m_valid"}, kinds{"m_kind"}, lengths{"m_length"}, bytes{"r_data"},
      outcomes{"outcome"};
  net::Address own;
  std::array<uint64_t, golden::kReceiveEvents> count{};

  // What goes in.
  std::deque<Frame> queue;
  size_t next = 0;  // byte of queue.front()
  double gaps = 0;
  int sent = 0;
  bool offering = false, room = false;

  // What must come out.
  std::deque<std::pair<uint64_t, uint32_t>> pulses;
  std::deque<Waiting> waiting;
  size_t used = 0;             // granules of what waits
  size_t taken = 0;            // granules of the frame on its way
  uint64_t blocked_until = 0;  // m_valid is low in the clock behind m_done

  // Reader: each message is read `passes` times, then held.
  int passes = 1, max_hold = 0, pass = 0, hold = 0;
  size_t reading = 0;
  int asked = -1, asked_before = -1;
  bool active = false, stopped = false;

  Bench() {
    for (auto& b : own.mac) b = static_cast<uint8_t>(random());
    own.mac[0] &= 0xfe;
    own.ip = 0xc0000000 | below(1u << 24);  // none of somebody()'s
    own.port = Traits<Dut>::kPort;
    dut.s_valid = dut.s_last = dut.m_done = 0;
    dut.r_addr = 0;
    dut.half_duplex = 0;
    uint64_t mac = 0;
    for (const uint8_t b : own.mac) mac = mac << 8 | b;
    dut.own_mac = mac;
    dut.own_ip = own.ip;
    sim.add(*this);
    sim.reset();
  }
  uint32_t below(uint32_t n) { return static_cast<uint32_t>(random()) % n; }
  bool chance(double p) { return std::bernoulli_distribution(p)(random); }
  Bytes noise(size_t size) {
    Bytes b(size);
    for (auto& v : b) v = static_cast<uint8_t>(random());
    return b;
  }
  net::Address somebody() {
    net::Address a;
    for (auto& b : a.mac) b = static_cast<uint8_t>(random());
    a.mac[0] &= 0xfe;
    a.ip = (1 + below(126)) << 24 | below(1u << 24);
    a.port = static_cast<uint16_t>(random());
    return a;
  }
  // `frame` with its FCS.
  void send(const Bytes& frame, uint8_t verdict = 0, uint32_t want = 0) {
    queue.push_back({frame, verdict, sent++, want});
  }
  Bytes closed(Bytes frame) {
    net::append_fcs(frame);
    return frame;
  }
  Bytes udp(size_t size) { return net::make_udp(somebody(), own, noise(size)); }
  // `size` bytes behind identifier and sequence number.
  Bytes icmp(size_t size) { return net::make_icmp_echo(somebody(), own, 8, noise(4 + size)); }
  Bytes arp() { return net::make_arp_request(somebody(), own.ip); }

  void drive() override {
    if (!offering) offering = !queue.empty() && !(gaps > 0 && chance(gaps));
    dut.s_valid = offering;
    const bool last = offering && next == queue.front().bytes.size();
    dut.s_last = offering ? last : static_cast<uint8_t>(random() & 1);
    dut.s_data = static_cast<uint8_t>(!offering ? random() : last ? queue.front().verdict : queue.front().bytes[next]);
    dut.m_done = 0;
    asked_before = asked;
    asked = -1;
    if (!active) {
      dut.r_addr = random() & 0x7ff;
      return;
    }
    const size_t size = waiting.front().bytes.size();
    if (pass < passes) {
      dut.r_addr = static_cast<uint16_t>(reading);
      asked = static_cast<int>(reading);
      if (++reading == size) reading = 0, ++pass;
    } else if (asked_before < 0 && !stopped && hold-- <= 0) {
      dut.m_done = 1;
    }
  }

  void sample() override {
    const uint64_t now = sim.cycle();
    // Pulses.
    uint32_t pulse = 0;
    if (!pulses.empty() && pulses.front().first == now) {
      pulse = pulses.front().second;
      pulses.pop_front();
    }
    if (pulse != 0 || dut.events != 0) events.compare(dut.events, pulse, {}, now);
    for (size_t i = 0; i < count.size(); ++i) count[i] += dut.events >> i & 1;

    // Messages.
    const bool valid = !waiting.empty() && now >= waiting.front().clock && now >= blocked_until;
    shown.compare(dut.m_valid, valid, {}, now);
    if (valid) {
      const Waiting& w = waiting.front();
      kinds.compare(dut.m_kind, static_cast<uint64_t>(w.message.kind), {w.number}, now);
      lengths.compare(dut.m_length, static_cast<uint64_t>(w.message.length), {w.number}, now);
      if (asked_before >= 0)
        bytes.compare(dut.r_data, w.bytes[static_cast<size_t>(asked_before)], {w.number, -1, asked_before, 0}, now);
      if (!active) active = true, pass = 0, reading = 0, hold = static_cast<int>(below(max_hold + 1u));
    }

    // Granules are free from the clock behind m_done on.
    const size_t used_now = used;
    if (dut.m_done) {
      used -= waiting.front().granules;
      waiting.pop_front();
      active = false;
      blocked_until = now + 2;
    }
    if (!dut.s_valid || !dut.s_ready) return;
    Frame& f = queue.front();
    offering = false;
    if (next == 0) room = true, taken = 0;
    if (next < f.bytes.size() && next % golden::kGranule == 0) room = room && used_now + ++taken <= kGranules;
    if (next++ < f.bytes.size()) return;
    const golden::Received r = golden::PacketRx(own, f.bytes).receive(f.verdict, room, dut.half_duplex);
    if (f.want != 0) outcomes.compare(r.events, f.want, {f.number}, now);
    pulses.emplace_back(now + kEventLatency, r.events);
    if (r.message) {
      waiting.push_back({*r.message, f.bytes, now + kMessageLatency, f.number, taken});
      used += taken;
    }
    queue.pop_front();
    next = 0;
  }

  void finish() {
    sim.run_until([&] { return queue.empty() && waiting.empty() && pulses.empty(); });
    sim.run(5);
  }
  void check() {
    for (const Scoreboard* board : {&events, &shown, &kinds, &lengths, &bytes}) {
      INFO(board->report());
      CHECK(board->ok());
    }
    INFO(outcomes.report());
    CHECK(outcomes.errors() == 0);
  }
};

constexpr uint32_t bit(int counter) { return 1u << counter; }
constexpr uint32_t kGoodArp = bit(net::kRxFrames) | bit(net::kArp);
constexpr uint32_t kGoodIcmp = bit(net::kRxFrames) | bit(net::kIcmp);
constexpr uint32_t kGoodUdp = bit(net::kRxFrames) | bit(net::kUdp);
constexpr uint32_t kGoodClosed = bit(net::kRxFrames) | bit(net::kRxOther);
constexpr uint32_t kBadSource = bit(golden::kEventBadSource);

Bytes golden_own(const net::Address& own) {
  Bytes b(own.mac.begin(), own.mac.end());
  net::append32(b, own.ip);
  return b;
}

// Makes the sums right again; `type`: which of them.
void repair_header(Bytes& f) {
  net::put16(f, 24, 0);
  net::put16(f, 24, net::internet_checksum(f.data() + 14, 20));
}
void repair_content(Bytes& f) {
  const size_t end = std::min<size_t>(f.size(), std::max<size_t>(14 + net::get16(f, 16), 42));
  const bool udp = f[23] == net::kProtocolUdp;
  const size_t at = udp ? 40 : 36;
  const uint32_t start =
      udp ? net::pseudo_header_sum(net::get32(f, 26), net::get32(f, 30), f[23], net::get16(f, 38)) : 0;
  net::put16(f, at, 0);
  const uint16_t sum = net::internet_checksum(f.data() + 34, end - 34, start);
  net::put16(f, at, udp && sum == 0 ? 0xffff : sum);
}

}  // namespace

TEMPLATE_TEST_CASE("packet_rx: every length of UDP and ICMP, with and without checksum, broadcasts are ARP alone", "",
                   Vpacket_rx_2, Vpacket_rx_4) {
  auto bench = std::make_unique<Bench<TestType>>();
  for (size_t size = 0; size <= 1472; ++size) {
    Bytes f = bench->udp(size);
    if (size % 3 == 1) net::put16(f, 40, 0);
    bench->send(bench->closed(f), 0, kGoodUdp);
    std::fill_n(f.begin(), 6, 0xff);
    bench->send(bench->closed(f), 0, bit(net::kRxFiltered));
    f = bench->icmp(size);
    bench->send(bench->closed(f), 0, kGoodIcmp);
    bench->finish();  // one by one, so that there is room
    if (size % 100 == 0) bench->send(bench->closed(bench->arp()), 0, kGoodArp);
    if (size % 100 == 50) {  // ARP to the chip alone
      f = bench->arp();
      std::copy(bench->own.mac.begin(), bench->own.mac.end(), f.begin());
      bench->send(bench->closed(f), 0, kGoodArp);
    }
    bench->gaps = size % 7 == 0 ? 0.7 : 0;
    bench->finish();
  }
  bench->check();
  CHECK(bench->count[net::kUdp] == 1473);
  CHECK(bench->count[net::kIcmp] == 1473);
  CHECK(bench->count[net::kArp] == 30);
  CHECK(bench->count[net::kRxFiltered] == 1473);
  CHECK(bench->count[net::kRxFrames] == 2 * 1473 + 30);
}

TEMPLATE_TEST_CASE("packet_rx: padding behind the packet changes nothing, a packet beyond the frame is refused", "",
                   Vpacket_rx_2, Vpacket_rx_4) {
  auto bench = std::make_unique<Bench<TestType>>();
  for (size_t size = 0; size <= 40; ++size) {
    for (size_t padding = 0; padding <= 30; ++padding) {
      for (const bool udp : {true, false}) {
        Bytes f = udp ? bench->udp(size) : bench->icmp(size);
        const Bytes tail = bench->noise(padding);
        f.insert(f.end(), tail.begin(), tail.end());
        f = bench->closed(f);
        bench->send(f, 0, udp ? kGoodUdp : kGoodIcmp);
        bench->finish();
      }
    }
    // As much as there is, and one byte more, up to the FCS.
    for (size_t more = 0; more <= 5; ++more) {
      Bytes f = bench->icmp(60 + size);
      net::put16(f, 16, static_cast<uint32_t>(f.size() - 14 + more));
      repair_header(f);
      repair_content(f);
      bench->send(bench->closed(f), 0, more == 0 ? kGoodIcmp : bit(net::kIpHeader));
      bench->finish();
    }
  }
  bench->check();
}

TEMPLATE_TEST_CASE("packet_rx: every bit of the first 42 bytes matters as the model says", "", Vpacket_rx_2,
                   Vpacket_rx_4) {
  auto bench = std::make_unique<Bench<TestType>>();
  for (const Bytes& good : {bench->udp(23), bench->icmp(24), bench->arp()}) {
    for (size_t at = 0; at < 42; ++at) {
      for (int flip = 0; flip < 8; ++flip) {
        for (const int repair : {0, 1, 2}) {
          Bytes f = good;
          f[at] = static_cast<uint8_t>(f[at] ^ 1 << flip);
          if (repair >= 1 && f[13] == 0) repair_header(f);
          if (repair >= 2 && f[13] == 0) repair_content(f);
          bench->send(bench->closed(f));
          bench->finish();
        }
      }
    }
  }
  bench->check();
  for (const int counter : {net::kRxFrames, net::kRxFiltered, net::kRxOther, net::kIpHeader, net::kIpFragment,
                            net::kChecksum, net::kArp, net::kIcmp, net::kUdp}) {
    INFO(net::kCounterNames[counter]);
    CHECK(bench->count[static_cast<size_t>(counter)] > 0);
  }
}

namespace {

struct Fault {
  const char* name;
  int counter;
  std::function<void(Bytes&, uint8_t&)> make;
  char kinds;  // of 'u', 'i', 'a'; '*' all, 'p' IP

  bool applies(char kind) const { return kinds == '*' || kinds == kind || (kinds == 'p' && kind != 'a'); }
};
enum { kHeaderSum = 1, kContentSum = 2 };

// In the order of precedence. broken: sums that are wrong on purpose.
std::vector<Fault> all_faults(const net::Address& address, int* broken) {
  auto verdict_bit = [](int n) { return [n](Bytes&, uint8_t& v) { v = static_cast<uint8_t>(v | 1 << n); }; };
  auto set = [](size_t at, uint8_t value) { return [at, value](Bytes& f, uint8_t&) { f[at] = value; }; };
  auto flip = [](size_t at, uint8_t mask) {
    return [at, mask](Bytes& f, uint8_t&) { f[at] = static_cast<uint8_t>(f[at] ^ mask); };
  };
  auto own_at = [&](size_t at, size_t bytes) {
    return [address, at, bytes](Bytes& f, uint8_t&) {
      const Bytes own = golden_own(address);
      std::copy_n(own.begin() + (bytes == 4 ? 6 : 0), bytes, f.begin() + static_cast<std::ptrdiff_t>(at));
    };
  };
  return {
      {"overflow", net::kRxOverflow, verdict_bit(5), '*'},
      {"rx_er", net::kRxError, verdict_bit(4), '*'},
      {"long", net::kRxLong, verdict_bit(3), '*'},
      {"short", net::kRxShort, verdict_bit(2), '*'},
      {"odd nibble", net::kRxAlign, verdict_bit(1), '*'},
      {"FCS", net::kRxFcs, verdict_bit(0), '*'},
      {"other MAC, first byte", net::kRxFiltered, set(0, 0x02), '*'},
      {"other MAC, last byte", net::kRxFiltered, flip(5, 0x01), '*'},
      {"ethertype IPv6", net::kRxOther, [](Bytes& f, uint8_t&) { net::put16(f, 12, 0x86dd); }, '*'},
      {"ethertype 0x0802", net::kRxOther, set(13, 0x02), '*'},
      {"ARP hardware", net::kRxOther, set(15, 6), 'a'},
      {"ARP protocol", net::kRxOther, set(17, 6), 'a'},
      {"ARP sizes", net::kRxOther, set(18, 8), 'a'},
      {"ARP reply", net::kRxOther, set(21, 2), 'a'},
      {"ARP target", net::kRxOther, flip(41, 0x80), 'a'},
      {"version 6", net::kIpHeader, set(14, 0x65), 'p'},
      {"options", net::kIpHeader, set(14, 0x46), 'p'},
      {"total length 27", net::kIpHeader, [](Bytes& f, uint8_t&) { net::put16(f, 16, 27); }, 'p'},
      {"total length 19", net::kIpHeader, [](Bytes& f, uint8_t&) { net::put16(f, 16, 19); }, 'p'},
      {"total length + 2048", net::kIpHeader, flip(16, 0x08), 'p'},
      {"total length beyond the frame", net::kIpHeader,
       [](Bytes& f, uint8_t&) { net::put16(f, 16, static_cast<uint32_t>(f.size() - 17)); }, 'p'},
      {"IP checksum", net::kIpHeader, [broken](Bytes&, uint8_t&) { *broken |= kHeaderSum; }, 'p'},
      {"other IP", net::kIpHeader, flip(33, 0x40), 'p'},
      {"source MAC of a group", golden::kEventBadSource, flip(6, 0x01), '*'},
      {"source MAC our own", golden::kEventBadSource, own_at(6, 6), '*'},
      {"ARP sender of a group", golden::kEventBadSource, flip(22, 0x01), 'a'},
      {"ARP sender's MAC our own", golden::kEventBadSource, own_at(22, 6), 'a'},
      {"ARP sender's IP our own", golden::kEventBadSource, own_at(28, 4), 'a'},
      {"source IP our own", golden::kEventBadSource, own_at(26, 4), 'p'},
      {"source IP 0.0.0.0", golden::kEventBadSource, [](Bytes& f, uint8_t&) { net::put32(f, 26, 0); }, 'p'},
      {"source IP 0/8", golden::kEventBadSource, set(26, 0), 'p'},
      {"source IP 127/8", golden::kEventBadSource, set(26, 127), 'p'},
      {"source IP 224/4", golden::kEventBadSource, set(26, 239), 'p'},
      {"source IP 240/4", golden::kEventBadSource, set(26, 240), 'p'},
      {"source IP all ones", golden::kEventBadSource, [](Bytes& f, uint8_t&) { net::put32(f, 26, ~0u); }, 'p'},
      {"more fragments", net::kIpFragment, flip(20, 0x20), 'p'},
      {"offset, high", net::kIpFragment, flip(20, 0x10), 'p'},
      {"offset, low", net::kIpFragment, flip(21, 0x01), 'p'},
      {"protocol TCP", net::kRxOther, set(23, 6), 'p'},
      {"protocol 0x13", net::kRxOther, set(23, 0x13), 'p'},
      {"ICMP reply", net::kRxOther, set(34, 0), 'i'},
      {"ICMP code", net::kRxOther, set(35, 1), 'i'},
      {"UDP length + 1", net::kChecksum, flip(39, 0x01), 'u'},
      {"UDP length + 256", net::kChecksum, flip(38, 0x01), 'u'},
      {"UDP length + 2048", net::kChecksum, flip(38, 0x08), 'u'},
      {"checksum", net::kChecksum, [broken](Bytes&, uint8_t&) { *broken |= kContentSum; }, 'p'},
  };
}

// A good frame of a kind with one fault or two: where both touch a byte, the first in order stays.
void spoil(Bytes& f, uint8_t& verdict, char kind, const Fault& first, const Fault& second, int& broken) {
  verdict = 0;
  broken = 0;
  second.make(f, verdict);
  if (&first != &second) first.make(f, verdict);
  if (kind == 'a') return;
  if (kind == 'i' || (f[40] | f[41])) repair_content(f);
  if (broken & kContentSum) f[40] = static_cast<uint8_t>(f[40] ^ 0x10);
  repair_header(f);
  if (broken & kHeaderSum) f[25] = static_cast<uint8_t>(f[25] ^ 0x01);
}

}  // namespace

TEMPLATE_TEST_CASE("packet_rx: all faults, alone and in pairs: the first in order counts", "", Vpacket_rx_2,
                   Vpacket_rx_4) {
  auto bench = std::make_unique<Bench<TestType>>();
  int broken = 0;
  const std::vector<Fault> faults = all_faults(bench->own, &broken);
  for (const char kind : {'u', 'i', 'a'}) {
    for (size_t a = 0; a < faults.size(); ++a) {
      for (size_t b = a; b < faults.size(); ++b) {
        if (!faults[a].applies(kind) || !faults[b].applies(kind)) continue;
        Bytes f = bench->closed(kind == 'u' ? bench->udp(64) : kind == 'i' ? bench->icmp(65) : bench->arp());
        std::copy(bench->own.mac.begin(), bench->own.mac.end(), f.begin());  // no broadcast: that is ARP's alone
        uint8_t verdict = 0;
        spoil(f, verdict, kind, faults[a], faults[b], broken);
        INFO(kind << ": " << faults[a].name << " and " << faults[b].name);
        bench->send(f, verdict, bit(faults[a].counter));
        bench->finish();
        REQUIRE(bench->outcomes.errors() == 0);
        REQUIRE(bench->events.errors() == 0);
      }
    }
  }
  CHECK(bench->outcomes.compared() > 1400);
  // A good frame after all that.
  bench->send(bench->closed(bench->udp(9)), 0, kGoodUdp);
  bench->finish();
  bench->check();
}

TEMPLATE_TEST_CASE("packet_rx: sources that may not be are refused, their neighbours are not", "", Vpacket_rx_2,
                   Vpacket_rx_4) {
  auto bench = std::make_unique<Bench<TestType>>();
  const net::Address& own = bench->own;
  for (int first = 0; first < 256; ++first) {  // each first byte of the source's IP, with all zeros, ones, and others
    for (const uint32_t rest : {0u, 0xffffffu, bench->below(1u << 24)}) {
      net::Address from = bench->somebody();
      from.ip = static_cast<uint32_t>(first) << 24 | rest;
      if (from.ip == own.ip) continue;
      const bool bad = first == 0 || first == 127 || first >= 224;
      bench->send(bench->closed(net::make_udp(from, own, bench->noise(30))), 0, bad ? kBadSource : kGoodUdp);
      bench->send(bench->closed(net::make_icmp_echo(from, own, 8, bench->noise(30))), 0, bad ? kBadSource : kGoodIcmp);
      bench->send(bench->closed(net::make_arp_request(from, own.ip)), 0, kGoodArp);  // 0: a probe
      bench->finish();
    }
  }
  for (int at = 0; at < 10; ++at) {  // own but for one bit is somebody else
    for (int flip = -1; flip < 8; ++flip) {
      auto change = [&](Bytes f, size_t where) {
        if (flip >= 0) f[where] = static_cast<uint8_t>(f[where] ^ 1 << flip);
        if (f[13] == 0) repair_header(f), repair_content(f);
        return bench->closed(f);
      };
      net::Address from = bench->somebody();
      if (at < 6) {
        from.mac = own.mac;
        const uint32_t want = flip < 0 || (at == 0 && flip == 0) ? kBadSource : 0;
        const size_t where = 6 + static_cast<size_t>(at);
        bench->send(change(net::make_udp(from, own, bench->noise(30)), where), 0, want != 0 ? want : kGoodUdp);
        Bytes f = net::make_arp_request(bench->somebody(), own.ip);
        std::copy(own.mac.begin(), own.mac.end(), f.begin() + 6);
        bench->send(change(f, where), 0, want != 0 ? want : kGoodArp);
        f = net::make_arp_request(bench->somebody(), own.ip);
        std::copy(own.mac.begin(), own.mac.end(), f.begin() + 22);
        bench->send(change(f, where + 16), 0, want != 0 ? want : kGoodArp);
      } else {
        from.ip = own.ip;
        const size_t where = 20 + static_cast<size_t>(at);
        const bool net_bad = flip >= 0 && at == 6 && (own.ip >> 24 ^ 1u << flip) >= 224;
        const uint32_t want = flip < 0 || net_bad ? kBadSource : kGoodUdp;
        bench->send(change(net::make_udp(from, own, bench->noise(30)), where), 0, want);
        bench->send(change(net::make_arp_request(from, own.ip), where + 2), 0, flip < 0 ? kBadSource : kGoodArp);
      }
      bench->finish();
    }
  }
  bench->check();
  CHECK(bench->count[golden::kEventBadSource] > 200);
}

TEMPLATE_TEST_CASE("packet_rx: UDP to every other port is a message of its own kind", "", Vpacket_rx_2, Vpacket_rx_4) {
  auto bench = std::make_unique<Bench<TestType>>();
  for (int i = -16; i < 300; ++i) {
    net::Address to = bench->own;
    to.port = static_cast<uint16_t>(i < 0 ? to.port ^ 1 << (i + 16) : bench->random());
    if (to.port == bench->own.port) continue;
    Bytes f = net::make_udp(bench->somebody(), to, bench->noise(bench->below(100)));
    bench->send(bench->closed(f), 0, kGoodClosed);
    Bytes bad = f;  // only with good sums, and only if it was for this chip alone
    bad[41] = static_cast<uint8_t>(bad[41] ^ 1);
    if ((bad[40] | bad[41]) != 0) bench->send(bench->closed(bad), 0, bit(net::kChecksum));
    bad = f;
    bad[39] = static_cast<uint8_t>(bad[39] ^ 2);
    bench->send(bench->closed(bad), 0, bit(net::kChecksum));
    std::fill_n(f.begin(), 6, 0xff);
    bench->send(bench->closed(f), 0, bit(net::kRxFiltered));
    bench->finish();
  }
  bench->check();
  CHECK(bench->count[net::kUdp] == 0);
}

TEMPLATE_TEST_CASE("packet_rx: collision fragments are counted apart from short frames, in half duplex only", "",
                   Vpacket_rx_2, Vpacket_rx_4) {
  auto bench = std::make_unique<Bench<TestType>>();
  for (const bool half : {false, true}) {
    bench->dut.half_duplex = half;
    for (int verdict = 0; verdict < 64; ++verdict) {
      const bool fragment = half && (verdict & 0x3d) == 5;
      bench->send(bench->noise(bench->below(64)), static_cast<uint8_t>(verdict),
                  fragment ? bit(golden::kEventFragment) : 0);
      bench->finish();
    }
  }
  bench->send(bench->closed(bench->udp(9)), 0, kGoodUdp);
  bench->finish();
  bench->check();
  CHECK(bench->count[golden::kEventFragment] == 2);
  CHECK(bench->count[net::kRxShort] == 4 + 2);
}

TEMPLATE_TEST_CASE("packet_rx: every verdict, and verdicts without a byte", "", Vpacket_rx_2, Vpacket_rx_4) {
  auto bench = std::make_unique<Bench<TestType>>();
  for (int verdict = 0; verdict < 64; ++verdict) {
    bench->send(bench->closed(bench->udp(30)), static_cast<uint8_t>(verdict));
    if (verdict != 0) bench->send({}, static_cast<uint8_t>(verdict));
    bench->finish();
  }
  bench->check();
  CHECK(bench->count[net::kUdp] == 1);
  CHECK(bench->count[net::kRxOverflow] == 64);
}

TEMPLATE_TEST_CASE("packet_rx: checksums at their corners", "", Vpacket_rx_2, Vpacket_rx_4) {
  auto bench = std::make_unique<Bench<TestType>>();
  int all_ones = 0;
  for (int i = 0; i < 400; ++i) {
    // Payload whose last word makes the true checksum 0, or one beside it.
    const net::Address from = bench->somebody();
    const size_t size = 2 + bench->below(60);
    Bytes payload = bench->noise(size);
    const size_t at = (size - 2) / 2 * 2;
    payload[at] = payload[at + 1] = 0;
    Bytes f = net::make_udp(from, bench->own, payload);
    const uint32_t rest = net::get16(f, 40);
    const uint32_t want = bench->below(3);  // the true checksum: 0xffff, 0 or 1 beyond
    const uint32_t word = rest + (want == 0 ? 0 : want == 1 ? 0xfffe : 1);
    net::put16(payload, at, word > 0xffff ? word - 0xffff : word);
    f = net::make_udp(from, bench->own, payload);
    if (net::get16(f, 40) == 0xffff) ++all_ones;
    bench->send(bench->closed(f), 0, kGoodUdp);
    Bytes wrong = f;
    wrong[40] = static_cast<uint8_t>(wrong[40] ^ 1 << bench->below(8));
    bench->send(bench->closed(wrong), 0, bit(net::kChecksum));
    net::put16(f, 40, 0);  // none: anything passes
    f[42] = static_cast<uint8_t>(~f[42]);
    bench->send(bench->closed(f), 0, kGoodUdp);
    bench->finish();
  }
  CHECK(all_ones > 50);
  // Only one byte of the checksum is zero: it counts.
  for (const size_t zero : {40, 41}) {
    Bytes f = bench->udp(32);
    f[zero] = 0;
    f[81 - zero] = 0x5a;
    bench->send(bench->closed(f));
  }
  bench->finish();
  // All ones, the carry that waits at the end, and ICMP's checksum in both its zeros.
  for (size_t size = 1; size < 40; ++size) {
    for (const uint8_t fill : Bytes{0xff, 0x00, 0xfe, 0x01}) {
      Bytes f = net::make_icmp_echo(bench->somebody(), bench->own, 8, Bytes(3 + size, fill));
      bench->send(bench->closed(f), 0, kGoodIcmp);
      f[36] = static_cast<uint8_t>(f[36] ^ 0x01);
      bench->send(bench->closed(f), 0, bit(net::kChecksum));
      bench->finish();
    }
  }
  for (const uint32_t sum : {0u, 0xffffu}) {
    Bytes f = net::make_icmp_echo(bench->somebody(), bench->own, 8, {0xf7, 0xff, 0, 0});
    CHECK(net::get16(f, 36) == 0);
    net::put16(f, 36, sum);
    bench->send(bench->closed(f), 0, kGoodIcmp);
    bench->finish();
  }
  bench->check();
}

TEMPLATE_TEST_CASE("packet_rx: a full ring, freed at any time, with a byte in every clock", "", Vpacket_rx_2,
                   Vpacket_rx_4) {
  auto bench = std::make_unique<Bench<TestType>>();
  bench->passes = 2;
  for (int i = 0; i < 3000; ++i) {
    const uint32_t kind = bench->below(4);
    const uint32_t about = bench->below(4);  // small frames, any, and lengths around 512 and 1024
    const uint32_t size = about == 0   ? bench->below(1473)
                          : about == 1 ? 512 * (1 + bench->below(2)) - 46 - 3 + bench->below(7)
                                       : bench->below(80);
    Bytes f = kind == 0 ? bench->arp() : kind == 1 ? bench->icmp(size) : bench->udp(size);
    const bool good = bench->below(8) != 0;
    bench->send(bench->closed(f), good ? 0 : static_cast<uint8_t>(bench->below(64)));
    if (bench->below(16) == 0) bench->send({}, 0x20);
  }
  while (!bench->queue.empty()) {
    bench->max_hold = static_cast<int>(bench->below(5)) * 900;
    bench->gaps = bench->below(3) == 0 ? 0.5 : 0;
    bench->sim.run(2000);
  }
  bench->finish();
  bench->check();
  CHECK(bench->count[net::kRxNoSlot] > 300);
  CHECK(bench->count[net::kRxFrames] > 300);
}

TEMPLATE_TEST_CASE("packet_rx: what just fits is kept, one granule too few is counted, from every granule on", "",
                   Vpacket_rx_2, Vpacket_rx_4) {
  auto bench = std::make_unique<Bench<TestType>>();
  constexpr size_t kAll = Traits<TestType>::kGranules;
  auto frame = [&](size_t bytes) { return bench->closed(bench->udp(bytes - 46)); };  // with FCS
  for (size_t turn = 0; turn < 2 * kAll + 1; ++turn) {                               // wrap around, the extra bit, too
    for (size_t left = 0; left <= 3; ++left) {
      for (const size_t size : {64, 511, 512, 513, 1023, 1024, 1025, 1518}) {
        bench->stopped = true;
        // Filled with frames of 1 to 3 granules up to `left`, each as long as its granules are.
        for (size_t used = 0; used < kAll - left;) {
          const size_t n = std::min<size_t>(1 + bench->below(3), kAll - left - used);
          bench->send(frame(std::min<size_t>(n * 512, 1518)), 0, kGoodUdp);
          used += n;
        }
        const bool fits = (size + 511) / 512 <= left;
        bench->send(frame(size), 0, fits ? kGoodUdp : bit(net::kRxNoSlot));
        bench->send(frame(size), 4, bit(net::kRxShort));  // a fault counts before the room
        bench->sim.run_until([&] { return bench->queue.empty(); });
        bench->stopped = false;
        bench->finish();
      }
    }
    bench->send(frame(64), 0, kGoodUdp);
    bench->finish();
  }
  bench->check();
  CHECK(bench->count[net::kRxNoSlot] == (2 * kAll + 1) * (8 + 5 + 2));
}

TEMPLATE_TEST_CASE("packet_rx: garbage of any length never touches a waiting message", "", Vpacket_rx_2, Vpacket_rx_4) {
  auto bench = std::make_unique<Bench<TestType>>();
  constexpr size_t kLargest = Traits<TestType>::kGranules / 3;
  for (size_t filled = 1; filled <= kLargest; ++filled) {
    bench->stopped = true;
    for (size_t i = 0; i < filled; ++i) bench->send(bench->closed(bench->udp(1472 - i)), 0, kGoodUdp);
    for (const size_t size : {0, 1, 5, 13, 33, 34, 41, 63, 1518, 1519, 1570, 2014, 2047, 2048, 2049, 4100, 9000}) {
      Bytes f = bench->noise(size);
      std::copy_n(bench->own.mac.begin(), std::min<size_t>(6, size), f.begin());
      bench->send(f, static_cast<uint8_t>(size < 64 ? 4 : size > 1518 ? 8 : 1));
    }
    bench->sim.run_until([&] { return bench->queue.empty(); });
    bench->pass = 0;  // read again
    bench->passes = 2;
    bench->stopped = false;
    bench->finish();
    bench->passes = 1;
  }
  bench->check();
  CHECK(bench->count[net::kRxNoSlot] == 0);
}

TEMPLATE_TEST_CASE("packet_rx: random and mutated frames", "", Vpacket_rx_2, Vpacket_rx_4) {
  auto bench = std::make_unique<Bench<TestType>>();
  const uint32_t seed = test_seed();
  INFO("seed " << seed);
  auto random_size = [&] { return bench->below(6) == 0 ? bench->below(1473) : bench->below(90); };
  for (int i = 0; i < 12000; ++i) {
    const uint32_t kind = bench->below(8);
    Bytes f = kind == 0   ? bench->arp()
              : kind == 1 ? bench->noise(14 + random_size())
              : kind < 4  ? bench->icmp(random_size())
                          : bench->udp(random_size());
    if (kind == 1) {
      std::copy_n(bench->own.mac.begin(), 6, f.begin());
      if (bench->chance(0.7)) net::put16(f, 12, bench->chance(0.8) ? 0x0800 : 0x0806);
    }
    for (uint32_t n = bench->below(4); n > 0; --n) {
      const uint32_t where = bench->below(4);
      const size_t at = where == 0 ? bench->below(static_cast<uint32_t>(f.size())) : bench->below(42);
      if (at >= f.size()) continue;
      const uint32_t how = bench->below(5);
      f[at] = how == 0   ? 0
              : how == 1 ? 0xff
              : how == 2 ? static_cast<uint8_t>(bench->random())
                         : static_cast<uint8_t>(f[at] ^ 1 << bench->below(8));
    }
    if (f.size() >= 42 && bench->chance(0.15)) {  // sources that are none
      const uint32_t how = bench->below(7);
      if (how == 0) std::copy(bench->own.mac.begin(), bench->own.mac.end(), f.begin() + 6);
      if (how == 1) f[6] |= 1;
      if (how == 2) f[26] = static_cast<uint8_t>(bench->below(256));
      if (how == 3) net::put32(f, f[13] == 6 ? 28 : 26, bench->own.ip);
      if (how == 4) net::put32(f, f[13] == 6 ? 28 : 26, 0);
      if (how == 5 && f[13] == 6) std::copy(bench->own.mac.begin(), bench->own.mac.end(), f.begin() + 22);
      if (how == 6 && f[13] == 6) f[22] |= 1;
    }
    if (f.size() >= 42 && bench->chance(0.3)) {  // hostile lengths
      const uint32_t real = static_cast<uint32_t>(f.size() - 14);
      const uint32_t choice[] = {0,     19, 20, 27, 28, real, real + 1, real + 4, real + 5, real - 1, 0x0800 + real,
                                 0xffff};
      net::put16(f, 16, choice[bench->below(12)]);
      if (bench->chance(0.5)) net::put16(f, 38, net::get16(f, 16) - 20);
    }
    if (f.size() >= 42 && f[13] == 0 && bench->chance(0.7)) {
      if (bench->chance(0.8)) repair_content(f);
      repair_header(f);
    }
    if (bench->chance(0.1)) f.resize(bench->below(static_cast<uint32_t>(f.size()) + 1));  // truncated
    if (bench->chance(0.1)) {                                                             // overlong
      const Bytes tail = bench->noise(bench->below(200));
      f.insert(f.end(), tail.begin(), tail.end());
    }
    if (bench->chance(0.95)) net::append_fcs(f);
    uint8_t verdict = bench->chance(0.9) ? 0 : static_cast<uint8_t>(bench->below(64));
    if (f.size() > 1518) verdict = static_cast<uint8_t>(verdict | 8);
    if (f.size() < 64 && bench->chance(0.7)) verdict = static_cast<uint8_t>(verdict | 4);
    bench->send(f, verdict);
  }
  while (!bench->queue.empty()) {
    bench->max_hold = bench->below(3) == 0 ? 12000 : 0;
    bench->gaps = bench->below(4) * 0.25;
    if (bench->gaps > 0) {
      bench->sim.run_until([&] { return bench->next == 0 && bench->pulses.empty(); });
      bench->dut.half_duplex = bench->below(2) != 0;
    }
    bench->sim.run(3000);
  }
  bench->finish();
  bench->check();
  for (int counter = 0; counter < golden::kEventResynchronised; ++counter) {
    INFO("event " << counter);
    CHECK(bench->count[static_cast<size_t>(counter)] > 10);
  }
  CHECK(bench->count[golden::kEventResynchronised] == 0);
}

TEMPLATE_TEST_CASE("packet_rx: reset in the middle of anything leaves nothing", "", Vpacket_rx_2, Vpacket_rx_4) {
  auto bench = std::make_unique<Bench<TestType>>();
  for (int i = 0; i < 60; ++i) {
    bench->stopped = true;
    for (int n = 0; n < 3; ++n) bench->send(bench->closed(bench->udp(bench->below(n == 1 ? 600 : 30))));
    bench->sim.run(20 + bench->below(220));
    bench->queue.clear();
    bench->waiting.clear();
    bench->pulses.clear();
    bench->offering = bench->active = false;
    bench->asked = bench->asked_before = -1;
    bench->next = bench->used = 0;
    bench->dut.s_valid = bench->dut.m_done = 0;
    bench->sim.reset();
    bench->stopped = false;
    for (size_t n = 0; n < Traits<TestType>::kGranules; ++n)
      bench->send(bench->closed(n % 2 ? bench->icmp(n) : bench->udp(n)), 0, n % 2 ? kGoodIcmp : kGoodUdp);
    bench->finish();
  }
  bench->check();
}

namespace {

const std::vector<UpsetSite> kSites = {
#include "packet_rx_upset.inc"
};

// Frames go in, messages are taken as they are shown, whatever they are.
struct UpsetBench : Agent {
  Sim<Vpacket_rx_upset> sim{2000000000, test_seed()};
  Vpacket_rx_upset& dut = sim.dut();
  std::mt19937 random{test_seed() + 5};
  net::Address own;
  std::deque<Bytes> queue;  // with FCS
  size_t next = 0;
  int hold = 0, most_hold = 60;
  int shown_for = 0;          // clocks of the present message
  std::vector<Bytes> taken;   // bytes 42 .. 45 of each: the number that send() gave it
  std::array<int, 4> read{};  // of the present message
  uint64_t resynchronised = 0;

  UpsetBench() {
    own.mac = {2, 0, 0x50, 0x53, 0x57, 1};
    own.ip = 0x0a050002;
    own.port = 20563;
    dut.own_mac = 0x020050535701;
    dut.own_ip = own.ip;
    dut.half_duplex = dut.s_valid = dut.m_done = 0;
    dut.flip_site = 0;
    dut.flip_mask = 0;
    sim.add(*this);
    sim.reset();
  }
  void send(uint32_t number, size_t size) {
    Bytes payload(size);
    for (auto& b : payload) b = static_cast<uint8_t>(random());
    net::put32(payload, 0, number);
    Bytes f = net::make_udp({{2, 0, 0, 0, 0, 9}, 0x0a050001, 4000}, own, payload);
    net::append_fcs(f);
    queue.push_back(f);
  }
  void drive() override {
    dut.s_valid = !queue.empty();
    dut.s_last = dut.s_valid && next == queue.front().size();
    dut.s_data = dut.s_valid && !dut.s_last ? queue.front()[next] : 0;
    dut.m_done = shown_for == 6 + hold;
    dut.r_addr = static_cast<uint16_t>(42 + shown_for);
  }
  void sample() override {
    resynchronised += dut.events >> golden::kEventResynchronised & 1;
    if (dut.s_valid && dut.s_ready && ++next > queue.front().size()) {
      queue.pop_front();
      next = 0;
    }
    if (!dut.m_valid) {
      shown_for = 0;
      return;
    }
    if (shown_for >= 1 && shown_for <= 4) read[static_cast<size_t>(shown_for - 1)] = dut.r_data;
    if (dut.m_done) {
      taken.push_back(Bytes(read.begin(), read.end()));
      shown_for = 0;
      hold = static_cast<int>(random() % static_cast<unsigned>(most_hold));
    } else {
      ++shown_for;
    }
  }
};

}  // namespace

TEST_CASE("packet_rx: after an upset of any register the ring is empty soon, and everything is right again") {
  UpsetBench bench;
  uint32_t number = 0;
  uint64_t wrong = 0, upsets = 0, ring = 0;
  for (size_t site = 0; site < kSites.size(); ++site) {
    for (int bit = 0; bit < kSites[site].bits; ++bit) {
      for (int round = 0; round < 8; ++round) {
        INFO(kSites[site].name << ", bit " << bit << ", round " << round);
        // A busy ring, or (every fourth time) an idle one.
        bench.most_hold = round % 4 == 0 ? 1 : 400;
        const uint32_t first = number;
        for (int i = 0; i < (round % 4 == 3 ? 0 : 6); ++i)
          bench.send(number++, 4 + bench.random() % (i % 3 ? 30 : 1100));
        bench.sim.run(bench.random() % (round % 4 == 3 ? 20 : 2000));
        bench.dut.flip_site = static_cast<uint16_t>(site + 1);
        bench.dut.flip_mask = uint64_t{1} << bit;
        bench.sim.tick();
        bench.dut.flip_site = 0;
        bench.sim.run_until([&] { return bench.queue.empty(); });
        // At most 16 messages are shown, each for at most 407 clocks.
        int quiet = 0;
        for (int i = 0; i < 16 * 410 + 30 && quiet < 30; ++i) {
          bench.sim.tick();
          quiet = bench.dut.m_valid ? 0 : quiet + 1;
        }
        REQUIRE(quiet == 30);
        wrong += bench.taken.size() != number - first;
        // One frame more may be judged by what was upset. From then on every frame is a message, in order.
        bench.send(number++, 4);
        bench.sim.run(600);
        bench.taken.clear();
        const uint32_t second = number;
        for (int i = 0; i < 3; ++i) bench.send(number++, i == 1 ? 1100 : 4);
        bench.sim.run_until([&] { return bench.queue.empty(); });
        for (int i = 0; i < 2000 && bench.taken.size() < 3; ++i) bench.sim.tick();
        bench.sim.run(10);
        REQUIRE(bench.taken.size() == 3);
        for (uint32_t i = 0; i < 3; ++i) REQUIRE(net::get32(bench.taken[i], 0) == second + i);
        bench.taken.clear();
        ++upsets;
        const std::string name = kSites[site].name;
        ring += name == "read_head" || name == "write_head" || name == "waiting";
      }
    }
  }
  INFO(upsets << " upsets, " << wrong << " with messages lost or shown too often, " << bench.resynchronised
              << " resynchronised");
  CHECK(upsets > 800);
  CHECK(ring > 30);
  CHECK(wrong > 10);
  CHECK(bench.resynchronised > 10);
}
