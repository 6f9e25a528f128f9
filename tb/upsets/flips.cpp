// SPDX-License-Identifier: Apache-2.0
// flips [--short] [--all] [--seed N] [--only CONFIGURATION:SITE:BIT:CLOCK:WORD[:refused]]: single-event upsets in the
// engine. One bit of one register, or of one word of a RAM, is changed in one clock of a tile, and the bench goes on as
// a host would: it waits for the tile, looks at errors, counters and the number of cells, aborts if something is wrong
// or nothing ends, and sends the next tiles. scripts/tools.py upsets makes the circuit that can be changed.
//   hang       the engine was busy longer than the largest tile of the build takes, though all streams moved
//   masked     map and status are as without the upset
//   detected   an error bit, a dropped tile, or a wrong number of cells; or error 'upset' of the next tile, of an upset
//              that the tile itself did not notice
//   status     the map is right, an error bit or counter is not
//   silent     the map is wrong and nothing says so
//   later      the next tile, for which all registers are written anew as for every tile, is wrong; the one behind it,
//              for which the plane table is written anew too, has to be right. (Behind an error 'upset' the host writes
//              the table at once.)
// --short: few clocks, for the regression; --all: registers of all entities, not only those of control.
// Exit code 1 if anything hangs, or if the tile behind the next one is wrong, or if an upset of plane table or offsets
// is silent or comes later, or if nothing was changed.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <memory>
#include <sstream>

#include "Vflips_odd_2.h"
#include "Vflips_tiny.h"
#include "contract/registers.hpp"
#include "golden/control.hpp"
#include "golden/psweep.hpp"
#include "scene/stimulus.hpp"
#include "simulator/engine_driver.hpp"
#include "verilated/rtl_engine.hpp"

using namespace psweep;

namespace {

struct Site {
  const char* entity;
  const char* name;
  int bits, words;  // 0: a register
};

const std::vector<Site> kTiny = {
#include "flips_tiny.inc"
};
const std::vector<Site> kOdd2 = {
#include "flips_odd_2.inc"
};

struct Upset {
  int site = 0, bit = 0, word = 0;  // site 0: none
  int64_t clock = 0;                // after the first register write of the tile
};

// What a host sees of a tile.
struct Seen {
  std::vector<uint64_t> cells;
  bool last_right = true;  // tlast with the last cell and no other
  unsigned errors = 0, done = 0, dropped = 0, error_count = 0, window_errors = 0;
  bool hang = false;
  int64_t clocks = 0;       // until the engine was idle, or given up
  std::vector<int> states;  // at each clock, if asked for
};

class Machine {
 public:
  virtual ~Machine() = default;
  virtual void reset() = 0;
  virtual Seen tile(const scene::Stimulus& s, bool with_table, bool refused, const Upset& upset, bool states) = 0;
  virtual void abort() = 0;
};

template <class Dut>
class UpsetEngine : public Machine {
 public:
  explicit UpsetEngine(const golden::Config& config) : config_(config) {
    context_.randReset(2);
    context_.randSeed(1);
    dut_ = std::make_unique<Dut>(&context_);
    driver_ = std::make_unique<simulator::EngineDriver<Dut>>(*dut_, config);
    // The largest tile that the build knows, on streams that never wait, and a draining packet before it.
    golden::TileJob job;
    job.tile_cols = config.plane_cols, job.tile_rows = config.plane_rows, job.planes = config.planes;
    job.win_cols = config.img_cols, job.win_rows = config.img_rows;
    longest_ = static_cast<int64_t>(golden::engine_clocks(config, job));
    reset();
  }
  ~UpsetEngine() override { dut_->final(); }

  void reset() override {
    dut_->flip_site = 0;
    dut_->rst = 1;
    driver_->rest();
    for (int i = 0; i < 4; ++i) clock();
    dut_->rst = 0;
  }
  void abort() override {
    driver_->rest();
    write({{golden::kRegCommand, golden::kCommandAbort}});
    for (int i = 0; i < 4; ++i) clock();
  }
  Seen tile(const scene::Stimulus& s, bool with_table, bool refused, const Upset& upset, bool states) override {
    seen_ = {};
    keep_states_ = states;
    upset_ = upset;
    at_ = 0;
    driver_->rest();
    auto words = simulator::tile_words(s.job, with_table ? &s.table : nullptr);
    words.insert(words.begin(), {golden::kRegCommand, golden::kCommandClear});
    if (refused) words.insert(words.end() - 1, {golden::kRegTileCols, 0});
    write(words);
    size_t sent = 0;
    // The upset may come before the tile, and what it does may come late: a quiet time is waited for.
    const int64_t begun = at_;
    for (int quiet = 0; quiet < 40;) {
      const bool more = driver_->offer(s.left, s.right, sent);
      const bool taken = more && dut_->s_pix_tready;
      collect();
      const bool busy = dut_->busy;
      clock();
      sent += taken;
      quiet = busy || taken ? 0 : quiet + 1;
      if (busy) seen_.clocks = at_ - begun;
      if (at_ - std::max(begun, upset.clock) > longest_ + 100) {
        seen_.hang = true;
        break;
      }
    }
    seen_.errors = dut_->errors;
    seen_.done = dut_->tiles_done;
    seen_.dropped = dut_->tiles_dropped;
    seen_.error_count = dut_->error_count;
    seen_.window_errors = dut_->window_errors;
    seen_.last_right &= !seen_.cells.empty() && (seen_.cells.back() & 1);
    upset_ = {};
    return seen_;
  }

 private:
  void write(const std::vector<golden::RegisterWrite>& words) {
    driver_->write(words, [this] {
      collect();
      clock();
    });
  }
  void clock() {
    const bool now = upset_.site > 0 && at_ == upset_.clock;
    dut_->flip_site = static_cast<SData>(now ? upset_.site : 0);
    dut_->flip_word = static_cast<SData>(upset_.word);
    dut_->flip_mask = uint64_t{1} << upset_.bit;
    dut_->clk = !dut_->clk;
    dut_->eval();
    if (keep_states_) seen_.states.push_back(dut_->state);
    ++at_;
  }
  void collect() {
    if (!dut_->m_map_tvalid) return;
    if (!seen_.cells.empty() && (seen_.cells.back() & 1)) seen_.last_right = false;
    seen_.cells.push_back(static_cast<uint64_t>(dut_->m_map_tdata) << 1 | dut_->m_map_tlast);
  }

  golden::Config config_;
  VerilatedContext context_;
  std::unique_ptr<Dut> dut_;
  std::unique_ptr<simulator::EngineDriver<Dut>> driver_;
  Seen seen_;
  Upset upset_;
  int64_t at_ = 0, longest_ = 0;
  bool keep_states_ = false;
};

struct Count {
  uint64_t flips = 0, masked = 0, detected = 0, status = 0, silent = 0, later = 0, hang = 0, never = 0;
  int64_t worst = 0;
};

struct Options {
  bool brief = false, all = false;
  uint32_t seed = 1;
  std::string only;
};

class Campaign {
 public:
  Campaign(const std::string& name, const std::vector<Site>& sites, std::unique_ptr<Machine> machine,
           const golden::Config& config, const Options& options)
      : name_(name), sites_(sites), machine_(std::move(machine)), options_(options), maker_(config, options.seed) {
    // Small tiles, so that many upsets can be tried: what control does is the same.
    const int planes = std::min(config.planes, 2 * config.lanes + 1);
    tile_ = maker_.make(scene::Texture::kStereo, scene::Geometry::kInside, 5, 4, planes);
    next_ = maker_.make(scene::Texture::kStereo, scene::Geometry::kInside, 4, 3, planes);
    next_.table = tile_.table;  // stays from tile to tile
    next_.job.tx_left = tile_.job.tx_left, next_.job.ty_left = tile_.job.ty_left;
    next_.job.tx_right = tile_.job.tx_right, next_.job.ty_right = tile_.job.ty_right;
    right_ = run(tile_, true, false, {}, true);
    right_next_ = run(next_, false, false, {}, false);
    machine_->reset();
    run(tile_, true, true, {}, false);
    refused_ = run(tile_, true, true, {}, true);
    machine_->reset();
    const auto model = golden::run_tile(config, tile_.job, tile_.table, tile_.left, tile_.right).cells;
    sound_ = right_.cells.size() == model.size() && right_.last_right && !right_.hang && right_.errors == 0;
    for (size_t i = 0; i < model.size() && sound_; ++i)
      sound_ = right_.cells[i] >> 1 == golden::pack_cell(config, model[i]);
  }

  // Every bit of every register, in several clocks of every state; of RAMs some words in some clocks.
  bool run_all() {
    if (!sound_) {
      std::printf("flips: %s: the engine without an upset is wrong\n", name_.c_str());
      return false;
    }
    if (!options_.only.empty()) return one();
    // Sites are found by name: one that is not found must not just be left out.
    for (const char* name : {"u_map.memory", "u_table.memory", "u_offsets.memory"}) {
      const bool found =
          std::any_of(sites_.begin(), sites_.end(), [&](const Site& s) { return s.name == std::string(name); });
      if (found) continue;
      std::printf("flips: %s: there is no %s to be upset\n", name_.c_str(), name);
      return false;
    }
    const auto begun = std::chrono::steady_clock::now();
    std::vector<std::pair<Upset, bool>> upsets;  // and: of a refused tile
    for (size_t n = 0; n < sites_.size(); ++n) {
      const Site& site = sites_[n];
      const bool control = is("control", site), memory = site.words > 0;
      if (!control && !memory && !options_.all) continue;
      if (memory && !options_.all && !wanted_memory(site)) continue;
      for (int bit = 0; bit < site.bits; ++bit) {
        for (int state = 0; state < 6; ++state) {
          const bool refused = state == 5;
          const auto& states = refused ? refused_.states : right_.states;
          std::vector<int64_t> clocks;
          for (size_t c = 1; c < states.size(); ++c)
            if (states[c] == state) clocks.push_back(static_cast<int64_t>(c));
          int times = control ? (options_.brief ? 1 : 6) : memory ? (options_.brief ? 1 : 12) : 1;
          if (!control && state != 1 && state != 2 && state != 4) continue;
          if (options_.brief && (static_cast<int>(n) + bit + state) % (control ? 3 : 12) != 0) continue;
          times = std::min<int>(times, static_cast<int>(clocks.size()));
          for (int i = 0; i < times; ++i) {
            Upset u;
            u.site = static_cast<int>(n) + 1;
            u.bit = bit;
            // The first and the last clock of the state, and any between.
            u.clock = i == 0 && !options_.brief ? clocks.front()
                      : i == 1 && !options_.brief
                          ? clocks.back()
                          : clocks[static_cast<size_t>(maker_.below(static_cast<int>(clocks.size())))];
            u.word = memory ? word_of(site) : 0;
            upsets.push_back({u, refused});
          }
        }
      }
    }
    size_t n = 0;
    double told = 0;
    for (const auto& [u, refused] : upsets) {
      experiment(u, refused);
      ++n;
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
      if (seconds > told + 5) {
        told = seconds;
        std::fprintf(stderr, "flips: %s: %zu of %zu, %.0f s left\n", name_.c_str(), n, upsets.size(),
                     seconds / static_cast<double>(n) * static_cast<double>(upsets.size() - n));
      }
    }
    return report();
  }

 private:
  static bool is(const char* entity, const Site& site) { return std::string(site.entity) == entity; }
  static bool wanted_memory(const Site& site) {
    const std::string n = site.name;
    return n == "u_table.memory" || n == "u_map.memory" || n == "u_offsets.memory";
  }
  // Words that the tile uses, most of the time.
  int word_of(const Site& site) {
    const std::string n = site.name;
    const int used = n == "u_table.memory" ? 8 * tile_.job.planes : n == "u_map.memory" ? 20 : site.words;
    return maker_.below(std::min(used, site.words));
  }
  Seen run(const scene::Stimulus& s, bool with_table, bool refused, const Upset& u, bool states) {
    return machine_->tile(s, with_table, refused, u, states);
  }
  // Control's registers one by one, the others by entity, RAMs by name.
  std::string group(const Site& site) const {
    if (is("control", site)) return std::string("control ") + site.name;
    if (site.words > 0) return std::string("RAM ") + site.name;
    return site.entity;
  }
  static bool same_map(const Seen& a, const Seen& b) { return a.cells == b.cells; }
  static bool same_status(const Seen& a, const Seen& b) {
    return a.errors == b.errors && a.done == b.done && a.dropped == b.dropped && a.error_count == b.error_count &&
           a.window_errors == b.window_errors;
  }

  void experiment(const Upset& u, bool refused) {
    const Site& site = sites_[static_cast<size_t>(u.site) - 1];
    Count& count = counts_[group(site)];
    machine_->reset();
    // A tile before, so that all registers and the table have been written once.
    if (!refused) run(tile_, true, false, {}, false);
    const Seen& expected = refused ? refused_ : right_;
    const Seen seen = run(tile_, refused, refused, u, false);
    ++count.flips;
    count.worst = std::max(count.worst, seen.clocks);
    const bool told = (seen.errors & ~expected.errors) != 0 || seen.dropped != expected.dropped ||
                      seen.cells.size() != expected.cells.size() || seen.last_right != expected.last_right;
    const bool right = same_map(seen, expected);
    const bool written = !refused && !told && right && same_status(seen, expected);  // until the next tile tells
    if (seen.hang) {
      ++count.hang;
      complain("hangs", u, refused);
    } else if (right && same_status(seen, expected)) {
      ++count.masked;
    } else if (right) {
      ++count.status;
    } else if (told) {
      ++count.detected;
    } else {
      ++count.silent;
    }
    // As a host: abort if something was told, else go on.
    if (told || seen.hang) machine_->abort();
    // Behind a refused tile the sizes are wrong: they are written for every tile.
    Seen next = run(next_, refused || (seen.errors & golden::kErrorUpset) != 0, false, {}, false);
    if (written && (next.errors & golden::kErrorUpset) != 0) {
      --count.masked, ++count.detected;
      next = run(next_, true, false, {}, false);
    }
    if (!same_map(next, right_next_) || next.errors != 0) {
      ++count.later;
      machine_->abort();
      next = run(next_, true, false, {}, false);
    }
    if (!same_map(next, right_next_) || next.errors != 0 || next.hang) {
      ++count.never;
      complain("the tile behind the next one is wrong", u, refused);
    }
  }
  void complain(const char* what, const Upset& u, bool refused) const {
    const Site& site = sites_[static_cast<size_t>(u.site) - 1];
    std::printf(
        "flips: %s: %s: %s %s bit %d word %d, clock %lld%s; again: build/tb/upsets/flips --seed %u --only "
        "%s:%d:%d:%lld:%d%s\n",
        name_.c_str(), what, site.entity, site.name, u.bit, u.word, static_cast<long long>(u.clock),
        refused ? " of a refused tile" : "", options_.seed, name_.c_str(), u.site, u.bit,
        static_cast<long long>(u.clock), u.word, refused ? ":refused" : "");
  }
  bool one() {
    std::istringstream text(options_.only.substr(options_.only.find(':') + 1));
    Upset u;
    char colon = 0;
    text >> u.site >> colon >> u.bit >> colon >> u.clock >> colon >> u.word;
    std::string rest;
    text >> rest;
    if (u.site < 1 || u.site > static_cast<int>(sites_.size())) throw std::runtime_error("--only: no such site");
    experiment(u, rest == ":refused");
    return report();
  }
  bool report() const {
    std::printf("%s\n%-34s %8s %8s %8s %8s %8s %8s %6s %8s\n", name_.c_str(), "upset in", "flips", "masked", "status",
                "detected", "silent", "later", "hang", "clocks");
    Count all;
    auto line = [](const std::string& what, const Count& c) {
      std::printf("%-34s %8llu %8llu %8llu %8llu %8llu %8llu %6llu %8lld\n", what.c_str(),
                  static_cast<unsigned long long>(c.flips), static_cast<unsigned long long>(c.masked),
                  static_cast<unsigned long long>(c.status), static_cast<unsigned long long>(c.detected),
                  static_cast<unsigned long long>(c.silent), static_cast<unsigned long long>(c.later),
                  static_cast<unsigned long long>(c.hang), static_cast<long long>(c.worst));
    };
    for (const auto& [what, c] : counts_) {
      if (!options_.brief) line(what, c);
      all.flips += c.flips, all.masked += c.masked, all.detected += c.detected, all.status += c.status;
      all.silent += c.silent, all.later += c.later, all.hang += c.hang, all.never += c.never;
      all.worst = std::max(all.worst, c.worst);
    }
    line("all", all);
    std::printf("(a tile without an upset: %lld clocks)\n", static_cast<long long>(right_.clocks));
    // Words with parity.
    uint64_t unnoticed = 0;
    for (const char* name : {"RAM u_table.memory", "RAM u_offsets.memory"})
      if (const auto found = counts_.find(name); found != counts_.end())
        unnoticed += found->second.silent + found->second.later;
    if (unnoticed > 0)
      std::printf("flips: %s: %llu upsets of plane table or offsets were not noticed\n", name_.c_str(),
                  static_cast<unsigned long long>(unnoticed));
    return all.flips > 0 && all.hang == 0 && all.never == 0 && unnoticed == 0;
  }

  std::string name_;
  const std::vector<Site>& sites_;
  std::unique_ptr<Machine> machine_;
  Options options_;
  scene::StimulusMaker maker_;
  scene::Stimulus tile_, next_;
  Seen right_, right_next_, refused_;
  std::map<std::string, Count> counts_;
  bool sound_ = false;
};

const golden::Config& config_of(const std::string& name) {
  for (const auto& c : rtl::configurations())
    if (c.name == name) return c.config;
  throw std::runtime_error("configuration " + name + " was not built");
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string arg = argv[i];
    if (arg == "--short") {
      options.brief = true;
    } else if (arg == "--all") {
      options.all = true;
    } else if (arg == "--seed" && i + 1 < argc) {
      options.seed = static_cast<uint32_t>(std::atoi(argv[++i]));
    } else if (arg == "--only" && i + 1 < argc) {
      options.only = argv[++i];
    } else {
      std::fprintf(stderr,
                   "usage: flips [--short] [--all] [--seed N] [--only CONFIGURATION:SITE:BIT:CLOCK:WORD[:refused]]\n");
      return 2;
    }
  }
  try {
    bool good = true;
    auto wanted = [&](const std::string& name) {
      return options.only.empty() || options.only.rfind(name + ":", 0) == 0;
    };
    if (wanted("tiny"))
      good &= Campaign("tiny", kTiny, std::make_unique<UpsetEngine<Vflips_tiny>>(config_of("tiny")), config_of("tiny"),
                       options)
                  .run_all();
    if (wanted("odd_2"))
      good &= Campaign("odd_2", kOdd2, std::make_unique<UpsetEngine<Vflips_odd_2>>(config_of("odd_2")),
                       config_of("odd_2"), options)
                  .run_all();
    std::printf("flips: %s\n", good ? "nothing hangs, the tile behind the next one is always right" : "FAILED");
    return good ? 0 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "flips: %s\n", e.what());
    return 2;
  }
}
