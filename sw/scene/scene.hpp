// SPDX-License-Identifier: Apache-2.0
// Synthetic Mars-like stereo pairs with ground truth (paper, section 3.2: a simulated rover on "rocky" and "flat"
// ground). A height field with fractal undulation, wind ripples and rocks of a power-law size distribution is ray-cast
// through the paper's rig: 1120 x 1120 pixels, f = 1200 px, baseline 0.20 m, mast 1 m, 39 degrees below the horizon.
// Other sizes scale f, so the view stays the same. docs/accuracy.md describes the model.
//
// The same bytes for (kind, seed, size) on every machine with IEEE arithmetic: integer hashes and + - * / sqrt only,
// no library transcendentals, no std distributions, no contraction. The number of threads changes nothing.
#pragma once
#include <cstdint>
#include <functional>

#include "core/image.hpp"
#include "core/rig.hpp"

namespace psweep {

enum class SceneKind { kRocky, kFlat };

struct Scene {
  Gray left, right;
  FloatImage truth;  // per map cell: depth Z in metres from the cyclopean eye of what the cell's ray hits first
                     // (computed in double precision); +inf where it hits nothing
  Rig rig;
};

// The paper's rig, scaled to `size` x `size` pixels.
Rig rover_rig(int size);

// size: 16 .. 4096, threads >= 1, else InputError. progress: fraction done, 0 .. 1, from any thread, never two at once;
// may be empty.
Scene render(SceneKind kind, uint64_t seed, int size, int threads = 1,
             const std::function<void(double)>& progress = {});

}  // namespace psweep
