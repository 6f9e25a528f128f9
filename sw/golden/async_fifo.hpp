// SPDX-License-Identifier: Apache-2.0
// Model of entity async_fifo: a FIFO, whatever the clocks of its sides.
#pragma once
#include "golden/stream_fifo.hpp"

namespace psweep::golden {

using AsyncFifo = StreamFifo;

}  // namespace psweep::golden
