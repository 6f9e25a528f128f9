# SPDX-License-Identifier: Apache-2.0
"""Results of the command line: compared, and of several engines side by side."""
from __future__ import annotations

import pathlib

from . import work
from .work import Failure


def same_output(a: pathlib.Path, b: pathlib.Path) -> bool:
    """Compares two output folders of psweep depth byte for byte, all files but report.json (times differ)."""
    names = sorted({path.name for folder in (a, b) if folder.is_dir() for path in folder.iterdir()} - {"report.json"})
    if not names or not (a / "depth.pfm").exists():
        raise Failure(f"no depth.pfm in {a}")
    differ = []
    for name in names:
        if not (a / name).is_file() or not (b / name).is_file() or (a / name).read_bytes() != (b / name).read_bytes():
            differ.append(name)
            print(f"{a / name} and {b / name} differ")
    print(f"{a} and {b}: {len(names) - len(differ)} of {len(names)} files are the same", flush=True)
    return not differ


def program(path: str) -> pathlib.Path:
    found = pathlib.Path(path)
    if not found.is_file():
        raise Failure(f"{found} is missing; run make build first")
    return found.resolve()


def main(arguments: list[str]) -> int:
    options = work.parser("scripts/same_output.sh", same_output.__doc__)
    options.add_argument("a", type=pathlib.Path)
    options.add_argument("b", type=pathlib.Path)
    given = options.parse_args(arguments)
    return 0 if same_output(given.a, given.b) else 1
