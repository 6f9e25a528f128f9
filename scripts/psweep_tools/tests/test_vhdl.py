# SPDX-License-Identifier: Apache-2.0
"""The reader of VHDL, alone and against GHDL's."""
from __future__ import annotations

import pathlib
import shutil
import subprocess
import tempfile
import unittest
from xml.etree import ElementTree

from ..vhdl import Design, Rtl, VhdlError, code_only, essence, listed, parse, range_of, tokens, width_of

TEXT = '''-- a comment; entity x is
library ieee;
  use work.some_pkg.all;
entity a is
  generic (
    G_ONE  : integer := 13; -- the first
    G_MANY : std_logic_vector(3 downto 0) := "0--1"
  );
  port (
    clk, rst : in  std_logic;
    d : in std_logic_vector(G_ONE - 1 downto 0); -- data; of course
    q : out std_logic_vector(2 * (G_ONE + 1) downto 0)
  );
end entity a;
architecture rtl of a is
  constant C_KEEP : string := "true";
  attribute keep : string;
  signal r, s : std_logic := ';';
  attribute keep of r, s : signal is C_KEEP;
begin
  assert G_ONE >= 2 and G_ONE <= 16
    report "a: G_ONE"
           -- synthesis translate_off
           & "=" & integer'image(G_ONE)
           -- synthesis translate_on
           & " outside 2..16" severity failure;
  assert not (d'event and unsigned'("1;") = 1) report "no" severity error;
  u_b : entity work.b(rtl)
    generic map (G_X => G_ONE, G_Y => maximum(1, 2))
    port map (clk => clk, q(1 downto 0) => open);
end architecture rtl;
'''


class Reader(unittest.TestCase):
    def test_declarations(self) -> None:
        design = parse(TEXT)
        entity = design.entity
        self.assertEqual([(g.name, g.type, g.default, g.comment) for g in entity.generics],
                         [("G_ONE", "integer", "13", "the first"),
                          ("G_MANY", "std_logic_vector(3 downto 0)", '"0--1"', "")])
        self.assertEqual([(p.name, p.mode, p.range, width_of(p)) for p in entity.ports],
                         [("clk", "in", "", "1"), ("rst", "in", "", "1"),
                          ("d", "in", "G_ONE - 1 downto 0", "G_ONE"),
                          ("q", "out", "2 * (G_ONE + 1) downto 0", "2 * (G_ONE + 1) + 1")])
        self.assertEqual(entity.ports[2].comment, "data; of course")
        self.assertEqual([a.of_generic for a in design.assertions], [("a", "G_ONE", "outside 2..16"), None])
        self.assertEqual(design.assertions[0].condition, "G_ONE >= 2 and G_ONE <= 16")
        instance = design.instances[0]
        self.assertEqual((instance.label, instance.entity), ("u_b", "b"))
        self.assertEqual(instance.generics, {"G_X": "G_ONE", "G_Y": "maximum(1, 2)"})
        self.assertEqual(instance.ports, {"clk": "clk", "q(1 downto 0)": "open"})
        self.assertEqual([(a.name, a.signals, a.value) for a in design.attributes], [("keep", ("r", "s"), "C_KEEP")])
        self.assertEqual((design.signals, design.constants), ({"r", "s"}, {"C_KEEP": ("string", '"true"')}))
        self.assertEqual(design.uses, {"some_pkg", "b"})

    def test_ticks(self) -> None:
        found = [token.text for token in tokens("a'b('0') & x\"00\" & ''' & 16#FF# & c'('1', ';')")]
        self.assertEqual(found, ["a", "'", "b", "(", "'0'", ")", "&", 'x"00"', "&", "'''", "&", "16#FF#", "&", "c", "'",
                                 "(", "'1'", ",", "';'", ")"])

    def test_nothing_gets_lost(self) -> None:
        for text in ("entity a is port (x : in std_logic", "entity a is port (x std_logic); end;",
                     "entity a is port (x : std_logic); end;", "entity a is attribute b; end;", "x ? y",
                     "entity a is generic (G : ); end;", "u : entity work.b port map (x, y);"):
            with self.assertRaises(VhdlError, msg=text):
                parse(text)
        with self.assertRaises(VhdlError):
            width_of(parse("entity a is port (x : in std_logic_vector(0 to 3)); end;").entity.ports[0])

    def test_texts(self) -> None:
        self.assertEqual(code_only('a -- b\n"--c"'), 'a     \n"--c"')
        self.assertEqual(essence("a; -- b\n\n-- synthesis translate_off\n"), "a;\n-- synthesis translate_off")
        self.assertEqual(list(listed("a.vhd\n# x\nsub/b.vhd # y\n").items()), [("a", "a.vhd"), ("b", "sub/b.vhd")])
        with self.assertRaises(VhdlError):
            listed("x/a.vhd\ny/a.vhd\n")

    def test_ranges(self) -> None:
        for condition, expected in (("G >= 2 and G <= 16", "2 .. 16"), ("G >= 3 and G <= 21 and G mod 2 = 1",
                                    "3 .. 21, odd"), ("G >= 1", "from 1"), ("G = 1 or G = 2", "1, 2"),
                                    ("G >= H + 1", "`G >= H + 1`")):
            self.assertEqual(range_of("G", condition), expected)


def _of_ghdl(sources: list[pathlib.Path]) -> dict[str, Design]:
    """By file: entities with generics and ports, instances, as GHDL reads them."""
    with tempfile.TemporaryDirectory() as work:
        done = subprocess.run(["ghdl", "--file-to-xml", "--std=93", f"--workdir={work}", *map(str, sources)],
                              capture_output=True, check=True)
    found: dict[str, Design] = {}
    for element in ElementTree.fromstring(done.stdout).iter():
        kind, file = element.get("kind"), pathlib.Path(element.get("file", "")).stem
        if kind == "entity_declaration" and file in {path.stem for path in sources}:
            lines = [f"entity {element.get('identifier')} is"]
            for chain in ("generic_chain", "port_chain"):
                items = element.find(chain)
                for item in (items if items is not None else ()):
                    default = item.find("default_value")
                    mark = item.find("subtype_indication")
                    if mark is not None and mark.get("kind") != "simple_name":
                        mark = mark.find("subtype_type_mark")
                    lines.append(" ".join((item.get("identifier", ""), item.get("mode", ""),
                                           (mark.get("identifier", "") if mark is not None else "as before"),
                                           (default.get("value", "") if default is not None else "").strip())))
            found.setdefault(file, Design()).uses.update(lines)
        elif kind == "component_instantiation_statement" and file in {path.stem for path in sources}:
            found.setdefault(file, Design()).signals.add(element.get("label", ""))
    return found


@unittest.skipIf(shutil.which("ghdl") is None, "no ghdl")
class AgainstGhdl(unittest.TestCase):
    """What GHDL says of every file, and what our reader says."""

    def test_all_files(self) -> None:
        rtl = Rtl()
        ghdl = _of_ghdl(rtl.sources())
        number = 0
        for unit in rtl.units:
            design = rtl.design(unit)
            theirs = ghdl.get(unit, Design())
            lines = set()
            for entity in design.entities:
                lines.add(f"entity {entity.name}".lower() + " is")
                for g in entity.generics:
                    lines.add(f"{g.name} in {g.type} {g.default}".lower())
                for p in entity.ports:
                    lines.add(f"{p.name} {p.mode} {p.type.split('(')[0]} ".lower())
            # GHDL says the type of a list of names with the first of them only.
            short = {line.split(" as before")[0].rsplit(" ", 1)[0] for line in theirs.uses if "as before" in line}
            self.assertEqual({line for line in theirs.uses if "as before" not in line},
                             {line for line in lines if not any(line.startswith(f"{s} ") for s in short)}, unit)
            self.assertEqual(theirs.signals, {i.label.lower() for i in design.instances}, unit)
            number += len(lines)
        self.assertGreater(number, 700)


if __name__ == "__main__":
    unittest.main()
