# SPDX-License-Identifier: Apache-2.0
"""Tests of evidence and mutants. Nothing is built or measured."""
import json
import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))

from psweep_tools.evidence import figures, manifest, pages, parsers, records, sources, tables  # noqa: E402
from psweep_tools.mutants import campaign, chains, faults  # noqa: E402
from psweep_tools.vhdl import Rtl  # noqa: E402


class Hashes(unittest.TestCase):
    def test_comments_do_not_count(self) -> None:
        def same(name: str, a: str, b: str) -> bool:
            return sources.digest(name, a.encode()) == sources.digest(name, b.encode())
        self.assertTrue(same("a.vhd", "x <= 1; -- one\n", "\nx <= 1;\n"))
        self.assertFalse(same("a.vhd", "x <= 1;\n", "x <= 2;\n"))
        self.assertFalse(same("a.vhd", 'r "--a";\n', 'r "--b";\n'))
        self.assertFalse(same("a.vhd", "-- synthesis translate_off\n", ""))
        self.assertTrue(same("a.cpp", "int a; // b\n/* c\n d */", "int a;"))
        self.assertFalse(same("a.cpp", 'f("//a");', 'f("//b");'))
        self.assertFalse(same("a.cpp", "int a = 1'000; f('\"', 1);", "int a = 1'000; f('\"', 2);"))
        self.assertFalse(same("a.sh", "a # b\n", "a\n"))

    def test_globs(self) -> None:
        names = ["rtl/x/a.vhd", "rtl/y/psweep.vhd", "rtl/c.vhd", "tb/x/t.cpp", "tb/x/y/u.cpp", "tb/x/test_v.cpp"]
        files_f = "x/a.vhd\ny/psweep.vhd\nc.vhd\n"
        self.assertEqual(sources.expand(["@engine"], names, files_f), ["rtl/x/a.vhd", "rtl/y/psweep.vhd"])
        self.assertEqual(len(sources.expand(["@chip"], names, files_f)), 3)
        self.assertEqual(sources.expand(["tb/x/**", "!tb/x/test_*"], names, files_f), ["tb/x/t.cpp", "tb/x/y/u.cpp"])
        self.assertEqual(sources.expand(["tb/x/*.cpp"], names, files_f), ["tb/x/t.cpp", "tb/x/test_v.cpp"])

    def test_moved_vhdl_is_the_same(self) -> None:
        self.assertEqual([sources.known_as(n) for n in ("rtl/x/a.vhd", "rtl/a.vhd", "rtl/configs/engine/tiny.json")],
                         ["rtl/a.vhd", "rtl/a.vhd", "rtl/configs/engine/tiny.json"])

    def test_closures(self) -> None:
        text = {"p": "package p", "a": "use work.p.all; -- b", "b": "u : entity work.a"}.__getitem__
        self.assertEqual(sources.rtl_closure("b", ["p", "a", "b"], text), ["p", "a", "b"])
        self.assertEqual(sources.rtl_closure("a", ["p", "a", "b"], text), ["p", "a"])
        files = {"tb/t.cpp": '#include "golden/g.hpp"\n#include <map>', "sw/golden/g.hpp": '#include "h.hpp"',
                 "sw/golden/g.cpp": "", "sw/golden/h.hpp": "", "sw/other.hpp": ""}
        self.assertEqual(sources.include_closure(["tb/t.cpp"], files.__contains__, files.__getitem__),
                         ["sw/golden/g.cpp", "sw/golden/g.hpp", "sw/golden/h.hpp", "tb/t.cpp"])

    def test_every_kind_depends_on_something(self) -> None:
        tree = sources.Tree()
        for kind in manifest.KINDS:
            self.assertTrue(tree.hashes(kind.depends), kind.name)
            self.assertIn(kind.name, parsers.PARSERS)
            for glob in kind.depends:
                # A helper's bench may come later.
                if glob[0] not in "@!" and kind.name != "flips-chip":
                    self.assertTrue([n for n in tree.names if sources.matches(glob, n)], f"{kind.name}: {glob}")


class Stamps(unittest.TestCase):
    def test_stale_by_name(self) -> None:
        tree = sources.Tree()
        kind = manifest.BY_NAME["rules"]
        files = dict(tree.hashes(kind.depends))
        record = records.Record("rules", records.Stamp("1234abc", "", "2026-01-01", "", files), {"passed": 1})
        self.assertFalse(records.status(kind, tree, record).stale)
        self.assertIn("as of 1234abc", records.status(kind, tree, record).text())
        files["rtl/control.vhd"] = "other"
        status = records.status(kind, tree, record)
        self.assertTrue(status.stale)
        self.assertEqual(status.changed, ["rtl/control.vhd"])
        self.assertIn("control.vhd", status.text())
        self.assertIn("the RTL has changed since", pages.origin(status))
        self.assertNotIn("changed", pages.origin(records.Status(kind, record, [])))

    def test_layout_is_json(self) -> None:
        for value in ({}, [], {"a": [1, 2], "b": {"c": None}}, {"a" * 60: ["x" * 70] * 5, "l": list(range(100))}):
            self.assertEqual(json.loads(records.layout(value)), value)
            self.assertLessEqual(max(map(len, records.layout(value).splitlines())), 150)

    def test_records_have_results_for_their_blocks(self) -> None:
        found = records.load_all([kind.name for kind in manifest.KINDS])
        self.assertTrue(found)
        for name, (kinds, make) in tables.BLOCKS.items():
            there = {k: found[k] for k in kinds if k in found}
            self.assertEqual(make(there, {k: "" for k in kinds}) != "", bool(there), name)
        for name, (kind, _, complete) in tables.FULL.items():
            self.assertIn("|---|", complete(found[kind].results), name)


class Pages(unittest.TestCase):
    def setUp(self) -> None:
        self.folder = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.folder.name)
        (self.root / "docs").mkdir()
        (self.root / "README.md").write_text("# R\n")
        record = records.Record("rules", records.Stamp("1234abc", "", "2026-01-01", "", {}),
                                {"told": ["a"], "passed": 1, "failed": 0})
        self.status = {k.name: records.Status(k, record if k.name == "rules" else None, []) for k in manifest.KINDS}
        self.others = [name for name in tables.BLOCKS if name != "rules"]
        self.page = self.root / "docs" / "a.md"

    def tearDown(self) -> None:
        self.folder.cleanup()

    def put(self, rules: str) -> None:
        text = "".join(f"<!-- evidence: {name} -->\n<!-- /evidence -->\n" for name in self.others)
        self.page.write_text(f"# A\n<!-- evidence: rules -->\n{rules}<!-- /evidence -->\n{text}")

    def test_written_then_right(self) -> None:
        self.put("")
        self.assertTrue(pages.check(self.status, False, self.root).wrong)
        self.assertEqual(pages.check(self.status, True, self.root).written, ["docs/a.md"])
        self.assertEqual(pages.check(self.status, False, self.root).wrong, [])
        self.assertIn("commit 1234abc", self.page.read_text())

    def test_a_changed_figure_is_wrong(self) -> None:
        self.put("")
        pages.check(self.status, True, self.root)
        self.page.write_text(self.page.read_text().replace("1 faults put", "2 faults put"))
        wrong = pages.check(self.status, False, self.root).wrong
        self.assertEqual(len(wrong), 1)
        self.assertIn("'rules'", wrong[0])

    def test_stale_is_told_but_not_wrong(self) -> None:
        self.put("")
        pages.check(self.status, True, self.root)
        self.status["rules"].changed = ["rtl/control.vhd"]
        found = pages.check(self.status, False, self.root)
        self.assertEqual(found.wrong, [])
        self.assertEqual(len(found.dated), 2)  # its own, and the summary of all
        pages.check(self.status, True, self.root)
        self.assertIn("the RTL has changed since", " ".join(self.page.read_text().split()))
        self.assertEqual(pages.check(self.status, False, self.root).dated, [])

    def test_blocks_that_nobody_knows_or_uses(self) -> None:
        self.page.write_text("<!-- evidence: nonsense -->\n<!-- /evidence -->\n")
        wrong = "\n".join(pages.check(self.status, False, self.root).wrong)
        self.assertIn("no block 'nonsense'", wrong)
        self.assertIn("block 'mutants' is in no page", wrong)

    def test_tables_by_hand_name_their_commit(self) -> None:
        waivers = self.root / figures.WAIVERS
        waivers.parent.mkdir(parents=True)
        waivers.write_text("")
        table = "| a | LUT | FF |\n|---|---|---|\n" + "| x | 12 | 34 |\n" * 3
        self.page.write_text("# A\n" + table)
        self.assertEqual(len(figures.check(self.root)), 1)
        self.page.write_text("# A\nMeasured at commit 1234abc.\n\n" + table)
        self.assertEqual(figures.check(self.root), [])
        self.page.write_text("# A\nMeasured at commit 1234abc.\n## B\n" + table)
        self.assertEqual(len(figures.check(self.root)), 1)
        self.page.write_text("# A\n<!-- cost: x -->\n" + table + "<!-- /cost -->\n")
        self.assertEqual(figures.check(self.root), [])
        self.page.write_text("# A\n" + table)
        waivers.write_text("docs/*.md | a | || computed\n")
        self.assertEqual(figures.check(self.root), [])
        waivers.write_text("docs/*.md | b | || computed\n")
        self.assertEqual(len(figures.check(self.root)), 2)


class Results(unittest.TestCase):
    """What the tools print, and that nothing in it is an error."""

    def test_flips(self) -> None:
        head = "tiny\nupset in  flips\n"
        row = f"{'state':34} {288:>8} {17:>8} {121:>8} {150:>8} {0:>8} {0:>8} {0:>6} {627:>8}\n"
        whole = row.replace("state", "all  ")
        tail = "(a tile without an upset: 592 clocks)\n"
        found = parsers.flips(head + row + whole + tail + (head + row + whole + tail).replace("tiny", "odd_2"))
        self.assertEqual(found["rows"]["state"]["flips"], 576)
        self.assertEqual(found["rows"]["state"]["worst"], {"tiny": 627, "odd_2": 627})
        self.assertIn("| state | 576 |", tables.flips_full(found))
        self.assertIn("| other registers | 576 |", tables.flips(found))
        with self.assertRaises(parsers.NothingFound):
            parsers.flips("flips: FAILED\n")

    def test_flips_chip(self) -> None:
        text = (f"flips_chip: 210 registers; without an upset: 9 clocks\n{'upset in':<38} {'flips':>6} {'masked':>8} "
                f"{'silent':>8} {'hang':>8} {'clocks':>7}\n")
        text += "".join(f"{name:<38} {9:>6} {8:>8} {1:>8} {0:>8} {77:>7}\n" for name in ("mac_tx, slot 2", "all"))
        text += ("silent: row_buffer u_arbiter.u_row_buffer.used: 3, 4 (2 times); again: x --only 1:2:3\n"
                 "silent: similarity u_engine.s8: 0; again: x --only 1:2:3\nflips_chip: nothing hangs\n")
        found = parsers.flips_chip(text)
        self.assertEqual(found["rows"]["mac_tx, slot 2"],
                         {"flips": 9, "masked": 8, "silent": 1, "hang": 0, "clocks": 77})
        self.assertEqual(found["sites"]["silent"], {"`u_row_buffer.used`": 3, "the engine": 1})
        self.assertIn("`u_row_buffer.used` 3, the engine 1.", tables.flips_chip_full(found))
        self.assertIn("| MAC | 9 | 8 | 1 |", tables.flips_chip(found))
        with self.assertRaises(parsers.NothingFound):
            parsers.flips_chip("flips_chip: FAILED\n")

    def test_soak(self) -> None:
        text = ("soak: tiny: aborts and resets in idle 1, load 2, sweep 3, flush 4, unload 5\n"
                "soak: tiny: 10 tiles and 5 behind bad ones: 9 good, 1 refused, 2 cut or too long, 2 aborted, 1 in a "
                "reset; 4 wrong writes; 7 errors, all counted; 0.30 M clocks\n"
                "soak: 1 of 1 configurations, 10 tiles, seed 1, 3 s\n")
        found = parsers.soak(text)
        self.assertEqual((found["rows"]["tiny"]["good"], found["left_in"], found["tiles"]), (9, [1, 2, 3, 4, 5], 10))
        self.assertIn("| tiny | 10 | 9 |", tables.soak_full(found))
        self.assertIn("1 engines, 10 tiles", tables.soak(found))
        with self.assertRaises(parsers.NothingFound):
            parsers.soak("soak: tiny: FAILED\n")

    def test_formal(self) -> None:
        text = ("formal: crc_step: proved (900 ms)\nformal: crc_step, one coefficient missing: fault found (800 ms)\n"
                "formal: control-2: FAILED: counterexample (10 ms)\n1 passed, 1 failed\n")
        found = parsers.formal(text)
        self.assertEqual(found["rows"]["crc_step"], {"proved": True, "ms": 1700, "faults": ["one coefficient missing"],
                                                     "failed": []})
        self.assertFalse(found["rows"]["control-2"]["proved"])
        self.assertIn("not proved", tables.formal(found))

    def test_rules(self) -> None:
        found = parsers.rules("rules: a: b: told\nrules: FAILED: not told: c (code 0, x)\n1 passed, 1 failed\n")
        self.assertEqual(found, {"told": ["a: b"], "passed": 1, "failed": 1})
        self.assertIn("NOT stopped", tables.rules(found))

    def test_gates(self) -> None:
        text = ("sim-gates: tiny:counted: 3398 clocks recorded\nsim-gates: tiny:counted:   LUT2      10\n"
                "sim-gates: tiny:counted:   LUT6      20\nsim-gates: tiny:counted: replay: 3083 steps, 37519 values "
                "compared, 0 differences\nLUT6 broken: found: mismatch line 1 clock 186 port dbg_p10_left: x\n")
        found = parsers.gates(text)
        self.assertEqual(found["rows"]["tiny:counted"]["cells"], {"LUT2": 10, "LUT6": 20})
        self.assertIn("| tiny:counted | 3398 | 37519 | 0 | 30 |", tables.gates(found))
        self.assertIn("clock 186, `dbg_p10_left`", tables.gates_faults(found))

    def test_sim_ghdl(self) -> None:
        text = ("sim-ghdl: tiny, seed 2: 100 steps, 50 values compared, 0 differences, 3 s\n"
                "sim-ghdl: odd, seed 2: FAILED\nsim-ghdl: 1 of 2 replays without a difference, 9 s\n")
        found = parsers.sim_ghdl(text)
        self.assertEqual((found["replays"], found["of"], found["steps"]), (1, 2, [100, 100]))

    def test_link_speed(self) -> None:
        flight = ("{n} in flight, 3 tiles:\n  before the first launch      9.400 ms: x\n"
                  "  launch to last map beat   9 ms: 1 clocks, 1 of them without stall: busy 83.900 %\n"
                  "  last map beat to end    10.800 ms: y\n  stall per tile change    3200000 clocks; z\n"
                  "  whole pair              3.320 s: 45 tiles, busy 1 % of that\n")
        text = flight.format(n=1) + flight.format(n=2) + (
            "full duplex: 90.70 Mbit/s up, 93.10 Mbit/s down at once; 0 chunks\n"
            "half duplex: 40.00 Mbit/s up + 38.20 Mbit/s down = 78.20; 3 collisions\n"
            "half duplex, mean of 6 runs: 87.30 Mbit/s\nhost library, full duplex: 91.90 Mbit/s map; 0 lost\n"
            "host library, half duplex: 81.50 Mbit/s rows and map; 0 lost\n"
            "STATUS on a quiet link: 18.0 .. 20.0 us\nSTATUS while the map is sent: 30.0 .. 252.0 us\n")
        found = parsers.link_speed(text)
        self.assertEqual((found["full_up"], found["full_down"], found["half"], found["flight_2"]["seconds"]),
                         (90.7, 93.1, 87.3, 3.32))
        self.assertIn("| 90.7 up, 93.1 Mbit/s down |", tables.link_speed(found))
        with self.assertRaises(parsers.NothingFound):
            parsers.link_speed(flight.format(n=1))

    def test_coverage(self) -> None:
        text = ("Lines\n\npsweep_pkg no statement that GHDL counts\nram_sdp                 14 of    14  100.00 %\n"
                "all                     14 of    15   93.33 %\n\nHoles\n\nrtl/a.vhd:3: x <= 1;\n    why\n")
        self.assertEqual(parsers.coverage(text),
                         {"rows": {"ram_sdp": [14, 14]}, "all": [14, 15], "holes": 1, "silent": 0})

    def test_tables_as_printed(self) -> None:
        found = parsers.tables("text\n| a | b |\n|---|---|\n| 1 | 2 |\n\n| c |\n|---|\n| 3 |\n")
        self.assertEqual(found["tables"], [[["a", "b"], ["1", "2"]], [["c"], ["3"]]])
        with self.assertRaises(parsers.NothingFound):
            parsers.tables("nothing\n")


_VHDL = """entity a is
  generic (G : integer := 1);
end entity a;
architecture rtl of a is
  signal x : integer := 3;
begin
  assert G > 0 severity failure;
  -- synthesis translate_off
  assert x = 1 report "x";
  -- synthesis translate_on
  p : process (clk)
  begin
    if rising_edge(clk) then
      if x = 3 and y = '1' then
        x <= x + 1;
      end if;
    end if;
  end process p;
end architecture rtl;""".split("\n")


class Draw(unittest.TestCase):
    def test_candidates(self) -> None:
        found = faults.candidates("a", _VHDL, 1)
        after = {faults.trimmed(m.after) for m in found}
        self.assertEqual({m.line for m in found}, {13, 14})
        for expected in ("if x /= 3 and y = '1' then", "if x = 3 or y = '1' then", "if false then", "x <= x - 1;",
                         "null;", "if x = 4 and y = '1' then", "if x = 3 and y = '0' then", "x <= x + 0;"):
            self.assertIn(expected, after)

    def test_order_does_not_hang_on_other_lines(self) -> None:
        first = faults.drawn_order(faults.candidates("a", _VHDL, 1))
        edited = faults.drawn_order(faults.candidates("a", ["-- more", *_VHDL], 1))
        self.assertEqual([m.after for m in first], [m.after for m in edited])
        self.assertEqual(len({m.line for m in first[:2]}), 2)  # a fault of each line before a second one of any
        self.assertEqual(first[0].id, "a.1")

    def test_density(self) -> None:
        self.assertEqual([faults.quota(n) for n in (41, 150, 201, 958)], [2, 3, 10, 19])
        rtl = Rtl()
        for unit in rtl.units:
            self.assertGreaterEqual(len(faults.candidates(unit, rtl.text(unit).split("\n"), 1)), 2, unit)

    def test_every_entity_has_tests(self) -> None:
        names = [str(p.relative_to(ROOT)) for f in ("rtl", "tb", "sw") for p in (ROOT / f).rglob("*") if p.is_file()]
        found = chains.Chains(names, lambda name: (ROOT / name).read_bytes().decode("latin-1"))
        for entity, tests in found.of.items():
            self.assertTrue(any(not t.thorough for t in tests), entity)
            self.assertTrue(any(t.thorough for t in tests), entity)
            self.assertTrue(all(len(found.depends(t)) == 16 for t in tests))
        self.assertEqual(found.of["control"][0].name, "soak of tiny")
        self.assertIn("arbiter", found.of_chip)


class _Chains:
    """Two tests: a cheap and a thorough one."""
    cheap = chains.Test("cheap", "all", (), (), False, False, (), "a")
    dear = chains.Test("dear", "all", (), (), True, True, (), "a")

    def __init__(self, versions: dict[str, str]) -> None:
        self.of, self.order, self.of_chip, self.versions = {"a": (self.cheap, self.dear)}, ["a"], {"a"}, versions

    def depends(self, test: chains.Test) -> str:
        return self.versions[test.name]


class _Job:
    """Kills what `kills` says, by the text of the copy."""

    def __init__(self, at: pathlib.Path, kills: dict[str, str]) -> None:
        self.at, self.kills, self.text, self.runs = at, kills, "\n".join(_VHDL), 0

    def put(self, _: str, text: str) -> None:
        self.text = text

    def make(self, test: chains.Test, log: pathlib.Path, limit: float) -> bool:
        return "x /= 3" not in self.text

    def try_(self, test: chains.Test, log: pathlib.Path, limit: float) -> tuple[int, float]:
        self.runs += 1
        broken = self.text != "\n".join(_VHDL)
        log.write_text("All tests passed (1 assertion")
        return int(broken and any(by == test.name and piece in self.text for piece, by in self.kills.items())), 0.01


class Campaign(unittest.TestCase):
    def run_it(self, folder: pathlib.Path, versions: dict[str, str], kills: dict[str, str],
               text: list[str] | None = None) -> tuple[campaign.Campaign, _Job]:
        lines = text or _VHDL
        entity = campaign.Entity("a", lines, faults.drawn_order(faults.candidates("a", lines, 1)), 6)
        job = _Job(folder, kills)
        run = campaign.Campaign(folder, _Chains(versions), [entity], [job], False, lambda _: None)  # type: ignore
        run.run(set())
        self.assertEqual(run.problems, [])
        return run, job

    def test_goes_on_and_forgets_what_changed(self) -> None:
        kills = {"x - 1": "cheap", "false": "dear", "null": "dear"}
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            run, job = self.run_it(folder, {"cheap": "1", "dear": "1"}, kills)
            verdicts = {m.after.strip(): run.results[m.key] for m in run.met["a"]}
            self.assertEqual(sum(r.verdict != campaign.INVALID for r in verdicts.values()), 6)
            self.assertEqual({r.verdict for r in verdicts.values()} - {campaign.INVALID},
                             {campaign.KILLED, campaign.SURVIVED})
            self.assertGreater(job.runs, 6)
            # Unchanged: nothing is run again.
            again, job = self.run_it(folder, {"cheap": "1", "dear": "1"}, kills)
            self.assertEqual(job.runs, 0)
            self.assertEqual({m.key: again.results[m.key].verdict for m in again.met["a"]},
                             {m.key: run.results[m.key].verdict for m in run.met["a"]})
            # Another thorough test: those that only it saw, and the survivors, meet it again; the cheap one is not run.
            cheap = sum(r.by == "cheap" and r.verdict == campaign.KILLED for r in verdicts.values())
            _, job = self.run_it(folder, {"cheap": "1", "dear": "2"}, kills)
            self.assertEqual(job.runs, 6 - cheap + 1)  # and on the circuit as it is
            # Another text of the entity: all of them.
            _, job = self.run_it(folder, {"cheap": "1", "dear": "2"}, kills, [*_VHDL, "x : y;"])
            self.assertGreaterEqual(job.runs, 6)
            # A comment is no other text.
            _, job = self.run_it(folder, {"cheap": "1", "dear": "2"}, kills, [*_VHDL, "-- x"])
            self.assertEqual(job.runs, 0)

    def test_a_test_that_fails_anyway_proves_nothing(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            entity = campaign.Entity("a", _VHDL, faults.drawn_order(faults.candidates("a", _VHDL, 1)), 1)
            job = _Job(folder, {})
            job.try_ = lambda test, log, limit: (log.write_text("FAILED"), (1, 0.01))[1]  # type: ignore
            run = campaign.Campaign(folder, _Chains({"cheap": "1", "dear": "1"}), [entity], [job],  # type: ignore
                                    False, lambda _: None)
            run.run(set())
            self.assertIn("fails on the circuit as it is", run.problems[0])
            self.assertEqual(run.results, {})
            campaign.Job.stopped.clear()  # for other tests


if __name__ == "__main__":
    unittest.main()
