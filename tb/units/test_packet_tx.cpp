// SPDX-License-Identifier: Apache-2.0
// packet_tx: every frame equals the model and net/frames.hpp byte by byte; all kinds, all lengths, checksums at their
// corners, both peers, any gaps of the payload; slots in turn, written only while they are free and only where the
// frame is; s_ready and the pulses to the clock, for every answer of the MAC at any time.
#include <algorithm>
#include <array>
#include <deque>
#include <optional>
#include <random>
#include <vector>

#include "Vpacket_tx_a.h"
#include "Vpacket_tx_b.h"
#include "golden/packet_tx.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"

using namespace psweep;
using namespace psweep::tb;
using golden::MessageKind;
using net::Bytes;

namespace {

// G_UDP_PORT of the models.
template <class Dut>
struct Traits;
template <>
struct Traits<Vpacket_tx_a> {
  static constexpr uint16_t kPort = 20563;
};
template <>
struct Traits<Vpacket_tx_b> {
  static constexpr uint16_t kPort = 65535;
};

constexpr uint64_t kHeaderClocks = 170, kHeaderClocksIcmp = 154;  // last byte of the payload to request
constexpr uint64_t kDoneLatency = 2;                              // f_done to s_ready
constexpr uint64_t kEventLatency = 3;                             // f_done to pulse

template <class Dut>
struct Bench : Agent {
  Sim<Dut> sim{400000000, test_seed()};
  Dut& dut = sim.dut();
  std::mt19937 random{test_seed() + 29};
  Scoreboard bytes{"frame"}, other{"net/frames.hpp"}, lengths{"f_length"}, writes{"ram_waddr"}, requests{"f_request"},
      ready{"s_ready"}, pulses{"ev"}, times{"clocks"};
  net::Address own;
  std::array<net::Address, 2> peers;

  std::array<std::array<int, 2048>, 2> ram{};  // -1: not written since s_start

  struct Packet {
    MessageKind kind{};
    Bytes payload;
    int bank = 0;
  };
  Packet job, work;  // to be started; in work
  bool starting = false, building = false;
  int slot = 0, number = 0;
  Bytes want;
  size_t next = 0;
  bool offering = false;
  double gaps = 0;
  uint64_t last_taken = 0;

  // The MAC.
  int max_wait = 0;
  std::array<int, 2> wait{-1, -1};  // clocks until the slot is done; -1: nothing to do
  unsigned done = 0, request = 0;
  std::deque<std::pair<uint64_t, unsigned>> done_seen;  // clock and value
  unsigned done_known = 0;
  std::deque<std::pair<uint64_t, unsigned>> events;  // clock and ev_late, ev_excessive, ev_sent
  std::array<uint64_t, 3> results{};

  Bench() {
    own = somebody();
    own.port = Traits<Dut>::kPort;
    apply_own();
    dut.s_start = dut.p_valid = dut.peer_we = 0;
    dut.f_done = 0;
    sim.add(*this);
    sim.reset();
    for (int i = 0; i < 2; ++i) set_peer(i, somebody());
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
    a.ip = static_cast<uint32_t>(random());
    a.port = static_cast<uint16_t>(random());
    return a;
  }
  void apply_own() {
    uint64_t mac = 0;
    for (const uint8_t b : own.mac) mac = mac << 8 | b;
    dut.own_mac = mac;
    dut.own_ip = own.ip;
  }
  // One byte a clock; the simulation goes on meanwhile.
  void set_peer(int at, const net::Address& a) {
    const Bytes b = golden::peer_bytes(a);
    for (size_t i = 0; i < b.size(); ++i) {
      dut.peer_we = 1;
      dut.peer_bank = at != 0;
      dut.peer_index = static_cast<uint8_t>(i);
      dut.peer_data = b[i];
      sim.tick();
    }
    dut.peer_we = 0;
    dut.peer_bank = at == 0;  // garbage
    peers[static_cast<size_t>(at)] = a;
  }
  // Waits for s_ready and starts.
  void start(MessageKind k, const Bytes& content, int from_bank) {
    sim.run_until([&] {
      dut.eval();
      return dut.s_ready != 0;
    });
    starting = true;
    job = {k, content, from_bank};
    sim.tick();
  }
  void finish() {
    sim.run_until([&] { return !building && events.empty() && wait[0] < 0 && wait[1] < 0; });
    sim.run(5);
  }

  void drive() override {
    const uint64_t now = sim.cycle();
    dut.s_start = starting;
    dut.s_kind = static_cast<uint8_t>(starting ? static_cast<unsigned>(job.kind) : random() & 3);
    dut.s_bank = starting ? job.bank != 0 : random() & 1;
    if (!offering) offering = building && next < work.payload.size() && !(gaps > 0 && chance(gaps));
    dut.p_valid = offering;
    dut.p_data = static_cast<uint8_t>(offering ? work.payload[next] : random());
    dut.p_last = static_cast<uint8_t>(offering ? next + 1 == work.payload.size() : random() & 1);
    // The result means something from the flip on.
    for (size_t s = 0; s < 2; ++s) {
      if (wait[s] < 0) continue;
      uint8_t result = static_cast<uint8_t>(random() & 3);
      if (wait[s]-- == 0) {
        result = static_cast<uint8_t>(below(3));
        done ^= 1u << s;
        events.emplace_back(now + kEventLatency, 1u << result);
        done_seen.emplace_back(now + kDoneLatency, done);
        ++results[result];
      }
      (s == 0 ? dut.f_result_0 : dut.f_result_1) = result;
    }
    dut.f_done = static_cast<uint8_t>(done);
  }

  void sample() override {
    const uint64_t now = sim.cycle();
    while (!done_seen.empty() && done_seen.front().first <= now) {
      done_known = done_seen.front().second;
      done_seen.pop_front();
    }
    unsigned pulse = 0;
    while (!events.empty() && events.front().first == now) {
      pulse |= events.front().second;
      events.pop_front();
    }
    pulses.compare(static_cast<uint64_t>(dut.ev_late << 2 | dut.ev_excessive << 1 | dut.ev_sent), pulse, {}, now);

    if (dut.f_request != request) check_frame(now);
    const bool want_ready = !building && ((request ^ done_known) >> slot & 1) == 0;
    ready.compare(dut.s_ready, want_ready, {number}, now);

    if (dut.ram_we) {
      const int at = dut.ram_waddr & 0x7ff;
      const bool legal = building && (dut.ram_waddr >> 11) == slot && static_cast<size_t>(at) < want.size();
      writes.compare(dut.ram_waddr, legal ? dut.ram_waddr : 0xffff, {number}, now);
      ram[dut.ram_waddr >> 11][static_cast<size_t>(at)] = dut.ram_wdata;
    }
    if (dut.p_valid && dut.p_ready) {
      offering = false;
      if (++next == work.payload.size()) last_taken = now;
    }
    if (starting) {
      starting = false;
      building = true;
      work = job;
      next = 0;
      last_taken = now;
      want = golden::transmit(work.kind, own, peers[static_cast<size_t>(work.bank)], work.payload);
      ram[static_cast<size_t>(slot)].fill(-1);
    }
  }

  void check_frame(uint64_t now) {
    requests.compare(dut.f_request, request ^ 1u << slot, {number}, now);
    request = dut.f_request;
    times.compare(now - last_taken, work.kind == MessageKind::kIcmp ? kHeaderClocksIcmp : kHeaderClocks, {number}, now);
    lengths.compare(slot == 0 ? dut.f_length_0 : dut.f_length_1, want.size(), {number}, now);
    const net::Address& peer = peers[static_cast<size_t>(work.bank)];
    const Bytes second = work.kind == MessageKind::kArp    ? net::make_arp_reply(own, peer)
                         : work.kind == MessageKind::kIcmp ? net::make_icmp_echo(own, peer, 0, work.payload)
                                                           : net::make_udp(own, peer, work.payload);
    other.compare(second.size(), want.size(), {number}, now);
    Bytes frame;
    for (size_t i = 0; i < want.size(); ++i) {
      const int byte = ram[static_cast<size_t>(slot)][i];
      bytes.compare(static_cast<uint64_t>(byte), want[i], {number, -1, static_cast<int>(i), 0}, now);
      other.compare(second[i], want[i], {number, -1, static_cast<int>(i), 0}, now);
      frame.push_back(static_cast<uint8_t>(byte));
    }
    if (work.kind == MessageKind::kUdp) {
      const auto parsed = net::parse_udp(frame);
      other.compare(parsed && parsed->payload == work.payload && parsed->to.port == peer.port &&
                        parsed->to.ip == peer.ip && parsed->from.ip == own.ip && parsed->from.port == own.port,
                    1, {number}, now);
    }
    wait[static_cast<size_t>(slot)] = 1 + static_cast<int>(below(static_cast<uint32_t>(max_wait) + 1));
    building = false;
    slot = 1 - slot;
    ++number;
  }
  void check() {
    for (const Scoreboard* board : {&bytes, &other, &lengths, &writes, &requests, &ready, &pulses, &times}) {
      INFO(board->report());
      CHECK(board->ok());
    }
    CHECK(static_cast<uint64_t>(number) == results[0] + results[1] + results[2]);
  }
};

}  // namespace

TEMPLATE_TEST_CASE("packet_tx: every length of UDP and ICMP, and ARP", "", Vpacket_tx_a, Vpacket_tx_b) {
  auto bench = std::make_unique<Bench<TestType>>();
  int packets = 0;
  for (size_t size = 1; size <= 1476; ++size) {
    bench->gaps = size % 9 == 0 ? 0.8 : 0;
    if (size <= 1472) {
      bench->start(MessageKind::kUdp, bench->noise(size), size & 1);
      ++packets;
    }
    bench->start(MessageKind::kIcmp, bench->noise(size), size >> 1 & 1);
    ++packets;
    if (size % 50 == 0) {
      bench->start(MessageKind::kArp, {}, size / 50 & 1);
      ++packets;
    }
  }
  bench->finish();
  bench->check();
  CHECK(bench->number == packets);
}

TEMPLATE_TEST_CASE("packet_tx: peers and own addresses of any kind, a peer changes while the other is served", "",
                   Vpacket_tx_a, Vpacket_tx_b) {
  auto bench = std::make_unique<Bench<TestType>>();
  bench->max_wait = 60;
  int bank = 0;
  for (int i = 0; i < 900; ++i) {
    const auto kind = static_cast<MessageKind>(bench->below(3));
    if (i % 20 == 0) {
      bench->finish();
      bench->own = bench->somebody();
      if (i % 60 == 20) bench->own.ip |= 0xff;
      if (i % 60 == 40) bench->own.mac = net::kBroadcast, bench->own.ip = 0xffffffff;
      bench->own.port = Traits<TestType>::kPort;
      bench->apply_own();
    }
    bench->start(kind, kind == MessageKind::kArp ? Bytes{} : bench->noise(1 + bench->below(40)), bank);
    net::Address peer = bench->somebody();
    const uint32_t how = bench->below(4);
    if (how == 0) peer.ip |= 0xff, peer.port = 0xffff;
    if (how == 1) peer.ip = 0xffffffff, peer.mac = net::kBroadcast;
    bank = 1 - bank;
    bench->set_peer(bank, peer);
  }
  bench->finish();
  bench->check();
  CHECK(bench->number == 900);
}

TEMPLATE_TEST_CASE("packet_tx: checksums at their corners", "", Vpacket_tx_a, Vpacket_tx_b) {
  auto bench = std::make_unique<Bench<TestType>>();
  int all_ones = 0, icmp_zero = 0, ip_zero = 0;
  for (int i = 0; i < 600; ++i) {
    // A word of the payload that makes the sum all ones, or one more or less.
    const size_t size = 2 + bench->below(12);
    const size_t at = (size - 2) / 2 * 2;
    for (const auto kind : {MessageKind::kUdp, MessageKind::kIcmp}) {
      const bool udp = kind == MessageKind::kUdp;
      Bytes payload = bench->noise(size);
      payload[at] = payload[at + 1] = 0;
      const Bytes f = golden::transmit(kind, bench->own, bench->peers[0], payload);
      const uint32_t rest = net::get16(f, udp ? 40 : 36);
      const uint32_t choice = bench->below(3);
      const uint32_t word = rest + (choice == 0 ? 0 : choice == 1 ? 0xfffe : 1);
      net::put16(payload, at, word > 0xffff ? word - 0xffff : word);
      bench->start(kind, payload, 0);
      (udp ? all_ones : icmp_zero) += net::get16(bench->want, udp ? 40 : 36) == (udp ? 0xffff : 0);
    }
  }
  CHECK(all_ones > 100);
  CHECK(icmp_zero > 100);
  // The same for the IP header, by the peer's address.
  for (int i = 0; i < 60; ++i) {
    net::Address peer = bench->peers[1];
    peer.ip = bench->below(0x10000) << 16;
    const uint32_t rest = net::get16(golden::transmit(MessageKind::kUdp, bench->own, peer, {1, 2, 3}), 24);
    const uint32_t word = rest + (i % 3 == 0 ? 0 : i % 3 == 1 ? 0xfffe : 1);
    peer.ip |= word > 0xffff ? word - 0xffff : word;
    bench->finish();
    bench->set_peer(1, peer);
    bench->start(MessageKind::kUdp, {1, 2, 3}, 1);
    ip_zero += net::get16(bench->want, 24) == 0;
  }
  CHECK(ip_zero >= 20);
  // Carries that wait everywhere.
  for (size_t size = 1; size <= 64; ++size) {
    for (const uint8_t fill : Bytes{0xff, 0x00, 0xfe, 0x80}) {
      bench->start(MessageKind::kUdp, Bytes(size, fill), 0);
      bench->start(MessageKind::kIcmp, Bytes(size, fill), 0);
    }
  }
  // Bytes of 0 and 0xff only, of everybody.
  for (int i = 0; i < 1500; ++i) {
    auto extreme = [&](Bytes b) {
      for (auto& v : b) v = bench->chance(0.7) ? 0xff : 0;
      return b;
    };
    if (i % 5 == 0) {
      bench->finish();
      net::Address peer;
      peer.ip = net::get32(extreme(Bytes(4)), 0);
      peer.port = static_cast<uint16_t>(net::get16(extreme(Bytes(2)), 0));
      bench->set_peer(0, peer);
      bench->own.ip = net::get32(extreme(Bytes(4)), 0);
      bench->apply_own();
    }
    bench->start(i & 1 ? MessageKind::kUdp : MessageKind::kIcmp, extreme(Bytes(1 + bench->below(300))), 0);
  }
  bench->finish();
  bench->check();
}

TEMPLATE_TEST_CASE("packet_tx: the MAC answers at any time, with any result", "", Vpacket_tx_a, Vpacket_tx_b) {
  auto bench = std::make_unique<Bench<TestType>>();
  for (int i = 0; i < 1500; ++i) {
    bench->max_wait = static_cast<int>(bench->below(4)) * 200;
    bench->gaps = bench->below(3) * 0.3;
    const auto kind = static_cast<MessageKind>(bench->below(3));
    bench->start(kind, kind == MessageKind::kArp ? Bytes{} : bench->noise(1 + bench->below(120)),
                 static_cast<int>(bench->below(2)));
  }
  bench->finish();
  bench->check();
  for (const uint64_t n : bench->results) CHECK(n > 300);
}

TEMPLATE_TEST_CASE("packet_tx: reset in the middle of anything leaves nothing", "", Vpacket_tx_a, Vpacket_tx_b) {
  auto bench = std::make_unique<Bench<TestType>>();
  for (int i = 0; i < 100; ++i) {
    const auto kind = static_cast<MessageKind>(i % 3);
    if (i % 2) bench->start(MessageKind::kArp, {}, 0);
    bench->start(kind, kind == MessageKind::kArp ? Bytes{} : bench->noise(1 + bench->below(60)), 0);
    bench->sim.run(bench->below(230));
    // mac_tx is reset, too.
    bench->done = bench->request = bench->done_known = 0;
    bench->done_seen.clear();
    bench->events.clear();
    bench->wait = {-1, -1};
    bench->building = bench->offering = bench->starting = false;
    bench->slot = 0;
    bench->dut.s_start = bench->dut.p_valid = bench->dut.f_done = 0;
    bench->sim.reset();
    bench->number = 0;
    bench->results = {};
    bench->start(kind, kind == MessageKind::kArp ? Bytes{} : bench->noise(1 + bench->below(60)), 1);
    bench->start(MessageKind::kUdp, bench->noise(7), 1);
    bench->finish();
  }
  bench->check();
}
