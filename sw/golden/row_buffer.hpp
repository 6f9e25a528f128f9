// SPDX-License-Identifier: Apache-2.0
// Model of entity row_buffer, by transactions: which chunks are taken, what the status shows, which pixels come out.
// When chunks are consumed is a matter of clocks and comes from outside.
#pragma once
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

namespace psweep::golden {

class RowBuffer {
 public:
  enum class Answer { kRefused, kNew, kRepeated };

  RowBuffer(int pix_bits, int chunk_pairs, int slots) : pix_bits_(pix_bits), chunk_pairs_(chunk_pairs), slots_(slots) {}

  int pair_bytes() const { return (2 * pix_bits_ + 7) / 8; }
  size_t chunk_bytes() const { return static_cast<size_t>(chunk_pairs_) * static_cast<size_t>(pair_bytes()); }

  void clear() {
    open_ = false;
    base_ = stored_ = 0;
    chunks_ = 0;
    there_.clear();
    pairs_.clear();
  }
  // The launched tile has failed; rows_left: not all of its pairs have been taken.
  void fail(bool rows_left) {
    if (rows_left) clear();
  }
  void open_tile(uint32_t pixels, int chunks) {
    clear();
    open_ = true;
    pixels_ = pixels;
    chunks_ = chunks;
    there_.assign(static_cast<size_t>(chunks), false);
    pairs_.clear();
  }

  Answer check(int chunk) const {
    if (chunk < base_) return Answer::kRepeated;
    if (!open_ || chunk >= chunks_ || chunk >= base_ + slots_) return Answer::kRefused;
    return there_[static_cast<size_t>(chunk)] ? Answer::kRepeated : Answer::kNew;
  }
  // Bytes of the chunk, {left, right} of each pair big endian; bits above the pair are ignored.
  void store(int chunk, const std::vector<uint8_t>& bytes) {
    if (check(chunk) != Answer::kNew || bytes.size() != chunk_bytes()) throw std::logic_error("row buffer: not new");
    const size_t end = static_cast<size_t>(chunk + 1) * static_cast<size_t>(chunk_pairs_);
    if (pairs_.size() < end) pairs_.resize(end, 0);
    size_t at = 0;
    for (int i = 0; i < chunk_pairs_; ++i) {
      uint32_t pair = 0;
      for (int k = 0; k < pair_bytes(); ++k) pair = pair << 8 | bytes[at++];
      pairs_[static_cast<size_t>(chunk) * static_cast<size_t>(chunk_pairs_) + static_cast<size_t>(i)] =
          pair & ((1u << 2 * pix_bits_) - 1);
    }
    there_[static_cast<size_t>(chunk)] = true;
    ++stored_;
  }
  // A chunk has been sent.
  void consume() {
    ++base_;
    if (base_ == chunks_) open_ = false;
  }

  bool open() const { return open_; }
  int base() const { return base_; }
  int received() const { return stored_; }
  bool complete() const { return open_ && base_ == 0 && (stored_ == chunks_ || stored_ == slots_); }
  bool bit(int index) const {
    const int chunk = base_ + index;
    return open_ && index < slots_ && chunk < chunks_ && there_[static_cast<size_t>(chunk)];
  }
  bool there(uint32_t pixel) const { return there_[pixel / static_cast<size_t>(chunk_pairs_)]; }
  uint32_t pixels() const { return pixels_; }
  // m_tdata: left in the low half.
  uint32_t beat(uint32_t pixel) const {
    const uint32_t mask = (1u << pix_bits_) - 1;
    return (pairs_[pixel] & mask) << pix_bits_ | pairs_[pixel] >> pix_bits_;
  }
  int chunks() const { return chunks_; }
  // Chunks sent when n pixels have been: the last one counts when it is as long as the tile needs it.
  int chunks_of(uint32_t n) const { return n == pixels_ ? chunks_ : static_cast<int>(n) / chunk_pairs_; }

 private:
  int pix_bits_, chunk_pairs_, slots_;
  bool open_ = false;
  int base_ = 0, stored_ = 0, chunks_ = 0;
  uint32_t pixels_ = 0;
  std::vector<bool> there_;
  std::vector<uint32_t> pairs_;
};

}  // namespace psweep::golden
