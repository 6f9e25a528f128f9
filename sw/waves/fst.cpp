// SPDX-License-Identifier: Apache-2.0
#include "waves/fst.hpp"

#include <gtkwave/fstapi.h>

#include <algorithm>
#include <memory>

namespace psweep::waves {
namespace {

// GHDL numbers what has no name in the VHDL: n1234_o, n1234_q.
bool invented(const std::string& name) {
  size_t at = 1;
  while (at < name.size() && name[at] >= '0' && name[at] <= '9') ++at;
  return name[0] == 'n' && at > 1 && (at == name.size() || name[at] == '_');
}

// "m_v [12:0]" as the file has it.
std::pair<std::string, std::string> split(const std::string& name) {
  const size_t at = name.find_last_of('[');
  if (at == std::string::npos || name.find(':', at) == std::string::npos) return {name, ""};
  size_t end = at;
  while (end > 0 && name[end - 1] == ' ') --end;
  return {name.substr(0, end), name.substr(at)};
}

struct Callback {
  const FstReader::Change* change;
  static void call(void* self, uint64_t time, fstHandle handle, const unsigned char* value) {
    (*static_cast<Callback*>(self)->change)(time, handle, reinterpret_cast<const char*>(value));
  }
  static void call_long(void* self, uint64_t time, fstHandle handle, const unsigned char* value, uint32_t) {
    call(self, time, handle, value);
  }
};

}  // namespace

FstReader::FstReader(const std::string& file) : context_(fstReaderOpen(file.c_str())) {
  if (!context_) throw WaveError(file + ": no readable FST file");
  std::vector<std::string> scopes;
  while (const fstHier* h = fstReaderIterateHier(context_)) {
    if (h->htyp == FST_HT_SCOPE) {
      const std::string name(h->u.scope.name, h->u.scope.name_length);
      scopes.push_back(scopes.empty() ? name : scopes.back() + '.' + name);
    } else if (h->htyp == FST_HT_UPSCOPE) {
      scopes.pop_back();
    } else if (h->htyp == FST_HT_VAR) {
      Signal s;
      std::string name;
      std::tie(name, s.range) = split(std::string(h->u.var.name, h->u.var.name_length));
      s.path = scopes.empty() ? name : scopes.back() + '.' + name;
      s.width = static_cast<int>(h->u.var.length);
      s.handle = h->u.var.handle;
      by_path_.emplace(s.path, signals_.size());
      signals_.push_back(s);
    }
  }
}
FstReader::~FstReader() { fstReaderClose(context_); }

const Signal* FstReader::find(const std::string& path) const {
  const auto at = by_path_.find(path);
  return at == by_path_.end() ? nullptr : &signals_[at->second];
}
const Signal& FstReader::get(const std::string& path) const {
  if (const Signal* s = find(path)) return *s;
  for (const Signal& s : signals_)
    if (s.path.size() > path.size() &&
        s.path.compare(s.path.size() - path.size() - 1, std::string::npos, '.' + path) == 0)
      return s;
  throw WaveError("no signal " + path + " in the waves");
}
uint64_t FstReader::start() const { return fstReaderGetStartTime(context_); }
uint64_t FstReader::end() const { return fstReaderGetEndTime(context_); }

void FstReader::changes(const Change& change) const {
  fstReaderSetFacProcessMaskAll(context_);
  Callback callback{&change};
  fstReaderIterBlocks2(context_, &Callback::call, &Callback::call_long, &callback, nullptr);
}
void FstReader::changes(const std::vector<uint32_t>& handles, const Change& change) const {
  fstReaderClrFacProcessMaskAll(context_);
  for (const uint32_t h : handles) fstReaderSetFacProcessMask(context_, h);
  Callback callback{&change};
  fstReaderIterBlocks2(context_, &Callback::call, &Callback::call_long, &callback, nullptr);
}

Values::Values(const FstReader& file, const std::vector<uint32_t>& handles) {
  for (const uint32_t h : handles) values_[h];
  file.changes(handles, [this](uint64_t time, uint32_t handle, const char* bits) {
    auto& list = values_[handle];
    if (!list.empty() && list.back().first == time) {
      list.back().second = bits;
    } else {
      list.emplace_back(time, bits);
    }
  });
}
const std::vector<std::pair<uint64_t, std::string>>& Values::all(uint32_t handle) const { return values_.at(handle); }
const std::string& Values::bits(uint32_t handle, uint64_t time) const {
  const auto& list = values_.at(handle);
  auto after = std::upper_bound(list.begin(), list.end(), time, [](uint64_t t, const auto& v) { return t < v.first; });
  if (after == list.begin()) throw WaveError("a value before the beginning of the waves");
  return (--after)->second;
}
uint64_t Values::at_clock(uint32_t handle, uint64_t clock) const {
  return number(bits(handle, clock * kPicosecondsPerClock));
}

uint64_t number(const std::string& bits) {
  uint64_t n = 0;
  for (const char bit : bits) {
    if (bit != '0' && bit != '1') throw WaveError("unknown bits: " + bits);
    n = n << 1 | static_cast<uint64_t>(bit - '0');
  }
  return n;
}

void write_trimmed(const FstReader& from, const std::string& root, uint64_t first, uint64_t last,
                   const std::vector<NewSignal>& added, const std::string& file) {
  const std::unique_ptr<void, void (*)(void*)> writer(fstWriterCreate(file.c_str(), 1), &fstWriterClose);
  if (!writer) throw WaveError(file + ": cannot be written");
  void* const out = writer.get();
  fstWriterSetPackType(out, FST_WR_PT_LZ4);
  fstWriterSetTimescale(out, -12);

  // Scopes are walked as a tree: of neighbours in the list only what differs is closed and opened.
  std::vector<std::string> open;
  auto declare = [&](const std::string& path, const std::string& range, int width, uint32_t alias) {
    std::vector<std::string> parts;
    for (size_t at = 0; at != std::string::npos;) {
      const size_t dot = path.find('.', at);
      parts.push_back(path.substr(at, dot == std::string::npos ? dot : dot - at));
      at = dot == std::string::npos ? dot : dot + 1;
    }
    const std::string name = parts.back();
    parts.pop_back();
    size_t same = 0;
    while (same < open.size() && same < parts.size() && open[same] == parts[same]) ++same;
    for (; open.size() > same; open.pop_back()) fstWriterSetUpscope(out);
    for (; open.size() < parts.size(); open.push_back(parts[open.size()]))
      fstWriterSetScope(out, FST_ST_VCD_MODULE, parts[open.size()].c_str(), nullptr);
    return fstWriterCreateVar(out, FST_VT_VCD_WIRE, FST_VD_IMPLICIT, static_cast<uint32_t>(width),
                              (range.empty() ? name : name + ' ' + range).c_str(), alias);
  };

  std::vector<uint32_t> copied;  // handle there, handle here, 0: not copied
  const size_t skip = root.find_last_of('.') == std::string::npos ? 0 : root.find_last_of('.') + 1;
  for (const Signal& s : from.signals()) {
    if (s.path.compare(0, root.size() + 1, root + '.') != 0 || invented(s.path.substr(s.path.find_last_of('.') + 1)))
      continue;
    if (s.handle >= copied.size()) copied.resize(s.handle + 1);
    copied[s.handle] = declare(s.path.substr(skip), s.range, s.width, copied[s.handle]);
  }
  if (copied.empty()) throw WaveError("no scope " + root + " in the waves");

  struct Event {
    uint64_t time;
    uint32_t handle;
    const std::string* bits;
  };
  std::vector<Event> events;
  const std::string top = root.substr(skip) + ".cell.";
  for (const NewSignal& s : added) {
    const fstHandle h =
        declare(top + s.path, s.width > 1 ? '[' + std::to_string(s.width - 1) + ":0]" : std::string(), s.width, 0);
    for (const auto& change : s.changes) events.push_back({std::max(first, change.first), h, &change.second});
  }
  for (; !open.empty(); open.pop_back()) fstWriterSetUpscope(out);
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) { return a.time < b.time; });

  uint64_t now = 0;
  bool started = false;
  auto go_to = [&](uint64_t time) {
    if (started && time == now) return;
    fstWriterEmitTimeChange(out, now = time);
    started = true;
  };
  size_t next = 0;
  auto add_until = [&](uint64_t time) {
    for (; next < events.size() && events[next].time <= time; ++next) {
      if (events[next].time > last) continue;
      go_to(events[next].time);
      fstWriterEmitValueChange(out, events[next].handle, events[next].bits->c_str());
    }
  };
  // What is there at the beginning, then what changes.
  std::vector<std::string> before(copied.size());
  auto begin = [&] {
    if (started) return;
    go_to(first);
    for (size_t handle = 0; handle < before.size(); ++handle)
      if (!before[handle].empty()) fstWriterEmitValueChange(out, copied[handle], before[handle].c_str());
  };
  uint64_t seen = 0;
  from.changes([&](uint64_t time, uint32_t handle, const char* bits) {
    if (handle >= copied.size() || copied[handle] == 0 || time > last) return;
    if (time <= first) {
      before[handle] = bits;
      return;
    }
    begin();
    if (time != seen) add_until(seen = time);
    go_to(time);
    fstWriterEmitValueChange(out, copied[handle], bits);
  });
  begin();
  add_until(last);
  go_to(last);
}

}  // namespace psweep::waves
