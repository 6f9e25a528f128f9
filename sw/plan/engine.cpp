// SPDX-License-Identifier: Apache-2.0
#include "plan/engine.hpp"

#include "core/error.hpp"

namespace psweep {
namespace {

constexpr TileSize kUsualTile{256, 130};

}  // namespace

void fit_format(SweepSetup& setup, std::optional<TileSize> tile) {
  const TileSize size = tile.value_or(kUsualTile);
  const BufferSize need = required_buffer(setup, size.cols, size.rows);
  setup.format.img_cols = need.img_cols;
  setup.format.img_rows = need.img_rows;
  setup.format.plane_cols = need.plane_cols;
  setup.format.plane_rows = need.plane_rows;
  setup.format.planes = setup.spacing.planes;
}

PlanAttempt attempt_plan(const SweepSetup& setup, std::optional<TileSize> tile) {
  // The planner's checks are made for one engine and report to the user; here their text is an answer.
  try {
    const TileSize size = tile ? *tile : largest_tile(setup);
    return {plan_tiles(setup, size.cols, size.rows), {}};
  } catch (const InputError& e) {
    return {std::nullopt, e.what()};
  }
}

golden::TileInput tile_input(const PlacedTile& t, const StereoPair& input) {
  return {t.job, cut_window(input.left, t.left_x, t.left_y, t.job.win_cols, t.job.win_rows),
          cut_window(input.right, t.right_x, t.right_y, t.job.win_cols, t.job.win_rows)};
}

}  // namespace psweep
