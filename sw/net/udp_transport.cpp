// SPDX-License-Identifier: Apache-2.0
#include "net/udp_transport.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>

#include "core/error.hpp"

namespace psweep::net {
namespace {

// A map of the largest tiles, so that nothing is lost while this process does not run.
constexpr int kReceiveBuffer = 4 << 20;

class UdpTransport : public Transport {
 public:
  explicit UdpTransport(const Endpoint& e) : start_(std::chrono::steady_clock::now()) {
    addrinfo hints{};
    hints.ai_family = AF_INET;
    hints.ai_socktype = SOCK_DGRAM;
    addrinfo* found = nullptr;
    const int problem = getaddrinfo(e.host.c_str(), std::to_string(e.port).c_str(), &hints, &found);
    if (problem != 0) throw InputError("udp://" + e.host + ": " + gai_strerror(problem));
    socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    int result = -1;
    if (socket_ >= 0) result = ::connect(socket_, found->ai_addr, found->ai_addrlen);
    const int code = errno;
    char text[INET_ADDRSTRLEN] = "";
    sockaddr_in address{};
    std::memcpy(&address, found->ai_addr, sizeof address);
    inet_ntop(AF_INET, &address.sin_addr, text, sizeof text);
    freeaddrinfo(found);
    peer_ = (e.host == text ? e.host : e.host + " (" + text + ")") + ":" + std::to_string(e.port);
    if (result != 0) {
      if (socket_ >= 0) ::close(socket_);
      throw InputError("udp://" + peer_ + ": " + std::strerror(code));
    }
    // As much as the system allows; a smaller one costs repetitions, nothing else.
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &kReceiveBuffer, sizeof kReceiveBuffer);
    // The chip takes no fragments: a packet that does not fit is to be refused here, or on its way, and told.
    const int never_fragment = IP_PMTUDISC_DO;
    setsockopt(socket_, IPPROTO_IP, IP_MTU_DISCOVER, &never_fragment, sizeof never_fragment);
    find_largest();
  }
  ~UdpTransport() override { ::close(socket_); }
  UdpTransport(const UdpTransport&) = delete;
  UdpTransport& operator=(const UdpTransport&) = delete;

  void send(const Bytes& m) override {
    // A full queue or a missing route is a lost packet: the client repeats it.
    if (::send(socket_, m.data(), m.size(), 0) < 0) complain(errno);
  }
  std::optional<Bytes> receive(double timeout_s) override {
    const double until = now() + timeout_s;
    for (;;) {
      Bytes m(2048);
      const ssize_t got = ::recv(socket_, m.data(), m.size(), MSG_DONTWAIT);
      if (got >= 0) {
        complaint_.clear();
        m.resize(static_cast<size_t>(got));
        return m;
      }
      if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) complain(errno);
      const double left = until - now();
      if (left <= 0) return std::nullopt;
      pollfd waiting{socket_, POLLIN, 0};
      ::poll(&waiting, 1, static_cast<int>(std::ceil(std::min(left, 1.0) * 1e3)));
    }
  }
  double now() override { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  std::string peer() const override { return peer_; }
  std::string complaint() const override { return complaint_; }
  std::optional<Largest> largest() const override { return largest_; }

 private:
  void complain(int code) {
    complaint_ = std::strerror(code);
    if (code == EMSGSIZE) find_largest();
  }
  // MTU of the path as far as the kernel knows it; at first that of the interface.
  void find_largest() {
    int path = 0;
    socklen_t size = sizeof path;
    if (::getsockopt(socket_, IPPROTO_IP, IP_MTU, &path, &size) != 0 || path < static_cast<int>(kIpUdpHeaders)) return;
    Largest l;
    l.payload = static_cast<size_t>(path) - kIpUdpHeaders;
    const std::string name = interface();
    ifreq request{};
    name.copy(request.ifr_name, sizeof request.ifr_name - 1);
    const bool of_interface = !name.empty() && ::ioctl(socket_, SIOCGIFMTU, &request) == 0 && request.ifr_mtu <= path;
    l.why = of_interface ? "interface " + name + " has an MTU of " + std::to_string(path)
                         : "the way to the chip has an MTU of " + std::to_string(path);
    largest_ = l;
  }
  // The one that has this socket's address, or nothing.
  std::string interface() const {
    sockaddr_in own{};
    socklen_t size = sizeof own;
    ifaddrs* all = nullptr;
    if (::getsockname(socket_, reinterpret_cast<sockaddr*>(&own), &size) != 0 || ::getifaddrs(&all) != 0) return {};
    std::string name;
    for (const ifaddrs* i = all; i != nullptr && name.empty(); i = i->ifa_next) {
      if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_INET) continue;
      sockaddr_in address{};
      std::memcpy(&address, i->ifa_addr, sizeof address);
      if (address.sin_addr.s_addr == own.sin_addr.s_addr) name = i->ifa_name;
    }
    ::freeifaddrs(all);
    return name;
  }

  int socket_ = -1;
  std::string peer_, complaint_;
  std::optional<Largest> largest_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace

Endpoint parse_endpoint(const std::string& option, const std::string& text) {
  const auto wrong = [&] { return InputError(option + ": found '" + text + "', expected udp://HOST[:PORT]"); };
  const std::string scheme = "udp://";
  if (text.compare(0, scheme.size(), scheme) != 0) throw wrong();
  Endpoint e;
  e.host = text.substr(scheme.size());
  const size_t colon = e.host.find(':');
  if (colon != std::string::npos) {
    const std::string port = e.host.substr(colon + 1);
    e.host.resize(colon);
    if (port.empty() || port.size() > 5 || port.find_first_not_of("0123456789") != std::string::npos) throw wrong();
    const int number = std::stoi(port);
    if (number < 1 || number > 65535) throw wrong();
    e.port = static_cast<uint16_t>(number);
  }
  if (e.host.empty() || e.host.find_first_of("/@ ") != std::string::npos) throw wrong();
  return e;
}

std::unique_ptr<Transport> connect_udp(const Endpoint& endpoint) { return std::make_unique<UdpTransport>(endpoint); }

}  // namespace psweep::net
