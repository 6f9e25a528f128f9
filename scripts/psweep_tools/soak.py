# SPDX-License-Identifier: Apache-2.0
"""Random tiles, good and bad, one after the other, in several engines (tb/soak/soak.cpp): nothing hangs, every error is
counted, the next good tile is right in every stage.

N tiles in all, shared by the configurations. Environment: JOBS. Exit code 1 if any fails, or if nothing was run."""
from __future__ import annotations

import pathlib

from . import work
from .paths import ROOT

SMALL = ("tiny", "narrow", "odd", "odd_2", "odd_4", "rectified", "rectified_2")


def run(program: pathlib.Path, name: str, tiles: int, seed: int, log: pathlib.Path) -> bool:
    return work.run([program], log=log, check=False, environment={
        "PSWEEP_CONFIG": name, "PSWEEP_TILES": str(tiles), "PSWEEP_SEED": str(seed)}) == 0


def main(arguments: list[str]) -> int:
    options = work.parser("scripts/soak.sh", __doc__)
    options.add_argument("--build", default="build", metavar="DIR")
    options.add_argument("--tiles", type=int, default=10000, metavar="N")
    options.add_argument("--seed", type=int, default=1, metavar="N")
    options.add_argument("names", nargs="*", metavar="CONFIGURATION", help=f"default: {' '.join(SMALL)}")
    given = options.parse_args(arguments)
    if given.tiles < 1 or given.seed < 0:
        options.error("--tiles and --seed are numbers")
    names, clock = given.names or list(SMALL), work.Clock()
    each = -(-given.tiles // len(names))
    build = ROOT / given.build
    out = work.fresh(build / "soak")

    def one(name: str) -> bool:
        log = out / f"{name}.log"
        good = run(build / "tb" / "soak" / "soak", name, each, given.seed, log)
        lines = log.read_text(errors="replace").splitlines()
        shown = [line for line in lines if line.startswith("soak: ")] if good else [*lines, f"soak: {name}: FAILED"]
        print("\n".join(shown), flush=True)
        return good

    good = sum(work.in_parallel(one, names))
    print(f"soak: {good} of {len(names)} configurations, {each * good} tiles, seed {given.seed}, {clock}")
    return 0 if good == len(names) else 1
