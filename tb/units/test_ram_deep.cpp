// SPDX-License-Identifier: Apache-2.0
// ram_deep of one to four parts, with and without columns of nine bits, with latency 1 and 2, against an array.
#include "Vram_deep_11_13000_9_1.h"
#include "Vram_deep_16_49280_0_1.h"
#include "Vram_deep_1_124688_0_1.h"
#include "Vram_deep_2_2_0_1.h"
#include "Vram_deep_31_33280_0_2.h"
#include "Vram_deep_31_33280_27_1.h"
#include "Vram_deep_31_33280_27_2.h"
#include "Vram_deep_3_2049_0_1.h"
#include "Vram_deep_5_30720_0_1.h"
#include "Vram_deep_7_600_0_1.h"
#include "Vram_deep_7_600_0_2.h"
#include "golden/ram_deep.hpp"
#include "support/memory_bench.hpp"

using namespace psweep::tb;

TEST_CASE("ram_deep: 3 * 16384 + 512") { try_memory<Vram_deep_16_49280_0_1, psweep::golden::RamDeep>(16, 49280, 1); }
TEST_CASE("ram_deep: 2 * 16384 + 512, 27 bits in columns of nine") {
  try_memory<Vram_deep_31_33280_27_1, psweep::golden::RamDeep>(31, 33280, 1);
}
TEST_CASE("ram_deep: 8192 + 4096 + 1024, one column of nine") {
  try_memory<Vram_deep_11_13000_9_1, psweep::golden::RamDeep>(11, 13000, 1);
}
TEST_CASE("ram_deep: four parts") { try_memory<Vram_deep_5_30720_0_1, psweep::golden::RamDeep>(5, 30720, 1); }
TEST_CASE("ram_deep: four parts beyond 65536 words, the last one as large as the third") {
  try_memory<Vram_deep_1_124688_0_1, psweep::golden::RamDeep>(1, 124688, 1);
}
TEST_CASE("ram_deep: one part, more words than asked for") {
  try_memory<Vram_deep_3_2049_0_1, psweep::golden::RamDeep>(3, 2049, 1);
}
TEST_CASE("ram_deep: small") { try_memory<Vram_deep_7_600_0_1, psweep::golden::RamDeep>(7, 600, 1); }
TEST_CASE("ram_deep: two words") { try_memory<Vram_deep_2_2_0_1, psweep::golden::RamDeep>(2, 2, 1); }
TEST_CASE("ram_deep: 2 * 16384 + 512, latency 2") {
  try_memory<Vram_deep_31_33280_0_2, psweep::golden::RamDeep>(31, 33280, 2);
}
TEST_CASE("ram_deep: the same, 27 bits in columns of nine") {
  try_memory<Vram_deep_31_33280_27_2, psweep::golden::RamDeep>(31, 33280, 2);
}
TEST_CASE("ram_deep: small, latency 2") { try_memory<Vram_deep_7_600_0_2, psweep::golden::RamDeep>(7, 600, 2); }
