# SPDX-License-Identifier: Apache-2.0
"""Engines of random sizes and formats, degenerate ones among them: each is built, and takes random tiles, good and bad,
every stage compared with the bit-true model (tb/soak/soak.cpp).

Works in build/sweep; results in build/sweep/results.txt. Exit code 1 if any fails. Environment: JOBS (default: all
cores), VERBOSE=1."""
from __future__ import annotations

import os
import re
import shutil
import sys

from . import soak, work
from .paths import ROOT
from .work import Failure

PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)


class Generator:
    """The generator of bash 5.1 and later (RANDOM), so that a seed draws what it always drew."""

    def __init__(self, seed: int) -> None:
        self.state = seed % 32768
        for _ in range(8):  # first values of seeds side by side are alike
            self.draw()

    def draw(self) -> int:
        """0 to 32767."""
        state = self.state or 123459876
        state = 16807 * (state % 127773) - 2836 * (state // 127773)
        self.state = state + 0x7FFFFFFF if state < 0 else state
        return ((self.state >> 16) ^ (self.state & 65535)) & 32767

    def pick(self, *values: int) -> int:
        return values[self.draw() % len(values)]

    def between(self, low: int, high: int) -> int:
        first = self.draw()
        return low + (first * 32768 + self.draw()) % (high - low + 1)


# What is special of the first ones: one cell, one plane, the largest window; one column, fewer planes than lanes, the
# smallest window; one row, a last set that is not full; the smallest formats.
DEGENERATE: dict[int, dict[str, int]] = {
    1: {"WINDOW": 21, "PLANE_COLS": 1, "PLANE_ROWS": 1, "PLANES": 1, "LANES": 1},
    2: {"WINDOW": 3, "PLANE_COLS": 1, "PLANE_ROWS": 17, "PLANES": 2, "LANES": 4},
    3: {"PLANE_COLS": 37, "PLANE_ROWS": 1, "PLANES": 7, "LANES": 2},
    4: {"PIX_BITS": 1, "WEIGHT_BITS": 1, "INTERP_FRAC": 0, "MNCC_BITS": 4, "FRAC_BITS": 2, "PLANE_ROWS": 5},
}
ORDER = ("PLANE_COLS", "PLANE_ROWS", "PLANES", "WINDOW", "PIX_BITS", "WEIGHT_BITS", "INTERP_FRAC", "MNCC_BITS",
         "FRAC_BITS", "LANES", "RECTIFIED", "DIVIDER", "SPLIT", "DISPARITY")


def drawn(seed: int, count: int) -> list[dict[str, int]]:
    """The configurations, one after the other, so that one alone is the same."""
    random, found = Generator(seed), []
    for k in range(1, count + 1):
        c = {"WINDOW": random.pick(3, 5, 7, 9, 11, 13, 15, 17, 19, 21), "PLANE_COLS": random.between(1, 40),
             "PLANE_ROWS": random.between(1, 24), "PLANES": random.between(1, 12), "LANES": random.pick(1, 1, 2, 4),
             "PIX_BITS": random.between(1, 12), "WEIGHT_BITS": random.between(1, 12),
             "INTERP_FRAC": random.between(0, 8), "MNCC_BITS": random.between(4, 16),
             "FRAC_BITS": random.between(2, 12), "RECTIFIED": random.pick(0, 0, 1), "DISPARITY": random.between(0, 12)}
        if random.pick(0, 1):
            c["PLANE_COLS"], c["PLANE_ROWS"] = random.pick(*PRIMES), random.pick(*PRIMES)
        c["DIVIDER"] = random.pick(0, 1)
        c["SPLIT"] = random.pick(0, 1)
        c.update(DEGENERATE.get(k, {}))
        # The bench's ports are words of 64 bits: samples of four lanes in one.
        if c["LANES"] * (c["PIX_BITS"] + c["INTERP_FRAC"]) > 64:
            c["INTERP_FRAC"] = 64 // c["LANES"] - c["PIX_BITS"]
        c["INTERP_FRAC"] = min(c["INTERP_FRAC"], 8)
        found.append({key: c[key] for key in ORDER})
    return found


def main(arguments: list[str]) -> int:
    options = work.parser("scripts/sweep.sh", __doc__)
    options.add_argument("--count", type=int, default=10, help="configurations (10); the first four are degenerate")
    options.add_argument("--seed", type=int, default=1, help="draws others (1)")
    options.add_argument("--tiles", type=int, default=60, help="tiles of each (60)")
    options.add_argument("--only", type=int, metavar="K", help="configuration number K alone")
    given = options.parse_args(arguments)
    if given.count < 1 or given.seed < 0 or given.tiles < 1:
        options.error("--count, --seed and --tiles are numbers")
    clock, out = work.Clock(), ROOT / "build" / "sweep"
    out.mkdir(parents=True, exist_ok=True)
    for old in [*out.glob("*.log"), out / "results.txt"]:
        old.unlink(missing_ok=True)
    configs = work.fresh(out / "configs")
    wanted = {k: c for k, c in enumerate(drawn(given.seed, given.count), 1) if given.only in (None, k)}
    if not wanted:
        raise Failure(f"no configuration {given.only} among {given.count}")
    for k, config in wanted.items():
        work.run([sys.executable, "-B", "scripts/configurations.py", "new", "--build", out, f"NAME=s{given.seed}_{k}",
                  "WAVES=1", *(f"{key}={value}" for key, value in config.items())],
                 log=out / f"s{given.seed}_{k}.log")
    print(f"sweep: seed {given.seed}, building {len(wanted)} engines", flush=True)
    build = out / "build"
    work.run(["cmake", "-S", ".", "-B", build, "-G", "Ninja", "-DPSWEEP_SWEEP=ON"], log=out / "cmake.log")
    shutil.rmtree(build / "configs", ignore_errors=True)
    shutil.copytree(configs, build / "configs")
    work.run(["cmake", build], log=out / "cmake.log")
    work.run(["ninja", "-C", build, "-j", str(work.jobs()), "soak"], log=out / "build.log")
    failed = 0
    for k, config in wanted.items():
        name = f"s{given.seed}_{k}"
        log = out / f"{name}.log"
        good = soak.run(build / "tb" / "soak" / "soak", name, given.tiles, given.seed, log)
        text = log.read_text(errors="replace")
        said = re.search(rf"^soak: {name}: [^:]*: (.*)", text, re.M)
        if good and said:
            verdict = f"good: {said[1]}"
        else:
            failed += 1
            verdict = (f"FAILED, see {log}; again: scripts/sweep.sh --seed {given.seed} --tiles {given.tiles} --only "
                       f"{k}")
            if os.environ.get("VERBOSE"):
                print(text)
        line = f"sweep: {name}: {' '.join(f'{key}={value}' for key, value in config.items())}: {verdict}"
        print(line, flush=True)
        with open(out / "results.txt", "a") as results:
            results.write(line + "\n")
    print(f"sweep: {len(wanted) - failed} passed, {failed} failed, seed {given.seed}, {clock}")
    return 1 if failed else 0
