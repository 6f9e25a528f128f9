# SPDX-License-Identifier: Apache-2.0
"""rtl/files.f: which files there are, and where an entity lies."""
from __future__ import annotations

import functools
import pathlib
import re
from collections.abc import Callable

from ..paths import RTL
from .reader import Design, Entity, parse
from .tokens import VhdlError

_VHDL = re.compile(r'"[^"\n]*"|--[^\n]*')
_PRAGMA = re.compile(r"--\s*(synthesis|pragma|synopsys)\s+translate_(on|off)")


def listed(files_f: str) -> dict[str, str]:
    """{entity or package: its file, relative to rtl/} in the order of files.f."""
    found: dict[str, str] = {}
    for line in files_f.splitlines():
        name = line.split("#")[0].strip()
        if name:
            unit = pathlib.PurePosixPath(name).stem
            if unit in found:
                raise VhdlError(f"files.f: {unit} twice")
            found[unit] = name
    return found


def uses(text: str) -> set[str]:
    """Packages and entities of library work that a file names."""
    return set(re.findall(r"\bwork\.(\w+)", re.sub(r"--.*", "", text)))


def essence(text: str) -> str:
    """The text without comments, trailing blanks and blank lines. A comment that tools read is no comment."""
    def kept(match: re.Match[str]) -> str:
        return match[0] if match[0][0] == '"' or _PRAGMA.match(match[0]) else ""
    lines = [line.rstrip() for line in _VHDL.sub(kept, text).split("\n")]
    return "\n".join(line for line in lines if line)


_parsed = functools.lru_cache(maxsize=256)(parse)


class Rtl:
    """A folder with VHDL and its files.f. `read` gives a file's text where it is not what lies on the disk."""

    def __init__(self, folder: pathlib.Path = RTL, read: Callable[[pathlib.Path], str] | None = None) -> None:
        self.folder = folder
        self._read = read or (lambda path: path.read_bytes().decode("latin-1"))
        self.files = listed(self._read(folder / "files.f"))
        self._designs: dict[str, Design] = {}

    @property
    def units(self) -> list[str]:
        """Entities and packages, in order."""
        return list(self.files)

    @property
    def entities(self) -> list[str]:
        return [unit for unit in self.files if not unit.endswith("_pkg")]

    def name(self, unit: str) -> str:
        """File of an entity or package, relative to the folder."""
        if unit not in self.files:
            raise VhdlError(f"{self.folder / 'files.f'} has no {unit}.vhd")
        return self.files[unit]

    def path(self, unit: str) -> pathlib.Path:
        return self.folder / self.name(unit)

    def up_to(self, top: str) -> list[str]:
        """Entities and packages in order, up to and including `top`."""
        self.name(top)
        return self.units[:self.units.index(top) + 1]

    def sources(self, top: str | None = None) -> list[pathlib.Path]:
        """Their files; all of them, or those up to and including `top`."""
        return [self.path(unit) for unit in (self.units if top is None else self.up_to(top))]

    def text(self, unit: str) -> str:
        return self._read(self.path(unit))

    def design(self, unit: str) -> Design:
        if unit not in self._designs:
            try:
                self._designs[unit] = _parsed(self.text(unit))
            except VhdlError as error:
                raise VhdlError(f"{self.path(unit)}: {error}") from None
        return self._designs[unit]

    def entity(self, unit: str) -> Entity:
        design = self.design(unit)
        if [entity.name for entity in design.entities] != [unit]:
            raise VhdlError(f"{self.path(unit)} does not declare entity {unit}")
        return design.entity
