# SPDX-License-Identifier: Apache-2.0
"""Copies of the tree, one a job, in which mutants are built and tested. The checkout is not touched.

A job has several build folders over its copy: 'all' with everything but the largest configurations, and one for each
engine or chip that is tried alone, so that nothing else has to be built for it."""
import os
import pathlib
import re
import signal
import subprocess
import threading
import time

from .chains import Test
from ..vhdl import Rtl

FOLDERS = ("CMakeLists.txt", "rtl", "sw", "tb", "scripts")
# Large and slow; no test used here needs them.
_LEFT_OUT = re.compile(r"rtl/configs/(engine|chip)/(tile|bands)\.json$|(^|/)__pycache__/")
_OPTIONS = ("-DPSWEEP_VERILATOR_EXTRA=-Wno-fatal", "-DPSWEEP_FAST_OPTION=-O1", "-DCMAKE_DISABLE_FIND_PACKAGE_ZLIB=ON")


class BrokenTest(Exception):
    """A test cannot be built or fails on the circuit as it is: nothing it says of a mutant would mean anything."""


class Stopped(Exception):
    """The run is to end."""


def synchronise(source: pathlib.Path, target: pathlib.Path) -> list[str]:
    """Brings a copy up to date; files that are the same keep their times. Returns the names of its files."""
    names = []
    for folder in FOLDERS:
        at = source / folder
        for path in [at] if at.is_file() else sorted(at.rglob("*")):
            name = str(path.relative_to(source))
            if not path.is_file() or _LEFT_OUT.search(name):
                continue
            names.append(name)
            content, copy = path.read_bytes(), target / name
            if copy.is_file() and copy.read_bytes() == content:
                continue
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(content)
            copy.chmod(path.stat().st_mode & 0o7777)
    kept = set(names)
    for path in target.rglob("*"):
        if path.is_file() and str(path.relative_to(target)) not in kept:
            path.unlink()
    return names


class Job:
    """One copy of the tree and its builds."""

    _running: set[subprocess.Popen[bytes]] = set()
    _lock = threading.Lock()
    stopped = threading.Event()

    def __init__(self, at: pathlib.Path) -> None:
        self.at, self.tree = at, at / "tree"
        self._configured: set[str] = set()
        self.environment = {**os.environ, "LC_ALL": "C", "CCACHE_BASEDIR": str(at), "CCACHE_NOHASHDIR": "1",
                            "PSWEEP_SEED": os.environ.get("PSWEEP_SEED", "1")}

    @classmethod
    def stop(cls) -> None:
        """Ends all that runs, of all jobs."""
        with cls._lock:
            cls.stopped.set()
            for process in cls._running:
                _kill(process)

    def run(self, log: pathlib.Path, limit: float, command: tuple[str, ...] | list[str], cwd: pathlib.Path,
            environment: tuple[tuple[str, str], ...] = ()) -> tuple[int | None, float]:
        """Exit code (None: not over in time) and seconds; output is appended to the log."""
        begun = time.monotonic()
        with open(log, "ab") as out, self._lock:
            if self.stopped.is_set():
                raise Stopped
            # A mutant may fill memory or disk.
            process = subprocess.Popen(
                ["bash", "-c", 'ulimit -v 8000000; ulimit -f 400000; exec "$@"', "bash", *command], cwd=cwd,
                stdout=out, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, start_new_session=True,
                env={**self.environment, **dict(environment)})
            self._running.add(process)
        try:
            code: int | None = process.wait(timeout=limit)
        except subprocess.TimeoutExpired:
            _kill(process)
            process.wait()
            code = None
        finally:
            with self._lock:
                self._running.discard(process)
        if self.stopped.is_set():
            raise Stopped
        return code, time.monotonic() - begun

    def put(self, entity: str, text: str) -> None:
        """Replaces the VHDL of an entity in the copy."""
        Rtl(self.tree / "rtl").path(entity).write_bytes(text.encode("latin-1"))

    def configure(self, name: str) -> pathlib.Path:
        """The build folder, configured once."""
        build = self.at / name
        if name in self._configured:
            return build
        options = list(_OPTIONS)
        kind, _, config = name.partition("_")
        if kind == "engine":
            (build / "configs").mkdir(parents=True, exist_ok=True)
            text = (self.tree / "rtl" / "configs" / "engine" / f"{config}.json").read_bytes()
            (build / "configs" / f"{config}.json").write_bytes(text)
            options.append("-DPSWEEP_SWEEP=ON")
        elif kind == "chip":
            options.append(f"-DPSWEEP_CHIPS={config}")
        log = self.at / f"configure.{name}.log"
        log.unlink(missing_ok=True)
        code, _ = self.run(log, 600, ["cmake", "-S", "tree", "-B", name, "-G", "Ninja", *options], self.at)
        if code != 0:
            raise BrokenTest(f"cmake failed: {log}")
        self._configured.add(name)
        return build

    def make(self, test: Test, log: pathlib.Path, limit: float) -> bool:
        """Builds what the test needs; true if that went well."""
        build = self.configure(test.build)
        return not test.targets or self.run(log, limit, ["ninja", "-j1", *test.targets], build)[0] == 0

    def try_(self, test: Test, log: pathlib.Path, limit: float) -> tuple[int | None, float]:
        """Runs it, as `run` does."""
        return self.run(log, limit, test.command, self.at / test.build, test.environment)


def _kill(process: subprocess.Popen[bytes]) -> None:
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
