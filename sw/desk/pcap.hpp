// SPDX-License-Identifier: Apache-2.0
// PcapWriter: frames as a classic pcap file (little endian, link type 1 = Ethernet, nanosecond magic 0xA1B23C4D), as
// Wireshark, tshark and tcpdump read it. Frames without FCS; time stamps are simulated time since power-on.
#pragma once
#include <cstdio>
#include <string>

#include "contract/frames.hpp"
#include "core/error.hpp"
#include "desk/chip_model.hpp"

namespace psweep::chip {

class PcapWriter {
 public:
  explicit PcapWriter(const std::string& name) : name_(name), file_(std::fopen(name.c_str(), "wb")) {
    if (!file_) throw InputError(name + ": cannot be written");
    put(0xa1b23c4d);
    put(4u << 16 | 2u);  // version 2.4: minor in the upper half
    put(0);              // time zone
    put(0);
    put(65535);  // longest frame
    put(1);
  }
  PcapWriter(const PcapWriter&) = delete;
  PcapWriter& operator=(const PcapWriter&) = delete;
  ~PcapWriter() {
    if (file_) std::fclose(file_);
  }

  void write(const net::Bytes& frame, Time at) {
    put(static_cast<uint32_t>(at / kSecond));
    put(static_cast<uint32_t>(at % kSecond / kNanosecond));
    put(static_cast<uint32_t>(frame.size()));
    put(static_cast<uint32_t>(frame.size()));
    good_ = std::fwrite(frame.data(), 1, frame.size(), file_) == frame.size() && good_;
    ++frames_;
  }
  uint64_t frames() const { return frames_; }
  // Throws if anything could not be written.
  void close() {
    if (!file_) return;
    const bool closed = std::fclose(file_) == 0;
    file_ = nullptr;
    if (!good_ || !closed) throw InputError(name_ + ": could not be written to its end");
  }

 private:
  void put(uint32_t word) {
    unsigned char bytes[4];
    for (int i = 0; i < 4; ++i) bytes[i] = static_cast<unsigned char>(word >> 8 * i);
    good_ = std::fwrite(bytes, 1, 4, file_) == 4 && good_;
  }

  std::string name_;
  std::FILE* file_;
  bool good_ = true;
  uint64_t frames_ = 0;
};

}  // namespace psweep::chip
