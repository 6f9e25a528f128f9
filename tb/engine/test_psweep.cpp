// SPDX-License-Identifier: Apache-2.0
// Good tiles: every stage and every cell equal the model, under all stalls, in every geometry and texture, tile after
// tile; clocks are the formula's.
#include "engine/configurations.hpp"
#include "engine/engine_bench.hpp"

using namespace psweep;
using namespace psweep::tb;

TEMPLATE_TEST_CASE("engine: every texture in every geometry, back to back", "", Tiny, Odd, Odd2, Odd4, Rectified,
                   Rectified2) {
  const uint32_t seed = test_seed();
  INFO("seed " << seed);
  const golden::Config config = TestType::config();
  EngineBench<typename TestType::Dut> bench(config, seed);
  scene::StimulusMaker maker(config, seed);
  uint64_t found = 0;
  for (int texture = 0; texture < 5; ++texture) {
    for (int geometry = 0; geometry < 4; ++geometry) {
      const bool full = geometry == 0;
      bench.run(maker.make(static_cast<scene::Texture>(texture), static_cast<scene::Geometry>(geometry),
                           full ? config.plane_cols : 1 + maker.below(config.plane_cols),
                           full ? config.plane_rows : 1 + maker.below(config.plane_rows),
                           full ? config.planes : 1 + maker.below(config.planes)));
      for (const auto& cell : bench.expected_cells()) found += cell.local_max;
    }
  }
  CHECK(found > 100);  // the stimuli lead to depths, not to nothing but rejected cells
}

TEMPLATE_TEST_CASE("engine: stalls on every stream change nothing but the clocks", "", Tiny, Odd, Odd2, Odd4, Rectified,
                   Rectified2) {
  const uint32_t seed = test_seed() + 1;
  const double amount = GENERATE(0.3, 0.8);
  const int which = GENERATE(1, 2, 4, 7);
  INFO("seed " << seed << " stall " << amount << " streams " << which);
  const Stalls stalls{which & 1 ? amount : 0, which & 2 ? amount : 0, which & 4 ? amount : 0};
  const golden::Config config = TestType::config();
  EngineBench<typename TestType::Dut> bench(config, seed, stalls);
  scene::StimulusMaker maker(config, seed);
  for (int i = 0; i < 3; ++i) bench.run(maker.any());
}

TEMPLATE_TEST_CASE("engine: smallest tiles", "", Tiny, Odd, Odd2, Odd4, Rectified, Rectified2) {
  const golden::Config config = TestType::config();
  EngineBench<typename TestType::Dut> bench(config, test_seed());
  scene::StimulusMaker maker(config, test_seed());
  bench.run(maker.make(scene::Texture::kRandom, scene::Geometry::kInside, 1, 1, 1));
  bench.run(maker.make(scene::Texture::kStereo, scene::Geometry::kInside, 1, 1, config.planes));
  bench.run(maker.make(scene::Texture::kStereo, scene::Geometry::kInside, 1, config.plane_rows, config.planes));
  bench.run(maker.make(scene::Texture::kStereo, scene::Geometry::kInside, config.plane_cols, 1, config.planes));
  for (int cols = 2; cols < 9; ++cols)  // rows around the shortest that needs no idle clocks
    bench.run(maker.make(scene::Texture::kStereo, scene::Geometry::kInside, cols, 2, 3));
}

TEMPLATE_TEST_CASE("engine: random tiles with random stalls", "", Tiny, Odd, Odd2, Odd4, Rectified, Rectified2) {
  const uint32_t seed = test_seed() + 2;
  INFO("seed " << seed);
  const golden::Config config = TestType::config();
  scene::StimulusMaker maker(config, seed);
  for (int i = 0; i < 6; ++i) {
    auto stall = [&] { return maker.below(2) ? 0.0 : maker.uniform(0, 0.9); };
    EngineBench<typename TestType::Dut> bench(config, seed + static_cast<uint32_t>(i), {stall(), stall(), stall()});
    for (int tile = 0; tile < 4; ++tile) bench.run(maker.any());
  }
}
