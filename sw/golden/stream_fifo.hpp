// SPDX-License-Identifier: Apache-2.0
// Model of entity stream_fifo: words leave in the order in which they came. When is a matter of clocks; that there are
// no more of them inside than places is not.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <stdexcept>

namespace psweep::golden {

class StreamFifo {
 public:
  explicit StreamFifo(size_t places) : places_(places) {}
  void put(uint64_t word) {
    if (words_.size() == places_) throw std::logic_error("fifo: no place");
    words_.push_back(word);
  }
  uint64_t take() {
    if (words_.empty()) throw std::logic_error("fifo: empty");
    const uint64_t word = words_.front();
    words_.pop_front();
    return word;
  }
  void clear() { words_.clear(); }
  size_t size() const { return words_.size(); }

 private:
  size_t places_;
  std::deque<uint64_t> words_;
};

}  // namespace psweep::golden
