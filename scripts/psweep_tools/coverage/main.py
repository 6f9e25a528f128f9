# SPDX-License-Identifier: Apache-2.0
"""How much of the circuit the tests reach. Two measures, merged over all runs:
  lines    statements of the original VHDL, counted by GHDL while it replays recordings of engines and chips
           (tb/replay). Needs GHDL 4 or newer, as in Debian 13; with an older one: exit code 2, nothing is measured.
  toggles  bits of registers, wires and ports that were seen to change both ways, counted by Verilator in the tests of
           units, engine and chip. Of the converted Verilog, whose signals have the names of the VHDL.

A line that is never run has to be in scripts/coverage_holes.txt, with a reason; a bit that never changes is listed.
Report: build/coverage/index.txt, lines.txt, toggles.txt, lines.lcov (for genhtml and editors).
Environment: GHDL (the program, default ghdl), JOBS, NO_BUILD=yes (recordings as they are), BUILD (default build),
ONLY (toggles: regular expression of the test programs that count, default all; building all takes half an hour).
Exit code 1 if a test failed, if less than 95 % of the lines were run, if a hole is not in the list or an entry of the
list is none, or if nothing was counted; 2 if GHDL is too old."""
from __future__ import annotations

import os
import pathlib
import re
import subprocess

from .. import work
from ..paths import ROOT
from ..vhdl import Rtl
from ..work import Failure
from . import report

RECORDINGS = "^replay: .*, record"
_GOOD = re.compile(r"replay: [1-9]\d* steps, [1-9]\d* values compared, 0 differences")


def say(text: str) -> None:
    print(f"coverage: {text}", flush=True)


class Coverage:
    def __init__(self) -> None:
        self.out = ROOT / "build" / "coverage"
        self.build = ROOT / os.environ.get("BUILD", "build")
        self.ghdl = os.environ.get("GHDL") or "ghdl"
        self.rtl = Rtl()
        self.out.mkdir(parents=True, exist_ok=True)
        for name in ("index.txt", "lines.txt", "toggles.txt", "lines.lcov"):
            (self.out / name).unlink(missing_ok=True)

    def ghdl_is_new(self) -> bool:
        version = work.output([self.ghdl, "--version"]).splitlines()[0]
        match = re.match(r"GHDL (\d+)\.", version)
        if match and int(match[1]) >= 4:
            return True
        say(f"{version}: too old to count lines; nothing was measured.")
        say("GHDL 4 or newer is needed. Debian 13 has 5.0: run this there, in a container")
        say(f"  docker run --rm -v {ROOT}:/psweep -w /psweep debian:trixie \\")
        say("    sh -c 'apt-get update; apt-get install -y make; make coverage'")
        say("or in a root of debootstrap --variant=minbase trixie (see scripts/fresh_machine.sh); or name one by "
            "GHDL=.")
        say("Toggles need no newer one: scripts/coverage.sh toggles")
        return False

    def names(self) -> list[str]:
        """The recordings that the tests replay, by the list of the tests; the longest first."""
        text = work.output(["ctest", "-C", "coverage", "-N", "-R", RECORDINGS], cwd=self.build)
        names = re.findall(r": replay: (\w+), record", text)
        if not names:
            raise Failure("no recordings in the build")
        for name in names:
            if not self.recording(name).is_file() or not self.recording(name).stat().st_size:
                raise Failure(f"no recording {self.recording(name)}")
        return sorted(names, key=lambda name: -self.recording(name).stat().st_size)

    def recording(self, name: str) -> pathlib.Path:
        return self.build / "tb" / "replay" / f"{name}.txt"

    def lines(self) -> int:
        """Every recording is replayed on a build that counts."""
        if os.environ.get("NO_BUILD") != "yes":
            work.run(["scripts/build.sh", "record_engine", "record_chip", "record_messages", "psweep_replay",
                      "psweep_top_replay"])
            say("recording")
            work.run(["ctest", "-C", "coverage", "--parallel", str(work.jobs()), "--no-tests=error", "-R", RECORDINGS,
                      "--output-on-failure"], cwd=self.build, log=self.out / "recording.log")
        folder = work.fresh(self.out / "lines")
        # Relative names make the report the same everywhere.
        sources = [f"rtl/{name}" for name in self.rtl.files.values()]
        for entity in ("psweep", "psweep_top"):
            (folder / entity).mkdir()
            analyse = [self.ghdl, "-a", "--std=93", f"--workdir={folder / entity}"]
            work.run([*analyse, "--coverage", *sources])
            work.run([*analyse, self.build / "tb" / "replay" / f"{entity}_replay.vhd"])
        names = self.names()
        if not all(work.in_parallel(lambda name: self.replay(folder, name), names)):
            return 1
        files = sorted(folder.glob("*.json"))
        if len(files) != len(names):
            raise Failure(f"{len(files)} counts of {len(names)} replays")
        return report.report_lines(self.out, files, self.rtl, (ROOT / report.HOLES).read_text())

    def replay(self, folder: pathlib.Path, name: str) -> bool:
        clock, entity = work.Clock(), "psweep_top" if name.startswith("chip_") else "psweep"
        recording, log = self.recording(name), folder / f"{name}.log"
        with open(recording) as lines:
            generics = [m for line in lines if (m := re.fullmatch(r"generic (\S+) (\S+)\n", line))]
        work.run([self.ghdl, "-r", "--std=93", "--coverage", f"--coverage-output={folder}/{name}.json",
                  f"--workdir={folder / entity}", f"{entity}_replay", *(f"-g{m[1]}={m[2]}" for m in generics),
                  f"-gG_FILE={recording}", "--ieee-asserts=disable"], log=log, check=False)
        if not _GOOD.search(log.read_text(errors="replace")):
            print(work.tail(log, 5))
            say(f"the replay of {name} failed")
            return False
        say(f"lines: {name} replayed ({clock})")
        return True

    def programs(self, build: pathlib.Path) -> list[str]:
        """'units/test_x' of the tests of units, engine and chip that can be built."""
        text = work.output(["ninja", "-C", build, "-t", "targets", "all"])
        targets = sorted(set(re.findall(r"^(test_\w+): phony$", text, re.M)))
        found = [f"{folder}/{target}" for target in targets for folder in ("units", "engine", "chip")
                 if (ROOT / "tb" / folder / f"{target}.cpp").is_file()]
        only = os.environ.get("ONLY")
        found = [name for name in found if not only or re.search(f"/({only})$", name)]
        if not found:
            raise Failure("no tests")
        return found

    def toggles(self) -> int:
        """The same tests, on models that count."""
        folder = self.out / "toggles"
        data, build = work.fresh(folder / "data"), folder / "build"
        work.run(["cmake", "-S", ".", "-B", build, "-G", "Ninja", "-DPSWEEP_COVERAGE=ON", "-DPSWEEP_FAST_OPTION=-O1"],
                 log=folder / "configure.log")
        programs = self.programs(build)
        say(f"toggles: building {len(programs)} test programs")
        names = [pathlib.PurePosixPath(program).name for program in programs]
        work.run(["ninja", "-C", build, "-j", str(work.jobs()), *names], log=folder / "build.log")
        for number, (program, name) in enumerate(zip(programs, names, strict=True), 1):
            work.run([build / "tb" / program], log=folder / f"{name}.log",
                     environment={"PSWEEP_COVERAGE": str(data / name)})
            say(f"toggles: {program} ({number} of {len(programs)})")
        return report.report_toggles(self.out, sorted(data.iterdir()), self.rtl)


def main(arguments: list[str]) -> int:
    options = work.parser("scripts/coverage.sh", __doc__)
    options.add_argument("parts", nargs="*", choices=("lines", "toggles", []), metavar="lines|toggles",
                         help="default: both")
    parts = options.parse_args(arguments).parts or ["lines", "toggles"]
    coverage, failed = Coverage(), 0
    if "lines" in parts and not coverage.ghdl_is_new():
        return 2
    for part, measure in (("lines", coverage.lines), ("toggles", coverage.toggles)):
        if part in parts:
            try:
                failed |= measure()
            except (Failure, subprocess.SubprocessError) as error:
                say(str(error))
                failed = 1
    texts = [path.read_text() for path in (coverage.out / "lines.txt", coverage.out / "toggles.txt") if path.is_file()]
    (coverage.out / "index.txt").write_text("".join(texts))
    say("report: build/coverage/index.txt")
    return failed
