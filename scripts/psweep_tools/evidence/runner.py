# SPDX-License-Identifier: Apache-2.0
"""Runs kinds of evidence one after the other and stamps each as soon as it is over."""
import os
import pathlib
import signal
import subprocess
import sys
import time

from . import pages, parsers, records, sources
from .manifest import KINDS, Kind

OUT = sources.ROOT / "build" / "evidence"


def say(text: str) -> None:
    print(f"evidence: {text}", flush=True)


def all_status(tree: sources.Tree | None = None) -> dict[str, records.Status]:
    tree = tree or sources.Tree()
    return {kind.name: records.status(kind, tree) for kind in KINDS}


def log_of(kind: Kind) -> pathlib.Path:
    return OUT / f"{kind.name}.log"


def _execute(kind: Kind) -> tuple[int, float]:
    """Exit code and seconds of a kind's commands; what they print is shown and kept."""
    OUT.mkdir(parents=True, exist_ok=True)
    begun = time.monotonic()
    code = 0
    with open(log_of(kind), "wb") as log:
        for command in kind.command:
            with subprocess.Popen(["make", *command.split()], cwd=sources.ROOT, stdin=subprocess.DEVNULL,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                  start_new_session=True) as process:
                try:
                    assert process.stdout is not None
                    for line in process.stdout:
                        log.write(line)
                        log.flush()
                        sys.stdout.buffer.write(line)
                        sys.stdout.buffer.flush()
                except BaseException:
                    # It may want to keep what it has.
                    os.killpg(process.pid, signal.SIGINT)
                    try:
                        process.wait(20)
                    except subprocess.TimeoutExpired:
                        os.killpg(process.pid, signal.SIGKILL)
                    raise
            code = code or process.returncode
    return code, time.monotonic() - begun


def _exists(kind: Kind) -> bool:
    return all(subprocess.run(["make", "-n", *command.split()], cwd=sources.ROOT, capture_output=True, check=False)
               .returncode == 0 for command in kind.command)


def _keep(kind: Kind, files: dict[str, str], results: parsers.Results, seconds: float, passed: bool,
          commit: str = "HEAD") -> None:
    stamp = records.stamp_of(files, commit)
    stamp.seconds, stamp.passed = round(seconds), passed
    records.save(records.Record(kind.name, stamp, results))
    written = pages.check(all_status(), True).written
    say(f"{kind.name}: stamped, {stamp.name}" + (f"; written: {', '.join(written)}" if written else ""))


def run(kinds: list[Kind], force: bool) -> int:
    """Number of kinds that went wrong."""
    wrong = 0
    for kind in kinds:
        tree = sources.Tree()
        status = records.status(kind, tree)
        if not status.stale and not force:
            say(f"{kind.name}: {status.text()}, not run again")
            continue
        if not _exists(kind):
            say(f"{kind.name}: there is no 'make {kind.command[0]}' here, left out")
            continue
        say(f"{kind.name}: {status.text()}; about {kind.minutes:g} min on two idle cores")
        files = tree.hashes(kind.depends)
        try:
            code, seconds = _execute(kind)
        except KeyboardInterrupt:
            say(f"{kind.name}: interrupted; goes on " + (kind.goes_on or "from the start"))
            if kind.name != "mutants":
                raise
            code, seconds = 130, 0
        if code == 2 and kind.needs:
            say(f"{kind.name}: cannot be run here, needs {kind.needs}")
            continue
        if code and not kind.speaks_for_itself:
            say(f"{kind.name}: FAILED with exit code {code}, not stamped; log: build/evidence/{kind.name}.log")
            wrong += 1
            continue
        try:
            results = parsers.results(kind, log_of(kind))
        except (parsers.NothingFound, ValueError, KeyError) as error:
            say(f"{kind.name}: FAILED, {error}; log: build/evidence/{kind.name}.log")
            wrong += 1
            continue
        if not kind.takes_a_copy and sources.Tree().hashes(kind.depends) != files:
            say(f"{kind.name}: what it depends on was changed while it ran, not stamped")
            wrong += 1
            continue
        passed = code == 0 or not results.get("survivors") and not results.get("problems")
        _keep(kind, files, results, seconds, passed)
        wrong += not passed
        if code == 130:
            raise KeyboardInterrupt
    return wrong


def stamp(kind: Kind, commit: str, force: bool) -> int:
    """Stamps what the latest run left behind; with a commit: as measured on that one's files."""
    if kind.name == "mutants":
        subprocess.run(["scripts/mutants.sh", "--report"], cwd=sources.ROOT, stdout=subprocess.DEVNULL, check=False)
    at = sources.ROOT / kind.output if kind.output else log_of(kind)
    tree = sources.Commit(commit) if commit else sources.Tree()
    files = tree.hashes(kind.depends)
    if not commit and not force and not kind.takes_a_copy and at.is_file():
        newer = [name for name in files if (sources.ROOT / name).stat().st_mtime > at.stat().st_mtime]
        if newer:
            say(f"{kind.name}: {', '.join(newer[:5])} changed after the run: not stamped (--force does)")
            return 1
    try:
        results = parsers.results(kind, log_of(kind))
    except (parsers.NothingFound, ValueError, KeyError) as error:
        say(f"{kind.name}: {error}")
        return 1
    _keep(kind, files, results, 0, not results.get("survivors"), commit or "HEAD")
    return 0
