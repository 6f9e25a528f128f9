# SPDX-License-Identifier: Apache-2.0
"""Real stereo pairs (make real DATA=<folder>) through float reference, bit-true model and simulated hardware; the last
two must write the same bytes; matched share and bad pixels against ground truth are tabled.

Layout of DATA (Middlebury's own file names; what is absent is skipped by name):
  tsukuba/  im3.png im4.png   groundtruth.png (scale 16)  nonocc.png
  teddy/    im2.png im6.png   groundtruth.png (scale 4)   nonocc.png
  rocks1/   view1.png view5.png  disp1.png (scale 2; half size; the truth can sit 0.5 px low; no mask)
  navcam/   left_rows.png right_rows.png  (no truth)
The pairs come without calibration, so depths are relative; disparities are what is evaluated.
Exit code 0 only if at least one pair was there and hardware and model agree on every pair."""
from __future__ import annotations

import json
import pathlib
from dataclasses import dataclass

from . import pairs, work
from .paths import ROOT

INTRO = """# Real pairs

Window 13, threshold 0.85, no clean-up. Evaluated: pixels of the left image with truth, outside occlusions where the
data set has that mask (rocks1 has none, so its occluded pixels count; its truth can sit 0.5 px low, which shows in the
mean error). Matched: share of these with a disparity. Bad: share of the matched
that is more than 1 px off; bad all: of the evaluated, unmatched ones counted. Mean px: error of the good ones.
= fixed: every file but report.json has the bytes of the bit-true model's. navcam has no truth.

| pair | engine | disparities | planes | matched % | bad % | bad all % | mean px | M clocks | = fixed |
|---|---|---|---|---|---|---|---|---|---|
"""


@dataclass(frozen=True)
class Pair:
    name: str
    left: str
    right: str
    range: str
    truth: str = ""
    scale: int = 0
    mask: str = ""

    def files(self) -> list[str]:
        return [name for name in (self.left, self.right, self.truth, self.mask) if name]


PAIRS = (Pair("tsukuba", "im3.png", "im4.png", "3:16", "groundtruth.png", 16, "nonocc.png"),
         Pair("teddy", "im2.png", "im6.png", "10:60", "groundtruth.png", 4, "nonocc.png"),
         Pair("rocks1", "view1.png", "view5.png", "18:115", "disp1.png", 2),
         Pair("navcam", "left_rows.png", "right_rows.png", "10:50"))


def number(text: str, name: str) -> str:
    """The value that `psweep eval` printed."""
    for line in text.splitlines():
        words = line.split()
        if len(words) > 1 and words[0] == name:
            return f"{float(words[1]):.2f}"
    return "-"


class Real:
    def __init__(self, data: pathlib.Path, psweep: pathlib.Path, out: pathlib.Path, engines: list[str],
                 threads: int) -> None:
        self.data, self.psweep, self.out, self.engines, self.threads = data, psweep, out, engines, threads
        self.rows: list[str] = []
        self.done: list[str] = []
        self.skipped: list[str] = []
        self.wrong: list[str] = []

    def engine(self, pair: Pair, engine: str) -> pathlib.Path:
        print(f"== {pair.name}: {engine}", flush=True)
        source, to = self.data / pair.name, self.out / pair.name / engine
        to.parent.mkdir(parents=True, exist_ok=True)
        work.run([self.psweep, "depth", source / pair.left, source / pair.right, "--disparity-range", pair.range,
                  "--engine", engine, "--threads", str(self.threads), "-o", to])
        text = ""
        if pair.truth:
            mask = ["--mask", str(source / pair.mask)] if pair.mask else []
            text = work.output([self.psweep, "eval", to, source / pair.truth, "--scale", str(pair.scale), *mask])
        (to.parent / f"{engine}.txt").write_text(text)
        same = "-"
        if engine == "rtl":
            same = "yes" if pairs.same_output(to.parent / "fixed", to) else "NO"
            self.wrong += [pair.name] if same == "NO" else []
        report = json.loads((to / "report.json").read_text())
        clocks = _found(report, "clocks_in_all")
        values = [number(text, name) for name in ("matched_percent", "bad1_percent", "bad1_all_percent", "mean_px")]
        self.rows.append("| " + " | ".join((pair.name, engine, pair.range, str(_found(report, "planes")), *values,
                                            "-" if clocks is None else f"{clocks / 1e6:.1f}", same)) + " |\n")
        return to

    def pair(self, pair: Pair) -> None:
        for name in pair.files():
            if not (self.data / pair.name / name).exists():
                print(f"== {pair.name}: skipped, {self.data / pair.name / name} is missing")
                self.skipped.append(pair.name)
                return
        runs = [self.engine(pair, engine) for engine in self.engines]
        work.run([self.psweep, "report", *runs, "-o", self.out / pair.name / "index.html", "--title",
                  f"psweep: {pair.name}", "--input", self.data / pair.name / pair.left, "--note",
                  f"Real stereo pair without calibration: depths are relative, disparities {pair.range} px were "
                  "searched."])
        self.done.append(pair.name)

    def page(self) -> str:
        text = INTRO + "".join(self.rows)
        for name in self.done:
            last = self.engines[-1]
            text += f"\n## {name}\n\n![{name}]({name}/{last}/depth.png)\n"
            if (self.out / name / last / "error.png").exists():
                text += f"![error]({name}/{last}/error.png)\n"
            text += f"\n[page]({name}/index.html)\n"
        return text + (f"\nSkipped, files missing: {' '.join(self.skipped)}\n" if self.skipped else "")


def _found(value: object, key: str) -> float | None:
    """A number of this name, wherever in a report it stands."""
    if isinstance(value, dict):
        if isinstance(value.get(key), (int, float)):
            return value[key]  # type: ignore[no-any-return]
        value = list(value.values())
    if isinstance(value, list):
        for inner in value:
            found = _found(inner, key)
            if found is not None:
                return found
    return None


def main(arguments: list[str]) -> int:
    options = work.parser("scripts/real.sh", __doc__)
    options.add_argument("data", type=pathlib.Path, help="folder with tsukuba/, teddy/, rocks1/, navcam/")
    options.add_argument("--psweep", default=str(ROOT / "build" / "psweep"), metavar="FILE", help="the command line")
    options.add_argument("--out", type=pathlib.Path, default=ROOT / "build" / "real", metavar="DIR")
    options.add_argument("--engines", default="float fixed rtl")
    options.add_argument("--threads", type=int, default=0)
    given = options.parse_args(arguments)
    if not given.data.is_dir():
        options.error(f"DATA='{given.data}' is no directory")
    given.out.mkdir(parents=True, exist_ok=True)
    real = Real(given.data, pairs.program(given.psweep), given.out, given.engines.split(), given.threads)
    for pair in PAIRS:
        real.pair(pair)
    table = given.out / "table.md"
    table.write_text(real.page())
    print("\n" + "".join(line for line in table.read_text().splitlines(keepends=True) if line.startswith("|")), end="")
    print(f"real: {len(real.done)} pairs done; skipped: {' '.join(real.skipped) or 'none'}; fixed and rtl differ on: "
          f"{' '.join(real.wrong) or 'none'}; see {table}")
    return 0 if real.done and not real.wrong else 1
