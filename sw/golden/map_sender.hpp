// SPDX-License-Identifier: Apache-2.0
// Model of entity map_sender: the READ in force, and when its next chunk can be sent.
#pragma once
#include <cstdint>

namespace psweep::golden {

class MapSender {
 public:
  struct Inputs {
    bool clear = false;                                         // the session ends or begins
    bool decide = false, read_head = false, read_tail = false;  // header of a message; of a READ; its argument
    uint32_t word = 0, word_next = 0;                           // header; argument
    bool answered = false, started = false, sent = false;       // reply begins; chunk begins, ends
    bool map_started = false, map_busy = false, ready = false;  // of map_buffer; ready: chunk() can be read
    uint16_t run_tile = 0;
  };

  bool due(const Inputs& in) const { return active_ && in.map_busy && in.ready && settle_ == 0 && tile_ == map_tile_; }
  bool first() const { return first_; }
  uint16_t chunk() const { return chunk_; }
  uint16_t keep() const { return keep_; }
  uint16_t map_tile() const { return map_tile_; }

  void clock(const Inputs& in) {
    const uint16_t named = static_cast<uint16_t>(in.word >> 16);
    const bool for_map = in.decide ? named == map_tile_ : for_map_;
    if (in.read_tail && for_map_) keep_ = static_cast<uint16_t>(in.word_next);
    if (in.map_started) keep_ = 0;
    if (in.read_head) {
      active_ = false;
      tile_ = named;
      chunk_ = static_cast<uint16_t>(in.word);
    }
    if (in.read_tail) {
      left_ = static_cast<uint16_t>(in.word_next >> 16);
      active_ = left_ != 0;
    }
    if (in.sent) {
      ++chunk_;
      if (--left_ == 0) active_ = false;
    }
    for_map_ = for_map;
    if (in.started) first_ = false;
    if (in.answered && !in.started) first_ = true;
    // What map_buffer says of a chunk belongs to a question of some clocks ago.
    settle_ = in.map_started || in.read_tail || in.sent ? 4 : settle_ > 0 ? settle_ - 1 : 0;
    if (in.map_started) map_tile_ = in.run_tile;
    if (in.clear) {
      active_ = false;
      map_tile_ = 0xffff;
    }
  }

 private:
  bool active_ = false, for_map_ = false, first_ = false;
  uint16_t tile_ = 0, map_tile_ = 0xffff, chunk_ = 0, left_ = 0, keep_ = 0;
  int settle_ = 0;
};

}  // namespace psweep::golden
