// SPDX-License-Identifier: Apache-2.0
// The chips in this binary: entity psweep_top, converted and Verilated, one per tb/chip/configs/*.json (and, added by
// the user, <build>/chips/*.json). This header needs no Verilator.
#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "chip/chip_model.hpp"
#include "contract/frames.hpp"

namespace psweep::chip {

struct Chip {
  std::string name;
  std::string description;
  std::string engine;  // name of the engine's configuration
  net::ArbiterConfig config;
  net::Address address;  // with straps 0
  bool waves;
  std::unique_ptr<ChipModel> (*make)();
};

// Sorted by name.
const std::vector<Chip>& chips();
// Throws InputError, which names those there are.
const Chip& chip_named(std::string_view name);

// Straps are exclusive-ored into the last byte of MAC and IP address.
net::Address strapped(net::Address address, uint8_t straps);
// "10.5.0.2", "02:00:50:53:57:01"
std::string ip_text(uint32_t ip);
std::string mac_text(const net::Mac& mac);

}  // namespace psweep::chip
