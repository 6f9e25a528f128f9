// SPDX-License-Identifier: Apache-2.0
// Records what an engine is driven with and what it shows, while EngineBench compares it with the model: good tiles
// of all kinds under stalls on all streams, refused, short, long and aborted ones, a reset in mid-tile, good ones
// behind each. Environment: PSWEEP_CONFIG (configuration), PSWEEP_RECORD (file), PSWEEP_SEED, PSWEEP_TILES (so many
// random tiles more, of any size up to PSWEEP_CLOCKS clocks, 20000 if not set).
#include <cstdio>

#include "engine/engine_bench.hpp"
#include "golden/control.hpp"
#include "replay/recorded_psweep.hpp"

using namespace psweep;
using namespace psweep::tb;
using namespace psweep::replay;
using golden::State;

namespace {

std::string from_environment(const char* name, const char* otherwise) {
  const char* text = std::getenv(name);
  return text ? text : otherwise;
}

class Session {
 public:
  Session(const golden::Config& config, uint32_t seed)
      : config_(config), bench_(config, seed, {0.2, 0.3, 0.3}), maker_(config, seed) {}

  void good(scene::Texture texture, scene::Geometry geometry) { bench_.run(make(texture, geometry)); }
  void refused() {
    const scene::Stimulus s = make(scene::Texture::kRandom, scene::Geometry::kInside);
    bench_.write(0x0007, 1);  // unknown register
    bench_.write_job(s.job);
    bench_.write(golden::kRegTileCols, static_cast<uint32_t>(config_.plane_cols) + 1);
    bench_.command(golden::kCommandStart);
    bench_.send_pixels(s, 9);
    dropped();
    CHECK((bench_.dut.errors & (golden::kErrorAddress | golden::kErrorConfig)) ==
          (golden::kErrorAddress | golden::kErrorConfig));
  }
  void wrong_length(bool long_packet) {
    const scene::Stimulus s = make(scene::Texture::kRandom, scene::Geometry::kInside);
    bench_.write_table(s.table);
    bench_.write_job(s.job);
    bench_.command(golden::kCommandStart);
    bench_.send_pixels(s, s.left.data.size() - !long_packet, !long_packet);
    if (long_packet) bench_.pix.push(1, true);
    dropped();
    CHECK((bench_.dut.errors & (long_packet ? golden::kErrorLong : golden::kErrorShort)) != 0);
  }
  void interrupted(State state, bool by_reset) {
    const scene::Stimulus s = make(scene::Texture::kStereo, scene::Geometry::kInside);
    bench_.write_table(s.table);
    bench_.write_job(s.job);
    bench_.command(golden::kCommandStart);
    bench_.expect(s);
    bench_.send_pixels(s);
    bench_.run_until_state(state);
    bench_.sim.run(static_cast<uint64_t>(maker_.below(8)));
    bench_.interrupt();
    if (by_reset) {
      bench_.cfg.clear();
      bench_.pix.clear();
      bench_.sim.reset(1);
    } else {
      bench_.command(golden::kCommandAbort | golden::kCommandClear);
      bench_.flush_cfg();
      bench_.pix.clear();
    }
    bench_.forget();
    CHECK(bench_.dut.state == static_cast<int>(State::kIdle));
    bench_.sim.run(3);
  }
  void any(uint64_t most_clocks) {
    for (;;) {
      const scene::Stimulus s = maker_.any();
      if (golden::engine_clocks(config_, s.job) > most_clocks) continue;
      bench_.run(s);
      return;
    }
  }

 private:
  // Small, since GHDL does some thousand clocks a second; a last set of planes that does not fill all lanes.
  scene::Stimulus make(scene::Texture texture, scene::Geometry geometry) {
    const int planes = std::min(config_.planes, config_.lanes + 1);
    for (;;) {
      const int cols = std::min(config_.plane_cols, 2 + maker_.below(5)),
                rows = std::min(config_.plane_rows, 1 + maker_.below(4));
      const scene::Stimulus s = maker_.make(texture, geometry, cols, rows, planes);
      if (s.job.win_rows < rows + config_.window + 2) return s;  // few rows that nobody looks at
    }
  }
  void dropped() {
    bench_.flush_cfg();
    bench_.wait([&] { return bench_.pix.done() && !bench_.dut.busy; });
    bench_.sim.run(2);
  }

  golden::Config config_;
  EngineBench<RecordedPsweep> bench_;
  scene::StimulusMaker maker_;
};

}  // namespace

TEST_CASE("record: a session of good, refused, cut and aborted tiles") {
  const std::string name = from_environment("PSWEEP_CONFIG", "tiny");
  const int tiles = std::stoi(from_environment("PSWEEP_TILES", "0"));
  const uint64_t most_clocks = std::stoull(from_environment("PSWEEP_CLOCKS", "20000"));
  INFO("configuration " << name << " seed " << test_seed());
  const Engine& e = engine(name);
  const std::string file = from_environment("PSWEEP_RECORD", "");
  REQUIRE(!file.empty());
  EngineRecorder recorder(file, e);
  RecordedPsweep::next_engine = &e;
  RecordedPsweep::recorder = &recorder;
  {
    Session session(e.config, test_seed());
    session.good(scene::Texture::kStereo, scene::Geometry::kInside);
    session.refused();
    session.good(scene::Texture::kRandom, scene::Geometry::kSkewed);
    session.wrong_length(false);
    session.wrong_length(true);
    session.good(scene::Texture::kSaturated, scene::Geometry::kLost);
    for (const State state : {State::kLoad, State::kSweep, State::kUnload}) session.interrupted(state, false);
    session.good(scene::Texture::kConstant, scene::Geometry::kBorder);
    session.good(scene::Texture::kFaint, scene::Geometry::kInside);
    session.interrupted(State::kSweep, true);
    session.good(scene::Texture::kStereo, scene::Geometry::kBorder);
    for (int i = 0; i < tiles; ++i) session.any(most_clocks);
  }
  RecordedPsweep::recorder = nullptr;
  recorder.close();
  std::printf("%s: configuration %s, %llu clocks\n", file.c_str(), name.c_str(),
              static_cast<unsigned long long>(recorder.clocks()));
}
