// SPDX-License-Identifier: Apache-2.0
// Layouts of save files: sw/waves/<stage>.waves, the signals of an entity in the order of its pipeline.
//
//   module NAME [lane]            instance whose signals follow; "lane": there is one per lane
//   group NAME OFFSET [when=KEY=N] TITLE
//                                 OFFSET: clocks behind the entity's input (control: its output); ".": not in step
//     SIGNAL [FORMAT] [lane] [held] [bit=N] [as=NAME] [when=KEY=N]
//
// FORMAT: bin (default), dec, sdec, hex, ufix(N), sfix(N) with N fraction bits. lane: of a bundle the field of the
// cell's lane. held: the value at the cell's clock, from that clock on. bit=N: one bit. as=: shown under this name.
// when=: only in configurations with that number. Numbers may be sums of numbers and keys of the configuration (and
// `lane`), such as 16+mncc_bits; {..} in SIGNAL likewise.
#pragma once
#include <map>
#include <string>
#include <vector>

namespace psweep::waves {

struct LayoutSignal {
  int line = 0;
  std::string name, alias, format;  // format: bin, dec, sdec, hex, ufix or sfix
  int fraction = 0;                 // fraction bits
  bool lane = false, held = false;
  int bit = -1;
};
struct LayoutGroup {
  std::string module, name, title;
  bool module_per_lane = false, timed = false;
  int offset = 0;
  std::vector<LayoutSignal> signals;
};
struct Layout {
  std::string stage, file;
  std::vector<LayoutGroup> groups;
};

// control .. updating in the order of the data, and psweep, which shows them all.
const std::vector<std::string>& stages();

// The layout of a stage for one configuration; throws WaveError.
Layout read_layout(const std::string& folder, const std::string& stage, const std::map<std::string, int>& keys);

// Sum of numbers and keys.
int evaluate(const std::string& sum, const std::map<std::string, int>& keys);

}  // namespace psweep::waves
