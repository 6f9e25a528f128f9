// SPDX-License-Identifier: Apache-2.0
// psweep info: what a chip on the network can do, what it does, and its counters. Opens no session, disturbs nobody.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/options.hpp"
#include "net/client.hpp"
#include "net/udp_transport.hpp"

namespace psweep {
namespace {

using nlohmann::ordered_json;

std::string mac_text(uint64_t mac) {
  char text[24];
  std::snprintf(text, sizeof text, "%02x:%02x:%02x:%02x:%02x:%02x", static_cast<unsigned>(mac >> 40 & 0xff),
                static_cast<unsigned>(mac >> 32 & 0xff), static_cast<unsigned>(mac >> 24 & 0xff),
                static_cast<unsigned>(mac >> 16 & 0xff), static_cast<unsigned>(mac >> 8 & 0xff),
                static_cast<unsigned>(mac & 0xff));
  return text;
}

void print_table(const char* title, const ordered_json& values) {
  std::printf("%s\n", title);
  for (const auto& [name, value] : values.items()) {
    std::printf("  %-22s %s\n", name.c_str(),
                value.is_string() ? value.get<std::string>().c_str() : value.dump().c_str());
  }
}

}  // namespace

void info_command(const InfoOptions& o) {
  const auto transport = net::connect_udp(net::parse_endpoint("CHIP", o.target));
  net::Client client(*transport, o.link_timeout, net::fresh_seed());
  const net::Capabilities chip = client.info();
  const net::ArbiterConfig& c = chip.config;
  const golden::Config& e = c.engine;
  const auto words = client.counters();
  // Refused, since it is not our session; how says whether there is one. More the chip tells its own host only.
  const bool session = client.request(net::kStatus).code != net::kNoSession;

  ordered_json j;
  j["chip"] = transport->peer();
  ordered_json& capabilities = j["capabilities"];
  capabilities["mac"] = mac_text(chip.mac);
  for (const auto& field : kEngineFields)
    if (field.info != 0) capabilities[field.key] = e.*field.value;
  for (const auto& field : kChipFields)
    if (field.info != 0) capabilities[field.key] = c.*field.value;
  // What follows from them.
  capabilities["chunk_pairs"] = c.chunk_pairs();
  capabilities["cell_bits"] = c.cell_bits();
  capabilities["cell_bytes"] = c.cell_bytes();
  capabilities["chunk_cells"] = c.chunk_cells();
  j["state"] = {{"session", session}};
  ordered_json& counters = j["counters"];
  for (int i = 0; i < net::kCounterWords; ++i) {
    counters[net::kCounterNames[i]] = words[i];
  }
  if (o.json) {
    std::printf("%s\n", j.dump(2).c_str());
    return;
  }
  std::printf("chip at %s\n", transport->peer().c_str());
  print_table("capabilities", j["capabilities"]);
  print_table("state", j["state"]);
  print_table("counters", counters);
}

}  // namespace psweep
