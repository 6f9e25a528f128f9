// SPDX-License-Identifier: Apache-2.0
// Model of entity ram_wide: a ram_sdp of any width and depth, whatever blocks it is made of.
#pragma once
#include "golden/ram_sdp.hpp"

namespace psweep::golden {

using RamWide = RamSdp;

}  // namespace psweep::golden
