# SPDX-License-Identifier: Apache-2.0
"""Merges and reports what was counted."""
from __future__ import annotations

import json
import pathlib
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from ..vhdl import Rtl
from ..work import Failure

LIMIT = 95  # percent of the lines
HOLES = "scripts/coverage_holes.txt"


def trimmed(text: str) -> str:
    return " ".join(re.sub(r"--.*", "", text).split())


@dataclass
class Hole:
    """A line that is never run, with its reason; `number` such lines."""
    where: str
    number: int = 0
    reason: str = ""


def explained(text: str) -> dict[tuple[str, str], Hole]:
    """{(entity, line): hole} of the list: file, lines ('- ' and the text; as often as there are such holes), reason. By
    text alone: the number of a line would be another's after the next edit."""
    found: dict[tuple[str, str], Hole] = {}
    entity, reasoned = "", False
    pending: list[tuple[str, str]] = []
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("#") or not line.strip():
            continue
        if m := re.fullmatch(r"rtl/(?:\w+/)*(\w+)\.vhd", line):
            entity, pending, reasoned = m[1], [], False
        elif (m := re.match(r"- (.*\S)", line)) and entity:
            if reasoned:
                pending, reasoned = [], False
            key = (entity, trimmed(m[1]))
            found.setdefault(key, Hole(f"{HOLES}:{number}")).number += 1
            if key not in pending:
                pending.append(key)
        elif (m := re.match(r"  (\S.*)", line)) and pending:
            for key in pending:
                found[key].reason += f"{m[1]} "
            reasoned = True
        else:
            raise Failure(f"{HOLES}:{number}: not understood")
    return found


def _results(value: Any) -> Iterator[tuple[str, dict[str, int]]]:
    """(file, {line: times}) of all that GHDL's report holds, however it wraps them."""
    if isinstance(value, dict):
        if isinstance(value.get("file"), str) and isinstance(value.get("result"), dict):
            yield value["file"], value["result"]
        value = list(value.values())
    if isinstance(value, list):
        for inner in value:
            yield from _results(inner)


def counted(files: list[pathlib.Path], entities: list[str]) -> dict[str, dict[int, bool]]:
    """{entity: {line: was it run}} of GHDL's counts: a line is covered if any run has reached it."""
    run: dict[str, dict[int, bool]] = {}
    for file in files:
        seen = 0
        for name, result in _results(json.loads(file.read_text())):
            entity = pathlib.PurePosixPath(name).stem
            if entity not in entities:
                continue
            lines = run.setdefault(entity, {})
            for line, times in result.items():
                lines[int(line)] = lines.get(int(line), False) or times > 0
                seen += 1
        if not seen:
            raise Failure(f"{file} counts no line of rtl/")
    return run


@dataclass
class Lines:
    """The report about lines."""
    table: list[str] = field(default_factory=list)
    holes: list[str] = field(default_factory=list)
    lcov: list[str] = field(default_factory=list)
    bad: list[str] = field(default_factory=list)
    total: int = 0
    hit: int = 0

    def entity(self, rtl: Rtl, name: str, run: dict[int, bool], known: dict[tuple[str, str], Hole],
               found: Counter[tuple[str, str]]) -> None:
        file, text = f"rtl/{rtl.name(name)}", rtl.text(name).split("\n")
        self.lcov.append(f"TN:\nSF:{file}\n")
        for number in sorted(run):
            self.lcov.append(f"DA:{number},{int(run[number])}\n")
            if run[number]:
                continue
            key = (name, trimmed(text[number - 1]))
            found[key] += 1
            hole = known.get(key)
            if hole is None or found[key] > hole.number:
                hole = None
                self.bad.append(f"a hole that {HOLES} does not explain: {file}:{number}: {key[1]}")
            self.holes.append(f"{file}:{number}: {key[1]}\n    {hole.reason if hole else 'NOT EXPLAINED'}\n")
        self.lcov.append("end_of_record\n")
        hit = sum(run.values())
        self.table.append(f"{name:<20} {hit:>5} of {len(run):>5}  {100 * hit / len(run):6.2f} %\n")
        self.total, self.hit = self.total + len(run), self.hit + hit


def report_lines(out: pathlib.Path, files: list[pathlib.Path], rtl: Rtl, holes: str) -> int:
    run, known = counted(files, rtl.units), explained(holes)
    lines, found = Lines(), Counter[tuple[str, str]]()
    lines.bad += [f"{hole.where}: no reason" for hole in known.values() if not hole.reason]
    for name in rtl.units:
        if name in run:
            lines.entity(rtl, name, run[name], known, found)
        else:
            # Constants and functions of a package belong to elaboration; GHDL counts what it runs after that.
            lines.table.append(f"{name:<20} no statement that GHDL counts\n")
    for key, hole in sorted(known.items()):
        if hole.number > found[key]:
            lines.bad.append(f"{hole.where}: {hole.number - found[key]} more than there are holes")
    if not lines.total:
        raise Failure("no line was counted")
    percent = 100 * lines.hit / lines.total
    if percent < LIMIT:
        lines.bad.append(f"{percent:.2f} % of the lines were run, {LIMIT} % are wanted")
    lines.table.append(f"{'all':<20} {lines.hit:>5} of {lines.total:>5}  {percent:6.2f} %\n")
    (out / "lines.lcov").write_text("".join(lines.lcov))
    (out / "lines.txt").write_text("".join(["Lines of VHDL that were run\n\n", *lines.table, "\nHoles\n\n",
                                            *lines.holes, "\n"]))
    print("".join(lines.table), end="")
    for problem in lines.bad:
        print(f"coverage: {problem}")
    print(f"coverage: {lines.hit} of {lines.total} lines, {percent:.2f} %, {len(lines.holes)} holes, {len(lines.bad)} "
          "problems")
    return 1 if lines.bad else 0


def entity_of(module: str, units: list[str]) -> str | None:
    """The entity of a module of the Verilog: its name, or that and a hash of its generics."""
    for unit in sorted(units, key=len, reverse=True):
        if module == unit or re.match(rf"{unit}_(?:[0-9a-f]{{8,}}|\d)", module):
            return unit
    return None


def report_toggles(out: pathlib.Path, files: list[pathlib.Path], rtl: Rtl) -> int:
    """Files: names of bits, '1' or '0' and a tabulator before each (sw/simulator/coverage.hpp)."""
    bits: dict[str, bool] = {}
    for file in files:
        for line in file.read_text().splitlines():
            once, name = line.split("\t", 1)
            bits[name] = bits.get(name, False) or once not in ("", "0")
    total, hit, unknown = Counter[str](), Counter[str](), 0
    changes: dict[str, dict[str, bool]] = {}
    owner: dict[str, str | None] = {}
    for name, changed in bits.items():
        module, _, signal = name.partition(" ")
        if module not in owner:
            owner[module] = entity_of(module, rtl.units)
        entity = owner[module]
        if entity is None:
            unknown += 1
            continue
        total[entity] += 1
        hit[entity] += changed
        base = signal.split("[")[0]
        signals = changes.setdefault(entity, {})
        signals[base] = signals.get(base, False) or changed
    if not total:
        raise Failure("no bit was counted")
    table, silent = [], []
    for unit in rtl.units:
        if not total[unit]:
            table.append(f"{unit:<20} no signal of its own\n")
            continue
        table.append(f"{unit:<20} {hit[unit]:>6} of {total[unit]:>6}  {100 * hit[unit] / total[unit]:6.2f} %\n")
        silent += [f"{unit}.{name}\n" for name, changed in sorted(changes[unit].items()) if not changed]
    changed_bits, all_bits = sum(hit.values()), sum(total.values())
    percent = 100 * changed_bits / all_bits
    table.append(f"{'all':<20} {changed_bits:>6} of {all_bits:>6}  {percent:6.2f} %\n")
    (out / "toggles.txt").write_text("".join(
        ["Bits that changed, in all configurations together\n\n", *table,
         "\nSignals of which no bit changed in any configuration\n\n", *silent, "\n"]))
    print("".join(table), end="")
    print(f"coverage: {changed_bits} of {all_bits} bits changed, {percent:.2f} %; {len(silent)} signals never did"
          + (f"; {unknown} bits of unknown modules" if unknown else ""))
    return 1 if unknown else 0
