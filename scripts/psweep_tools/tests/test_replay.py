# SPDX-License-Identifier: Apache-2.0
"""Benches from ports, and registers that can be upset."""
from __future__ import annotations

import pathlib
import tempfile
import unittest

from .. import generics, verilog
from ..replay import ports
from ..upsets import inject
from ..vhdl import Rtl, VhdlError, parse

ENTITY = """entity a is
  generic (G_W : integer := 4);
  port (clk, rst : in std_logic; d : in std_logic_vector(G_W - 1 downto 0); q : out std_logic;
        dbg_x : out std_logic_vector(7 downto 0));
end entity a;"""

CIRCUIT = """module ram_sdp_8
  (input  clk,
   input  we,
   output [7:0] rdata);
  reg [7:0] memory[3:0] ; // memory
  reg [7:0] n5_data;
  assign rdata = n5_data; //
  always @(posedge clk)
    if (re)
      n5_data <= memory[raddr];
  always @(posedge clk)
    if (we)
      memory[waddr] <= wdata;
endmodule

module psweep
  (input  clk,
   output q);
  wire [69:0] total;
  reg [69:0] n3_q;
  reg n4_q;
  assign total = n3_q; //
  assign q = n4_q; //
  ram_sdp_8 u_one (
    .clk(clk),
    .we(q));
  ram_sdp_8 u_two (
    .clk(clk),
    .we(q));
  always @(posedge clk)
    n3_q <= n9;
  always @(posedge clk or posedge rst)
    if (rst)
      n4_q <= 1'b0;
    else
      n4_q <= n8;
endmodule
"""


class Ports(unittest.TestCase):
    def test_bench(self) -> None:
        entity = parse(ENTITY).entity
        with tempfile.TemporaryDirectory() as folder:
            template = pathlib.Path(folder) / "t"
            template.write_text("@TOP@ @OUTPUTS@\n@SIGNALS@@HEADER@@COMPARE@")
            text = ports.bench(entity, template, ["clk"], "dbg_")
            self.assertIn("a 1\n  signal clk : std_logic := '0';\n", text)
            self.assertIn("  signal d : std_logic_vector(G_W - 1 downto 0) := (others => '0');\n", text)
            self.assertIn('    port_is("in", "d", d\'length);\n    port_is("out", "q", 1);\n', text)
            self.assertNotIn("dbg_x", text)
            with self.assertRaises(ports.PortsError):
                ports.bench(entity, template, ["clk", "other"])
            template.write_text("@UNKNOWN@")
            with self.assertRaises(ports.PortsError):
                ports.bench(entity, template, ["clk"])

    def test_pins(self) -> None:
        text = ports.pins(parse(ENTITY).entity)
        for piece in ("  CData clk = 0;\n", "  QData d = 0;\n", "  CData dbg_x = 0;\n", 'f("d", true, QData{d});',
                      "    q = dut.q;\n"):
            self.assertIn(piece, text)
        with self.assertRaises(ports.PortsError):
            ports.pins(parse(ENTITY.replace("integer := 4", "boolean := true")).entity)

    def test_modules(self) -> None:
        self.assertEqual([(p.name, p.is_input, p.bits) for p in verilog.ports(CIRCUIT, "ram_sdp_8")],
                         [("clk", True, 1), ("we", True, 1), ("rdata", False, 8)])
        old = "module m(a, b);\n  input [3:0] a;\n  output b;\nendmodule\n"
        self.assertEqual(ports.widths(old, "m").splitlines()[1:], ['{"a", 4},', '{"b", 1},'])
        for text, name in ((old, "n"), (old.replace("  output b;\n", ""), "m"),
                           ("module m(input foo bar);\nendmodule", "m")):
            with self.assertRaises(verilog.VerilogError):
                verilog.ports(text, name)


class Upsets(unittest.TestCase):
    def inject(self, text: str, **options: bool) -> tuple[str, list[inject.Site]]:
        return inject.inject(text, Rtl().entities, inject.Options("psweep", ("clk",), **options))

    def test_every_instance_has_its_own(self) -> None:
        text, sites = self.inject(CIRCUIT, rams=True, short_names=True)
        self.assertEqual([(s.name, s.bits, s.words) for s in sites],
                         [("u_one.rdata", 8, 0), ("u_one.memory", 8, 4), ("u_two.rdata", 8, 0), ("u_two.memory", 8, 4),
                          ("total", 64, 0), ("q", 1, 0)])
        self.assertIn("memory[psweep.flip_word[1:0]] <= memory[psweep.flip_word[1:0]] ^ psweep.flip_mask[7:0];", text)
        self.assertIn("n3_q <= n9 ^ (psweep.flip_site == 5 ? {6'd0, psweep.flip_mask} : 70'd0);", text)
        self.assertEqual(text.count("module ram_sdp_8__"), 2)

    def test_attributes_change_nothing(self) -> None:  # GHDL 5 writes them
        attributed = CIRCUIT.replace("  reg [7:0] memory", '  (* ram_style="block" *) reg [7:0] memory')
        self.assertNotEqual(attributed, CIRCUIT)
        self.assertEqual(self.inject(attributed, rams=True), self.inject(CIRCUIT, rams=True))

    def test_wide_and_both_edges(self) -> None:
        text, sites = self.inject(CIRCUIT, wide=True, both_edges=True)
        self.assertEqual([s.bits for s in sites], [8, 8, 70, 1])
        self.assertIn("psweep.flip_wide[69:0]", text)
        self.assertIn("always @(posedge clk or negedge clk or posedge rst)", text)
        self.assertIn("module psweep\n  (input [15:0] flip_site,\n   input [63:0] flip_mask,\n   input [511:0]", text)

    def test_own(self) -> None:
        text, sites = self.inject(CIRCUIT, own=True)
        self.assertEqual([s.line(("name", "bits")) for s in sites], ['{"total", 64},\n', '{"q", 1},\n'])
        self.assertIn(CIRCUIT.split("\nmodule psweep")[0], text)

    def test_nothing_gets_lost(self) -> None:
        for old, new in (("    n3_q <= n9;", "    n3_q <= n9 + 1;"), ("posedge clk)\n    n3", "negedge clk)\n    n3"),
                         ("  reg n4_q;\n", ""),
                         ("    n3_q <= n9;", "    n3_q <= n9;\n    n4_q <= n9;"), ("module psweep\n", "module other\n"),
                         ("posedge clk or posedge rst", "posedge rst or posedge clk")):
            with self.assertRaises(inject.InjectError, msg=new):
                self.inject(CIRCUIT.replace(old, new), rams=True)


class Generics(unittest.TestCase):
    def test_values(self) -> None:
        self.assertEqual(generics.outside("outside 3..21 or even", {}), [2, 22, 4])
        self.assertEqual(generics.outside("outside G_LOW..9", {"G_LOW": "4"}), [3, 10])
        self.assertEqual(generics.outside("below 1", {}), [0])
        with self.assertRaises(VhdlError):
            generics.outside("is odd", {})

    def test_every_message_is_understood(self) -> None:
        rtl, number = Rtl(), 0
        for unit in rtl.entities:
            defaults = {g.name: g.default for g in rtl.entity(unit).generics}
            for assertion in rtl.design(unit).assertions:
                if assertion.of_generic:
                    number += len(generics.outside(assertion.of_generic[2], defaults))
        self.assertGreater(number, 150)


if __name__ == "__main__":
    unittest.main()
