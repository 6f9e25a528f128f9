# SPDX-License-Identifier: Apache-2.0
"""The page traceability: requirement, where it is implemented, what shows it; everything that it names has to exist.

Rows of the tables '| requirement | source | implemented in | shown by |'. Implemented in: files or folders in
backticks. Shown by, in backticks: `make TARGET ..`, `lint CHECK`, `test_x` (tb/**/test_x.cpp), `test_x "regex"` (names
of its TEST_CASEs) or `ctest "regex"` (names given to add_test or rtl_must_not_elaborate); at least one. Every
tb/**/test_*.cpp has to be referenced."""
from __future__ import annotations

import pathlib
import re
from collections.abc import Iterable

from .tree import Tree

_CASE = re.compile(r'TEST_CASE(?:_\w+)?\(\s*((?:"(?:[^"\\]|\\.)*"\s*)+)')
_LITERAL = re.compile(r'"((?:[^"\\]|\\.)*)"')
_TEST = re.compile(r'(?:add_test\(\s*NAME|rtl_must_not_elaborate\()\s*"([^"]+)"')
HEAD = ["requirement", "source", "implemented in", "shown by"]


class _Known:
    """Tests, make targets and checks that there are."""

    def __init__(self, tree: Tree, checks: Iterable[str]) -> None:
        self.problems: list[str] = []
        self.cases: dict[str, list[str]] = {}
        self.tests: list[str] = []
        self.used: set[str] = set()
        self.targets = set(re.findall(r"^([a-z][a-z-]*):", tree.read("Makefile"), re.M))
        self.checks = set(checks)
        for name in tree.select(r"^tb/"):
            path = pathlib.PurePosixPath(name)
            if re.fullmatch(r"test_\w+\.cpp", path.name):
                # Adjacent literals are one name.
                found = ["".join(_LITERAL.findall(m[1])) for m in _CASE.finditer(tree.read(name))]
                self.cases[path.stem] = found
                if not found:
                    self.problems.append(f"{name}: no TEST_CASE was found")
            if path.name == "CMakeLists.txt" or path.suffix == ".cmake":
                # Variables in a name stand for anything: one word.
                self.tests += [re.sub(r"\$\{\w+\}", "NAME", test) for test in _TEST.findall(tree.read(name))]

    def problem(self, token: str) -> str:
        """'' if this test exists, else what is wrong."""
        if m := re.match(r"make ([a-z-]+)\b", token):
            return "" if m[1] in self.targets else f"no make target '{m[1]}'"
        if m := re.fullmatch(r"lint (\w+)", token):
            return "" if m[1] in self.checks else f"no check '{m[1]}' of make lint"
        if m := re.fullmatch(r'ctest "(.+)"', token):
            return "" if any(re.search(m[1], name) for name in self.tests) else \
                f'no add_test has a name like "{m[1]}"'
        if m := re.fullmatch(r'(test_\w+)(?: "(.+)")?', token):
            if m[1] not in self.cases:
                return f"no test program '{m[1]}' in tb/"
            self.used.add(m[1])
            return "" if m[2] is None or any(re.search(m[2], name) for name in self.cases[m[1]]) else \
                f'no test of {m[1]} has a name like "{m[2]}"'
        return f"'{token}' is no test"


def check_trace(tree: Tree, checks: Iterable[str], page: str = "") -> list[str]:
    page = page or tree.page("traceability")
    known = _Known(tree, checks)
    problems, seen, in_table = known.problems, set(), False
    for number, line in enumerate(tree.read(page).split("\n"), 1):
        if not line.startswith("|"):
            in_table = False
            continue
        cells = re.split(r"\s*(?<!\\)\|\s*", line)[1:]
        while cells and not cells[-1]:
            cells.pop()
        if cells == HEAD:
            in_table = True
            continue
        if not in_table or re.fullmatch(r"[-|: ]+", line):
            continue
        place = f"{page}:{number}"
        if len(cells) != 4:
            problems.append(f"{place}: {len(cells)} cells instead of 4")
            continue
        name = re.match(r"(R-[A-Z]+-\d\d) \S", cells[0])
        if name is None:
            problems.append(f"{place}: a requirement begins with R-AREA-00 and a text")
            continue
        if name[1] in seen:
            problems.append(f"{place}: {name[1]} a second time")
        seen.add(name[1])
        files = re.findall(r"`([^`]+)`", cells[2])
        if not files:
            problems.append(f"{place}: {name[1]} is implemented nowhere")
        problems += [f"{place}: {file} does not exist" for file in files if not tree.exists(file)]
        found = [known.problem(token) for token in re.findall(r"`([^`]+)`", cells[3])]
        problems += [f"{place}: {problem}" for problem in found if problem]
        if all(found):
            problems.append(f"{place}: nothing shows {name[1]}")
    problems += [f"{page}: {program} is not referenced" for program in sorted(set(known.cases) - known.used)]
    if not (seen and known.cases and known.targets and known.checks):
        problems.append("trace: nothing was checked")
    return problems
