// SPDX-License-Identifier: Apache-2.0
// link_speed: the link's goodput, how busy it keeps the engine, and how long a whole pair takes, in simulated time
// (make link-speed). The chip 'tile' (256 x 130 cells, double buffers) sweeps the first tiles of the paper's pair, 1120
// x 1120 pixels and 301 planes, sent by the host library over the in-process link at 100 Mbit/s in full duplex.
//   busy       the tiles' clocks without any stall (golden/control.hpp), over those from the first launch to the last
//              map beat. What is left: waiting for rows, for the map buffer, and for the scheduler
//   whole pair begin and end as measured; the tiles in between by their own clocks and the stalls measured per tile
//   goodput    as psweep bench-link measures it, and counted at the chip's pins; 5 % apart at most
// Usage: link_speed [tiles] [in flight]; default 3 tiles, and 1 and 2 in flight. Exit code 1 if a tile differs from the
// model, the link broke, or bench-link is wrong.
#include <chrono>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>

#include "chip/goodput.hpp"
#include "chip/watched.hpp"
#include "fast/fast.hpp"
#include "golden/control.hpp"
#include "golden/psweep.hpp"
#include "net/link_engine.hpp"
#include "plan/planner.hpp"
#include "scene/scene.hpp"
#include "verilated/chips.hpp"

namespace psweep::chip {
namespace {

const net::Address kHost{{0x02, 0x00, 0x00, 0x00, 0x00, 0x01}, 0x0a050001, 40000};
constexpr int kSize = 1120, kPlanes = 301;

double ms(Time t) { return 1e-12 * static_cast<double>(t); }

bool link_goodput() {
  constexpr double kSeconds = 0.02;  // each
  const Chip& chip = chip_named("tile");
  Desk desk(chip.make(), {});
  Station station(desk, kHost, chip.address.ip, chip.address.port);
  ChipTransport transport(station, chip.address);
  net::Client client(transport, 5.0, 1);
  net::LinkBench bench(client, client.info());
  bool good = true;
  struct {
    const char* name;
    bool up, down;
  } const kinds[] = {{"up alone", true, false}, {"down alone", false, true}, {"both at once", true, true}};
  for (const auto& k : kinds) {
    const Goodput g = goodput(desk, chip.address.port, bench, k.up, k.down, kSeconds);
    std::printf("goodput, %-12s  up %6.2f Mbit/s, at the pins %6.2f; down %6.2f, at the pins %6.2f\n", k.name,
                g.bench.up, g.wire_up, g.bench.down, g.wire_down);
    good = good && g.worst() < 0.05;
  }
  client.close();
  return good;
}

bool measure(const SweepSetup& setup, const Scene& scene, const Plan& plan, int tiles, int in_flight) {
  const Chip& chip = chip_named("tile");
  Desk desk(chip.make(), {});
  Station station(desk, kHost, chip.address.ip, chip.address.port);
  Watched transport(station, chip.address);
  net::Client client(transport, 5.0, 1);
  const auto capabilities = client.info();
  net::LinkOptions options;
  options.in_flight = in_flight;
  auto input = [&](int i) {
    const PlacedTile& t = plan.tiles[static_cast<size_t>(i)];
    return golden::TileInput{t.job, cut_window(scene.left, t.left_x, t.left_y, t.job.win_cols, t.job.win_rows),
                             cut_window(scene.right, t.right_x, t.right_y, t.job.win_cols, t.job.win_rows)};
  };
  std::vector<Time> done;
  size_t wrong = 0;
  const auto wall = std::chrono::steady_clock::now();
  const Time begin = desk.now();
  const int64_t clocks_before = desk.clocks();
  const auto figures = net::run_link_tiles(
      client, capabilities, plan.table, tiles, options, input,
      [&](int i, const std::vector<golden::MapCell>& cells) {
        done.push_back(desk.now());
        const golden::TileInput in = input(i);
        const auto model = run_tile_fast(setup.format, in.job, plan.table, in.left, in.right);
        for (size_t c = 0; c < cells.size(); ++c)
          wrong += net::pack_wire_cell(setup.format, cells[c]) != net::pack_wire_cell(setup.format, model.cells[c]);
      },
      [](uint64_t) {});
  const double wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count();
  const Time end = desk.now();

  uint64_t useful = 0, whole = 0;
  for (size_t i = 0; i < plan.tiles.size(); ++i) {
    const uint64_t clocks = golden::engine_clocks(setup.format, plan.tiles[i].job);
    if (static_cast<int>(i) < tiles) useful += clocks;
    whole += clocks;
  }
  const Time elapsed = transport.last_busy - transport.first_launch;
  const auto elapsed_clocks = static_cast<uint64_t>(transport.busy_clock - transport.launch_clock);
  const double stall = static_cast<double>(elapsed_clocks - std::min(useful, elapsed_clocks));
  const double stall_per_tile = tiles > 1 ? stall / (tiles - 1) : 0;
  const auto& s = client.statistics();
  std::printf("%d in flight, %d tiles:\n", in_flight, tiles);
  std::printf("  before the first launch %10.3f ms: session, plane table, rows of the first tile\n",
              ms(transport.first_launch - begin));
  std::printf(
      "  launch to last map beat %10.3f ms: %" PRIu64 " clocks, %" PRIu64 " of them without stall: busy %.3f %%\n",
      ms(elapsed), elapsed_clocks, useful, 100.0 * static_cast<double>(useful) / static_cast<double>(elapsed_clocks));
  std::printf("  last map beat to end    %10.3f ms: the rest of the last map\n", ms(end - transport.last_busy));
  std::printf("  stall per tile change   %10.0f clocks; chip's counters: wait_rows %" PRIu64 ", wait_map %" PRIu64 "\n",
              stall_per_tile, figures.wait_rows_clocks, figures.wait_map_clocks);
  const double seconds = 1e-15 * static_cast<double>(transport.first_launch - begin + end - transport.last_busy) +
                         (static_cast<double>(whole) + stall_per_tile * static_cast<double>(plan.tiles.size() - 1)) /
                             (1e3 * chip.config.clk_khz);
  std::printf("  whole pair              %10.3f s: %zu tiles, busy %.3f %% of that\n", seconds, plan.tiles.size(),
              100 * static_cast<double>(whole) / (1e3 * chip.config.clk_khz) / seconds);
  std::printf("  link: %" PRIu64 " lost, %" PRIu64 " resent, %" PRIu64
              " time-outs, rx_no_slot %u; cells that differ: %zu\n",
              s.lost, s.resent, s.timeouts, figures.counters_after[net::kRxNoSlot], wrong);
  std::printf("  simulation: %.1f s, %.3g clocks a second\n", wall_seconds,
              static_cast<double>(desk.clocks() - clocks_before) / wall_seconds);
  return wrong == 0 && static_cast<int>(done.size()) == tiles;
}

// The whole pair with L lanes: a tile takes its load, a share 1/L of its sweep, and its unload, or as long as the link
// needs for the rows of the next tile or for the map of the one before, with all headers and gaps.
void forecast(const SweepSetup& setup, const Plan& plan) {
  const net::ArbiterConfig& c = chip_named("tile").config;
  auto link_seconds = [&](uint64_t items, int per, int bytes) {
    // Ethernet header, FCS, preamble, gap, IP and UDP around the message.
    constexpr int kAround = 14 + 4 + 8 + 12 + 20 + 8 + static_cast<int>(net::kHeaderBytes);
    return 8e-8 * static_cast<double>((items + static_cast<uint64_t>(per) - 1) / static_cast<uint64_t>(per)) *
           (kAround + per * bytes);
  };
  for (const int lanes : {1, 2, 4, 8}) {
    double total = 0, engine = 0, before = 0;
    for (size_t i = 0; i < plan.tiles.size(); ++i) {
      const golden::TileJob& t = plan.tiles[i].job;
      const double clocks =
          static_cast<double>(golden::load_clocks(t) + golden::unload_clocks(t) + golden::fill_clocks(setup.format)) +
          static_cast<double>(golden::sweep_clocks(setup.format, t)) / lanes;
      const double sweep = clocks / (1e3 * c.clk_khz);
      const double down = link_seconds(golden::unload_clocks(t), c.chunk_cells(), c.cell_bytes());
      double up = 0;
      if (i == 0) total += link_seconds(golden::load_clocks(t), c.chunk_pairs(), c.pair_bytes());
      if (i + 1 < plan.tiles.size())
        up = link_seconds(golden::load_clocks(plan.tiles[i + 1].job), c.chunk_pairs(), c.pair_bytes());
      total += std::max({sweep, up, before});
      engine += sweep;
      before = down;
    }
    total += before;
    std::printf("forecast, %d lane%s: %.3f s, engine busy %.2f %% of it\n", lanes, lanes == 1 ? " " : "s", total,
                100 * engine / total);
  }
}

int run(int argc, char** argv) {
  const int tiles = argc > 1 ? std::atoi(argv[1]) : 3, only = argc > 2 ? std::atoi(argv[2]) : 0;
  const golden::Config& format = chip_named("tile").config.engine;
  const Scene scene = render(SceneKind::kRocky, 1, kSize, 1);
  const SweepSetup setup{scene.rig, {kPlanes, 1.0, 4.0}, format, threshold_for(format, 0.85)};
  const TileSize size = largest_tile(setup);
  const Plan plan = plan_tiles(setup, size.cols, size.rows);
  if (tiles < 1 || tiles > static_cast<int>(plan.tiles.size()) || only < 0 || only > 2) {
    std::fprintf(stderr, "usage: link_speed [1 .. %zu tiles] [1 or 2 in flight]\n", plan.tiles.size());
    return 2;
  }
  std::printf("%dx%d, %d planes in %zu tiles of up to %dx%d cells; 100 Mbit/s full duplex, %g MHz\n", kSize, kSize,
              kPlanes, plan.tiles.size(), size.cols, size.rows, chip_named("tile").config.clk_khz / 1000.0);
  forecast(setup, plan);
  bool good = link_goodput();
  for (const int in_flight : {1, 2})
    if (only == 0 || only == in_flight) good = measure(setup, scene, plan, tiles, in_flight) && good;
  return good ? 0 : 1;
}

}  // namespace
}  // namespace psweep::chip

int main(int argc, char** argv) {
  try {
    return psweep::chip::run(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "link_speed: %s\n", e.what());
    return 1;
  }
}
