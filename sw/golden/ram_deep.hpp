// SPDX-License-Identifier: Apache-2.0
// Model of entity ram_deep: a ram_sdp of any depth, whatever parts it is made of, and whether these use their ninth
// bits.
#pragma once
#include "golden/ram_sdp.hpp"

namespace psweep::golden {

using RamDeep = RamSdp;

}  // namespace psweep::golden
