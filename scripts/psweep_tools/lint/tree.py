# SPDX-License-Identifier: Apache-2.0
"""The files that are checked, and the exceptions."""
from __future__ import annotations

import pathlib
import re
import subprocess
from dataclasses import dataclass, field

from ..paths import ROOT
from ..vhdl import Rtl

WAIVERS = "scripts/lint_waivers.txt"


class Skip(Exception):
    """A check that cannot be made here, and why."""


@dataclass
class Waiver:
    mode: str
    rule: str
    file: str
    text: str  # part of the line; '': any
    line: int
    used: bool = False


class Tree:
    """The files of the repository; `edits`: texts of files that are looked at as if they were these."""

    def __init__(self, root: pathlib.Path = ROOT, edits: dict[str, str] | None = None) -> None:
        self.root, self.edits = root, edits or {}
        self.files = _list_files(root)
        self.rtl = Rtl(root / "rtl", lambda path: self.read(str(path.relative_to(root))))
        self.waivers = _waivers(root / WAIVERS)

    def select(self, pattern: str) -> list[str]:
        return [name for name in self.files if re.search(pattern, name)]

    def read(self, name: str) -> str:
        return self.edits[name] if name in self.edits else (self.root / name).read_bytes().decode("latin-1")

    def exists(self, name: str) -> bool:
        return (self.root / name).exists()

    def page(self, name: str) -> str:
        """The page of this name, wherever in docs/ it lies."""
        found = sorted((self.root / "docs").rglob(f"{name}.md"))
        return str(found[0].relative_to(self.root)) if found else f"docs/{name}.md"


@dataclass
class Findings:
    """What one check has found, waivers applied."""
    mode: str
    waivers: list[Waiver]
    lines: list[str] = field(default_factory=list)

    def add(self, file: str, line: int, rule: str, what: str, text: str = "") -> None:
        for waiver in self.waivers:
            if (waiver.mode, waiver.rule, waiver.file) == (self.mode, rule, file) and waiver.text in text:
                waiver.used = True
                return
        self.lines.append(f"{file}:{line}: {rule}: {what}")

    def close(self) -> list[str]:
        """All lines; a waiver that matches nothing is an error, too."""
        return self.lines + [f"{WAIVERS}:{w.line}: unused: nothing there to waive" for w in self.waivers
                             if w.mode == self.mode and not w.used]


def _list_files(root: pathlib.Path) -> list[str]:
    """Tracked files and new ones that git does not ignore. Without git: all but builds."""
    try:
        listed = subprocess.run(["git", "-c", "safe.directory=*", "ls-files", "-co", "--exclude-standard"], cwd=root,
                                capture_output=True, text=True, check=True).stdout.splitlines()
    except (OSError, subprocess.CalledProcessError):
        listed = [str(path.relative_to(root)) for path in root.rglob("*")
                  if not str(path.relative_to(root)).startswith(("build", ".git/")) and "__pycache__" not in path.parts]
    return sorted({name for name in listed if (root / name).is_file()})


def _waivers(path: pathlib.Path) -> list[Waiver]:
    found = []
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        match = re.match(r"(\S+)\s+(\S+)\s+(\S+)\s*(.*?)\s*\|\s*(\S.*)$", line)
        if match is None:
            raise ValueError(f"{WAIVERS}:{number}: no 'mode rule file [text] | reason'")
        found.append(Waiver(match[1], match[2], match[3], match[4], number))
    return found
