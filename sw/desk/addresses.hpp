// SPDX-License-Identifier: Apache-2.0
// Addresses of a chip: what the straps make of them, and as text.
#pragma once
#include <cstdint>
#include <string>

#include "contract/frames.hpp"

namespace psweep::chip {

// Straps are exclusive-ored into the last byte of MAC and IP address.
net::Address strapped(net::Address address, uint8_t straps);
// "10.5.0.2", "02:00:50:53:57:01"
std::string ip_text(uint32_t ip);
std::string mac_text(const net::Mac& mac);

}  // namespace psweep::chip
