// SPDX-License-Identifier: Apache-2.0
#include "net/udp_engine.hpp"

#include <vector>

#include "core/error.hpp"
#include "golden/control.hpp"
#include "net/udp_transport.hpp"

namespace psweep::net {
namespace {

// Formats decide every bit of the map, so they must be the same; the message names the field and both values.
void check_chip(const std::string& where, const golden::Config& chip, const SweepSetup& setup) {
  const golden::Config& f = setup.format;
  struct Field {
    const char* option;
    int chip, request;
  };
  for (const Field& x :
       {Field{"--window", chip.window, f.window}, Field{"pixel bits", chip.pix_bits, f.pix_bits},
        Field{"--weight-bits", chip.weight_bits, f.weight_bits},
        Field{"--interp-bits", chip.interp_frac, f.interp_frac}, Field{"--mncc-bits", chip.mncc_bits, f.mncc_bits},
        Field{"--frac-bits", chip.frac_bits, f.frac_bits}}) {
    if (x.chip != x.request) {
      throw InputError(std::string(x.option) + ": found " + std::to_string(x.request) + ", but the chip at " + where +
                       " has " + std::to_string(x.chip));
    }
  }
  if (setup.spacing.planes > chip.planes) {
    throw InputError("--planes: found " + std::to_string(setup.spacing.planes) + ", but the chip at " + where +
                     " has room for " + std::to_string(chip.planes));
  }
}

}  // namespace

UdpEngine::UdpEngine(const std::string& url, double timeout, int in_flight)
    : transport_(connect_udp(parse_endpoint("--engine", url))),
      client_(*transport_, timeout, fresh_seed()),
      in_flight_(in_flight) {}

SweepPlan UdpEngine::plan(const SweepSetup& setup, std::optional<TileSize> tile) {
  run_ = {};
  run_.peer = transport_->peer();
  run_.chip = client_.info();
  check_chip(client_.where(), run_.chip.config.engine, setup);
  SweepPlan out{setup, {}};
  out.setup.format = run_.chip.config.engine;
  const TileSize size = tile ? *tile : largest_tile(out.setup);
  out.tiles = plan_tiles(out.setup, size.cols, size.rows);
  return out;
}

DepthResult UdpEngine::sweep(const SweepPlan& plan, const StereoPair& input, const ProgressCall& progress) {
  const std::vector<PlacedTile>& tiles = plan.tiles.tiles;
  uint64_t all = 0;
  for (const auto& t : tiles) all += golden::unload_clocks(t.job);
  std::vector<std::vector<golden::MapCell>> cells(tiles.size());
  LinkOptions options;
  options.in_flight = in_flight_;
  run_.figures = run_link_tiles(
      client_, run_.chip, plan.tiles.table, static_cast<int>(tiles.size()), options,
      [&](int i) { return tile_input(tiles[static_cast<size_t>(i)], input); },
      [&](int i, std::vector<golden::MapCell> out) { cells[static_cast<size_t>(i)] = std::move(out); },
      [&](uint64_t done) { progress(done, all); });
  run_.clocks_expected = 0;
  for (const auto& t : tiles)
    run_.clocks_expected += golden::engine_clocks(plan.setup.format, t.job) + kFirstPairClocks;
  run_.statistics = client_.statistics();
  return to_result(plan.setup, assemble(plan.setup.rig, plan.tiles, cells));
}

}  // namespace psweep::net
