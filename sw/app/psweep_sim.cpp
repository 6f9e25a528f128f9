// SPDX-License-Identifier: Apache-2.0
// psweep-sim: the simulated chip on a TAP device, or, without one, its self-test over the in-process link
// (docs/psweep_sim.md).
// Exit codes: 0 good; 2 wrong option, device or file; 1 everything else.
#include <poll.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cinttypes>
#include <cstdio>
#include <string>

#include "contract/protocol.hpp"
#include "core/error.hpp"
#include "desk/chip_transport.hpp"
#include "desk/session_watch.hpp"
#include "desk/tap.hpp"
#include "verilated/chips.hpp"

namespace psweep::chip {
namespace {

volatile sig_atomic_t stopped = 0;
void stop(int) { stopped = 1; }

struct Options {
  std::string config = "tiny", tap, pcap;
  WaveWindow wave;
  DeskSettings desk;
  double clk_mhz = 0, seconds = 0, session_wall = 0;
  int straps = 0;
  bool ten = false, quiet = false, list = false;
};

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

// Addresses of the program itself when it asks the chip: last but one of the chip's network.
net::Address own_address(const net::Address& chip) {
  return {{0x02, 0x00, 0x50, 0x53, 0x57, 0xfe}, (chip.ip & 0xffffff00) | 0xfd, 40000};
}

net::Bytes message(uint8_t type, uint16_t sequence) {
  net::Header h;
  h.type = type;
  h.sequence = sequence;
  net::Bytes m = net::encode(h);
  // As long as the answer.
  if (type == net::kInfo) m.resize(net::kInfoRequestBytes);
  if (type == net::kCounters) m.resize(net::kCountersRequestBytes);
  return m;
}

// Words of the reply to INFO or COUNTERS; empty if none came. Asks again a few times, as faults may be switched on.
std::vector<uint32_t> ask(Station& station, net::Type type) {
  for (uint16_t attempt = 1; attempt <= 20; ++attempt) {
    if (!station.send_udp(message(type, attempt))) return {};
    while (auto reply = station.receive_udp(5 * kMillisecond)) {
      const auto h = net::decode(*reply);
      if (!h || h->type != (type | net::kReply) || h->flags != net::kOk) continue;
      std::vector<uint32_t> words;
      for (size_t at = net::kHeaderBytes; at + 4 <= reply->size(); at += 4) words.push_back(net::get32(*reply, at));
      return words;
    }
  }
  return {};
}

void print_counters(Desk& desk, const net::Address& chip) {
  desk.set_faults({});
  desk.set_cable(true);
  Station station(desk, own_address(chip), chip.ip, chip.port);
  const auto words = ask(station, net::kCounters);
  if (words.empty()) {
    std::printf("the chip does not tell its counters\n");
    return;
  }
  std::printf("the chip's counters (these questions included):");
  for (size_t i = 0; i < words.size() && i < size_t{net::kCounterWords}; ++i)
    if (words[i] != 0) std::printf(" %s %" PRIu32, net::kCounterNames[i], words[i]);
  std::printf("\n");
}

void print_faults(const char* direction, const FaultCounters& f) {
  std::printf("faults %s: %" PRIu64 " lost, %" PRIu64 " doubled, %" PRIu64 " reordered, %" PRIu64 " delayed, %" PRIu64
              " corrupted, %" PRIu64 " corrupted with a good FCS\n",
              direction, f.lost, f.duplicated, f.reordered, f.delayed, f.corrupted, f.corrupted_fcs);
}

void print_summary(Desk& desk, const Options& o, double running, double wall) {
  const double simulated = static_cast<double>(desk.now()) / kSecond;
  const LinkCounters& l = desk.link();
  std::printf("simulated %.6f s (%" PRId64
              " clocks of %g MHz) in %.1f s of computing, %.1f s in all: %.0f clocks/s, "
              "%.0f times slower than the chip\n",
              simulated, desk.clocks(), desk.clk_mhz(), running, wall, static_cast<double>(desk.clocks()) / running,
              running / simulated);
  std::printf("engine: %" PRId64 " tiles launched, busy for %.6f s\n", desk.chip().launches(),
              static_cast<double>(desk.chip().busy_clocks()) / (desk.clk_mhz() * 1e6));
  std::printf("frames to the chip: %" PRIu64 " (%" PRIu64 " bytes), from it: %" PRIu64 " (%" PRIu64 " bytes)\n", l.sent,
              l.sent_bytes, l.received, l.received_bytes);
  if (l.violations() != 0)
    std::printf("WRONG frames from the chip: %" PRIu64 " FCS, %" PRIu64 " short, %" PRIu64 " long, %" PRIu64
                " malformed, %" PRIu64 " too close\n",
                l.fcs, l.short_frames, l.long_frames, l.malformed, l.gap);
  if (o.desk.half_duplex)
    std::printf("collisions of frames to the chip: %" PRIu64 ", late %" PRIu64 ", given up %" PRIu64
                "; fragments from the chip: %" PRIu64 "\n",
                l.collisions, l.late, l.excessive, l.fragments);
  if (o.desk.faults.any()) {
    print_faults("to the chip", desk.faults_to_chip());
    print_faults("from the chip", desk.faults_from_chip());
  }
}

void print_start(const Chip& chip, const net::Address& a, const Options& o) {
  const auto& e = chip.config.engine;
  const std::string ip = ip_text(a.ip);
  std::printf("psweep-sim: chip '%s' at %s, %s: %s\n", chip.name.c_str(), ip.c_str(), mac_text(a.mac).c_str(),
              chip.description.c_str());
  std::printf("tiles of %dx%d cells, %d planes, window %d; clk %g MHz, %s Mbit/s, %s duplex\n", e.plane_cols,
              e.plane_rows, e.planes, e.window, o.desk.clk_mhz, o.desk.speed_100 ? "100" : "10",
              o.desk.half_duplex ? "half" : "full");
  if (o.tap.empty()) return;
  const std::string host = ip_text((a.ip & 0xffffff00) | 1);
  std::printf("once, as root:  ip addr add %s/24 dev %s; ip link set %s up\n", host.c_str(), o.tap.c_str(),
              o.tap.c_str());
  std::printf("then:           ping %s\n", ip.c_str());
  std::printf("                psweep depth LEFT RIGHT --calib FILE -o DIR --planes %d --window %d --engine udp://%s\n",
              e.planes, e.window, ip.c_str());
  std::printf("end:            Ctrl-C\n");
  std::fflush(stdout);
}

// Seconds of computing, sleep not counted.
double serve(Desk& desk, Tap& tap, const net::Address& chip, const Options& o, uint64_t& refused) {
  // So many frames wait at the chip's side of the cable; the rest wait in the kernel's queue.
  constexpr size_t kAhead = 8;
  const auto begin = Clock::now();
  double slept = 0;
  SessionWatch session(desk, chip, o.session_wall);
  desk.on_frame = [&](const net::Bytes& frame) {
    if (o.session_wall <= 0 || !SessionWatch::answer(frame)) refused += !tap.write(frame);
  };
  while (!stopped) {
    if (o.seconds > 0 && seconds_since(begin) >= o.seconds) break;
    session.look(seconds_since(begin));
    while (desk.waiting() < kAhead) {
      auto frame = tap.read();
      if (!frame) break;
      if (frame->size() >= 14) desk.send(std::move(*frame));
      // What faults hold back does not count as waiting.
      if (!desk.idle()) desk.run_for(kMicrosecond);
    }
    if (!desk.idle()) {
      desk.run_for(10 * kMicrosecond);
      continue;
    }
    const auto asleep = Clock::now();
    pollfd p{tap.fd(), POLLIN, 0};
    int timeout = -1;
    if (o.seconds > 0) timeout = static_cast<int>(std::max(0.0, o.seconds - seconds_since(begin)) * 1000) + 1;
    ::poll(&p, 1, timeout);
    slept += seconds_since(asleep);
  }
  desk.on_frame = nullptr;
  if (session.ended() > 0 && !o.quiet)
    std::printf("sessions ended for %g s of silence: %" PRIu64 "\n", o.session_wall, session.ended());
  return seconds_since(begin) - slept;
}

// Without a TAP device: what can be seen of the chip from inside the program.
bool self_test(Desk& desk, const net::Address& chip) {
  Station station(desk, own_address(chip), chip.ip, chip.port);
  const Time begin = desk.now();
  if (!station.resolve()) {
    std::printf("nobody answers ARP\n");
    return false;
  }
  std::printf("ARP: %s is at %s after %.1f us\n", ip_text(chip.ip).c_str(), mac_text(*station.chip_mac()).c_str(),
              static_cast<double>(desk.now() - begin) / kMicrosecond);
  bool good = *station.chip_mac() == chip.mac;
  for (const size_t size : {size_t{0}, size_t{56}, size_t{1000}, size_t{1468}}) {
    std::optional<Time> time;
    for (int attempt = 0; attempt < 10 && !time; ++attempt) time = station.ping(size, 5 * kMillisecond);
    if (time) {
      std::printf("ping, %zu bytes: %.1f us\n", size + 4, static_cast<double>(*time) / kMicrosecond);
    } else {
      std::printf("ping, %zu bytes: no answer\n", size + 4);
      good = false;
    }
  }
  const auto info = ask(station, net::kInfo);
  std::printf("capability words:");
  for (const uint32_t w : info) std::printf(" %" PRIu32, w);
  std::printf("\n");
  return good && info.size() == size_t{net::kInfoWords};
}

int run(Options& o) {
  if (o.list) {
    for (const auto& c : chips()) std::printf("%-12s %s\n", c.name.c_str(), c.description.c_str());
    return 0;
  }
  const Chip& chip = chip_named(o.config);
  if (!o.wave.file.empty() && !chip.waves) {
    std::string with;
    for (const auto& c : chips())
      if (c.waves) with += " " + c.name;
    throw InputError("--wave: chip '" + chip.name + "' was built without waves, those with:" + with);
  }
  o.desk.clk_mhz = o.clk_mhz > 0 ? o.clk_mhz : chip.config.clk_khz / 1000.0;
  o.desk.speed_100 = !o.ten;
  o.desk.straps = static_cast<uint8_t>(o.straps);
  const net::Address address = strapped(chip.address, o.desk.straps);
  std::optional<Tap> tap;
  if (!o.tap.empty()) tap.emplace(o.tap);

  // Installed before anything says that the chip is there.
  struct sigaction action {};
  action.sa_handler = stop;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);

  Desk desk(chip.make(), o.desk);
  if (!o.pcap.empty()) desk.record(o.pcap);
  if (!o.wave.file.empty()) {
    if (o.wave.frame == 0 && o.wave.tile < 0) o.wave.frame = 1;
    desk.watch(o.wave);
  }
  if (!o.quiet) print_start(chip, address, o);
  const auto begin = Clock::now();
  double running;
  bool good = true;
  uint64_t refused = 0;
  if (tap) {
    running = serve(desk, *tap, address, o, refused);
  } else {
    good = self_test(desk, address);
    running = seconds_since(begin);
  }
  desk.finish();
  if (!o.quiet) {
    print_summary(desk, o, running, seconds_since(begin));
    if (refused != 0) std::printf("frames the TAP device did not take (is it up?): %" PRIu64 "\n", refused);
    if (!o.pcap.empty()) std::printf("%s: %" PRIu64 " frames\n", o.pcap.c_str(), desk.recorded());
    if (!o.wave.file.empty())
      std::printf("%s: %s\n", o.wave.file.c_str(), desk.wave_written() ? "written" : "the frame or tile never came");
    print_counters(desk, address);
  }
  return good && desk.link().violations() == 0 ? 0 : 1;
}

int main_function(int argc, char** argv) {
  Options o;
  CLI::App app{"psweep-sim: the psweep chip in simulation, behind a network cable"};
  app.add_option("--config", o.config, "Which chip (--list)")->capture_default_str();
  app.add_flag("--list", o.list, "Lists the chips in this program and ends");
  app.add_option("--tap", o.tap, "TAP device to plug the cable into; without it: self-test, then end");
  app.add_option("--for", o.seconds, "End after so many seconds of wall time")->check(CLI::Range(0.1, 1e9));
  app.add_option("--session-wall", o.session_wall,
                 "End a session whose host has been silent for so many seconds of wall time (default: the chip's own "
                 "timer alone, in simulated time)")
      ->check(CLI::Range(0.5, 1e9));
  app.add_option("--pcap", o.pcap, "Record the wire at the chip's pins for Wireshark (simulated time)");
  auto* wave = app.add_option("--wave", o.wave.file, "Record waves (FST) for GTKWave or Surfer; default: frame 1");
  auto* frame = app.add_option("--wave-frame", o.wave.frame, "Waves begin with this frame, from 1, both directions")
                    ->check(CLI::Range(int64_t{1}, int64_t{1} << 40))
                    ->needs(wave);
  app.add_option("--wave-tile", o.wave.tile, "Waves begin when the engine starts this tile, from 0")
      ->check(CLI::Range(int64_t{0}, int64_t{1} << 40))
      ->needs(wave)
      ->excludes(frame);
  app.add_option("--wave-clocks", o.wave.clocks, "Length of the waves, edges of clk")
      ->check(CLI::Range(int64_t{1}, int64_t{1} << 40))
      ->needs(wave)
      ->capture_default_str();
  app.add_option("--clk-mhz", o.clk_mhz, "Engine clock (default: the configuration's)")
      ->check(CLI::Range(30.0, 1000.0));
  app.add_flag("--half-duplex", o.desk.half_duplex, "Duplex pin and medium: half");
  app.add_flag("--10", o.ten, "10 Mbit/s (MII clocks of 2.5 MHz)");
  app.add_option("--straps", o.straps, "Exclusive-ored into the last byte of MAC and IP address")
      ->check(CLI::Range(0, 255));
  const struct {
    const char* name;
    double FaultRates::*rate;
    const char* help;
  } faults[] = {{"--loss", &FaultRates::loss, "Share of frames that vanish, each direction"},
                {"--duplicate", &FaultRates::duplicate, "Share of frames that come twice"},
                {"--reorder", &FaultRates::reorder, "Share of frames that the next one overtakes"},
                {"--delay", &FaultRates::delay, "Share of frames that come up to 3 ms later"},
                {"--corrupt", &FaultRates::corrupt, "Share of frames with wrong bits on the wire (wrong FCS)"},
                {"--corrupt-fcs", &FaultRates::corrupt_fcs, "Share of IPv4 frames with a wrong bit and a good FCS"}};
  for (const auto& f : faults)
    app.add_option(f.name, o.desk.faults.*f.rate, f.help)->check(CLI::Range(0.0, 1.0))->type_name("RATE");
  app.add_option("--seed", o.desk.seed, "Seed of faults and backoff")->capture_default_str();
  app.add_flag("--quiet", o.quiet, "Print nothing but errors");
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& e) {  // --help
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    std::fprintf(stderr, "psweep-sim: %s\nSee psweep-sim --help\n", e.what());
    return 2;
  }
  return run(o);
}

}  // namespace
}  // namespace psweep::chip

int main(int argc, char** argv) {
  try {
    return psweep::chip::main_function(argc, argv);
  } catch (const psweep::InputError& e) {
    std::fprintf(stderr, "psweep-sim: %s\n", e.what());
    return 2;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "psweep-sim: %s\n", e.what());
    return 1;
  }
}
