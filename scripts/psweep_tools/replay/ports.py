# SPDX-License-Identifier: Apache-2.0
"""Reads the ports of a circuit and writes what replays or records them, so that no list of ports is kept by hand.

  bench ENTITY TEMPLATE [CLOCK ..] [--open START]          VHDL bench: TEMPLATE (tb/replay/replay.vhd.in) filled in
  gates MODULE.v MODULE ENTITY TEMPLATE CLOCK [--open START]   the same in Verilog: tb/gates/replay.v.in
  pins ENTITY                                              C++: struct Pins, a member for each port
  widths MODULE.v MODULE                                   C++: {"name", bits}, of the ports of converted Verilog
  --open: ports whose names begin with START are left open

Ends with an error if anything of the generics or ports is not understood: none may get lost."""
from __future__ import annotations

import argparse
import pathlib
import re
import sys
from collections.abc import Iterable

from .. import verilog
from ..vhdl import Entity, Port, Rtl, VhdlError


class PortsError(Exception):
    """What does not fit together."""


def fill(template: pathlib.Path, values: dict[str, str]) -> str:
    """Replaces each @KEY@ of a template."""
    def value(match: re.Match[str]) -> str:
        if match[1] not in values:
            raise PortsError(f"{template}: @{match[1]}@ is not known")
        return values[match[1]]
    return re.sub(r"@(\w+)@", value, template.read_text())


def _checked(entity: Entity) -> Entity:
    for generic in entity.generics:
        if generic.type != "integer" or not re.fullmatch(r"-?\d+", generic.default):
            raise PortsError(f"entity {entity.name}: generic {generic.name} is no integer with a number as default")
    for port in entity.ports:
        if port.mode not in ("in", "out") or port.range is None:
            raise PortsError(f"entity {entity.name}: port {port.name} is neither in nor out")
    return entity


def _is_open(name: str, start: str) -> bool:
    return start != "" and name.startswith(start)


def bench(entity: Entity, template: pathlib.Path, clocks: list[str], left_open: str = "") -> str:
    _checked(entity)
    used = [port for port in entity.ports if not _is_open(port.name, left_open)]
    inputs = [port for port in used if port.is_input and port.name not in clocks]
    outputs = [port for port in used if not port.is_input]
    if not inputs or not outputs or len([port for port in used if port.name in clocks]) != len(clocks):
        raise PortsError(f"{entity.name}: no input, no output or not this clock")

    def kind(port: Port) -> str:
        return f"std_logic_vector({port.range})" if port.range else "std_logic"

    def start(port: Port) -> str:
        return "" if not port.is_input else " := (others => '0')" if port.range else " := '0'"

    def header(what: str, port: Port) -> str:
        bits = f"{port.name}'length" if port.range else "1"
        return f'    port_is("{what}", "{port.name}", {bits});\n'

    names = [generic.name for generic in entity.generics]
    maps = ",\n".join(f"      {name} => {name}" for name in names)
    return fill(template, {
        "TOP": entity.name, "OUTPUTS": str(len(outputs)), "CLOCKS": str(len(clocks)),
        "GENERICS": "".join(f"    {g.name} : integer := {g.default};\n" for g in entity.generics),
        "GENERIC_MAP": f"    generic map (\n{maps}\n    )\n" if names else "",
        "GENERIC_CHECKS": "".join(f'        generic_is("{name}", {name});\n' for name in names),
        "SIGNALS": "".join(f"  signal {p.name} : {kind(p)}{start(p)};\n" for p in used),
        "PORT_MAP": ",\n".join(f"      {p.name} => {p.name}" for p in used),
        "EXPECTATIONS": "".join(f"    variable v_{p.name} : std_logic_vector({p.range or '0 downto 0'}) "
                                ":= (others => '-');\n" for p in outputs),
        "HEADER": "".join([f'    port_is("clock", "{clock}", 1);\n' for clock in clocks]
                          + [header("in", p) for p in inputs] + [header("out", p) for p in outputs]),
        "DRIVE": "".join(f"      next_field;\n      drive({p.name});\n" for p in inputs),
        "EXPECT": "".join(f"      next_field;\n      expect(v_{p.name});\n" for p in outputs),
        "COMPARE": "".join(f'        compare({n}, "{p.name}", {p.name if p.range else f"(0 => {p.name})"}, '
                           f"v_{p.name});\n" for n, p in enumerate(outputs)),
        "SEEN": "".join(f'    seen({n}, "{p.name}");\n' for n, p in enumerate(outputs)),
        "RISE": "".join(f"        {clock} <= v_rises({n});\n" for n, clock in enumerate(clocks)),
        "FALL": "".join(f"        {clock} <= '0';\n" for clock in clocks)})


def _take(port: verilog.Port, *targets: str) -> str:
    return (f'      next_word;\n      if (word != ".") begin\n        to_bits({port.bits});\n'
            f"        {' '.join(targets)}\n      end\n")


def _compare(port: verilog.Port) -> str:
    n = port.name
    return (f"        if (care_{n} != 0) begin\n          seen_{n} = 1;\n          compared = compared + 1;\n"
            f"          if (((want_{n} ^ {n}) & care_{n}) !== 0) "
            f'differs("{n}", {n}, want_{n}, care_{n}, {port.bits});\n        end\n')


def gates(text: str, module: str, entity: Entity, template: pathlib.Path, clock: str, left_open: str = "") -> str:
    """Widths from the module, order of the ports (that of a recording) from the entity."""
    bits = {port.name: port.bits for port in verilog.ports(text, module)}
    missing = [port.name for port in entity.ports if port.name not in bits]
    extra = sorted(set(bits) - {port.name for port in entity.ports})
    if missing or extra:
        raise PortsError(f"module {module}: no port {' '.join(missing) or '-'}; not of the entity: {' '.join(extra)}")
    ports = [verilog.Port(port.name, port.is_input, bits[port.name]) for port in entity.ports]
    inputs = [port for port in ports if port.is_input and port.name != clock]
    recorded = [port for port in ports if not port.is_input]
    outputs = [port for port in recorded if not _is_open(port.name, left_open)]
    if not inputs or not outputs or bits.get(clock) != 1:
        raise PortsError(f"{module}: no input, no output or no clock {clock}")

    def wide(port: verilog.Port) -> str:
        return "" if port.bits == 1 else f"[{port.bits - 1}:0] "

    def expect(port: verilog.Port) -> str:
        if _is_open(port.name, left_open):
            return _take(port)
        return _take(port, f"want_{port.name} = value;", f"care_{port.name} = known;")

    return fill(template, {
        "TOP": module, "CLOCK": clock,
        "SIGNALS": f"  reg {clock} = 0;\n" + "".join(f"  reg {wide(p)}{p.name} = 0;\n" for p in inputs) + "".join(
            f"  wire {wide(p)}{p.name};\n  reg {wide(p)}want_{p.name} = 0, care_{p.name} = 0;\n"
            f"  reg seen_{p.name} = 0;\n" for p in outputs),
        "PORT_MAP": ",\n".join(f"    .{p.name}({p.name})" for p in ports
                               if p.is_input or not _is_open(p.name, left_open)),
        "HEADER": "".join(f'    port_is("{"in" if p.is_input else "out"}", "{p.name}", {p.bits});\n'
                          for p in [*inputs, *recorded]),
        "DRIVE": "".join(_take(p, f"{p.name} = value;") for p in inputs),
        "EXPECT": "".join(expect(p) for p in recorded),
        "COMPARE": "".join(_compare(p) for p in outputs),
        "SEEN": "".join(f'    if (!seen_{p.name}) refuse("port {p.name} was never compared");\n' for p in outputs)})


def _verilated_type(port: Port) -> str:
    """Verilator's type for a port of this range, the widest where it depends on generics."""
    match = re.fullmatch(r"(\d+) downto 0", port.range)
    top = 0 if port.range == "" else int(match[1]) if match else 63
    return "CData" if top < 8 else "SData" if top < 16 else "IData" if top < 32 else "QData"


def pins(entity: Entity) -> str:
    _checked(entity)
    ports = entity.ports
    text = "// SPDX-License-Identifier: Apache-2.0\n"
    text += f"// Generated by scripts/tools.py ports: the ports of entity {entity.name}, as wide as any configuration"
    text += " needs.\n#pragma once\n#include <verilated.h>\n\n#include <type_traits>\n\nnamespace psweep::replay {\n\n"
    text += "struct Pins {\n" + "".join(f"  {_verilated_type(p)} {p.name} = 0;\n" for p in ports)
    text += "\n  // f(name, is it an input, value)\n  template <class F>\n  void each(F&& f) const {\n"
    text += "".join(f'    f("{p.name}", {"true" if p.is_input else "false"}, QData{{{p.name}}});\n' for p in ports)
    text += "  }\n  template <class Dut>\n  void drive(Dut& dut) const {\n"
    text += "".join(f"    dut.{p.name} = static_cast<std::remove_reference_t<decltype(dut.{p.name})>>({p.name});\n"
                    for p in ports if p.is_input)
    text += "  }\n  template <class Dut>\n  void sample(const Dut& dut) {\n"
    text += "".join(f"    {p.name} = dut.{p.name};\n" for p in ports if not p.is_input)
    return text + "  }\n};\n\n}  // namespace psweep::replay\n"


def widths(text: str, module: str) -> str:
    return "// Generated by scripts/tools.py ports.\n" + "".join(
        f'{{"{port.name}", {port.bits}}},\n' for port in verilog.ports(text, module))


def _written(options: argparse.Namespace, rtl: Rtl) -> str:
    if options.what == "bench":
        return bench(rtl.entity(options.entity), options.template, options.clock, options.open)
    if options.what == "gates":
        return gates(options.verilog.read_text(), options.module, rtl.entity(options.entity), options.template,
                     options.clock, options.open)
    if options.what == "pins":
        return pins(rtl.entity(options.entity))
    return widths(options.verilog.read_text(), options.module)


def main(arguments: Iterable[str]) -> int:
    parser = argparse.ArgumentParser(prog="scripts/tools.py ports", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rtl", type=pathlib.Path, help="folder with files.f (default: rtl)")
    parser.add_argument("--out", type=pathlib.Path, help="file that is written (default: standard output)")
    kinds = parser.add_subparsers(dest="what", required=True)
    for what in ("bench", "gates", "pins", "widths"):
        kind = kinds.add_parser(what)
        if what in ("gates", "widths"):
            kind.add_argument("verilog", type=pathlib.Path)
            kind.add_argument("module")
        if what != "widths":
            kind.add_argument("entity")
        if what in ("bench", "gates"):
            kind.add_argument("template", type=pathlib.Path)
            kind.add_argument("clock", **({"nargs": "*"} if what == "bench" else {}))  # type: ignore[arg-type]
            kind.add_argument("--open", default="")
    options = parser.parse_args(list(arguments))
    try:
        text = _written(options, Rtl(options.rtl) if options.rtl else Rtl())
    except (PortsError, VhdlError, verilog.VerilogError, OSError) as error:
        print(f"ports: {error}", file=sys.stderr)
        return 1
    if options.out:
        options.out.write_text(text)
    else:
        print(text, end="")
    return 0
