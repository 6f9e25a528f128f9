// SPDX-License-Identifier: Apache-2.0
#include "waves/layout.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "waves/fst.hpp"

namespace psweep::waves {

const std::vector<std::string>& stages() {
  static const std::vector<std::string> all = {"control",    "address_generator", "storage", "interpolation",
                                               "similarity", "updating",          "psweep"};
  return all;
}

int evaluate(const std::string& sum, const std::map<std::string, int>& keys) {
  int total = 0;
  for (size_t at = 0; at < sum.size();) {
    int sign = 1;
    if (sum[at] == '+' || sum[at] == '-') sign = sum[at++] == '-' ? -1 : 1;
    const size_t end = std::min(sum.find_first_of("+-", at), sum.size());
    const std::string term = sum.substr(at, end - at);
    at = end;
    const auto key = keys.find(term);
    if (key != keys.end()) {
      total += sign * key->second;
    } else if (!term.empty() && term.find_first_not_of("0123456789") == std::string::npos) {
      total += sign * std::stoi(term);
    } else {
      throw WaveError("'" + term + "' is neither a number nor a key of the configuration");
    }
  }
  if (sum.empty()) throw WaveError("a number is missing");
  return total;
}

namespace {

std::string fill_in(std::string text, const std::map<std::string, int>& keys) {
  for (size_t open; (open = text.find('{')) != std::string::npos;) {
    const size_t close = text.find('}', open);
    if (close == std::string::npos) throw WaveError("'}' is missing in " + text);
    const std::string number = std::to_string(evaluate(text.substr(open + 1, close - open - 1), keys));
    text.replace(open, close - open + 1, number);
  }
  return text;
}

bool starts_with(const std::string& text, const std::string& start) {
  return text.compare(0, start.size(), start) == 0;
}

// "rectified=0".
bool holds(const std::string& condition, const std::map<std::string, int>& keys) {
  const size_t equal = condition.find('=');
  if (equal == std::string::npos) throw WaveError("when= wants KEY=N, not '" + condition + "'");
  return evaluate(condition.substr(0, equal), keys) == evaluate(condition.substr(equal + 1), keys);
}

// False if the configuration does not have this signal.
bool read_signal(std::istringstream& words, LayoutSignal& s, const std::map<std::string, int>& keys) {
  bool there = true;
  s.format = "bin";
  for (std::string word; words >> word;) {
    if (word == "bin" || word == "dec" || word == "sdec" || word == "hex") {
      s.format = word;
    } else if (word == "lane") {
      s.lane = true;
    } else if (word == "held") {
      s.held = true;
    } else if (starts_with(word, "bit=")) {
      s.bit = evaluate(word.substr(4), keys);
    } else if (starts_with(word, "as=")) {
      s.alias = word.substr(3);
    } else if (starts_with(word, "when=")) {
      there = holds(word.substr(5), keys);
    } else if ((starts_with(word, "ufix(") || starts_with(word, "sfix(")) && word.back() == ')') {
      s.format = word.substr(0, 4);
      s.fraction = evaluate(word.substr(5, word.size() - 6), keys);
    } else {
      throw WaveError("unknown word '" + word + "'");
    }
  }
  return there;
}

}  // namespace

Layout read_layout(const std::string& folder, const std::string& stage, const std::map<std::string, int>& keys) {
  Layout layout;
  layout.stage = stage;
  layout.file = folder + '/' + stage + ".waves";
  std::ifstream in(layout.file);
  if (!in) throw WaveError(layout.file + ": cannot be read");
  std::string module;
  bool per_lane = false, skip = false;  // skip: a group that the configuration does not have
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (line.empty() || line[0] == '#') continue;
    try {
      std::istringstream words(line);
      std::string first;
      words >> first;
      if (first == "module") {
        std::string rest;
        per_lane = false;
        if (!(words >> module)) throw WaveError("a name is missing");
        if (words >> rest) {
          if (rest != "lane") throw WaveError("unknown word '" + rest + "'");
          per_lane = true;
        }
      } else if (first == "group") {
        LayoutGroup group;
        std::string offset;
        if (module.empty() || !(words >> group.name >> offset)) throw WaveError("not: group NAME OFFSET TITLE");
        group.module = module;
        group.module_per_lane = per_lane;
        group.timed = offset != ".";
        if (group.timed) group.offset = evaluate(offset, keys);
        std::getline(words >> std::ws, group.title);
        skip = false;
        if (starts_with(group.title, "when=")) {
          const size_t end = std::min(group.title.find(' '), group.title.size());
          skip = !holds(group.title.substr(5, end - 5), keys);
          group.title.erase(0, end + 1);
        }
        if (!skip) layout.groups.push_back(group);
      } else {
        if (skip) continue;
        if (layout.groups.empty()) throw WaveError("a signal before the first group");
        LayoutSignal s;
        s.line = number;
        s.name = fill_in(first, keys);
        if (read_signal(words, s, keys)) layout.groups.back().signals.push_back(s);
      }
    } catch (const WaveError& e) {
      throw WaveError(layout.file + ':' + std::to_string(number) + ": " + e.what());
    }
  }
  if (layout.groups.empty()) throw WaveError(layout.file + ": shows nothing");
  return layout;
}

}  // namespace psweep::waves
