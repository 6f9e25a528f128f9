// SPDX-License-Identifier: Apache-2.0
// The engine's words (golden/registers.hpp) under the names that the Verilated engine's code uses.
#pragma once
#include "golden/registers.hpp"

namespace psweep::rtl {

using golden::error_names;
using golden::job_writes;
using golden::pack_cell;
using golden::RegisterWrite;
using golden::table_writes;
using golden::unpack_cell;

}  // namespace psweep::rtl
