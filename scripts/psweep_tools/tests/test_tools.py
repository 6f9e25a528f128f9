# SPDX-License-Identifier: Apache-2.0
"""What the tools compute between the programs that they call."""
from __future__ import annotations

import contextlib
import importlib
import io
import json
import os
import pathlib
import tempfile
import unittest
from collections.abc import Iterator

from .. import cli, edits, formal, pairs, real, setup, sim, sweep
from ..coverage import report
from ..flows import gates, machine
from ..paths import ROOT
from ..replay import rules
from ..vhdl import Rtl
from ..work import Failure

RESULTS = """<testsuite>
<testcase name="good" status="run"><system-out>fine</system-out></testcase>
<testcase name="asked &lt;1&gt;" status="notrun"><skipped message="SKIP_REGULAR_EXPRESSION_MATCHED"/>
<system-out>a
SKIPPED: no &lt;tool&gt;
</system-out></testcase>
<testcase name="off" status="disabled"><skipped message="Disabled"/></testcase>
<testcase name="lost" status="notrun"><skipped message="Unable to find executable"/></testcase>
<testcase name="broken" status="notrun"><skipped message="SKIP_REGULAR_EXPRESSION_MATCHED"/>
<system-out>SKIPPED: b
x.cpp:3: FAILED:
</system-out></testcase>
<testcase name="bad" status="fail"><failure message="Failed"/></testcase>
</testsuite>
"""


@contextlib.contextmanager
def folder() -> Iterator[pathlib.Path]:
    with tempfile.TemporaryDirectory() as name, contextlib.redirect_stdout(io.StringIO()):
        yield pathlib.Path(name)


class Sim(unittest.TestCase):
    def test_summary(self) -> None:
        with folder() as at:
            (at / "r.xml").write_text(RESULTS)
            lines, code = sim.summary(at / "r.xml")
            self.assertEqual((lines, code), ([
                "failed:  lost: could not be run: Unable to find executable", "failed:  broken", "failed:  bad",
                "skipped: asked <1>: no <tool>", "skipped: off: Disabled", "1 passed, 3 failed, 2 skipped"], 1))
            (at / "r.xml").write_text("<testsuite></testsuite>")
            self.assertEqual(sim.summary(at / "r.xml")[0][-1], "0 passed, 1 failed, 0 skipped")
            self.assertEqual(sim.summary(at / "none.xml")[1], 1)


class Faults(unittest.TestCase):
    def test_edited(self) -> None:
        self.assertEqual(edits.edited("aa\na\nb", "a", "c"), "ca\nc\nb")
        self.assertEqual(edits.edited("a\nb\na\nc", r"(a\n)b", r"\1c"), "a\nc\na\nc")
        with self.assertRaises(edits.DoesNotFit):
            edits.edited("a", "b", "c")

    def test_every_fault_fits(self) -> None:
        rtl = Rtl()
        faults = [*rules.RULES, *(fault for proof in formal.proofs(rtl) for fault in proof.faults)]
        self.assertGreater(len(faults), 40)
        for fault in faults:
            self.assertNotEqual(fault.text(rtl), rtl.text(fault.entity), fault)


class Coverage(unittest.TestCase):
    def test_lines(self) -> None:
        rtl = Rtl()
        text = rtl.text("ram_sdp").split("\n")
        line = next(n for n, t in enumerate(text, 1) if "<=" in t and not t.strip().startswith("--"))
        holes = f"rtl/{rtl.name('ram_sdp')}\n- {text[line - 1].strip()}\n  a reason\n"
        with folder() as at:
            for result, list_of_holes, code in (
                    ({str(line): 1}, "", 0), ({str(line): 0}, "", 1), ({str(line): 1}, holes, 1)):
                (at / "c.json").write_text(
                    json.dumps({"outputs": [{"file": f"rtl/{rtl.name('ram_sdp')}", "result": result}]}))
                self.assertEqual(report.report_lines(at, [at / "c.json"], rtl, list_of_holes), code)
            (at / "c.json").write_text('{"outputs": []}')
            with self.assertRaises(Failure):
                report.report_lines(at, [at / "c.json"], rtl, "")

    def test_list_of_holes(self) -> None:
        found = report.explained("rtl/a.vhd\n- x;\n- x; -- y\n- z;\n  why\n  so\n- u;\n  else\n")
        self.assertEqual({key: (hole.number, hole.reason) for key, hole in found.items()},
                         {("a", "x;"): (2, "why so "), ("a", "z;"): (1, "why so "), ("a", "u;"): (1, "else ")})
        with self.assertRaises(Failure):
            report.explained("- x;\n")

    def test_toggles(self) -> None:
        with folder() as at:
            (at / "a").write_text("1\tram_sdp_0123abcd q[0]\n0\tram_sdp_0123abcd q[1]\n0\tram_sdp r\n")
            self.assertEqual(report.report_toggles(at, [at / "a"], Rtl()), 0)
            self.assertIn("\nram_sdp.r\n", (at / "toggles.txt").read_text())
            self.assertIn("     1 of      3", (at / "toggles.txt").read_text())
            (at / "a").write_text("1\tother q\n1\tram_sdp q\n")
            self.assertEqual(report.report_toggles(at, [at / "a"], Rtl()), 1)


class Gates(unittest.TestCase):
    def test_broken_cells(self) -> None:
        cell = "  {} #(\n    .INIT(64'h00ff)\n  ) _{}_ (\n    .D(a),\n    .Q(b)\n  );\n"
        netlist = "".join(cell.format("LUT6", n) for n in range(4)) + cell.format("FDRE", 9)
        self.assertEqual(gates.count(netlist), {"LUT6": 4, "FDRE": 1})
        text = gates.broken(netlist, "LUT6", 5)
        self.assertEqual(text.count("64'hff00"), 1)
        self.assertLess(text.index("_1_"), text.index("64'hff00"))
        self.assertIn(".D(~a),\n", gates.broken(netlist, "FDRE", 2))
        for kind in ("CARRY4", "SRL16E"):
            with self.assertRaises(Failure):
                gates.broken(netlist, kind, 5)

    def test_models(self) -> None:
        models = "module RAMB18E1(x);\nendmodule\nmodule RAMB36E1(x);\nendmodule\nalways @* a <= b;\n"
        self.assertEqual(gates.usable_models(models), "always begin a = b; @(b); end\n")
        with self.assertRaises(Failure):
            gates.usable_models("module RAMB18E1(x);\nendmodule\n")
        self.assertEqual(gates.without_unknown_starts("  .INIT_0A(256'hxxxx),\n  .INIT_0B(256'h1xxx),\n"),
                         "  .INIT_0B(256'h1xxx),\n")


class Others(unittest.TestCase):
    def test_sweep_draws_what_it_always_drew(self) -> None:
        c = sweep.drawn(1, 5)
        self.assertEqual(c[0]["WINDOW"], 21)
        random = sweep.Generator(1)
        self.assertEqual([random.draw() for _ in range(3)], EXPECTED)
        for config in sweep.drawn(7, 200):
            self.assertLessEqual(config["LANES"] * (config["PIX_BITS"] + config["INTERP_FRAC"]), 64)

    def test_quick_start(self) -> None:
        self.assertEqual(machine.commands((ROOT / "README.md").read_text())[-1], "make sim")
        with self.assertRaises(Failure):
            machine.commands("# a\n## Quick start\ntext\n## b\n```sh\nmake\n```\n")

    def test_output_is_compared(self) -> None:
        with folder() as at:
            for name in ("a", "b"):
                (at / name).mkdir()
                (at / name / "depth.pfm").write_text("1")
                (at / name / "report.json").write_text(name)
            self.assertTrue(pairs.same_output(at / "a", at / "b"))
            (at / "b" / "more").write_text("1")
            self.assertFalse(pairs.same_output(at / "a", at / "b"))
            with self.assertRaises(Failure):
                pairs.same_output(at / "none", at / "none")

    def test_numbers(self) -> None:
        self.assertEqual([real.number("bad1 3.456 x\n", name) for name in ("bad1", "bad")], ["3.46", "-"])

    def test_groups_of_packages(self) -> None:
        groups = {package.group for package in setup.packages()}
        self.assertTrue({"build", "lint", "cost", "python"} <= groups)
        for group in setup.VENVS:
            self.assertTrue(not setup.requirements(group).is_file() or group in groups, group)

    def test_every_tool_is_there(self) -> None:
        for name, (module, text) in cli.COMMANDS.items():
            self.assertTrue(callable(importlib.import_module(f"psweep_tools.{module}").main), name)
            self.assertTrue(text)
        for script in (ROOT / "scripts").rglob("*.sh"):
            for line in script.read_text().splitlines():
                if "tools.py\" " in line:
                    self.assertIn(line.split("tools.py\" ")[1].split()[0], cli.COMMANDS, script)
                    self.assertTrue(os.access(script, os.X_OK), script)


EXPECTED = [31152, 29673, 10638]

if __name__ == "__main__":
    unittest.main()
