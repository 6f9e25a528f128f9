// SPDX-License-Identifier: Apache-2.0
// One cell's values at every stage: the model's beside those in the waves.
#pragma once
#include <string>
#include <vector>

#include "waves/capture.hpp"

namespace psweep::waves {

struct TableRow {
  std::string stage, what;
  uint64_t clock = 0;
  std::string sample;  // "plane: column,row" of the sample or cell
  int64_t golden = 0, rtl = 0;
  int fraction = -1;     // fraction bits of both, -1: none
  bool compared = true;  // false: means nothing here, shown only
  bool equal() const { return !compared || golden == rtl; }
};

// The model runs on `stimulus`, which is that of the capture unless a test wants them to differ.
std::vector<TableRow> compare_cell(const Capture& capture, const scene::Stimulus& stimulus);

// Text; with `all` also rows that mean nothing. Ends with a line that counts.
std::string table_text(const Capture& capture, const std::vector<TableRow>& rows);
// Interpolated samples of the window, left and right, those of the waves; "model/waves" where they differ.
std::string window_text(const Capture& capture, const scene::Stimulus& stimulus);

size_t differences(const std::vector<TableRow>& rows);

}  // namespace psweep::waves
