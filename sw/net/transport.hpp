// SPDX-License-Identifier: Apache-2.0
// Transport: a connection to one UDP port, with a clock. Behind it is a socket and the machine's clock
// (udp_transport.hpp), or a simulated chip and simulated time (tests), so the same client runs on both.
#pragma once
#include <optional>
#include <string>

#include "contract/protocol.hpp"

namespace psweep::net {

constexpr size_t kIpUdpHeaders = 28;  // of a packet, in front of its payload

// The largest payload that goes out in one packet, and what sets it: "interface eth0 has an MTU of 1400".
struct Largest {
  size_t payload = 0;
  std::string why;
};

class Transport {
 public:
  virtual ~Transport() = default;
  // One packet; may be lost without notice.
  virtual void send(const Bytes& udp_payload) = 0;
  // The next packet, or nothing after this many seconds (0: only what is there already).
  virtual std::optional<Bytes> receive(double timeout_s) = 0;
  // Seconds since some moment, never backwards.
  virtual double now() = 0;
  // For messages: "192.168.1.80:20563".
  virtual std::string peer() const = 0;
  // Nothing: no limit that matters is known.
  virtual std::optional<Largest> largest() const { return std::nullopt; }
  // What the system last said about lost packets ("connection refused"), or empty.
  virtual std::string complaint() const { return {}; }
};

}  // namespace psweep::net
