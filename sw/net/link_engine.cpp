// SPDX-License-Identifier: Apache-2.0
#include "net/link_engine.hpp"

#include <algorithm>
#include <array>
#include <deque>
#include <map>
#include <optional>

#include "contract/registers.hpp"
#include "golden/control.hpp"

namespace psweep::net {
namespace {

constexpr int kAnswerEvery = 8;                                             // WRITEs
constexpr double kFullDuplexPatience = 0.004, kHalfDuplexPatience = 0.015;  // at least
constexpr double kLeastPause = 0.001;                                       // between two questions that need no hurry
constexpr double kMostPause = 0.25;                                         // well below any silence timer
constexpr uint32_t kMergeGap = 4;       // map chunks sent again in vain rather than one more round trip
constexpr int kMostRefusals = 64;       // of one session, beyond what reordering explains
constexpr int kMostNowhere = 8;         // status blocks in a row without a trace of a started tile
constexpr int kMostStill = 64;          // status blocks in a row in which nothing moves, and no tile is swept
constexpr int kMostFruitlessOpens = 8;  // sessions in a row that brought no tile
constexpr int kMostTableRefusals = 4;   // of a plane table
constexpr int kMostTries = 3;           // of one tile

class Pump {
 public:
  Pump(Client& client, const Capabilities& chip, const std::vector<golden::PlaneEntry>& table, int count,
       const LinkOptions& options, const std::function<golden::TileInput(int)>& input,
       const std::function<void(int, std::vector<golden::MapCell>)>& output,
       const std::function<void(uint64_t)>& progress)
      : client_(client),
        chip_(chip),
        c_(chip.config),
        table_(table),
        count_(count),
        options_(options),
        input_(input),
        output_(output),
        progress_(progress) {}

  LinkFigures run() {
    const double begin = client_.now();
    figures_.counters_before = client_.counters();
    begin_session(false);
    try {
      while (wanted_ < count_) {
        if (lost_session_) {
          keep_finished();
          begin_session(true);
          continue;
        }
        turn();
      }
    } catch (const LinkError&) {
      keep_finished();
      if (!finished_) throw;
      ++figures_.tiles_unconfirmed;
      give(wanted_, std::move(*finished_));
    }
    // Nothing of what follows is needed for the map.
    client_.close();
    client_.briefly([this] { figures_.counters_after = client_.counters(); });
    auto clocks = [&](Counter counter) {
      if (figures_.counters_after.empty()) return uint64_t{0};
      return uint64_t{figures_.counters_after[counter] - figures_.counters_before[counter]} * 256;
    };
    figures_.wait_rows_clocks = clocks(kEngineWaitRows);
    figures_.wait_map_clocks = clocks(kEngineWaitMap);
    figures_.seconds = client_.now() - begin;
    return figures_;
  }

 private:
  // A request that is repeated until it is answered. order: of its latest sending, 0: nothing is waited for.
  struct Pending {
    uint64_t order = 0;
    double sent = 0;
    explicit operator bool() const { return order != 0; }
  };
  struct Chunk {
    uint64_t order = 0;  // of the latest WRITE
    bool known = false;  // the chip has it
  };
  // The tile whose rows are sent: the latest one that was started.
  struct Upload {
    uint16_t number = 0;  // in the session
    bool started = false;
    std::vector<Bytes> rows;
    std::vector<Chunk> chunks;
    uint32_t known = 0, next = 0;                      // next: first chunk never sent
    std::deque<std::pair<uint64_t, uint32_t>> flying;  // order, chunk
    std::deque<uint32_t> again;
    bool done() const { return started && known == chunks.size(); }
  };
  struct Download {
    golden::TileJob job;
    std::vector<golden::MapCell> cells;
    std::vector<bool> there;
    uint32_t known = 0, missing = 0;  // missing: first one
    uint32_t highest = 0;             // one more than the highest received
    bool checked = false;             // a status block told of its end, and of no error
  };

  uint16_t number(int tile) const { return static_cast<uint16_t>(tile - first_); }
  int tile_of(uint16_t number_in_session) const { return first_ + number_in_session; }
  bool ring() const { return c_.map_depth < c_.engine.plane_cols * c_.engine.plane_rows; }
  // Between two questions while the chip is busy with something long.
  double pause() const { return std::clamp(2 * client_.rtt(), kLeastPause, kMostPause); }

  void turn() {
    act();
    const double now = client_.now();
    const auto event = client_.receive(std::max(0.0, next_timer() - now));
    if (event) {
      if (const auto* reply = std::get_if<Reply>(&*event)) {
        on_reply(*reply);
      } else {
        on_map(std::get<MapChunk>(*event));
      }
    }
    on_timer();
    if (client_.silent_for() > client_.timeout()) client_.check_silence(outstanding());
  }

  // The last tile's map, when all of it is there, only not the chip's word that nothing went wrong: better than none.
  void keep_finished() {
    const auto it = downloads_.find(wanted_);
    if (suspect_ || wanted_ != count_ - 1 || it == downloads_.end()) return;
    if (it->second.known == it->second.there.size()) finished_ = std::move(it->second);
    downloads_.erase(it);
  }

  void begin_session(bool again) {
    lost_session_ = suspect_ = false;
    if (again) {
      if (wanted_ == wanted_at_open_ && ++fruitless_ > kMostFruitlessOpens) {
        throw LinkError(client_.where() + ": the session was lost " + std::to_string(fruitless_) +
                        " times without one tile in between");
      }
      if (wanted_ != wanted_at_open_) fruitless_ = 0;
      const std::string cut = fruitless_ > 0 ? client_.fragments() : "";
      if (!cut.empty()) throw LinkError(client_.where() + ": the session brought nothing: " + cut);
      if (!same_capabilities(client_.info().config, c_)) {
        throw LinkError(client_.where() + ": came back as a chip with other capabilities");
      }
    }
    wanted_at_open_ = wanted_;
    client_.close();  // if the session is still there after all, a new one would be refused
    const Status s = client_.open(chip_);
    errors_ = s.errors;
    error_count_ = s.error_count;
    set_duplex(s);
    refusals_ = nowhere_ = still_ = 0;
    first_ = next_ = wanted_;
    upload_ = Upload{};
    upload_active_ = false;
    start_ = read_ = releasing_ = Pending{};
    reading_ = false;
    downloads_.clear();
    start_after_ = 0;
    asked_ = answered_ = 0;
    cells_in_work_ = 0;  // what came of an unfinished tile comes again
    progress_(cells_done_);
    lost_session_ = !write_table(client_, c_, table_);
    session_order_ = client_.order();
    asked_at_ = client_.now();
  }

  // In half duplex who has the medium keeps it for a while (the capture effect of CSMA/CD): at 100 Mbit/s a request or
  // its answer waits 12 ms behind a whole map, and to repeat it would only add to the queue.
  void set_duplex(const Status& s) {
    half_duplex_ = !s.has(kFlagFullDuplex);
    client_.least_patience(half_duplex_ ? kHalfDuplexPatience : kFullDuplexPatience);
  }

  // What can be sent now -------------------------------------------------------------------------------------------
  // RELEASE, READ and START one after the other, the map first: it is the larger part, and rows that overtook the READ
  // would delay all of it (measured: 87 against 92 Mbit/s).
  void act() {
    if (!reading_ && !releasing_ && wanted_ < count_ && downloads_.count(wanted_) != 0) send_read();
    if (!start_ && !releasing_ && !read_ && next_ < count_ && (!upload_active_ || !upload_.started || upload_.done()) &&
        client_.now() >= start_after_ && (options_.in_flight > 1 || (wanted_ == next_ && !releasing_))) {
      prepare();
      send_start();
    }
    if (upload_active_ && upload_.started && !upload_.done()) send_rows();
  }

  void prepare() {
    if (upload_active_ && !upload_.started) return;  // refused for now; its rows are ready
    const golden::TileInput tile = input_(next_);
    upload_ = Upload{};
    upload_.number = number(next_);
    upload_.rows = row_chunks(c_, tile);
    upload_.chunks.resize(upload_.rows.size());
    upload_active_ = true;
    job_ = tile.job;
  }

  void send_start() { start_ = {ask(kStart, upload_.number, 0, start_payload(c_, job_, 1)), client_.now()}; }

  // In half duplex the chip cannot answer while this side sends, and its frames wait for the answer: one burst, one
  // answer, and the chip's map packets in between.
  void send_rows() {
    if (half_duplex_ && (!upload_.flying.empty() || waiting())) return;
    const auto window = static_cast<size_t>(half_duplex_ ? std::min(options_.window, kAnswerEvery) : options_.window);
    while (upload_.flying.size() < window) {
      uint32_t c;
      bool first_time = false;
      if (!upload_.again.empty()) {
        c = upload_.again.front();
        upload_.again.pop_front();
        if (upload_.chunks[c].known) continue;
      } else if (upload_.next < upload_.chunks.size() &&
                 upload_.next < row_base_ + static_cast<uint32_t>(c_.row_slots)) {
        c = upload_.next++;
        first_time = true;
      } else {
        return;
      }
      const bool more = !upload_.again.empty() || (upload_.next < upload_.chunks.size() &&
                                                   upload_.next < row_base_ + static_cast<uint32_t>(c_.row_slots));
      const bool flag =
          (++writes_ % kAnswerEvery == 0 && !half_duplex_) || !more || upload_.flying.size() + 1 == window;
      const uint64_t order =
          client_.send(kWrite, upload_.number, static_cast<uint16_t>(c), upload_.rows[c], flag ? kFlagAnswer : 0);
      if (flag) note_asked(order);
      if (!first_time) ++client_.statistics().resent;
      upload_.chunks[c].order = order;
      upload_.flying.push_back({order, c});
    }
  }

  // From the first missing chunk on: the next gap, with small islands in it, or all that is to come.
  void send_read(bool again = false) {
    const Download& d = downloads_.at(wanted_);
    const uint32_t total = static_cast<uint32_t>(d.there.size());
    uint32_t end = total, island = 0;
    for (uint32_t i = d.missing; i < total; ++i) {
      island = d.there[i] ? island + 1 : 0;
      if (island > kMergeGap) {
        end = i + 1 - island;
        break;
      }
    }
    if (ring()) {
      end = std::min(end, d.missing + std::max<uint32_t>(1, static_cast<uint32_t>(c_.map_depth / c_.chunk_cells())));
    }
    for (uint32_t i = d.missing; i < std::min(end, d.highest); ++i) client_.statistics().lost += !d.there[i];
    read_end_ = end;
    const auto keep = static_cast<uint16_t>(ring() ? d.missing : 0);
    if (again) ++client_.statistics().resent;
    read_ = {ask(kRead, number(wanted_), static_cast<uint16_t>(d.missing),
                 read_payload(static_cast<uint16_t>(end - d.missing), keep)),
             client_.now()};
    read_order_ = read_.order;
    read_began_ = d.missing;
    reading_ = true;
    heard_map_ = client_.now();
    cells_seen_ = 0;
  }

  void send_release() { releasing_ = {ask(kRelease, number(release_tile_)), client_.now()}; }

  uint64_t ask(Type type, uint16_t tile = 0, uint16_t index = 0, const Bytes& payload = {}) {
    const uint64_t order = client_.send(type, tile, index, payload);
    note_asked(order);
    return order;
  }
  void note_asked(uint64_t order) {
    asked_ = order;
    asked_at_ = client_.now();
  }

  // Time -----------------------------------------------------------------------------------------------------------
  // Something was asked that has not been answered, nor anything after it.
  bool waiting() const { return asked_ > answered_; }
  double next_timer() const {
    double t = asked_at_ + (waiting() ? client_.patience() : pause());
    for (const Pending* p : {&start_, &read_, &releasing_})
      if (*p) t = std::min(t, p->sent + client_.patience());
    if (start_after_ > 0 && !start_ && next_ < count_) t = std::min(t, std::max(start_after_, client_.now() + 1e-4));
    return t;
  }

  void on_timer() {
    const double now = client_.now(), patience = client_.patience();
    if (waiting() && now >= asked_at_ + patience) client_.silence();
    auto overdue = [&](const Pending& p) { return p && now >= p.sent + patience; };
    if (overdue(start_)) {
      ++client_.statistics().resent;
      send_start();
    }
    if (overdue(releasing_)) {
      ++client_.statistics().resent;
      send_release();
    }
    if (overdue(read_)) send_read(true);
    // The answer shows what is missing of rows and map, keeps the session, and tells of failures.
    if (now >= asked_at_ + (waiting() ? patience : pause())) ask(kStatus);
  }

  // What comes back ------------------------------------------------------------------------------------------------
  void on_reply(const Reply& r) {
    if (r.type == kOpen || r.type == kTable || r.type == kClose || r.type == kInfo || r.type == kCounters) return;
    if (r.order <= session_order_) return;  // about an older session
    const bool newest = r.order > answered_;
    if (newest) answered_ = r.order;
    if (r.code == kBusy || r.code == kNoSession) {
      lost_session_ = true;
      return;
    }
    if (r.code == kBadMessage) {
      // Nothing this program sends is malformed; perhaps something on the way made it so.
      if (++refusals_ > kMostRefusals) {
        throw LinkError(client_.where() + ": the chip refuses " + type_name(r.type) + " as a bad message");
      }
      return;
    }
    if (!r.status) return;
    const Status& s = *r.status;
    if (!good_status(s)) return;
    if (r.type == kStart && start_ && upload_active_ && r.tile == upload_.number && !upload_.started) {
      on_start(r);
    } else if (r.type == kRead && read_ && r.order == read_.order) {
      read_ = Pending{};
    } else if (r.type == kRelease && releasing_ && r.tile == number(release_tile_)) {
      // "order": an earlier RELEASE of this tile came through, and the next tile is in the map buffer.
      if (r.code == kOk || r.code == kOrder) releasing_ = Pending{};
    }
    if (newest) on_status(s, r.order);
  }

  void on_start(const Reply& r) {
    if (r.code == kOk) {
      start_ = Pending{};
      start_after_ = 0;
      upload_.started = true;
      row_base_ = 0;
      Download d;
      d.job = job_;
      d.cells.resize(static_cast<size_t>(job_.tile_cols) * job_.tile_rows);
      d.there.resize((d.cells.size() + c_.chunk_cells() - 1) / c_.chunk_cells());
      downloads_[next_] = std::move(d);
      ++next_;
    } else if (r.code == kNotReady) {
      if (r.order == start_.order) {
        start_ = Pending{};
        // The shortest round trip: later ones include the rows that waited on this side.
        start_after_ = client_.now() + std::clamp(2 * client_.statistics().rtt_min, kLeastPause, kMostPause);
      }
    } else if (r.order == start_.order) {
      // The session is not what this side believes: begin afresh.
      lost_session_ = true;
    }
  }

  // False if a tile has failed: it comes again in a new session, whose table is written anew as well.
  bool good_status(const Status& s) {
    if (!s.has(kFlagSession)) return true;
    if (s.has(kFlagFailed)) {
      on_failure(s, tile_of(s.failed_tile), ": refused or dropped by the engine");
      return false;
    }
    if (s.error_count < error_count_) {  // cleared since
      error_count_ = s.error_count;
      errors_ = s.errors;
    }
    if (s.error_count > error_count_ || (s.errors & ~errors_) != 0) {
      on_failure(s, tile_of(s.engine_tile), " or the one before it is wrong");
      return false;
    }
    return true;
  }

  void on_failure(const Status& s, int tile, const std::string& what) {
    suspect_ = true;
    finished_.reset();
    if (++tries_[tile] >= kMostTries) {
      throw LinkError(client_.where() + ": tile " + std::to_string(tile) + what +
                      " (engine error bits: " + golden::error_names(s.errors) + "; " + std::to_string(s.window_errors) +
                      " samples outside the loaded window), " + std::to_string(kMostTries) + " times");
    }
    ++figures_.tiles_repeated;
    for (size_t bit = 0; bit < figures_.repeated_by_error.size(); ++bit)
      figures_.repeated_by_error[bit] += s.errors >> bit & 1;
    lost_session_ = true;
  }

  void on_status(const Status& s, uint64_t order) {
    set_duplex(s);
    if (upload_active_ && upload_.started && s.row_tile == upload_.number) {
      const bool consumed = !s.has(kFlagRows);
      row_base_ = std::max(row_base_, s.base);
      for (uint32_t i = 0; i < upload_.chunks.size(); ++i) {
        Chunk& c = upload_.chunks[i];
        if (!c.known && (consumed || s.chunk(i))) {
          c.known = true;
          ++upload_.known;
        }
      }
      while (!upload_.flying.empty() && upload_.flying.front().first <= order) {
        const auto [sent, chunk] = upload_.flying.front();
        upload_.flying.pop_front();
        const Chunk& c = upload_.chunks[chunk];
        if (c.known || c.order != sent) continue;
        ++client_.statistics().lost;
        upload_.again.push_back(chunk);
      }
      if (upload_.done()) upload_.rows.clear();
    }
    const auto it = downloads_.find(wanted_);
    // A started tile that is nowhere would be waited for in vain. Not at once: the chip hands tiles on in steps.
    const bool nowhere =
        it != downloads_.end() && !releasing_ && !s.has(kFlagRows) && !s.has(kFlagEngine) && !s.has(kFlagMap);
    nowhere_ = nowhere ? nowhere_ + 1 : 0;
    // Nor does it go on if this side takes for done what is not: no chip says so, but one wrong packet is enough.
    const std::array<uint32_t, 8> look = {
        s.row_tile, s.flags,    s.engine_tile, s.map_tile,
        s.base,     s.received, s.cells,       it != downloads_.end() ? it->second.known : 0};
    const int engine = s.flags >> 8 & 7;
    const bool sweeping =
        engine == static_cast<int>(golden::State::kSweep) || engine == static_cast<int>(golden::State::kFlush);
    still_ = look == look_ && !sweeping ? still_ + 1 : 0;
    look_ = look;
    if (nowhere_ > kMostNowhere || still_ > kMostStill) lost_session_ = true;
    if (it != downloads_.end() && s.has(kFlagMap) && s.map_tile == number(wanted_)) {
      Download& d = it->second;
      if (s.has(kFlagMapComplete) && !d.checked) {
        // An upset of the chip's count: cells are missing, or lie at other places than they should.
        if (s.cells != d.cells.size()) {
          on_failure(s, wanted_,
                     ": a map of " + std::to_string(s.cells) + " cells, not " + std::to_string(d.cells.size()));
          return;
        }
        d.checked = true;
        figures_.engine_clocks += s.tile_clocks;
        if (d.known == d.there.size()) {
          finish();
          return;
        }
      }
      // Cells are there, the chip knows of the READ, but nothing comes: they were lost.
      const uint32_t there = s.has(kFlagMapComplete) ? static_cast<uint32_t>(d.there.size())
                                                     : s.cells / static_cast<uint32_t>(c_.chunk_cells());
      // Since they were there: a READ may have waited long for the tile.
      if (cells_seen_ == 0 && d.missing < there) cells_seen_ = client_.now();
      const double quiet = client_.now() - std::max(heard_map_, cells_seen_);
      if (reading_ && !read_ && order > read_order_ && d.missing < there && quiet > map_patience()) {
        ++client_.statistics().lost;
        send_read(true);
      }
    }
  }

  double map_patience() const { return std::max(client_.patience() * 0.5, 4 * map_gap_); }

  void on_map(const MapChunk& m) {
    const auto it = downloads_.find(tile_of(m.tile));
    if (it == downloads_.end() || it->first != wanted_ || m.index >= it->second.there.size()) {
      ++client_.statistics().duplicates;
      return;
    }
    Download& d = it->second;
    const size_t first = static_cast<size_t>(m.index) * c_.chunk_cells();
    const size_t expected = std::min(d.cells.size() - first, static_cast<size_t>(c_.chunk_cells()));
    if (m.cells.size() != expected * c_.cell_bytes()) {
      ++client_.statistics().malformed;
      return;
    }
    const double now = client_.now();
    if (m.index != 0) map_gap_ += (std::min(now - heard_map_, kMostPause) - map_gap_) / 8;
    heard_map_ = now;
    if (d.there[m.index]) {
      ++client_.statistics().duplicates;
    } else {
      if (!decode_cells(c_, d.job, m.cells, first, d.cells)) {
        ++client_.statistics().malformed;
        return;
      }
      d.there[m.index] = true;
      ++d.known;
      figures_.cell_bytes += m.cells.size();
      cells_in_work_ += expected;
      progress_(cells_done_ + cells_in_work_);
    }
    d.highest = std::max(d.highest, uint32_t{m.index} + 1);
    while (d.missing < d.there.size() && d.there[d.missing]) ++d.missing;
    if (m.order == read_.order) read_ = Pending{};  // so it has arrived
    if (d.known == d.there.size()) {
      if (d.checked) {
        finish();
      } else {
        ask(kStatus);
      }
      return;
    }
    if (!d.checked && d.known == d.there.size() / 2) ask(kStatus);  // so that the answer is there at the end
    if (m.order != read_order_) return;
    // The range is over, or half of the ring can be freed for more: on with what is missing.
    if (uint32_t{m.index} + 1 == read_end_ ||
        (ring() && read_end_ < d.there.size() &&
         d.missing >= read_began_ + std::max(1u, (read_end_ - read_began_) / 2))) {
      send_read(d.missing < d.highest);
    }
  }

  void finish() {
    const int tile = wanted_;
    Download d = std::move(downloads_.at(tile));
    downloads_.erase(tile);
    give(tile, std::move(d));
    reading_ = false;
    read_ = Pending{};
    if (wanted_ == count_) return;  // CLOSE forgets the last map
    release_tile_ = tile;
    send_release();
  }

  void give(int tile, Download d) {
    cells_done_ += d.cells.size();
    cells_in_work_ = 0;
    progress_(cells_done_);
    figures_.pixel_bytes += golden::load_clocks(d.job) * c_.pair_bytes();
    output_(tile, std::move(d.cells));
    ++wanted_;
  }

  std::string outstanding() const {
    std::string text;
    auto add = [&text](const std::string& part) { text += (text.empty() ? "" : "; ") + part; };
    if (start_) add("START of tile " + std::to_string(next_));
    if (upload_active_ && upload_.started && !upload_.done()) {
      add("rows of tile " + std::to_string(tile_of(upload_.number)) + " (" + std::to_string(upload_.known) + " of " +
          std::to_string(upload_.chunks.size()) + " chunks sent)");
    }
    const auto it = downloads_.find(wanted_);
    if (it != downloads_.end()) {
      add("map of tile " + std::to_string(wanted_) + " (" + std::to_string(it->second.known) + " of " +
          std::to_string(it->second.there.size()) + " chunks received)");
    }
    if (releasing_) add("RELEASE of tile " + std::to_string(release_tile_));
    return text.empty() ? "STATUS" : text;
  }

  Client& client_;
  const Capabilities& chip_;
  const ArbiterConfig& c_;
  const std::vector<golden::PlaneEntry>& table_;
  const int count_;
  const LinkOptions options_;
  const std::function<golden::TileInput(int)>& input_;
  const std::function<void(int, std::vector<golden::MapCell>)>& output_;
  const std::function<void(uint64_t)>& progress_;
  LinkFigures figures_;

  // Tiles: wanted_ <= next_; below wanted_ all received, below next_ all started. first_ is tile 0 of the session.
  int wanted_ = 0, next_ = 0, first_ = 0;
  int wanted_at_open_ = 0, fruitless_ = 0, refusals_ = 0, nowhere_ = 0, still_ = 0;
  std::array<uint32_t, 8> look_{};               // of the latest status block
  bool lost_session_ = false, suspect_ = false;  // suspect_: an error of the engine has come up
  std::map<int, int> tries_;                     // of tiles that failed
  std::optional<Download> finished_;
  bool half_duplex_ = false;
  unsigned errors_ = 0, error_count_ = 0;  // at OPEN
  uint64_t cells_done_ = 0, cells_in_work_ = 0;

  Upload upload_;
  bool upload_active_ = false;
  golden::TileJob job_;  // of upload_
  Pending start_;
  double start_after_ = 0;  // not ready before
  uint32_t row_base_ = 0;
  uint64_t writes_ = 0;

  std::map<int, Download> downloads_;
  Pending read_;          // until its status block came
  bool reading_ = false;  // a READ of tile wanted_ was sent
  uint64_t read_order_ = 0;
  uint32_t read_began_ = 0, read_end_ = 0;
  double heard_map_ = 0, map_gap_ = 0;
  double cells_seen_ = 0;  // when a status block first told of cells for the latest READ, 0: not yet

  Pending releasing_;
  int release_tile_ = 0;

  uint64_t asked_ = 0, answered_ = 0;  // orders of the latest request that is answered, and of the latest answer
  uint64_t session_order_ = 0;         // requests of this session come after it
  double asked_at_ = 0;
};

}  // namespace

Bytes start_payload(const ArbiterConfig& c, const golden::TileJob& job, uint16_t table) {
  const auto pixels = static_cast<uint32_t>(golden::load_clocks(job));
  const auto per = static_cast<uint32_t>(c.chunk_pairs());
  Bytes b;
  append16(b, table);
  append16(b, 0);
  append32(b, pixels);
  append32(b, (pixels + per - 1) / per);
  for (const auto& w : golden::job_writes(job)) append32(b, w.value);
  return b;
}

std::vector<Bytes> row_chunks(const ArbiterConfig& c, const golden::TileInput& tile) {
  const size_t pairs = tile.left.data.size(), per = c.chunk_pairs(), width = c.pair_bytes();
  std::vector<Bytes> chunks((pairs + per - 1) / per);
  for (size_t i = 0; i < chunks.size(); ++i) {
    Bytes& b = chunks[i];
    b.assign(per * width, 0);  // the last one is filled up
    for (size_t k = 0; k < per && i * per + k < pairs; ++k) {
      const uint32_t pair = pack_wire_pair(c.engine, tile.left.data[i * per + k], tile.right.data[i * per + k]);
      for (size_t byte = 0; byte < width; ++byte)
        b[k * width + byte] = static_cast<uint8_t>(pair >> 8 * (width - 1 - byte));
    }
  }
  return chunks;
}

Bytes read_payload(uint16_t count, uint16_t keep) {
  Bytes b;
  append16(b, count);
  append16(b, keep);
  return b;
}

bool decode_cells(const ArbiterConfig& c, const golden::TileJob& job, const Bytes& bytes, size_t first,
                  std::vector<golden::MapCell>& cells) {
  const size_t width = c.cell_bytes(), n = bytes.size() / width;
  if (first + n > cells.size()) return false;
  std::vector<golden::MapCell> decoded(n);
  for (size_t i = 0; i < n; ++i) {
    uint64_t word = 0;
    for (size_t b = 0; b < width; ++b) word = word << 8 | bytes[i * width + b];
    if (word >> c.cell_bits() != 0) return false;
    decoded[i] = unpack_wire_cell(c.engine, word, job.threshold);
    if (decoded[i].plane >= job.planes) return false;
  }
  std::copy(decoded.begin(), decoded.end(), cells.begin() + static_cast<std::ptrdiff_t>(first));
  return true;
}

bool write_table(Client& client, const ArbiterConfig& c, const std::vector<golden::PlaneEntry>& table) {
  const auto writes = golden::table_writes(table);
  const size_t per = static_cast<size_t>(c.chunk_bytes) / 4;
  const double start = client.now();
  int refused = 0;
  for (size_t first = 0; first < writes.size(); first += per) {
    Bytes payload;
    for (size_t i = first; i < std::min(first + per, writes.size()); ++i) append32(payload, writes[i].value);
    for (;;) {
      const Reply r = client.request(kTable, 1, static_cast<uint16_t>(first), payload);
      if (r.code == kOk) break;
      if (r.code == kBusy || r.code == kNoSession) return false;
      // It may have been damaged on its way.
      if (r.code == kBadMessage && ++refused < kMostTableRefusals) continue;
      // The engine may need a moment to drop what an older session left.
      if (r.code != kNotReady || client.now() - start > client.timeout()) {
        throw LinkError(client.where() + ": the plane table was refused: " + code_name(r.code));
      }
    }
  }
  return true;
}

LinkFigures run_link_tiles(Client& client, const Capabilities& chip, const std::vector<golden::PlaneEntry>& table,
                           int count, const LinkOptions& options, const std::function<golden::TileInput(int)>& input,
                           const std::function<void(int, std::vector<golden::MapCell>)>& output,
                           const std::function<void(uint64_t cells)>& progress) {
  try {
    return Pump(client, chip, table, count, options, input, output, progress).run();
  } catch (...) {
    client.close();
    throw;
  }
}

}  // namespace psweep::net
