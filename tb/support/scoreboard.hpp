// SPDX-License-Identifier: Apache-2.0
// Scoreboard: expected values in order, each with the place it comes from; compares what the RTL delivers.
//   expect(value, place)      queue an expectation
//   observe(value, clock)     the next value of the stage; compared with the oldest expectation
//   ok()                      everything expected was seen, nothing else, no mismatch, and something was compared
//   report()                  counts and the first 8 mismatches: tile, plane, cell, stage, clock, both values
// A scoreboard that compared nothing is not ok.
#pragma once
#include <cstdint>
#include <deque>
#include <sstream>
#include <string>

namespace psweep::tb {

// Where a value belongs; negative coordinates are not printed.
struct Place {
  int tile = -1, plane = -1, x = -1, y = -1;
};

inline std::string to_string(const Place& p) {
  std::ostringstream text;
  if (p.tile >= 0) text << " tile " << p.tile;
  if (p.plane >= 0) text << " plane " << p.plane;
  if (p.x >= 0) text << " cell (" << p.x << ',' << p.y << ')';
  return text.str();
}

class Scoreboard {
 public:
  static constexpr int kMaxReports = 8;

  explicit Scoreboard(std::string stage) : stage_(std::move(stage)) {}

  // Bits outside `mask` are not compared (they mean nothing there).
  void expect(uint64_t value, const Place& place = {}, uint64_t mask = ~uint64_t{0}) {
    expected_.push_back({value & mask, mask, place});
  }

  void observe(uint64_t value, uint64_t clock) {
    if (expected_.empty()) {
      note() << "unexpected value 0x" << std::hex << value << std::dec << " after " << compared_
             << " good places, clock " << clock << '\n';
      return;
    }
    const Expected want = expected_.front();
    expected_.pop_front();
    ++compared_;
    if ((value & want.mask) != want.value)
      note() << "mismatch" << to_string(want.place) << " stage " << stage_ << " clock " << clock << std::hex
             << ": rtl 0x" << value << " model 0x" << want.value << std::dec << '\n';
  }

  // For observations which already know both values.
  void compare(uint64_t value, uint64_t want, const Place& place, uint64_t clock) {
    ++compared_;
    if (value != want)
      note() << "mismatch" << to_string(place) << " stage " << stage_ << " clock " << clock << std::hex << ": rtl 0x"
             << value << " model 0x" << want << std::dec << '\n';
  }

  void forget_expectations() { expected_.clear(); }

  const std::string& stage() const { return stage_; }
  size_t compared() const { return compared_; }
  size_t outstanding() const { return expected_.size(); }
  size_t errors() const { return errors_; }
  bool untouched() const { return errors_ == 0 && expected_.empty() && compared_ == 0; }
  bool ok() const { return errors_ == 0 && expected_.empty() && compared_ > 0; }
  std::string report() const {
    std::ostringstream text;
    text << stage_ << ": " << compared_ << " compared, " << errors_ << " wrong, " << expected_.size() << " missing\n"
         << first_.str();
    return text.str();
  }

 private:
  struct Expected {
    uint64_t value, mask;
    Place place;
  };
  std::ostream& note() {
    static std::ostringstream sink;
    sink.str("");
    return errors_++ < kMaxReports ? first_ : sink;
  }

  std::string stage_;
  std::deque<Expected> expected_;
  size_t compared_ = 0, errors_ = 0;
  std::ostringstream first_;
};

}  // namespace psweep::tb
