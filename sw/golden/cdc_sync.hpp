// SPDX-License-Identifier: Apache-2.0
// Model of entity cdc_sync: what was sampled comes out so many clocks later, which is a delay_line that is always
// enabled. (That a bit which changes at the edge may be sampled either way is not modelled: there is no such edge
// here.)
#pragma once
#include <cstddef>
#include <cstdint>

#include "golden/delay_line.hpp"

namespace psweep::golden {

class CdcSync : public DelayLine {
 public:
  explicit CdcSync(size_t stages) : DelayLine(stages) {}
  void clock(uint32_t sampled) { DelayLine::clock(true, sampled); }
};

}  // namespace psweep::golden
