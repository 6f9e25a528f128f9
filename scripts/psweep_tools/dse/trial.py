# SPDX-License-Identifier: Apache-2.0
"""Does the workflow of 'make dse' do what it is for? A small grid is killed in the middle and resumed; nothing changes,
and nothing may run; a VHDL file has a fault, which must be told; it changes, and only what depends on it may run.
A minute, with --slurm some."""
from __future__ import annotations

import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from .. import work
from ..paths import RTL, SCRIPTS, START
from ..vhdl import Rtl
from ..work import Failure

GRID = """cost: [[16, 12, 5, 13, 1], [16, 12, 7, 13, 1]]
tiles: [[1092, 20], [1092, 30], [256, 130]]
windows: [7, 13]
scenes: [rocky-1-560, flat-1-128]
accuracy_windows: [7, 13]
formats: ["float:13:2:8:8", "mncc:13:2:8:8", "fixed:13:2:8:8"]
"""
RESULTS = 6  # those that take some time


class Trial:
    def __init__(self, folder: pathlib.Path, programs: str, slurm: bool) -> None:
        self.folder, self.slurm, self.log, self.out = folder, slurm, folder / "log", folder / "out"
        shutil.copytree(RTL, folder / "rtl")
        (folder / "grid.yaml").write_text(GRID)
        more = ["--slurm", "--", "--slurm-init-seconds-before-status-checks", "3"] if slurm else []
        self.command = [sys.executable, "-B", str(SCRIPTS / "tools.py"), "dse", "--grid", str(folder / "grid.yaml"),
                        "--out", str(self.out), "--programs", programs, "--rtl", str(folder / "rtl"), *more]
        self.file = Rtl(folder / "rtl").path("updating")

    def run(self) -> bool:
        return work.run(self.command, log=self.log, check=False) == 0

    def fail(self, text: str) -> Failure:
        return Failure(f"FAILED: {text}\n{work.tail(self.log)}")

    def need(self, condition: bool, text: str) -> None:
        if not condition:
            raise self.fail(text)

    def jobs(self, rule: str) -> int:
        return len(re.findall(rf"^(?:local)?rule {rule}:", self.log.read_text(errors="replace"), re.M))

    def products(self) -> int:
        return sum(path.is_file() for name in ("accuracy", "cost") for path in (self.out / name).rglob("*"))

    def waiting(self) -> int:
        done = subprocess.run(["squeue", "--noheader"], capture_output=True, text=True, check=False)
        return len(done.stdout.splitlines())

    def killed(self) -> None:
        """As soon as there are some of the results, with all of its jobs; those of a cluster go on."""
        clock = work.Clock()
        with open(self.log, "wb") as log:
            process = subprocess.Popen(self.command, stdout=log, stderr=log, start_new_session=True)
        for _ in range(3000):
            if self.products() >= 2 or process.poll() is not None:
                break
            time.sleep(0.1)
        self.need(process.poll() is None, "the run ended before it could be killed")
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        while True:
            try:
                os.killpg(process.pid, 0)
            except ProcessLookupError:
                break
            time.sleep(0.1)
        self.need(not (self.out / "index.html").exists(), "the run was killed too late")
        before = self.products()
        self.need(before >= 2, "nothing was finished when the run was killed")
        left = ""
        if self.slurm:
            self.need(self.waiting() > 0, "no job outlived the run")
            left = f", {self.waiting()} jobs left in the queue"
        print(f"killed after {clock} with files of {before} of {RESULTS} results{left}", flush=True)

    def resumed(self) -> None:
        clock = work.Clock()
        self.need(self.run(), "the run does not resume")
        page = self.out / "index.html"
        self.need(page.is_file() and page.stat().st_size > 0, "no page")
        resumed = self.jobs("cost") + self.jobs("scene") + self.jobs("accuracy")
        self.need(self.products() == RESULTS, f"{self.products()} results, not {RESULTS}")
        self.need(0 < resumed < 8, f"resumed with {resumed} of 8 points")
        said = ""
        if self.slurm:
            text = self.log.read_text(errors="replace")
            cancelled = re.search(r"dse.sh: cancelling (\d+) jobs", text)
            if cancelled is None:
                raise self.fail("the jobs of the killed run were not cancelled")
            self.need("Unable to get the status" not in text, "jobs were lost from sight")
            submitted = text.count("has been submitted with SLURM jobid")
            self.need(submitted == resumed, f"{submitted} jobs were submitted, not {resumed}")
            self.need(self.waiting() == 0, "jobs are left in the queue")
            said = f", all submitted and seen finished, after {cancelled[1]} old ones were cancelled"
        print(f"resumed with {resumed} of 8 jobs{said}: {clock}", flush=True)

    def unchanged(self) -> None:
        self.need(self.run(), "a run with nothing to do")
        self.need(self.jobs(".*") == 0, "something ran again though nothing had changed")
        print("nothing changed: nothing ran", flush=True)

    def faulty(self) -> None:
        good = self.file.read_text()
        self.file.write_text(good + "fault\n")
        self.need(not self.run(), "a fault in the VHDL, and the run succeeds")
        self.need(bool(re.search(r"updating.vhd:\d+:\d+", self.log.read_text(errors="replace"))),
                  "the fault in the VHDL is not shown")
        print("a fault in the VHDL: told, exit code not 0", flush=True)
        clock = work.Clock()
        self.file.write_text(good + "-- one more line\n")
        self.need(self.run(), "a run with changed VHDL")
        ran = ", ".join(f"{rule} {self.jobs(rule)}" for rule in ("cost", "shape", "scene", "accuracy"))
        self.need(ran == "cost 2, shape 0, scene 0, accuracy 0", f"VHDL changed: {ran}")
        self.need(self.jobs("page") == 1, "the page was not made once")
        print(f"VHDL changed: {ran}, page 1: {clock}", flush=True)


def main(arguments: list[str]) -> int:
    options = work.parser("scripts/dse/test_workflow.sh", __doc__)
    options.add_argument("--programs", default="", metavar="DIR", help="default build")
    options.add_argument("--slurm", action="store_true",
                         help="as jobs of a Slurm cluster, which must be there: scripts/dse/one_node.sh starts one")
    given = options.parse_args(arguments)
    programs = str((START / given.programs).resolve() if given.programs else SCRIPTS.parent / "build")
    with tempfile.TemporaryDirectory() as folder:
        trial = Trial(pathlib.Path(folder), programs, given.slurm)
        for step in (trial.killed, trial.resumed, trial.unchanged, trial.faulty):
            step()
    return 0
