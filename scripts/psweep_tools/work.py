# SPDX-License-Identifier: Apache-2.0
"""What the tools that run other programs have in common."""
from __future__ import annotations

import argparse
import concurrent.futures
import os
import pathlib
import shutil
import subprocess
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeVar

from .paths import ROOT

Item = TypeVar("Item")
Result = TypeVar("Result")


class Failure(Exception):
    """Ends a tool with its text."""


def jobs() -> int:
    """JOBS, or all cores."""
    return int(os.environ.get("JOBS") or os.cpu_count() or 1)


def parser(tool: str, text: str | None) -> argparse.ArgumentParser:
    return argparse.ArgumentParser(prog=tool, description=text, formatter_class=argparse.RawDescriptionHelpFormatter)


def need(*programs: str, how: str = "") -> None:
    for program in programs:
        if shutil.which(program) is None:
            raise Failure(f"{program} is missing{f'; {how}' if how else ''}")


def run(command: Sequence[str | pathlib.Path], *, log: pathlib.Path | None = None, check: bool = True,
        environment: Mapping[str, str] | None = None, cwd: pathlib.Path = ROOT, quiet: bool = False,
        limit: float | None = None, append: bool = False) -> int:
    """Runs a command; its output goes to `log`, nowhere (quiet) or to the terminal. A failure ends the tool (check),
    with the end of the log."""
    text = [str(part) for part in command]
    env = {**os.environ, **(environment or {})}
    if log is not None:
        log.parent.mkdir(parents=True, exist_ok=True)
        with open(log, "ab" if append else "wb") as out:
            code = _call(text, env, cwd, out.fileno(), limit)
    else:
        code = _call(text, env, cwd, subprocess.DEVNULL if quiet else None, limit)
    if code and check:
        raise Failure(f"{pathlib.Path(text[0]).name} ended with {code}" + (f":\n{tail(log)}" if log else ""))
    return code


def _call(command: list[str], env: dict[str, str], cwd: pathlib.Path, out: int | None, limit: float | None) -> int:
    try:
        return subprocess.run(command, env=env, cwd=cwd, stdout=out, check=False, timeout=limit,
                              stderr=subprocess.STDOUT if out is not None else None).returncode
    except subprocess.TimeoutExpired:
        return 124
    except FileNotFoundError:
        raise Failure(f"{command[0]} is missing") from None


def output(command: Sequence[str | pathlib.Path], *, environment: Mapping[str, str] | None = None,
           cwd: pathlib.Path = ROOT, notes: pathlib.Path | None = None) -> str:
    """What a command that succeeds prints; what it has to say goes to the file `notes`, if there is one."""
    done = subprocess.run([str(part) for part in command], env={**os.environ, **(environment or {})}, cwd=cwd,
                          text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE if notes else None, check=False)
    if notes:
        notes.write_text(done.stderr)
    if done.returncode:
        raise Failure(f"{command[0]} ended with {done.returncode}\n{((done.stderr or '') + done.stdout)[-2000:]}")
    return done.stdout


def tail(path: pathlib.Path | None, lines: int = 20) -> str:
    if path is None or not path.exists():
        return ""
    return "\n".join(path.read_text(errors="replace").splitlines()[-lines:])


def in_parallel(work: Callable[[Item], Result], items: Iterable[Item], number: int | None = None) -> list[Result]:
    """Results in the order of the items, `number` (default: JOBS) at once."""
    with concurrent.futures.ThreadPoolExecutor(number or jobs()) as pool:
        return list(pool.map(work, items))


def fresh(folder: pathlib.Path) -> pathlib.Path:
    """The folder, empty."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


class Clock:
    """Seconds since it was made."""

    def __init__(self) -> None:
        self.begun = time.monotonic()

    def __str__(self) -> str:
        return f"{time.monotonic() - self.begun:.0f} s"

    @property
    def milliseconds(self) -> int:
        return int((time.monotonic() - self.begun) * 1000)
