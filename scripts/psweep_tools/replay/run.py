# SPDX-License-Identifier: Apache-2.0
"""A recording replayed on VHDL, by tb/replay/Replay.cmake."""
from __future__ import annotations

import os
import pathlib
from collections.abc import Iterable

from .. import work
from ..paths import ROOT
from ..work import Failure


def build_folder(name: str) -> pathlib.Path:
    """A build with the recorder and the bench of the engine."""
    build = (ROOT / name).resolve()
    for file in ("record_engine", "psweep_replay.vhd"):
        if not (build / "tb" / "replay" / file).exists():
            raise Failure(f"no {build}/tb/replay/{file}; make build first")
    return build


def record(build: pathlib.Path, log: pathlib.Path, recording: pathlib.Path, config: str, **more: str) -> int:
    environment = {"PSWEEP_CONFIG": config, "PSWEEP_RECORD": str(recording),
                   **{f"PSWEEP_{key.upper()}": value for key, value in more.items()}}
    return work.run([build / "tb" / "replay" / "record_engine"], environment=environment, log=log, check=False)


def replay(build: pathlib.Path, sources: Iterable[pathlib.Path], recording: pathlib.Path, folder: pathlib.Path,
           log: pathlib.Path, limit: float | None = None) -> int:
    return work.run(["cmake", "-D", f"GHDL={os.environ.get('GHDL') or 'ghdl'}", "-D", "STANDARD=--std=93",
                     "-D", "SOURCES=" + "|".join(map(str, sources)),
                     "-D", f"BENCH={build / 'tb' / 'replay' / 'psweep_replay.vhd'}", "-D", f"FILE={recording}",
                     "-D", f"DIR={folder}", "-P", "tb/replay/Replay.cmake"], log=log, check=False, limit=limit)
