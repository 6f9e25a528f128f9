# SPDX-License-Identifier: Apache-2.0
"""Explores the design space by Snakemake: resources, clocks, accuracy as CSV, plots and a page (docs/dse.md).
Goes on where another run stopped; measures only what depends on what changed.

Environment, which jobs of a cluster have, too: JOBS (default: all cores; with --slurm jobs in the queue, default
64), COST_VENV, COST_CACHE (scripts/cost/measure.py), DSE_VENV (Snakemake's Python: scripts/setup.sh dse makes it).
Exit code 1 if a point failed: its log is shown, the other points that do not need it are made."""
from __future__ import annotations

import fcntl
import getpass
import os
import pathlib
import subprocess
import sys
import time
import zlib

from .. import setup, work
from ..paths import ROOT, SCRIPTS, START
from ..work import Failure


def _queue(name: str) -> list[str]:
    """Numbers of the jobs whose names begin so."""
    text = work.output(["squeue", "--noheader", "--user", getpass.getuser(), "--format", "%i %j"])
    return [line.split()[0] for line in text.splitlines() if line.split()[1].startswith(f"{name}_")]


def _cluster(out: pathlib.Path) -> list[str]:
    """Options for Slurm. Jobs carry the folder in their name: those of a run that was killed would write the files of
    this one."""
    name = f"psweep-{zlib.crc32(str(out).encode())}"
    left = _queue(name)
    if left:
        print(f"dse.sh: cancelling {len(left)} jobs of a run that was killed", file=sys.stderr, flush=True)
        work.run(["scancel", *left])
        while _queue(name):
            time.sleep(1)
    jobs = ["--jobs", os.environ["JOBS"]] if os.environ.get("JOBS") else []
    return ["--profile", str(SCRIPTS / "dse" / "slurm"), "--slurm-jobname-prefix", name, *jobs]


def main(arguments: list[str]) -> int:
    more: list[str] = []
    if "--" in arguments:
        at = arguments.index("--")
        arguments, more = arguments[:at], arguments[at + 1:]
    options = work.parser("scripts/dse/dse.sh", __doc__)
    options.add_argument("--grid", help="grid (default scripts/dse/default.yaml; scripts/dse/large.yaml takes hours)")
    options.add_argument("--out", help="results (default build/dse); the page is index.html in it")
    options.add_argument("--programs", help="build folder with psweep, shape_table, psweep_accuracy (default build)")
    options.add_argument("--rtl", help="another folder with VHDL and its files.f (default rtl)")
    options.add_argument("--slurm", action="store_true", help="as jobs of a Slurm cluster, by the profile scripts/dse/"
                         "slurm; jobs of a killed run are cancelled first")
    given = options.parse_args(arguments)
    # Jobs run in the folder of the results; names are those of where the user stands.
    for name in ("COST_VENV", "COST_CACHE", "DSE_VENV"):
        if os.environ.get(name):
            os.environ[name] = str((START / os.environ[name]).absolute())
    snakemake = setup.venv_place("dse") / "bin" / "snakemake"
    if not snakemake.exists():
        raise Failure(f"no {snakemake}: run scripts/setup.sh dse")
    grid = (START / given.grid).resolve() if given.grid else SCRIPTS / "dse" / "default.yaml"
    out = (START / given.out).resolve() if given.out else ROOT / "build" / "dse"
    out.mkdir(parents=True, exist_ok=True)
    settings = [f"{key}={(START / value).resolve()}"
                for key, value in (("programs", given.programs), ("rtl", given.rtl)) if value]
    # Snakemake's own lock outlives a run that was killed; this one does not. Half a file is made again.
    with open(out / ".dse.lock", "w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise Failure(f"another run is at work in {out}") from None
        how = _cluster(out) if given.slurm else ["--cores", str(work.jobs())]
        return subprocess.run(
            [str(snakemake), "--snakefile", "scripts/dse/Snakefile", "--directory", str(out), "--configfile", str(grid),
             *how, *(["--config", *settings] if settings else []), "--rerun-incomplete", "--keep-going",
             "--rerun-triggers", "mtime", "params", "--nolock", *more], cwd=ROOT, check=False).returncode
