# SPDX-License-Identifier: Apache-2.0
"""Entries of the lists of exceptions that name what is no longer there."""
import pathlib
import re

from . import sources
from ..mutants import faults
from .. import vhdl


def gone(root: pathlib.Path = sources.ROOT) -> list[str]:
    return _holes(root) + _equivalents(root)


def _lines(root: pathlib.Path, entity: str) -> list[str]:
    rtl = vhdl.Rtl(root / "rtl")
    return rtl.text(entity).split("\n") if entity in rtl.files else []


def _holes(root: pathlib.Path) -> list[str]:
    out: list[str] = []
    entity = ""
    there: dict[str, int] = {}
    name = "scripts/coverage_holes.txt"
    for n, line in enumerate((root / name).read_text().splitlines(), 1):
        if m := re.fullmatch(r"rtl/(?:\w+/)*(\w+)\.vhd", line):
            entity, there = m[1], {}
            for text in _lines(root, entity):
                there[faults.trimmed(text)] = there.get(faults.trimmed(text), 0) + 1
        elif m := re.match(r"- (.*\S)", line):
            text = faults.trimmed(m[1])
            there[text] = there.get(text, 0) - 1
            if there[text] < 0:
                out.append(f"{name}:{n}: {entity}.vhd has no such line (any more): {text}")
    return out


def _equivalents(root: pathlib.Path) -> list[str]:
    out = []
    for key, entry in faults.equivalents(root / "scripts" / "mutants_equivalent.txt").items():
        entity = key.split("|")[0]
        if not any(m.key == key for m in faults.candidates(entity, _lines(root, entity), 1)):
            out.append(f"scripts/{entry.where}: fits no line of {entity}.vhd (any more)")
    return out
