// SPDX-License-Identifier: Apache-2.0
// The model of the chip (golden/arbiter.hpp) behind a real UDP socket of 127.0.0.1, in real time, in a thread of this
// process: what the command line is tested against.
#pragma once
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "golden/arbiter.hpp"

namespace psweep {

class UdpChip {
 public:
  explicit UdpChip(const net::ArbiterConfig& config) : chip_(config) {
    chip_.set_compute([this](const golden::TileJob& job, const std::vector<golden::PlaneEntry>& table,
                             const golden::Pixels& left, const golden::Pixels& right) {
      auto result = golden::run_tile(chip_.config().engine, job, table, left, right);
      if (fail_tiles > 0) {
        --fail_tiles;
        result.window_errors = 1;
      }
      return result;
    });
    socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    if (socket_ < 0 || ::bind(socket_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
        ::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
      throw std::runtime_error("no UDP socket on 127.0.0.1");
    }
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { serve(); });
  }
  ~UdpChip() { stop(); }
  UdpChip(const UdpChip&) = delete;
  UdpChip& operator=(const UdpChip&) = delete;

  std::atomic<int> drop_every{0};          // 0: nothing is lost; n: every n-th packet, both ways
  std::atomic<int> fail_tiles{0};          // so many tiles from now on have samples outside their window
  std::atomic<bool> deaf_to_close{false};  // from the first CLOSE on nothing arrives
  std::atomic<double> sweep_seconds{-1};   // of a tile; negative: as the engine's clocks

  int port() const { return port_; }
  std::string url() const { return "udp://127.0.0.1:" + std::to_string(port_); }
  void stop() {
    if (!thread_.joinable()) return;
    over_ = true;
    thread_.join();
    ::close(socket_);
  }

 private:
  bool dropped() { return drop_every > 0 && ++packets_ % drop_every == 0; }
  void send(const net::Bytes& m, const sockaddr_in& to) {
    if (dropped()) return;
    // A full socket buffer is a lost packet.
    [[maybe_unused]] const ssize_t sent =
        ::sendto(socket_, m.data(), m.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
  void serve() {
    const auto start = std::chrono::steady_clock::now();
    std::vector<sockaddr_in> peers;  // their places are their numbers
    double next_map = 0;
    while (!over_) {
      pollfd waiting{socket_, POLLIN, 0};
      ::poll(&waiting, 1, 1);
      net::Bytes m(2048);
      sockaddr_in from{};
      socklen_t size = sizeof from;
      const ssize_t got =
          ::recvfrom(socket_, m.data(), m.size(), MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&from), &size);
      const double now = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      chip_.set_sweep_time(sweep_seconds);
      chip_.step(now);
      if (got > 3 && deaf_to_close && m[3] == net::kClose) dead_ = true;
      if (got >= 0 && !dead_ && !dropped()) {
        m.resize(static_cast<size_t>(got));
        uint32_t peer = 0;
        while (peer < peers.size() &&
               (peers[peer].sin_port != from.sin_port || peers[peer].sin_addr.s_addr != from.sin_addr.s_addr)) {
          ++peer;
        }
        if (peer == peers.size()) peers.push_back(from);
        for (const auto& reply : chip_.message(m, peer)) send(reply, from);
      }
      // About 100 Mbit/s.
      for (int i = 0; i < 16 && now >= next_map; ++i) {
        const auto packet = chip_.map_packet();
        if (!packet) break;
        next_map = std::max(next_map, now - 1e-3) + 80e-9 * static_cast<double>(packet->size() + 66);
        send(*packet, peers.at(chip_.map_peer()));
      }
    }
  }

  golden::Arbiter chip_;
  int socket_ = -1, port_ = 0;
  std::atomic<bool> over_{false};
  int packets_ = 0;
  bool dead_ = false;
  std::thread thread_;
};

}  // namespace psweep
