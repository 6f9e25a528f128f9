// SPDX-License-Identifier: Apache-2.0
// packet_tx: every frame equals the model and contract/frames.hpp byte by byte; all kinds, all lengths, checksums at
// their corners, both peers, any gaps of the payload; slots in turn, written only while they are free and only where
// the frame is; s_ready and the pulses to the clock, for every answer of the MAC at any time; abort at any time; mac_tx
// in reset; upsets of every bit of every register.
#include <algorithm>
#include <array>
#include <deque>
#include <optional>
#include <random>
#include <vector>

#include "Vpacket_tx_a.h"
#include "Vpacket_tx_b.h"
#include "Vpacket_tx_upset.h"
#include "golden/packet_tx.hpp"
#include "support/catch.hpp"
#include "support/scoreboard.hpp"
#include "support/sim.hpp"
#include "support/upset.hpp"

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
  Scoreboard bytes{"frame"}, other{"contract/frames.hpp"}, lengths{"f_length"}, writes{"ram_waddr"},
      requests{"f_request"}, ready{"s_ready"}, pulses{"ev"}, times{"clocks"};
  net::Address own;
  std::array<net::Address, 2> peers;

  std::array<std::array<int, 2048>, 2> ram{};  // -1: not written since s_start

  struct Packet {
    MessageKind kind{};
    Bytes payload;
    int bank = 0;
  };
  Packet job, work;  // to be started; in work
  bool starting = false, building = false, aborted = false;
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
  std::deque<std::pair<uint64_t, unsigned>> events;  // clock and ev_deferred .. ev_sent
  std::array<uint64_t, 4> results{};

  Bench() {
    own = somebody();
    own.port = Traits<Dut>::kPort;
    apply_own();
    dut.s_start = dut.p_valid = dut.peer_we = 0;
    dut.f_done = 0;
    dut.s_abort = dut.tx_rst = 0;
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
        result = static_cast<uint8_t>(below(4));
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
    const int shown =
        dut.ev_recovered << 4 | dut.ev_deferred << 3 | dut.ev_late << 2 | dut.ev_excessive << 1 | dut.ev_sent;
    pulses.compare(static_cast<uint64_t>(shown), pulse, {}, now);

    if (dut.f_request != request) check_frame(now);
    const bool want_ready = !building && ((request ^ done_known) >> slot & 1) == 0;
    ready.compare(dut.s_ready, want_ready, {number}, now);

    if (dut.ram_we) {  // the clock behind an abort may still write where the frame was
      const int at = dut.ram_waddr & 0x7ff;
      const bool legal =
          (building || aborted) && (dut.ram_waddr >> 11) == slot && static_cast<size_t>(at) < want.size();
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

  Bytes unreachable(const net::Address& peer) const {
    Bytes f = net::make_icmp_echo(own, peer, 3, work.payload);
    f[35] = 3;
    net::put16(f, 36, 0);
    net::put16(f, 36, net::internet_checksum(f.data() + 34, f.size() - 34));
    return f;
  }
  void check_frame(uint64_t now) {
    requests.compare(dut.f_request, request ^ 1u << slot, {number}, now);
    request = dut.f_request;
    const bool icmp = work.kind == MessageKind::kIcmp || work.kind == MessageKind::kClosed;
    times.compare(now - last_taken, icmp ? kHeaderClocksIcmp : kHeaderClocks, {number}, now);
    lengths.compare(slot == 0 ? dut.f_length_0 : dut.f_length_1, want.size(), {number}, now);
    const net::Address& peer = peers[static_cast<size_t>(work.bank)];
    const Bytes second = work.kind == MessageKind::kArp    ? net::make_arp_reply(own, peer)
                         : work.kind == MessageKind::kIcmp ? net::make_icmp_echo(own, peer, 0, work.payload)
                         : work.kind == MessageKind::kUdp  ? net::make_udp(own, peer, work.payload)
                                                           : unreachable(peer);
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
    if (wait[0] == wait[1]) ++wait[static_cast<size_t>(slot)];  // the MAC ends one frame at a time
    building = false;
    slot = 1 - slot;
    ++number;
  }
  void check() {
    for (const Scoreboard* board : {&bytes, &other, &lengths, &writes, &requests, &ready, &pulses, &times}) {
      INFO(board->report());
      CHECK(board->ok());
    }
    CHECK(static_cast<uint64_t>(number) == results[0] + results[1] + results[2] + results[3]);
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
    if (size < 80 || size % 25 == 0) {
      bench->start(MessageKind::kClosed, bench->noise(size), size >> 2 & 1);
      ++packets;
    }
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
    const auto kind = static_cast<MessageKind>(bench->below(4));
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
    for (const auto kind : {MessageKind::kUdp, MessageKind::kIcmp, MessageKind::kClosed}) {
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
      bench->start(MessageKind::kClosed, Bytes(size, fill), 0);
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
    const auto kind = static_cast<MessageKind>(bench->below(4));
    bench->start(kind, kind == MessageKind::kArp ? Bytes{} : bench->noise(1 + bench->below(120)),
                 static_cast<int>(bench->below(2)));
  }
  bench->finish();
  bench->check();
  for (const uint64_t n : bench->results) CHECK(n > 200);
}

TEMPLATE_TEST_CASE("packet_tx: reset in the middle of anything leaves nothing", "", Vpacket_tx_a, Vpacket_tx_b) {
  auto bench = std::make_unique<Bench<TestType>>();
  for (int i = 0; i < 100; ++i) {
    const auto kind = static_cast<MessageKind>(i % 4);
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

TEMPLATE_TEST_CASE("packet_tx: abort at any time, the frame is forgotten, what waits for the MAC is not", "",
                   Vpacket_tx_a, Vpacket_tx_b) {
  auto bench = std::make_unique<Bench<TestType>>();
  bench->max_wait = 600;
  int aborted = 0;
  for (int i = 0; i < 600; ++i) {
    const auto kind = static_cast<MessageKind>(i % 4);
    bench->gaps = i % 3 ? 0 : 0.6;
    bench->start(MessageKind::kUdp, bench->noise(5), 0);
    bench->start(kind, kind == MessageKind::kArp ? Bytes{} : bench->noise(1 + bench->below(60)), 1);
    bench->sim.run(bench->below(240));
    // The clock in which the frame is complete belongs to it.
    if (!bench->building) continue;
    const uint64_t left =
        (kind == MessageKind::kIcmp || kind == MessageKind::kClosed ? kHeaderClocksIcmp : kHeaderClocks);
    if (bench->next == bench->work.payload.size() && bench->sim.cycle() - bench->last_taken + 2 >= left) continue;
    bench->dut.s_abort = 1;
    bench->sim.tick();
    bench->dut.s_abort = 0;
    bench->building = bench->offering = false;
    bench->aborted = true;
    ++aborted;
    bench->start(kind, kind == MessageKind::kArp ? Bytes{} : bench->noise(1 + bench->below(60)), 1);
    bench->aborted = false;
  }
  bench->finish();
  bench->check();
  CHECK(aborted > 300);
}

namespace {

const std::vector<UpsetSite> kSites = {
#include "packet_tx_upset.inc"
};

// A responder with a watchdog in front of the entity, mac_tx behind it.
struct Chain : Agent {
  static constexpr int kWatchdog = 3000;

  Sim<Vpacket_tx_upset> sim{2000000000, test_seed()};
  Vpacket_tx_upset& dut = sim.dut();
  std::mt19937 random{test_seed() + 31};
  net::Address own{{2, 0, 0x50, 0x53, 0x57, 1}, 0x0a050002, 20563}, peer{{2, 0, 0, 0, 0, 9}, 0x0a050001, 4000};
  struct Packet {
    MessageKind kind;
    Bytes payload;
  };
  std::vector<Packet> queue;
  std::vector<Bytes> sent;  // what the MAC found in the slots
  bool started = false;     // queue.front() is in work
  size_t next = 0;
  int stuck = 0;
  bool abort_next = false;
  uint64_t aborts = 0, recovered = 0, events = 0;
  bool mac_works = true;

  Chain() {
    dut.own_mac = 0x020050535701;
    dut.own_ip = own.ip;
    dut.f_done = dut.f_result_0 = dut.f_result_1 = 0;
    dut.s_abort = dut.tx_rst = dut.s_start = dut.p_valid = dut.peer_we = dut.s_bank = 0;
    dut.flip_site = 0;
    dut.flip_mask = 0;
    sim.reset();
    const Bytes b = golden::peer_bytes(peer);
    for (size_t i = 0; i < 2 * b.size(); ++i) {
      dut.peer_we = 1;
      dut.peer_bank = i >= b.size();
      dut.peer_index = static_cast<uint8_t>(i % b.size());
      dut.peer_data = b[i % b.size()];
      sim.tick();
    }
    dut.peer_we = 0;
    sim.add(*this);
  }
  void send(MessageKind kind, size_t size) {
    Bytes payload(kind == MessageKind::kArp ? 0 : size);
    for (auto& b : payload) b = static_cast<uint8_t>(random());
    queue.push_back({kind, payload});
  }
  bool quiet() const { return queue.empty() && dut.f_request == dut.f_done && wait_ < 0; }

  void drive() override {
    dut.s_start = 0;
    dut.s_abort = abort_next;
    if (abort_next) {  // the message is given up
      abort_next = started = false;
      stuck = 0;
      ++aborts;
      if (!queue.empty()) queue.erase(queue.begin());
    }
    dut.eval();
    if (!queue.empty() && !started && dut.s_ready && !dut.s_abort) {
      dut.s_start = 1;
      dut.s_kind = static_cast<uint8_t>(queue.front().kind);
      started = true;
      next = 0;
    } else if (started && next == queue.front().payload.size()) {
      queue.erase(queue.begin());
      started = false;
    }
    dut.p_valid = started && !dut.s_start && next < queue.front().payload.size();
    if (dut.p_valid) {
      dut.p_data = queue.front().payload[next];
      dut.p_last = next + 1 == queue.front().payload.size();
    }
    // mac_tx: one slot after the other, and the other one if only that waits.
    if (!mac_works) return;
    const unsigned waits = dut.f_request ^ dut.f_done;
    if (wait_ < 0 && waits != 0) {
      if (waits == (slot_ ? 1u : 2u)) slot_ = 1 - slot_;
      wait_ = 200;
    } else if (wait_ > 0 && --wait_ == 0) {
      wait_ = -1;
      const size_t length = slot_ ? dut.f_length_1 : dut.f_length_0;
      const auto begin = ram_.begin() + slot_ * 2048;
      sent.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(length));
      const unsigned bit = 1u << slot_;
      dut.f_done = static_cast<CData>((dut.f_done & ~bit) | (dut.f_request & bit));
      slot_ = 1 - slot_;
    }
  }
  void sample() override {
    if (dut.ram_we) ram_[dut.ram_waddr] = dut.ram_wdata;
    const bool moved = dut.s_start || (dut.p_valid && dut.p_ready);
    if (dut.p_valid && dut.p_ready) ++next;
    stuck = moved || queue.empty() ? 0 : stuck + 1;
    if (stuck > kWatchdog) abort_next = true;
    recovered += dut.ev_recovered;
    events += dut.ev_sent + dut.ev_excessive + dut.ev_late + dut.ev_deferred;
  }
  void forget() {  // what a reset of clk does to the rest
    queue.clear();
    started = false;
    wait_ = -1;
    slot_ = 0;
  }

 private:
  std::array<uint8_t, 4096> ram_{};
  int wait_ = -1, slot_ = 0;
};

}  // namespace

TEST_CASE(
    "packet_tx: while mac_tx is in reset no slot is free, and what that forgets does not look like a sent frame") {
  Chain chain;
  for (int frames = 0; frames < 5; ++frames) {
    for (const int late : {0, 1, 2, 50}) {  // clocks from the end of the reset of clk to the first tick of tx_clk
      for (const bool waits : {false, true}) {
        for (int i = 0; i < frames; ++i) chain.send(MessageKind::kUdp, 9);
        chain.sim.run_until([&] { return chain.quiet(); });
        chain.mac_works = !waits;
        if (waits) {
          chain.send(MessageKind::kUdp, 9);
          chain.sim.run(400);
        }
        // The reset of clk makes that of tx_clk, which ends later. f_done is what it was until tx_clk ticks.
        chain.mac_works = false;
        chain.forget();
        chain.dut.tx_rst = 1;
        chain.sim.reset(16);
        chain.events = 0;
        chain.send(MessageKind::kArp, 0);  // it waits
        int early = 0, requests = 0;
        for (int i = 0; i < late + 6; ++i) {
          if (i == late) chain.dut.f_done = 0;
          if (i == late + 4) chain.dut.tx_rst = 0;
          chain.sim.tick();
          early += chain.started;
          requests += chain.dut.f_request != 0;
        }
        CHECK(early == 0);
        CHECK(requests == 0);
        CHECK(chain.events == 0);
        chain.mac_works = true;
        chain.sent.clear();
        chain.send(MessageKind::kUdp, 7);
        const Bytes payload = chain.queue.back().payload;
        chain.sim.run_until([&] { return chain.quiet(); });
        chain.sim.run(5);
        CHECK(chain.events == 2);
        REQUIRE(chain.sent.size() == 2);
        CHECK(chain.sent[0] == golden::transmit(MessageKind::kArp, chain.own, chain.peer, {}));
        CHECK(chain.sent[1] == golden::transmit(MessageKind::kUdp, chain.own, chain.peer, payload));
      }
    }
  }
  CHECK(chain.aborts == 0);
}

TEST_CASE("packet_tx: after an upset of any register, and a watchdog's abort at worst, what follows is right") {
  Chain chain;
  uint64_t upsets = 0, harmed = 0;
  for (size_t site = 0; site < kSites.size(); ++site) {
    const std::string name = kSites[site].name;
    for (int bit = 0; bit < kSites[site].bits; ++bit) {
      for (int round = 0; round < (kSites[site].bits == 1 ? 40 : 6); ++round) {
        INFO(name << ", bit " << bit << ", round " << round);
        const auto play = [&](int frames, int flip_after) {
          std::vector<Bytes> want;
          for (int i = 0; i < frames; ++i) {
            chain.send(static_cast<MessageKind>(chain.random() % 4), 1 + chain.random() % 40);
            want.push_back(
                golden::transmit(chain.queue.back().kind, chain.own, chain.peer, chain.queue.back().payload));
          }
          chain.sent.clear();
          int quiet = 0, clocks = 0;
          for (; quiet < 300 && clocks < 60000; ++clocks) {
            chain.dut.flip_site = static_cast<uint16_t>(clocks == flip_after ? site + 1 : 0);
            chain.dut.flip_mask = clocks == flip_after ? uint64_t{1} << bit : 0;
            chain.sim.tick();
            quiet = chain.quiet() ? quiet + 1 : 0;
          }
          chain.dut.flip_site = 0;
          return quiet == 300 && chain.sent == want;
        };
        harmed += !play(round % 4 == 3 ? 0 : 3, static_cast<int>(chain.random() % (round % 4 == 3 ? 20 : 700)));
        // A step that began by itself ends by the watchdog: with the next message, if none came since.
        const uint64_t before = chain.aborts;
        play(1, -1);
        CHECK(chain.aborts - before <= 1);
        REQUIRE(play(4, -1));
        ++upsets;
      }
    }
  }
  INFO(upsets << " upsets, " << harmed << " harmed a frame, " << chain.recovered << " recovered, " << chain.aborts
              << " aborts");
  CHECK(upsets > 1000);
  CHECK(harmed > 100);
  CHECK(chain.recovered > 10);
  CHECK(chain.aborts > 0);
}
