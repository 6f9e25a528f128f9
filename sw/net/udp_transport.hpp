// SPDX-License-Identifier: Apache-2.0
// Transport over a connected UDP/IPv4 socket: packets of other senders do not come through, and none is fragmented.
// No privileges needed.
#pragma once
#include <memory>
#include <string>

#include "net/transport.hpp"

namespace psweep::net {

struct Endpoint {
  std::string host;
  uint16_t port = kUdpPort;
};

// "udp://HOST" or "udp://HOST:PORT". InputError, which begins with `option`, for anything else.
Endpoint parse_endpoint(const std::string& option, const std::string& text);

// InputError if the name is unknown or no socket can be had.
std::unique_ptr<Transport> connect_udp(const Endpoint& endpoint);

}  // namespace psweep::net
