// SPDX-License-Identifier: Apache-2.0
// psweep render: a synthetic scene as files that psweep depth and eval take.
#include <algorithm>
#include <cstdio>
#include <thread>

#include "app/options.hpp"
#include "io/calibration.hpp"
#include "io/image_io.hpp"
#include "io/output_dir.hpp"
#include "io/pfm.hpp"
#include "io/picture.hpp"
#include "io/progress.hpp"
#include "scene/scene.hpp"

namespace psweep {

void render_command(const RenderOptions& o) {
  OutputDir out(o.output);
  const int threads = o.threads > 0 ? o.threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  Scene scene;
  {
    Progress bar("render", o.quiet);
    scene = render(o.kind == "flat" ? SceneKind::kFlat : SceneKind::kRocky, o.seed, o.size, threads,
                   [&](double share) { bar.update(static_cast<size_t>(share * 1000), 1000); });
  }
  write_png(out.file("left.png"), scene.left);
  write_png(out.file("right.png"), scene.right);
  write_pfm(out.file("truth.pfm"), scene.truth);
  write_png(out.file("truth.png"), depth_picture(scene.truth, PlaneSpacing()));
  write_calibration(out.file("calib.yaml"), scene.rig);
  out.commit();
  if (o.quiet) return;
  std::printf("%s, seed %llu: %dx%d, f = %g px, baseline %g m\nwritten: %s\n", o.kind.c_str(),
              static_cast<unsigned long long>(o.seed), scene.rig.width, scene.rig.height, scene.rig.left.fx,
              scene.rig.baseline, out.target().c_str());
}

}  // namespace psweep
