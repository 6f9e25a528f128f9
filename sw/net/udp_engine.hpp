// SPDX-License-Identifier: Apache-2.0
// UdpEngine: a chip at the end of a link as an Engine. Its plan asks the chip for its generics.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "net/client.hpp"
#include "net/link_engine.hpp"
#include "net/transport.hpp"
#include "plan/engine.hpp"

namespace psweep::net {

struct LinkRun {
  std::string peer;
  Capabilities chip;
  LinkFigures figures;
  LinkStatistics statistics;
  uint64_t clocks_expected = 0;  // planner's formula
};

class UdpEngine : public Engine {
 public:
  // url: udp://HOST[:PORT]. timeout: seconds without any answer. in_flight: tiles in work at once, 1 or 2.
  UdpEngine(const std::string& url, double timeout, int in_flight);
  SweepPlan plan(const SweepSetup& setup, std::optional<TileSize> tile) override;
  DepthResult sweep(const SweepPlan& plan, const StereoPair& input, const ProgressCall& progress) override;
  const LinkRun& figures() const { return run_; }  // of the latest sweep

 private:
  std::unique_ptr<Transport> transport_;
  Client client_;
  int in_flight_;
  LinkRun run_;
};

}  // namespace psweep::net
