// SPDX-License-Identifier: Apache-2.0
// Tap: a Linux TAP device (IFF_TAP | IFF_NO_PI): the kernel sees a network card, this side sees its frames, without
// FCS. Non-blocking. Errors of opening: InputError, which says what right or device is missing.
#pragma once
#include <optional>
#include <string>

#include "contract/frames.hpp"

namespace psweep::chip {

class Tap {
 public:
  explicit Tap(const std::string& device);
  ~Tap();
  Tap(const Tap&) = delete;
  Tap& operator=(const Tap&) = delete;

  int fd() const { return fd_; }
  std::optional<net::Bytes> read();
  // False if the kernel does not take it, for example because the device is down.
  bool write(const net::Bytes& frame);

 private:
  int fd_ = -1;
};

}  // namespace psweep::chip
