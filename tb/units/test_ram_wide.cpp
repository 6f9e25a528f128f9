// SPDX-License-Identifier: Apache-2.0
// ram_wide, cut into blocks or not, with latency 1 and 2, against an array.
#include "Vram_wide_18_4128_1.h"
#include "Vram_wide_1_2_2.h"
#include "Vram_wide_20_14352_1.h"
#include "Vram_wide_20_14352_2.h"
#include "Vram_wide_20_14385_1.h"
#include "Vram_wide_20_16384_1.h"
#include "Vram_wide_20_3484_2.h"
#include "Vram_wide_36_2050_1.h"
#include "Vram_wide_38_6144_2.h"
#include "golden/ram_wide.hpp"
#include "support/memory_bench.hpp"

using namespace psweep::tb;

TEST_CASE("ram_wide: seven blocks, 16 words, 2 bits") {
  try_memory<Vram_wide_20_14352_1, psweep::golden::RamWide>(20, 14352, 1);
}
TEST_CASE("ram_wide: the same with latency 2") {
  try_memory<Vram_wide_20_14352_2, psweep::golden::RamWide>(20, 14352, 2);
}
TEST_CASE("ram_wide: two eighteens, no bit above") {
  try_memory<Vram_wide_36_2050_1, psweep::golden::RamWide>(36, 2050, 1);
}
TEST_CASE("ram_wide: two eighteens, two bits above, no word behind") {
  try_memory<Vram_wide_38_6144_2, psweep::golden::RamWide>(38, 6144, 2);
}
TEST_CASE("ram_wide: 32 words behind") { try_memory<Vram_wide_18_4128_1, psweep::golden::RamWide>(18, 4128, 1); }
TEST_CASE("ram_wide: eight blocks") { try_memory<Vram_wide_20_16384_1, psweep::golden::RamWide>(20, 16384, 1); }
TEST_CASE("ram_wide: too many words behind the blocks") {
  try_memory<Vram_wide_20_14385_1, psweep::golden::RamWide>(20, 14385, 1);
}
TEST_CASE("ram_wide: no block less") { try_memory<Vram_wide_20_3484_2, psweep::golden::RamWide>(20, 3484, 2); }
TEST_CASE("ram_wide: two words of one bit") { try_memory<Vram_wide_1_2_2, psweep::golden::RamWide>(1, 2, 2); }
