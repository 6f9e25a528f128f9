# SPDX-License-Identifier: Apache-2.0
"""The pages of the entities: contract, diagram; tables of generics and ports against the VHDL.

A page has one table '| generic | default | range | meaning, cost |' if the entity has generics, and one or more tables
'| port | dir | width | meaning |'. Each generic has a row with the entity's default and the range that its assertion
states: 'a .. b', 'a .. b, even', 'a, b', 'from a', or the condition itself. A generic that the entity hands down as it
is has the range of the entity that checks it; 'any' if nobody does. Each port has a row with its direction and width;
ports alike may share a row, separated by commas. Nothing else may be in these tables. '## Contract' is a table with the
rows of CONTRACT; '## Diagram' a block of text or a picture."""
from __future__ import annotations

import re
from dataclasses import dataclass, field

from ..vhdl import Rtl, VhdlError, range_of, squeezed, width_of
from .tree import Tree

CONTRACT = ("rate", "latency", "formats", "reset", "corner cases", "cost")
HEADS = {"generic|default|range|meaning, cost": "generic", "port|dir|width|meaning": "port"}


def find_range(rtl: Rtl, unit: str, generic: str) -> str | None:
    """The range of a generic by the assertion of its entity, or of an entity that it is handed down to."""
    if unit not in rtl.files:
        return None
    design = rtl.design(unit)
    stated = [a for a in design.assertions if a.of_generic and a.of_generic[:2] == (unit, generic)]
    if len(stated) > 1:
        raise VhdlError(f"rtl/{rtl.name(unit)}: two assertions about {generic}")
    own = range_of(generic, stated[0].condition) if stated else None
    if own is not None and not own.startswith("`"):
        return own
    for instance in design.instances:
        below = next((formal for formal, actual in instance.generics.items() if actual == generic), None)
        if below is None or instance.entity == unit or (own is not None and below != generic):
            continue
        found = find_range(rtl, instance.entity, below)
        if found is not None:
            found = re.sub(rf"\b{below}\b", generic, found)
            return found if own is None else f"{found}; {own}"
    return own


def rows(rtl: Rtl) -> list[str]:
    """What the tables have to say, meanings left blank."""
    out = []
    for unit in rtl.entities:
        for g in rtl.entity(unit).generics:
            out.append("\t".join((unit, "generic", g.name, g.default, find_range(rtl, unit, g.name) or "any")))
        for p in rtl.entity(unit).ports:
            out.append("\t".join((unit, "port", p.name, p.mode, width_of(p))))
    return out


@dataclass
class _Page:
    name: str
    problems: list[str] = field(default_factory=list)
    found: dict[str, dict[str, tuple[int, str, str]]] = field(default_factory=lambda: {"generic": {}, "port": {}})
    contract: set[str] = field(default_factory=set)
    drawn: bool = False

    def row(self, table: str, number: int, cells: list[str]) -> None:
        place = f"{self.name}:{number}"
        if len(cells) != 4:
            self.problems.append(f"{place}: {len(cells)} cells instead of 4")
            return
        if not cells[3]:
            self.problems.append(f"{place}: no meaning")
        for name in cells[0].split(", "):
            if name in self.found[table]:
                self.problems.append(f"{place}: {table} {name} a second time")
            self.found[table][name] = (number, cells[1], cells[2])

    def read(self, text: str) -> None:
        section, table = "", ""
        for number, line in enumerate(text.splitlines(), 1):
            if line.startswith("## "):
                section = line[3:]
            if section == "Contract" and (m := re.match(r"\| ([a-z ]+) \| .*\S.* \|$", line)):
                self.contract.add(m[1])
            self.drawn |= section == "Diagram" and line.startswith(("```text", "!["))
            if not line.startswith("|"):
                table = ""
                continue
            cells = [squeezed(cell) for cell in re.split(r"(?<!\\)\|", line)][1:-1]
            head = "|".join(cells)
            if head in HEADS:
                table = HEADS[head]
                continue
            if cells and cells[0] in ("generic", "port") and not table:
                self.problems.append(f"{self.name}:{number}: a table of {cells[0]}s in another form than it should be")
            if table and not re.fullmatch(r"[-:|]+", head):
                self.row(table, number, cells)


def _check_page(page: _Page, rtl: Rtl, unit: str) -> tuple[int, int]:
    """Adds to page.problems; numbers of generics and ports that were compared."""
    file, out = f"rtl/{rtl.name(unit)}", page.problems
    out += [f"{page.name}: no row '{name}' in ## Contract" for name in CONTRACT if name not in page.contract]
    if not page.drawn:
        out.append(f"{page.name}: nothing drawn in ## Diagram")
    entity = rtl.entity(unit)
    compared = {"generic": 0, "port": 0}
    wanted = [("generic", g.name, (("default", g.default, "in the entity"),
                                   ("range", find_range(rtl, unit, g.name) or "any", "by the assertions")))
              for g in entity.generics]
    wanted += [("port", p.name, (("direction", p.mode, "in the entity"), ("width", width_of(p), "in the entity")))
               for p in entity.ports]
    for table, name, columns in wanted:
        row = page.found[table].pop(name, None)
        if row is None:
            out.append(f"{page.name}: no row for {table} {name} of {file}")
            continue
        for (what, value, where), cell in zip(columns, row[1:], strict=True):
            if cell != value:
                out.append(f"{page.name}:{row[0]}: {table} {name}: {what} '{cell}', {where} '{value}'")
        compared[table] += 1
    for table in ("generic", "port"):
        out += [f"{page.name}:{row[0]}: {table} {name} is not in {file}"
                for name, row in sorted(page.found[table].items())]
    if not entity.ports:
        out.append(f"{file}: no port was found")
    return compared["generic"], compared["port"]


def check_tables(tree: Tree) -> list[str]:
    """The page of each entity: contract, diagram; generics and ports are those of the entity."""
    problems: list[str] = []
    generics = ports = 0
    for unit in tree.rtl.entities:
        page = _Page(tree.page(unit))
        if not tree.exists(page.name):
            problems.append(f"{page.name}: missing, the page of rtl/{tree.rtl.name(unit)}")
            continue
        page.read(tree.read(page.name))
        try:
            numbers = _check_page(page, tree.rtl, unit)
            generics, ports = generics + numbers[0], ports + numbers[1]
        except VhdlError as error:
            page.problems.append(str(error))
        problems += page.problems
    if not generics or not ports:
        problems.append(f"nothing was checked: {generics} generics, {ports} ports")
    return problems
