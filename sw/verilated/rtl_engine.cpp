// SPDX-License-Identifier: Apache-2.0
#include "verilated/rtl_engine.hpp"

#include <algorithm>
#include <cctype>
#include <exception>
#include <mutex>
#include <sstream>
#include <thread>

#include "core/error.hpp"
#include "verilated/engine_model.hpp"

namespace psweep::rtl {

bool serves(const golden::Config& built, const golden::Config& need) {
  return std::all_of(kEngineFields.begin(), kEngineFields.end(), [&](const auto& field) {
    const int has = built.*field.value, wants = need.*field.value;
    return field.role == Role::size ? has >= wants : field.role != Role::format || has == wants;
  });
}

const Configuration* find_configuration(const golden::Config& need) {
  const Configuration* best = nullptr;
  auto cells = [](const Configuration& c) { return int64_t{c.config.plane_cols} * c.config.plane_rows; };
  for (const auto& c : configurations())
    if (serves(c.config, need) && (!best || cells(c) < cells(*best))) best = &c;
  return best;
}

std::string build_command(const golden::Config& need) {
  auto even = [](int v) { return v + (v & 1); };
  std::ostringstream text;
  // The name carries the formats as well: two requests must not replace each other's file.
  text << "make config NAME=w" << need.window << "_" << need.plane_cols << "x" << need.plane_rows << "_p"
       << need.planes;
  for (const auto& field : kEngineFields)
    if (field.role == Role::format && field.value != &EngineFields::window) text << "_" << need.*field.value;
  for (const auto& field : kEngineFields) {
    if (field.role == Role::build) continue;
    std::string key = field.key;
    std::transform(key.begin(), key.end(), key.begin(), [](unsigned char c) { return std::toupper(c); });
    text << " " << key << "=" << (field.multiple == 2 && field.rest == 0 ? even(need.*field.value) : need.*field.value);
  }
  return text.str();
}

RtlEngine::RtlEngine(const Configuration& configuration)
    : config_(configuration.config), model_(configuration.make()) {}
RtlEngine::~RtlEngine() = default;
RtlEngine::RtlEngine(RtlEngine&&) noexcept = default;
RtlEngine& RtlEngine::operator=(RtlEngine&&) noexcept = default;

const golden::Config& RtlEngine::config() const { return config_; }
void RtlEngine::set_table(const std::vector<golden::PlaneEntry>& table) {
  if (table.size() > static_cast<size_t>(config_.planes))
    throw EngineError("rtl engine: " + std::to_string(table.size()) + " planes, the hardware has room for " +
                      std::to_string(config_.planes));
  model_->set_table(table);
}
TileOutput RtlEngine::run(const golden::TileJob& job, const golden::Pixels& left, const golden::Pixels& right) {
  for (const auto* image : {&left, &right})
    if (image->width != job.win_cols || image->height != job.win_rows)
      throw EngineError("rtl engine: pixels are " + std::to_string(image->width) + "x" + std::to_string(image->height) +
                        ", the tile's window is " + std::to_string(job.win_cols) + "x" + std::to_string(job.win_rows));
  return model_->run(job, left, right);
}
void RtlEngine::count_clocks_in(std::atomic<uint64_t>* counter) { model_->count_clocks_in(counter); }

void run_tiles(const Configuration& configuration, const std::vector<golden::PlaneEntry>& table, int count, int threads,
               const std::function<golden::TileInput(int)>& input, const std::function<void(int, TileOutput)>& output,
               std::atomic<uint64_t>* clock_counter) {
  if (threads <= 0) threads = std::max(1u, std::thread::hardware_concurrency());
  threads = std::min(threads, count);
  std::mutex mutex;
  std::exception_ptr failure;
  int next = 0;
  auto work = [&] {
    try {
      RtlEngine engine(configuration);
      engine.set_table(table);
      engine.count_clocks_in(clock_counter);
      std::unique_lock<std::mutex> lock(mutex);
      while (next < count && !failure) {
        const int tile = next++;
        const golden::TileInput in = input(tile);
        lock.unlock();
        TileOutput out = engine.run(in.job, in.left, in.right);
        lock.lock();
        output(tile, std::move(out));
      }
    } catch (...) {
      std::lock_guard<std::mutex> lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  std::vector<std::thread> workers;
  for (int i = 0; i < threads; ++i) workers.emplace_back(work);
  for (auto& worker : workers) worker.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace psweep::rtl
