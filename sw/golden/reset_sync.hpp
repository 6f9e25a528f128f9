// SPDX-License-Identifier: Apache-2.0
// Model of entity reset_sync: rst rises with arst at any time, also without a clock; it falls with the third edge after
// arst has fallen.
#pragma once

namespace psweep::golden {

class ResetSync {
 public:
  static constexpr int kEdges = 3;

  void set(bool arst) {
    arst_ = arst;
    if (arst) left_ = kEdges;
  }
  void edge() {
    if (!arst_ && left_ > 0) --left_;
  }
  bool rst() const { return left_ > 0; }

 private:
  bool arst_ = true;
  int left_ = kEdges;
};

}  // namespace psweep::golden
