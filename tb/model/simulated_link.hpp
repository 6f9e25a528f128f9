// SPDX-License-Identifier: Apache-2.0
// Transport to a model of the chip (golden/arbiter.hpp) over a simulated wire, in simulated time: 100 Mbit/s each way,
// latency, and faults: packets lost, doubled, held back, corrupted on the wire (and then dropped for their FCS, as the
// MAC and the host's network card do), a pulled cable, a chip that is reset. Everything seeded and repeatable.
#pragma once
#include <algorithm>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "contract/frames.hpp"
#include "golden/arbiter.hpp"
#include "net/transport.hpp"

namespace psweep {

struct LinkFaults {  // shares of the packets, each way
  double loss = 0, duplication = 0, reordering = 0, delay = 0, corruption = 0;
};

class SimulatedLink : public net::Transport {
 public:
  SimulatedLink(golden::Arbiter& chip, const LinkFaults& faults, uint32_t seed)
      : chip_(chip), faults_(faults), random_(seed) {}

  double byte_time = 80e-9, latency = 50e-6;
  std::vector<std::pair<double, double>> unplugged;  // from, to: what is sent or arrives then is lost
  std::vector<double> resets;                        // of the chip, ascending
  // What happens to a packet towards the host besides the faults; may add packets, which arrive at the same time.
  std::function<void(double now, std::vector<net::Bytes>&)> meddle;
  uint64_t sent = 0, dropped = 0, corrupted = 0;
  uint32_t host = 1;

  void send(const net::Bytes& m) override { transmit(m, up_free_, to_chip_); }

  std::optional<net::Bytes> receive(double timeout_s) override {
    const double until = now_ + timeout_s;
    for (;;) {
      work();
      const auto first = to_host_.begin();
      if (first != to_host_.end() && first->first <= now_) {
        net::Bytes m = std::move(first->second);
        to_host_.erase(first);
        return m;
      }
      if (now_ >= until) return std::nullopt;
      // The chip is looked at every 20 us for maps that have become ready.
      double next = std::min(until, now_ + 20e-6);
      for (const auto* queue : {&to_chip_, &to_host_})
        if (!queue->empty()) next = std::min(next, std::max(now_, queue->begin()->first));
      now_ = next;
    }
  }
  double now() override { return now_; }
  std::string peer() const override { return "simulated:20563"; }

  // A packet of another host, and what the chip answers.
  std::vector<net::Bytes> foreign(const net::Bytes& m) {
    chip_.step(now_);
    return chip_.message(m, 2);
  }
  void pass(double seconds) {  // the host is busy with something else
    const double until = now_ + seconds;
    while (now_ < until) {
      now_ = std::min(until, now_ + 20e-6);
      work();
    }
  }

 private:
  using Queue = std::multimap<double, net::Bytes>;

  bool chance(double p) { return std::uniform_real_distribution<double>(0, 1)(random_) < p; }
  bool plugged(double t) const {
    return std::none_of(unplugged.begin(), unplugged.end(),
                        [t](const auto& u) { return t >= u.first && t < u.second; });
  }

  void transmit(const net::Bytes& m, double& line_free, Queue& queue) {
    ++sent;
    const double start = std::max(now_, line_free);
    const auto frame = static_cast<double>(std::max<size_t>(m.size() + 42, 60) + 4 + 8 + 12);  // FCS, preamble, gap
    line_free = start + frame * byte_time;
    const int copies = chance(faults_.duplication) ? 2 : 1;
    for (int i = 0; i < copies; ++i) {
      double arrival = line_free + latency;
      if (chance(faults_.reordering))
        arrival += 5 * frame * byte_time * std::uniform_real_distribution<>(0, 1)(random_);
      if (chance(faults_.delay)) arrival += std::uniform_real_distribution<>(0, 0.05)(random_);
      if (chance(faults_.loss) || !plugged(start) || !plugged(arrival)) {
        ++dropped;
        continue;
      }
      net::Bytes content = m;
      if (chance(faults_.corruption) && !survives(content)) {
        ++corrupted;
        continue;
      }
      queue.emplace(arrival, std::move(content));
    }
  }

  // The payload after a few bits on the wire were turned; false if the receiver drops the frame.
  bool survives(net::Bytes& m) {
    net::Address a, b;
    a.mac = {2, 0, 0, 0, 0, 1}, a.ip = 0xc0a80101, a.port = 40000;
    b.mac = {2, 0, 0, 0, 0, 2}, b.ip = 0xc0a80150, b.port = net::kUdpPort;
    net::Bytes frame = net::make_udp(a, b, m);
    net::append_fcs(frame);
    const int flips = 1 + static_cast<int>(random_() % 8);
    for (int i = 0; i < flips; ++i) frame[random_() % frame.size()] ^= static_cast<uint8_t>(1 << random_() % 8);
    if (!net::fcs_good(frame)) return false;
    const auto packet = net::parse_udp(frame);
    if (!packet) return false;
    m = packet->payload;
    return true;
  }

  void work() {
    while (!resets.empty() && resets.front() <= now_) {
      chip_.step(resets.front());
      chip_.power_on();
      resets.erase(resets.begin());
    }
    while (!to_chip_.empty() && to_chip_.begin()->first <= now_) {
      const auto first = to_chip_.begin();
      chip_.step(std::max(first->first, stepped_));
      stepped_ = std::max(first->first, stepped_);
      for (const auto& reply : chip_.message(first->second, host)) transmit(reply, down_free_, to_host_);
      to_chip_.erase(first);
    }
    chip_.step(now_);
    stepped_ = now_;
    while (down_free_ <= now_) {
      const auto packet = chip_.map_packet();
      if (!packet) break;
      if (chip_.map_peer() == host) transmit(*packet, down_free_, to_host_);
    }
    if (meddle) {
      std::vector<net::Bytes> extra;
      meddle(now_, extra);
      for (auto& m : extra) to_host_.emplace(now_, std::move(m));
    }
  }

  golden::Arbiter& chip_;
  LinkFaults faults_;
  std::mt19937 random_;
  double now_ = 0, stepped_ = 0, up_free_ = 0, down_free_ = 0;
  Queue to_chip_, to_host_;
};

}  // namespace psweep
