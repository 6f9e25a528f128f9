// SPDX-License-Identifier: Apache-2.0
#include "desk/addresses.hpp"

#include <cstdio>

namespace psweep::chip {

net::Address strapped(net::Address address, uint8_t straps) {
  address.mac[5] ^= straps;
  address.ip ^= straps;
  return address;
}

std::string ip_text(uint32_t ip) {
  char text[16];
  std::snprintf(text, sizeof text, "%u.%u.%u.%u", ip >> 24, ip >> 16 & 255, ip >> 8 & 255, ip & 255);
  return text;
}
std::string mac_text(const net::Mac& m) {
  char text[18];
  std::snprintf(text, sizeof text, "%02x:%02x:%02x:%02x:%02x:%02x", m[0], m[1], m[2], m[3], m[4], m[5]);
  return text;
}

}  // namespace psweep::chip
