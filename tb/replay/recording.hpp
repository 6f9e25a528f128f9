// SPDX-License-Identifier: Apache-2.0
// Recording: writes what a circuit was driven with and what it showed, for a bench in any simulator (docs/replay.md,
// format; scripts/tools.py ports makes the benches). Names, order and widths of the ports are those of the entity:
// clocks, other inputs, outputs. Each step: set() and expect() as far as values change, then step().
#pragma once
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace psweep::replay {

class Recording {
 public:
  // Generics as "NAME=VALUE". Throws std::runtime_error if the file cannot be written.
  Recording(const std::string& file, const std::string& entity, const std::vector<std::string>& generics)
      : out_(file), file_(file) {
    if (!out_) throw std::runtime_error(file + ": cannot be written");
    out_ << "recording " << entity << '\n';
    for (const auto& g : generics) {
      const size_t equals = g.find('=');
      if (equals == std::string::npos) throw std::runtime_error("not NAME=VALUE: " + g);
      out_ << "generic " << g.substr(0, equals) << ' ' << g.substr(equals + 1) << '\n';
    }
  }

  // In this order; the numbers that come back are for set() and expect().
  void clock(const std::string& name) { out_ << "clock " << name << " 1\n"; }
  int in(const std::string& name, int bits) { return port("in", name, bits, '0'); }
  int out(const std::string& name, int bits) { return port("out", name, bits, '-'); }

  void set(int number, uint64_t value) { expect(number, value, ~uint64_t{0}); }
  // Bits that `defined` leaves out are not compared.
  void expect(int number, uint64_t value, uint64_t defined = ~uint64_t{0}) {
    Port& p = ports_[static_cast<size_t>(number)];
    for (int bit = 0; bit < p.bits; ++bit)
      p.now[static_cast<size_t>(p.bits - 1 - bit)] = (defined >> bit & 1) == 0 ? '-'
                                                     : (value >> bit & 1) != 0 ? '1'
                                                                               : '0';
  }
  // One character a clock: '1' if it rises at the end of the step. `count` equal steps.
  void step(const std::string& rising, uint64_t count = 1) {
    bool same = rising == rising_;
    for (const Port& p : ports_) same = same && p.now == p.before;
    if (!same) write();
    rising_ = rising;
    repeat_ += count;
    steps_ += count;
    if (!same)
      for (Port& p : ports_) p.line = p.now == p.before ? std::string(1, '.') : p.now, p.before = p.now;
  }
  // The end mark: without it a bench refuses the recording.
  void close() {
    write();
    out_ << "end " << steps_ << '\n';
    out_.close();
    if (!out_) throw std::runtime_error(file_ + ": cannot be written");
  }
  uint64_t steps() const { return steps_; }

 private:
  struct Port {
    int bits;
    std::string now, before, line;  // before: of the step before; line: what the present line says
  };
  int port(const char* kind, const std::string& name, int bits, char start) {
    out_ << kind << ' ' << name << ' ' << bits << '\n';
    ports_.push_back({bits, std::string(static_cast<size_t>(bits), start), {}, {}});
    return static_cast<int>(ports_.size()) - 1;
  }
  void write() {
    if (repeat_ == 0) return;
    out_ << rising_ << ' ' << repeat_;
    for (const Port& p : ports_) out_ << ' ' << p.line;
    out_ << '\n';
    repeat_ = 0;
  }

  std::ofstream out_;
  std::string file_, rising_;
  std::vector<Port> ports_;
  uint64_t repeat_ = 0, steps_ = 0;
};

}  // namespace psweep::replay
