# SPDX-License-Identifier: Apache-2.0
"""More replays on the original VHDL in GHDL than `make sim` has time for (make sim-ghdl): every configuration that was
built, several seeds, random tiles besides the session of good, refused, cut and aborted ones. Each is recorded on the
Verilated engine, whose every stage is compared with the model meanwhile, and replayed clock by clock, every output
port compared, memories unknown at the start (docs/replay.md).

Environment: SEEDS (default '2 3'; make sim has 1), JOBS (replays at once; default: all cores), GHDL (the program).
Exit code 1 if anything differs, if a recording fails or if nothing was replayed."""
from __future__ import annotations

import os
import pathlib
import re
import shutil

from .. import work
from ..vhdl import Rtl
from . import run


class Replays:
    def __init__(self, build: pathlib.Path, out: pathlib.Path, tiles: int, clocks: int) -> None:
        self.build, self.out, self.tiles, self.clocks = build, out, tiles, clocks
        self.sources = Rtl().sources("psweep")

    def one(self, what: tuple[str, str]) -> bool:
        """Configuration, seed: another seed than make sim's, and tiles of any size."""
        name, seed = what
        clock, log = work.Clock(), self.out / f"{name}.{seed}.log"
        recording, folder = self.out / f"{name}.{seed}.txt", self.out / f"{name}.{seed}"
        if run.record(self.build, log, recording, name, seed=seed, tiles=str(self.tiles), clocks=str(self.clocks)):
            print(f"{log.read_text(errors='replace')}sim-ghdl: {name}, seed {seed}: FAILED: the Verilated engine and "
                  "the model differ", flush=True)
            return False
        code = run.replay(self.build, self.sources, recording, folder, log)
        text = log.read_text(errors="replace")
        if code:
            shown = [line for line in text.splitlines() if not re.match(r" *(in|from|call)", line)]
            print("\n".join([*shown, f"sim-ghdl: {name}, seed {seed}: FAILED"]), flush=True)
            return False
        steps = re.search(r"replay: (\d+ steps.*)", text)
        print(f"sim-ghdl: {name}, seed {seed}: {steps[1] if steps else '?'}, {clock}", flush=True)
        recording.unlink()
        shutil.rmtree(folder)
        return True


def main(arguments: list[str]) -> int:
    options = work.parser("scripts/sim_ghdl.sh", __doc__)
    options.add_argument("--build", default="build", metavar="DIR", help="folder with tb/replay (default: build)")
    options.add_argument("--out", metavar="DIR", help="where to write (default: build/sim-ghdl)")
    options.add_argument("--tiles", type=int, default=3, help="random tiles of each recording (default: 3)")
    options.add_argument("--clocks", type=int, default=3000, help="the longest of them, in clocks (default: 3000)")
    options.add_argument("names", nargs="*", metavar="CONFIGURATION", help="default: all")
    given = options.parse_args(arguments)
    build, clock = run.build_folder(given.build), work.Clock()
    names = given.names or sorted(path.stem.removeprefix("widths_")
                                  for path in (build / "tb" / "replay").glob("widths_*.inc"))
    out = work.fresh(pathlib.Path(given.out).resolve() if given.out else build / "sim-ghdl")
    replays = Replays(build, out, given.tiles, given.clocks)
    seeds = (os.environ.get("SEEDS") or "2 3").split()
    good = work.in_parallel(replays.one, [(name, seed) for seed in seeds for name in names])
    print(f"sim-ghdl: {sum(good)} of {len(good)} replays without a difference, {clock}")
    return 0 if good and all(good) else 1
