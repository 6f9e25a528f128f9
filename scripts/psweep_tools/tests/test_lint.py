# SPDX-License-Identifier: Apache-2.0
"""Every check of texts finds the fault that it is for: faults planted one by one into the texts of this tree."""
from __future__ import annotations

import re
import unittest
from collections.abc import Callable

from ..lint import hardware, main, programs, tables, text, tree

PAGE, ENTITY = "docs/updating.md", "updating"


_before: dict[Callable[[tree.Tree], list[str]], set[str]] = {}


def _only(mode: Callable[[tree.Tree], list[str]], edits: dict[str, str]) -> list[str]:
    """What a check says of the edited tree beyond what it says of the tree as it is."""
    if mode not in _before:
        _before[mode] = set(mode(tree.Tree()))
    return [line for line in mode(tree.Tree(edits=edits)) if line not in _before[mode]]


class Planted(unittest.TestCase):
    base: tree.Tree
    page: str
    rtl: str

    @classmethod
    def setUpClass(cls) -> None:
        cls.base = tree.Tree()
        cls.page = cls.base.page(ENTITY)
        cls.rtl = f"rtl/{cls.base.rtl.name(ENTITY)}"

    def plant(self, mode: Callable[[tree.Tree], list[str]], name: str, old: str, new: str, *wanted: str) -> None:
        before = self.base.read(name)
        after = re.sub(old, new, before, count=1, flags=re.M | re.S)
        self.assertTrue(before != after, f"{name}: {old} is not there")
        found = "\n".join(_only(mode, {name: after}))
        for pattern in wanted:
            self.assertRegex(found, pattern, f"{name}: {old} -> {new}")

    def test_text(self) -> None:
        name = "rtl/files.f"
        for old, new, wanted in (
                (r"\A", "\u00e9\n", "ascii"), (r"\n", "\r\n", "lf"), (r"\n", "\t\n", "tab"), (r"\n", " \n", "blanks"),
                (r"\Z", "\n", "blank line at the end"), (r"\n\Z", "", "no newline"), (r".*", "", "empty"),
                (r"Apache-2.0", "MIT", "spdx"), (r"\n", " " + "x" * 120 + "\n", "columns"),
                (r"\n", " TO" + "DO\n", "promises"), (r"\n", " /ho" + "me/me\n", "path of one machine"),
                (r"\n", '\nTEST_' + 'CASE("a;b")\n', "semicolon")):
            self.plant(text.check_text, name, old, new, f"{name}:\\d+: .*{wanted}|{name}:\\d+: {wanted}")

    def test_links(self) -> None:
        self.plant(text.check_links, "README.md", r"\n", "\n[a](docs/none.md)\n", "docs/none.md does not exist")
        self.plant(text.check_links, "README.md", r"\n", "\n[a](README.md#no-such)\n", "no heading for #no-such")
        self.plant(text.check_links, "docs/README.md", r"\]\(updating\.md\)|\]\(\w+/updating\.md\)", "](README.md)",
                   "updating.md is not listed")

    def test_vhdl(self) -> None:
        for line, rule in (("  when others => x <= y;", "others"), ("  with a select b <= c;", "with_select"),
                           ("  x <= abs y;", "abs"), ("  x <= y rem z;", "rem"), ("  shift_right(x);", "shift_right"),
                           ("  x sra 2;", "sra"), ("  std_match(x);", "std_match"), ("  process (all)", "vhdl2008"),
                           ("  signal a : std_logic := '0';", "initial_value"), ("  wait;", "not_hardware"),
                           ("  signal reg : std_logic;", "reserved"), ("  x <= 'X';", "unknown"),
                           ("  use ieee.std_logic_arith.all;", "library"), ("  integer'image(3);", "image"),
                           ("  p : inout std_logic;", "port_mode"), ("  wire : in std_logic;", "reserved"),
                           ("  G_X : real;", "generic_type"), ("  signal myName : std_logic;", "camel_case")):
            findings = tree.Findings("vhdl", [])
            hardware.check_constructs(findings, "rtl/a.vhd", f"entity a is\nend entity a;\n;\n{line}\n")
            self.assertEqual([f.split(": ")[1] for f in findings.lines], [rule], line)
            self.assertRegex(findings.lines[0], "^rtl/a.vhd:[34]: ")
        for content, rule in (("entity b is\nend entity b;\n", "one_entity"), ("x ? y", "reader"),
                              ("entity a is end entity a;\nu : entity work.a port map (x => y);", "recursion")):
            findings = tree.Findings("vhdl", [])
            hardware.check_constructs(findings, "rtl/a.vhd", content)
            self.assertIn(rule, " ".join(findings.lines))

    def test_waivers(self) -> None:
        found = tree.Findings("vhdl", [tree.Waiver("vhdl", "abs", "a", "", 1), tree.Waiver("vhdl", "rem", "a", "", 2)])
        found.add("a", 1, "abs", "what")
        self.assertEqual(found.close(), ["scripts/lint_waivers.txt:2: unused: nothing there to waive"])

    def test_units_and_attributes(self) -> None:
        self.plant(hardware.check_units, "rtl/files.f", r"\Z", "other.vhd\n", "golden: .*other.hpp is missing",
                   "test: .*test_other.cpp is missing", "page: ")
        flows = self.base.page("flows")
        self.plant(hardware.check_attributes, flows, r"^## Attributes\n(.*?\|[-|]+\|\n\| \w+ \| \w+ \|) \w+ \|",
                   r"## Attributes\n\1 other |", "not in the VHDL: other", "not in docs/")
        similarity = f"rtl/{self.base.rtl.name('similarity')}"
        self.plant(hardware.check_attributes, similarity, r"(attribute \w+ of )(\w+)", r"\1no_signal",
                   "no signal no_signal")

    def test_tables(self) -> None:
        check, page = tables.check_tables, self.page
        self.plant(check, page, r"^(\| (?:\w+, )*)clk\b", r"\1clkk", "no row for port clk", "port clkk is not in")
        self.plant(check, page, r"^(\| G_CELLS \|) \w+", r"\1 7", "default '7', in the entity")
        self.plant(check, page, r"^(\| G_CELLS \| \w+ \|)[^|]+", r"\1 any ", "range 'any', by the assertions")
        self.plant(check, page, r"^## Contract", "## Other", "no row 'rate' in ## Contract")
        self.plant(check, page, r"^## Diagram", "## Other", "nothing drawn")
        self.plant(check, page, r"^\| generic \| default \|", "| generic | preset |", "another form")
        self.plant(check, page, r"^(\| G_CELLS \|[^\n]*\|)[^|\n]*\|$", r"\1 |", "no meaning|cells instead of 4")
        self.plant(check, self.rtl, r"(G_CELLS +: integer := )\d+", r"\g<1>9", "default '.*', in the entity '9'")
        self.plant(check, self.rtl, r"(clk +: )in", r"\1out", "direction 'in', in the entity 'out'")

    def test_trace(self) -> None:
        page = self.base.page("traceability")
        for old, new, wanted in ((r"^(\| R-[^\n]*)`make [a-z-]+", r"\1`make nothing", "no make target 'nothing'"),
                                 (r"^(\| R-[^\n]*)`lint \w+`", r"\1`lint nothing`", "no check 'nothing'"),
                                 (r'^(\| R-[^\n]*)`ctest "[^"]+"', r'\1`ctest "no such name"',
                                  "no add_test has a name"),
                                 (r"^(\| R-[^\n]*)`test_\w+( \"[^`]*)?`", r"\1`test_nothing`",
                                  "no test program 'test_nothing'"),
                                 (r"^\| R-", "| X-", "a requirement begins with"),
                                 (r"^(\| R-[A-Z]+-\d\d [^|]*\|[^|]*\|)[^|]*\|", r"\1 `none.vhd` |",
                                  "none.vhd does not exist"),
                                 (r"^(\| R-[^\n]*\|)[^|\n]*\|$", r"\1 nothing |", "nothing shows")):
            self.plant(main.trace, page, old, new, wanted)

    def test_shell(self) -> None:
        self.assertEqual(programs.style_of_shell("a", "#!/bin/sh\nx | sort\n"), [])
        self.assertTrue(programs.style_of_shell("a", "x\n" * 41))
        self.assertTrue(programs.style_of_shell("a", "x | " + "awk '{print}'\n"))


if __name__ == "__main__":
    unittest.main()
