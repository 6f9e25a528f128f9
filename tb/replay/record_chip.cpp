// SPDX-License-Identifier: Apache-2.0
// record_chip CHIP FILE GENERIC=VALUE ..: drives the Verilated chip with everything it knows and records its pins
// (chip_recorder.hpp): ARP, pings, capabilities, counters, a session with two tiles of random texture, a broken and a
// foreign frame, messages in wrong order, a refused start; then, in half duplex, with collisions. The generics are
// those the chip was built with. Exit code 1 if the chip did not answer.
#include <cstdio>
#include <exception>
#include <random>

#include "desk/chip_transport.hpp"
#include "desk/station.hpp"
#include "net/client.hpp"
#include "net/link_engine.hpp"
#include "replay/chip_recorder.hpp"
#include "verilated/chips.hpp"

using namespace psweep;
using namespace psweep::chip;

namespace {

golden::TileInput random_tile(const golden::Config& e, std::mt19937& random) {
  golden::TileInput t;
  t.job.tile_cols = std::min(e.plane_cols, e.img_cols - e.window - 2);
  t.job.tile_rows = std::min(e.plane_rows, e.img_rows - e.window);
  t.job.win_cols = t.job.tile_cols + e.window + 2;  // samples, two pixels of shift, a neighbour
  t.job.win_rows = t.job.tile_rows + e.window;
  t.job.planes = 3;
  t.job.threshold = (1 << e.mncc_bits) / 2;
  t.job.left = t.job.right = {0, t.job.win_cols - 2, 0, t.job.win_rows - 2};
  t.left = t.right = golden::Pixels(t.job.win_cols, t.job.win_rows);
  for (size_t i = 0; i < t.left.data.size(); ++i) {
    t.right.data[i] = static_cast<uint16_t>(random() & ((1u << e.pix_bits) - 1));
    t.left.data[i] = t.right.data[i > 0 ? i - 1 : 0];  // the plane at one pixel wins
  }
  return t;
}

std::vector<golden::PlaneEntry> shifts() {
  std::vector<golden::PlaneEntry> table(3);
  for (size_t k = 0; k < table.size(); ++k) {
    table[k].x0_left = static_cast<int32_t>(k) << golden::kPosFrac;
    table[k].dx_left = table[k].dy_left = table[k].dx_right = table[k].dy_right = 1u << golden::kPosFrac;
  }
  return table;
}

void run(const Chip& chip, const std::string& file, const std::vector<std::string>& generics) {
  std::mt19937 random(1);
  DeskSettings settings;
  settings.clk_mhz = 30.7;  // near the lowest, so that few clocks have to be replayed
  Desk desk(std::make_unique<ChipRecorder>(chip.make(), file, generics), settings);
  const net::Address own{{2, 0, 0, 0, 0, 9}, chip.address.ip ^ 3, 4000};
  Station station(desk, own, chip.address.ip, chip.address.port);
  if (!station.resolve()) throw net::LinkError("no answer to ARP");
  for (const size_t size : {0, 57}) {
    if (!station.ping(size)) throw net::LinkError("no answer to ping");
  }
  // Frames that must not be obeyed.
  net::Bytes frame = net::make_arp_request(own, chip.address.ip);
  net::append_fcs(frame);
  for (const size_t at : {3, 20, 41}) {
    net::Bytes broken = frame;
    broken[at] ^= 0x40;
    desk.send_raw(broken);
  }
  desk.send_raw(net::Bytes(frame.begin(), frame.begin() + 30));

  ChipTransport transport(station, chip.address);
  net::Client client(transport, 1.0, 1);
  const net::Capabilities capabilities = client.info();
  client.counters();
  client.request(net::kStatus);  // no session
  const auto table = shifts();
  size_t cells = 0;
  net::run_link_tiles(
      client, capabilities, table, 2, {}, [&](int) { return random_tile(chip.config.engine, random); },
      [&](int, std::vector<golden::MapCell> map) { cells += map.size(); }, [](uint64_t) {});
  if (cells == 0) throw net::LinkError("no map came back");

  // Messages out of order, a tile that the engine refuses, half duplex.
  client.open(capabilities);
  client.request(net::kRelease, 7);
  client.request(net::kTable, 9, 3, net::Bytes(8, 0x55));
  client.send(net::kWrite, 5, 0, net::Bytes(10, 1), net::kFlagAnswer);
  client.receive(1e-3);
  net::write_table(client, chip.config, table);
  golden::TileInput tile = random_tile(chip.config.engine, random);
  tile.job.win_cols = 4095;
  client.request(net::kStart, 0, 0, net::start_payload(chip.config, tile.job, 1));
  client.request(net::kStatus);
  client.request(net::kSet, 0, 0, {0, 0, 0, net::kDuplexHalf});
  for (const size_t size : {40}) station.ping(size);
  client.close();
  client.counters();
  desk.finish();
  std::printf("%s: %zu cells, %lld clocks\n", file.c_str(), cells, static_cast<long long>(desk.clocks()));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: record_chip CHIP FILE GENERIC=VALUE ..\n");
    return 2;
  }
  try {
    run(chip_named(argv[1]), argv[2], std::vector<std::string>(argv + 3, argv + argc));
  } catch (const std::exception& e) {
    std::fprintf(stderr, "record_chip: %s\n", e.what());
    return 1;
  }
  return 0;
}
