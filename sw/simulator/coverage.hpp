// SPDX-License-Identifier: Apache-2.0
// Which bits of the Verilated models changed, over all simulations of a program. Only in builds with PSWEEP_COVERAGE
// (scripts/coverage.sh); in others save_coverage() does nothing.
//   save_coverage(context)   before the model of this context goes
// At the end of the program the file named by environment variable PSWEEP_COVERAGE gets a line per bit:
//   1 or 0, tabulator, module, blank, signal with index
#pragma once
#include <verilated.h>
#if VM_COVERAGE
#include <unistd.h>
#include <verilated_cov.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <mutex>
#include <string>
#endif

namespace psweep::simulator {

#if VM_COVERAGE

class Coverage {
 public:
  static Coverage& instance() {
    static Coverage coverage;
    return coverage;
  }
  // Verilator has no other way to its counters than a file.
  void take(VerilatedContext& context) {
    if (!file_) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::string name = std::string(file_) + "." + std::to_string(getpid()) + ".tmp";
    context.coveragep()->write(name.c_str());
    std::ifstream in(name);
    for (std::string line; std::getline(in, line);) {
      const std::string page = value(line, "page"), signal = value(line, "o");
      const size_t count = line.rfind(' ');
      if (page.rfind("v_toggle/", 0) != 0 || signal.empty() || count == std::string::npos) continue;
      bits_[page.substr(9) + ' ' + signal] |= line.compare(count + 1, std::string::npos, "0") != 0;
    }
    std::remove(name.c_str());
  }

 private:
  Coverage() = default;
  ~Coverage() {
    if (!file_) return;
    std::ofstream out(file_);
    for (const auto& [name, changed] : bits_) out << changed << '\t' << name << '\n';
  }
  // A line holds pairs: \001 key \002 value, up to the next \001 or the apostrophe at the end.
  static std::string value(const std::string& line, const std::string& key) {
    const std::string mark = '\001' + key + '\002';
    const size_t at = line.find(mark);
    if (at == std::string::npos) return {};
    const size_t begin = at + mark.size();
    return line.substr(begin, line.find_first_of("\001'", begin) - begin);
  }

  const char* file_ = std::getenv("PSWEEP_COVERAGE");
  std::mutex mutex_;
  std::map<std::string, bool> bits_;
};

inline void save_coverage(VerilatedContext& context) { Coverage::instance().take(context); }

#else

inline void save_coverage(VerilatedContext&) {}

#endif

}  // namespace psweep::simulator
