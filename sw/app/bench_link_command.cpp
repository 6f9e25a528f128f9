// SPDX-License-Identifier: Apache-2.0
// psweep bench-link: goodput up (rows), down (map), both at once, and the time of a question and its answer
// (net/link_bench.hpp).
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/options.hpp"
#include "net/link_bench.hpp"
#include "net/udp_transport.hpp"

namespace psweep {

using nlohmann::ordered_json;

void bench_link_command(const BenchLinkOptions& o) {
  const auto transport = net::connect_udp(net::parse_endpoint("CHIP", o.target));
  net::Client client(*transport, o.link_timeout, net::fresh_seed());
  ordered_json j;
  try {
    const net::Capabilities chip = client.info();
    net::LinkBench bench(client, chip);
    const auto up = bench.measure(true, false, o.seconds), down = bench.measure(false, true, o.seconds),
               both = bench.measure(true, true, o.seconds);
    const auto latency = bench.latencies(o.seconds);
    auto at = [&](double share) {
      return 1e6 * latency[static_cast<size_t>(share * static_cast<double>(latency.size() - 1))];
    };
    j = {{"chip", transport->peer()},
         {"seconds_each", o.seconds},
         {"up_Mbit_per_s", up.up},
         {"down_Mbit_per_s", down.down},
         {"both_up_Mbit_per_s", both.up},
         {"both_down_Mbit_per_s", both.down},
         {"chunks_lost_up", up.chunks_sent - up.chunks_up + both.chunks_sent - both.chunks_up},
         {"latency_us",
          {{"questions", latency.size()},
           {"min", at(0)},
           {"median", at(0.5)},
           {"p90", at(0.9)},
           {"p99", at(0.99)},
           {"max", at(1)}}}};
  } catch (...) {
    client.close();
    throw;
  }
  client.close();
  if (o.json) {
    std::printf("%s\n", j.dump(2).c_str());
    return;
  }
  const auto& l = j["latency_us"];
  auto number = [](const ordered_json& v) { return v.get<double>(); };
  std::printf("link to %s, %g s each\n", transport->peer().c_str(), o.seconds);
  std::printf("  up alone      %8.2f Mbit/s\n", number(j["up_Mbit_per_s"]));
  std::printf("  down alone    %8.2f Mbit/s\n", number(j["down_Mbit_per_s"]));
  std::printf("  both at once  %8.2f Mbit/s up, %.2f Mbit/s down\n", number(j["both_up_Mbit_per_s"]),
              number(j["both_down_Mbit_per_s"]));
  std::printf("  chunks of rows lost on their way  %llu\n", j["chunks_lost_up"].get<unsigned long long>());
  std::printf("  latency, us   min %.0f, median %.0f, 90 %% %.0f, 99 %% %.0f, max %.0f of %zu\n", number(l["min"]),
              number(l["median"]), number(l["p90"]), number(l["p99"]), number(l["max"]), l["questions"].get<size_t>());
}

}  // namespace psweep
