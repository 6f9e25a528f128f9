// SPDX-License-Identifier: Apache-2.0
// Portable sweep: any processor, any legal format. Contract: sweep.hpp.
#include "fast/sweep.hpp"

namespace psweep::fast {
namespace {

#include "fast/sweep_raster.inc"

}  // namespace

const SweepLevel kRasterPlain = {1, sweep_raster, local_max_raster};

}  // namespace psweep::fast
