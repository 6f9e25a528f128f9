# SPDX-License-Identifier: Apache-2.0
"""The demo (make demo, make demo-full): renders a rocky scene, computes its depth by float reference, bit-true model
and simulated hardware, proves that the last two wrote the same bytes, evaluates against ground truth, and writes one
page with everything. Exit code 0 only if hardware and model agree in every file."""
from __future__ import annotations

import pathlib

from . import pairs, work
from .work import Failure

RUNS = {"float": ("float",), "fixed": ("fixed",), "rtl": ("rtl",), "fixed_cleaned": ("fixed", "--cleanup")}


def main(arguments: list[str]) -> int:
    options = work.parser("scripts/demo.sh", __doc__)
    options.add_argument("--full", action="store_true", help="1120x1120 pixels and 301 planes (default: 400x400, 109)")
    options.add_argument("--psweep", default="build/psweep", metavar="FILE", help="the command line")
    options.add_argument("--out", metavar="DIR", help="default: build/demo, with --full build/demo-full")
    for name, default in (("size", None), ("planes", None), ("seed", 1), ("threads", 0)):
        options.add_argument(f"--{name}", type=int, default=default, metavar="N")
    given = options.parse_args(arguments)
    psweep, clock = pairs.program(given.psweep), work.Clock()
    size, planes = given.size or (1120 if given.full else 400), given.planes or (301 if given.full else 109)
    out = pathlib.Path(given.out or ("build/demo-full" if given.full else "build/demo"))
    out.mkdir(parents=True, exist_ok=True)
    scene = out / "scene"
    print(f"== scene: rocky terrain, {size}x{size}, seed {given.seed}", flush=True)
    work.run([psweep, "render", "--kind", "rocky", "--seed", str(given.seed), "--size", str(size), "-o", scene])
    for name, (engine, *more) in RUNS.items():
        print(f"== {name}", flush=True)
        work.run([psweep, "depth", scene / "left.png", scene / "right.png", "--calib", scene / "calib.yaml", "--planes",
                  str(planes), "--threads", str(given.threads), "-o", out / name, "--engine", engine, *more])
        work.run([psweep, "eval", out / name, scene / "truth.pfm"])
    print("== fixed = rtl?", flush=True)
    if not pairs.same_output(out / "fixed", out / "rtl"):
        raise Failure("hardware and model differ")
    work.run([psweep, "report", *(out / name for name in RUNS), "-o", out / "index.html", "--title",
              "psweep: plane-sweep stereo in simulated hardware", "--input", scene / "left.png", "--truth",
              scene / "truth.pfm", "--note", f"A rendered rocky terrain ({size}x{size} pixels, seed {given.seed}), "
              f"swept over {planes} planes."])
    print(f"demo: hardware and model agree in every file; wall time {clock}; open {out}/index.html")
    return 0
