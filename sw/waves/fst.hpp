// SPDX-License-Identifier: Apache-2.0
// Wave files: read one, and write another from its signals and from new ones. GTKWave's own code for the format comes
// with Verilator's run-time library.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/error.hpp"

namespace psweep::waves {

// A clock lasts 10 ns in the files: its rising edge is at 10 n ns, and what follows until the next edge is clock n.
constexpr uint64_t kPicosecondsPerClock = 10000;

struct Signal {
  std::string path;   // scopes and name, separated by dots, without range
  std::string range;  // "[12:0]", or nothing
  int width = 1;
  uint32_t handle = 0;
  std::string full() const { return path + range; }  // as in a save file
};

class FstReader {
 public:
  explicit FstReader(const std::string& file);
  ~FstReader();
  FstReader(const FstReader&) = delete;
  FstReader& operator=(const FstReader&) = delete;

  const std::vector<Signal>& signals() const { return signals_; }
  // nullptr if there is none.
  const Signal* find(const std::string& path) const;
  // The one whose path, or end of path behind a dot, is this; throws WaveError.
  const Signal& get(const std::string& path) const;
  uint64_t start() const;
  uint64_t end() const;

  using Change = std::function<void(uint64_t time, uint32_t handle, const char* bits)>;
  // All changes of all signals, or of those given, in the order of time.
  void changes(const Change& change) const;
  void changes(const std::vector<uint32_t>& handles, const Change& change) const;

 private:
  void* context_ = nullptr;
  std::vector<Signal> signals_;
  std::map<std::string, size_t> by_path_;
};

// Values of some signals over time.
class Values {
 public:
  Values(const FstReader& file, const std::vector<uint32_t>& handles);
  // Bits at that time, the most significant one first; throws WaveError before the first one.
  const std::string& bits(uint32_t handle, uint64_t time) const;
  // Clock n, as an unsigned number; throws WaveError if a bit is unknown.
  uint64_t at_clock(uint32_t handle, uint64_t clock) const;
  const std::vector<std::pair<uint64_t, std::string>>& all(uint32_t handle) const;

 private:
  std::map<uint32_t, std::vector<std::pair<uint64_t, std::string>>> values_;
};

uint64_t number(const std::string& bits);

// A signal that the written file has and the original has not: changes in the order of time.
struct NewSignal {
  std::string path;  // below the root
  int width = 1;
  std::vector<std::pair<uint64_t, std::string>> changes;
};

// Copies the scope `root` of `from` (and all below it) for the times first .. last, without the names that the
// conversion to Verilog invented, and adds `added`.
void write_trimmed(const FstReader& from, const std::string& root, uint64_t first, uint64_t last,
                   const std::vector<NewSignal>& added, const std::string& file);

}  // namespace psweep::waves
