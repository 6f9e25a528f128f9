// SPDX-License-Identifier: Apache-2.0
// A register of an entity that scripts/tools.py upsets has made one that can be upset; <model>.inc lists them,
// flip_site 1 being the first.
#pragma once

namespace psweep::tb {

struct UpsetSite {
  const char* name;
  int bits;
};

}  // namespace psweep::tb
