// SPDX-License-Identifier: Apache-2.0
// EchoChip: a stand-in that answers ARP, ping and UDP (payload sent back) at the pins of ChipModel, in C++. With it
// link, faults, recording and station are tested by themselves. It never collides on purpose, but defers to the
// carrier and repeats after a collision.
#pragma once
#include <deque>
#include <optional>
#include <random>

#include "contract/frames.hpp"
#include "core/error.hpp"
#include "desk/chip_model.hpp"

namespace psweep::chip {

class EchoChip : public ChipModel {
 public:
  explicit EchoChip(const net::Address& own) : own_(own) {}
  void set_pins(const StaticPins& pins) override { half_ = !pins.full_duplex; }
  void set_reset(bool active) override { reset_ = active; }
  void set_medium(bool carrier, bool collision) override {
    carrier_ = carrier;
    collision_ = collision;
  }
  void clk_edges(int64_t count, Time first, Time period) override {
    if (first <= last_edge_) ++disorder_;
    last_edge_ = first + (count - 1) * period;
    clocks_ += count;
  }
  void rx_edge(const MiiSample& pins, Time at) override {
    if (at < last_edge_) ++disorder_;
    now_ = at;
    if (!pins.valid || reset_) {
      if (!in_.empty()) answer();
      in_.clear();
      in_frame_ = false;
      return;
    }
    if (in_frame_) {
      in_.push_back(pins.data);
    } else if (pins.data == 13) {
      in_frame_ = true;
    }
  }
  MiiSample tx_edge(Time at) override {
    if (at < last_edge_) ++disorder_;
    now_ = at;
    const MiiSample shown = out_;
    if (sending_ && half_ && collision_) {
      jam_ = 8;
      sending_ = false;
      wait_ = 128 * static_cast<int>(random_() % 8);
    }
    if (jam_ > 0) {
      --jam_;
      out_ = {9, true, false};
      gap_ = 0;
    } else if (sending_) {
      const net::Bytes& f = answers_.front();
      const size_t i = at_++;
      const uint8_t byte = i < 16 ? 0x55 : f[(i - 16) / 2];
      out_ = {static_cast<uint8_t>(i == 15 ? 13 : byte >> 4 * (i % 2) & 15), true, false};
      if (at_ == 16 + 2 * f.size() - (damage == Damage::kOddNibble ? 1 : 0)) {
        answers_.pop_front();
        sending_ = false;
      }
      gap_ = 0;
    } else {
      out_ = {};
      ++gap_;
      if (half_ && carrier_) gap_ = 0;
      if (wait_ > 0) --wait_;
      if (answers_.empty()) {
        if (auto frame = unasked()) {
          net::append_fcs(*frame);
          answers_.push_back(std::move(*frame));
        }
      }
      if (!answers_.empty() && gap_ >= 24 && wait_ == 0) {
        sending_ = true;
        at_ = damage == Damage::kPreamble ? 1 : 0;
      }
    }
    return shown;
  }
  bool session() const override { return false; }
  bool busy() const override { return false; }
  int64_t launches() const override { return 0; }
  int64_t busy_clocks() const override { return 0; }
  void open_wave(const std::string& file) override { throw WaveError(file + ": the stand-in has no waves"); }
  void close_wave() override {}

  // What is wrong with the frames it sends.
  enum class Damage { kNone, kFcs, kPreamble, kOddNibble, kShort };
  Damage damage = Damage::kNone;

  int64_t clocks() const { return clocks_; }
  int64_t disorder() const { return disorder_; }
  uint64_t good_frames() const { return good_; }
  uint64_t bad_frames() const { return bad_; }

 protected:
  // The payload that answers this one, if any.
  virtual std::optional<net::Bytes> reply(const net::UdpPacket& udp) { return udp.payload; }
  // A frame that nobody waits for, when there is nothing else to send.
  virtual std::optional<net::Bytes> unasked() { return std::nullopt; }
  Time now() const { return now_; }
  const net::Address& own() const { return own_; }

 private:
  void answer() {
    net::Bytes f;
    for (size_t i = 0; i + 1 < in_.size(); i += 2) f.push_back(static_cast<uint8_t>(in_[i] | in_[i + 1] << 4));
    if (in_.size() % 2 != 0 || f.size() < 64 || !net::fcs_good(f)) {
      ++bad_;
      return;
    }
    ++good_;
    f.resize(f.size() - 4);
    net::Bytes out;
    net::Address to;
    std::copy(f.begin() + 6, f.begin() + 12, to.mac.begin());
    if (net::get16(f, 12) == 0x0806 && net::get32(f, 38) == own_.ip) {
      to.ip = net::get32(f, 28);
      out = net::make_arp_reply(own_, to);
    } else if (auto udp = net::parse_udp(f)) {
      const auto payload = reply(*udp);
      if (!payload) return;
      out = net::make_udp(udp->to, udp->from, *payload);
    } else if (f[23] == net::kProtocolIcmp && net::ones_sum(f.data() + 14, 20) == 0xffff) {
      const size_t length = net::get16(f, 16);
      if (length < 28 || 14 + length > f.size() || net::ones_sum(f.data() + 34, length - 20) != 0xffff) return;
      to.ip = net::get32(f, 26);
      const auto end = f.begin() + static_cast<std::ptrdiff_t>(14 + length);
      out = net::make_icmp_echo(own_, to, 0, net::Bytes(f.begin() + 38, end));
    } else {
      return;
    }
    net::append_fcs(out);
    if (damage == Damage::kFcs) out.back() ^= 1;
    if (damage == Damage::kShort) out.resize(63);
    answers_.push_back(std::move(out));
  }

  net::Address own_;
  bool half_ = false, reset_ = false, carrier_ = false, collision_ = false, in_frame_ = false, sending_ = false;
  std::vector<uint8_t> in_;
  std::deque<net::Bytes> answers_;
  MiiSample out_;
  size_t at_ = 0;
  int jam_ = 0, gap_ = 0, wait_ = 0;
  Time last_edge_ = -1, now_ = 0;
  int64_t clocks_ = 0, disorder_ = 0;
  uint64_t good_ = 0, bad_ = 0;
  std::mt19937 random_{7};
};

}  // namespace psweep::chip
