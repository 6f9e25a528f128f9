// SPDX-License-Identifier: Apache-2.0
// RecordedPsweep: a Verilated engine of any configuration with all its ports as plain members, for Sim and EngineBench,
// which writes every clock into a recording. One class for all configurations, so the benches are compiled once.
// Compared (docs/interfaces.md): handshakes, state, errors, counters and valids in every clock; payloads while their
// valid is high, pixels only of usable samples.
#pragma once
#include <verilated.h>

#include <deque>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "contract/config.hpp"
#include "golden/control.hpp"
#include "psweep_pins.hpp"
#include "replay/recording.hpp"

namespace psweep::replay {

// A Verilated engine behind Pins.
class PinModel {
 public:
  virtual ~PinModel() = default;
  virtual void eval(Pins& pins) = 0;
  virtual void final() = 0;
};
template <class Dut>
class VerilatedPins : public PinModel {
 public:
  explicit VerilatedPins(VerilatedContext* context) : dut_(context) {}
  void eval(Pins& pins) override {
    pins.drive(dut_);
    dut_.eval();
    pins.sample(dut_);
  }
  void final() override { dut_.final(); }

 private:
  Dut dut_;
};

struct Engine {
  std::string name;
  golden::Config config;
  std::vector<std::string> generics;  // NAME=VALUE
  std::map<std::string, int> bits;    // of each port
  std::unique_ptr<PinModel> (*make)(VerilatedContext*);
};
const std::vector<Engine>& engines();  // generated

inline const Engine& engine(const std::string& name) {
  for (const Engine& e : engines())
    if (e.name == name) return e;
  throw std::runtime_error("configuration " + name + " was not built");
}

class EngineRecorder {
 public:
  EngineRecorder(const std::string& file, const Engine& engine)
      : config_(engine.config), recording_(file, "psweep", engine.generics) {
    recording_.clock("clk");
    const Pins pins;
    pins.each([&](const std::string& name, bool input, QData) {
      if (input && name != "clk") ports_.push_back({name, recording_.in(name, engine.bits.at(name)), 0});
    });
    inputs_ = ports_.size();
    pins.each([&](const std::string& name, bool input, QData) {
      if (!input) ports_.push_back({name, recording_.out(name, engine.bits.at(name)), engine.bits.at(name)});
    });
  }
  // Just before a rising edge of clk.
  void edge(const Pins& pins) {
    std::map<std::string, QData> value;
    pins.each([&](const std::string& name, bool, QData v) { value[name] = v; });
    usable_.push_back(pins.dbg_usable_x & pins.dbg_usable_y);
    if (usable_.size() > golden::kStorageLatency + 1) usable_.pop_front();
    for (size_t i = 0; i < ports_.size(); ++i) {
      const Port& p = ports_[i];
      if (i < inputs_)
        recording_.set(p.number, value[p.name]);
      else
        recording_.expect(p.number, value[p.name], awake_ ? defined(p, pins) : 0);
    }
    recording_.step("1");
    awake_ = awake_ || pins.rst != 0;
  }
  void close() { recording_.close(); }
  uint64_t clocks() const { return recording_.steps(); }

 private:
  struct Port {
    std::string name;
    int number, bits;
  };
  static bool starts(const std::string& text, const char* with) { return text.rfind(with, 0) == 0; }
  // A bit for each lane to a mask of a bundle.
  uint64_t of_lanes(uint64_t lanes, int bits) const {
    const int field = bits / config_.lanes;
    uint64_t mask = 0;
    for (int n = 0; n < config_.lanes; ++n)
      if ((lanes >> n & 1) != 0) mask |= (field >= 64 ? ~uint64_t{0} : (uint64_t{1} << field) - 1) << n * field;
    return mask;
  }
  // Which bits mean something.
  uint64_t defined(const Port& p, const Pins& pins) const {
    const std::string& name = p.name;
    const uint64_t all = ~uint64_t{0};
    auto ends_in_valid = [&] { return name.size() > 6 && name.compare(name.size() - 6, 6, "_valid") == 0; };
    if (name == "m_map_tdata" || name == "m_map_tlast") return pins.m_map_tvalid ? all : 0;
    if (!starts(name, "dbg_") || name == "dbg_map_we") return all;
    if (starts(name, "dbg_map_")) return pins.dbg_map_we ? all : 0;
    if (ends_in_valid()) return all;
    if (starts(name, "dbg_sim_")) return of_lanes(pins.dbg_sim_valid, p.bits);
    if (name == "dbg_l" || name == "dbg_r") return of_lanes(pins.dbg_interp_valid, p.bits);
    if (starts(name, "dbg_p")) return of_lanes(pins.dbg_quad_valid & usable_.front(), p.bits);
    return of_lanes(pins.dbg_sample_valid, p.bits);  // positions and flags
  }

  golden::Config config_;
  Recording recording_;
  std::vector<Port> ports_;  // inputs first
  size_t inputs_ = 0;
  std::deque<uint64_t> usable_;  // lanes, the latest clocks
  bool awake_ = false;           // a reset was seen: outputs are defined
};

// What Sim<Dut> asks for. Which engine, and its recorder, have to be named before: Sim makes it with a context alone.
class RecordedPsweep : public Pins {
 public:
  static inline const Engine* next_engine = nullptr;
  static inline EngineRecorder* recorder = nullptr;  // nullptr: nothing is recorded

  explicit RecordedPsweep(VerilatedContext* context) : model_(next_engine->make(context)) {}
  void eval() {
    if (clk && !clk_before_ && recorder) recorder->edge(*this);
    clk_before_ = clk;
    model_->eval(*this);
  }
  void final() { model_->final(); }

 private:
  std::unique_ptr<PinModel> model_;
  CData clk_before_ = 0;
};

}  // namespace psweep::replay
