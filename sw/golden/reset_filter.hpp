// SPDX-License-Identifier: Apache-2.0
// Model of entity reset_filter: a level of arst_n counts when so many edges in a row have seen it, and shows at rst two
// edges behind the last of them. The beginning is that after a long rest.
#pragma once
#include <array>

namespace psweep::golden {

class ResetFilter {
 public:
  static constexpr int kEdges = 16;    // that a level must cover
  static constexpr int kLatency = 18;  // edges from arst_n to rst

  explicit ResetFilter(bool arst_n) : way_{!arst_n, !arst_n}, rst_(!arst_n) {}
  void edge(bool arst_n) {
    const bool seen = way_[1];
    way_ = {!arst_n, way_[0]};
    run_ = seen == rst_ ? 0 : run_ + 1;
    if (run_ == kEdges) {
      rst_ = seen;
      run_ = 0;
    }
  }
  bool rst() const { return rst_; }

 private:
  std::array<bool, kLatency - kEdges> way_;
  bool rst_;
  int run_ = 0;
};

}  // namespace psweep::golden
