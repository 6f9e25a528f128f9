# SPDX-License-Identifier: Apache-2.0
"""What the vendor flows have in common: sources, entities, generics of a configuration, boards, the top with pins.

Nothing is listed twice: files come from rtl/files.f, generics and ports from the VHDL, configurations from
rtl/configs/engine and rtl/configs/chip as for scripts/cost/measure.py, boards from constraints/<board>/board.json.

A flow builds <top>_pins, an entity that wrapper() writes, with <top> as its only instance u_<top>. Outputs dbg_* are
for waves and would take hundreds of pads: they stay open.
  psweep_top     ports as they are, without logic; besides, what the board asks for in its board.json:
                 "set"    inputs that have no pin: {"phy_full_duplex": 1}
                 "invert" inputs whose pin has the other level: {"arst_n": "cpu_reset"}, name of the pin
                 "drive"  outputs that the board needs besides: {"phy_reset_n": 1}
  other tops     for estimates: their clocks, and for each clock one input, through a shift register to all inputs of
                 this clock, and one output, an exclusive-or of registers of all outputs (as scripts/cost/pnr.py). So
                 nothing is optimised away and no pad limits the clock; the tables count u_<top> alone
Runs in Python 3.8 and later: the tools bring their own.
"""
import json
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "scripts" / "cost"))

import measure  # noqa: E402  (generics and configurations are read in one place)
import points  # noqa: E402

from psweep_tools import vhdl  # noqa: E402

CostError = measure.CostError
RTL = ROOT / "rtl"
CONSTRAINTS = ROOT / "constraints"
# What a flow can build: its clocks; for tops without pads how the names of the ports of a clock start (clk: the rest).
TOPS = {
    "psweep_top": {"clocks": ("clk", "mii_rx_clk", "mii_tx_clk"), "pads": True},
    "psweep": {"clocks": ("clk",), "pads": False, "of": {}},
    "arbiter": {"clocks": ("clk", "rx_clk", "tx_clk"), "pads": False,
                "of": {"rx_": "rx_clk", "mii_rx": "rx_clk", "tx_": "tx_clk", "mii_": "tx_clk"}},
}
MII_NS = 40.0


class FlowError(Exception):
    """Says what to do, without a trace."""


def sources(top=None):
    """Files of rtl/files.f in its order, absolute; up to and including <top>.vhd."""
    try:
        files = measure.read_rtl(RTL).sources(top)
    except vhdl.VhdlError as error:
        raise FlowError(str(error)) from None
    missing = [path.name for path in files if not path.is_file()]
    if missing:
        raise FlowError("rtl/files.f: missing " + " ".join(missing))
    return files


def boards(tool=None):
    found = {}
    for path in sorted(CONSTRAINTS.glob("*/board.json")):
        settings = json.loads(path.read_text())
        if tool is None or settings["tool"] == tool:
            found[path.parent.name] = settings
    return found


def board(name, tool):
    known = boards(tool)
    if name not in known:
        raise FlowError("no board '{}' for this tool in constraints/: {}".format(name, ", ".join(known)))
    return known[name]


def ports_of(entity):
    """[(name, 'in' or 'out', type)] of an entity, from its declaration."""
    try:
        found = [(port.name, port.mode, port.type) for port in measure.read_rtl(RTL).entity(entity).ports]
    except vhdl.VhdlError as error:
        raise FlowError(str(error)) from None
    if not found:
        raise FlowError("entity {} has no ports".format(entity))
    return found


def bits(port_type):
    """Number of bits of a port whose width is a number, None for std_logic."""
    if port_type == "std_logic":
        return None
    match = re.match(r"std_logic_vector\((\d+) downto 0\)\Z", port_type)
    if not match:
        raise FlowError("width of '{}' is no number: it cannot be a pin".format(port_type))
    return int(match[1]) + 1


def pins(top, settings):
    """[(port of the wrapper, direction, bits or None)]: what needs pads."""
    if not TOPS[top]["pads"]:
        return [(clock + end, direction, None) for clock in TOPS[top]["clocks"]
                for end, direction in (("", "in"), ("_si", "in"), ("_so", "out"))]
    found = []
    for name, direction, port_type in ports_of(top):
        if name.startswith("dbg_") or name in settings.get("set", {}):
            continue
        found.append((settings.get("invert", {}).get(name, name), direction, bits(port_type)))
    return found + [(name, "out", None) for name in settings.get("drive", {})]


def pin_bits(top, settings):
    """{'mii_rxd<0>': 'in', ..} in the spelling of UCF."""
    out = {}
    for name, direction, number in pins(top, settings):
        for bit in [""] if number is None else ["<{}>".format(i) for i in range(number)]:
            out[name + bit] = direction
    return out


def configured(top, config):
    """Generics of a configuration by name, or of a row of docs/cost.md (scripts/cost/points.py) for this top."""
    try:
        return measure.config_generics(top, config, RTL)
    except CostError:
        point = points.POINTS.get(config, {})
        if point.get("entity", "psweep") != top or not point or "unit" in point:
            raise
    out = measure.config_generics(top, point["config"], RTL) if "config" in point else {}
    out.update(point.get("generics", {}))
    return out


def config_of(settings, top):
    """What is built where no configuration is given: what is meant for this device."""
    return settings["config"] if TOPS[top]["pads"] else "tile"


def generics(top, config, settings, given=()):
    """{'G_X': n}: by the configuration, then by the board, then as given ('G_X=n'). Unknown names are errors."""
    known = measure.generics_of(top, RTL)
    out = configured(top, config)
    for name, value in settings.get("generics", {}).items():
        if name in known:
            out[name] = value
    for pair in given:
        if not re.match(r"G_\w+=-?\d+\Z", pair):
            raise FlowError("'{}' is not G_X=n".format(pair))
        name, value = pair.split("=")
        out[name] = int(value)
    for name in out:
        if name not in known:
            raise FlowError("{} has no generic {}: {}".format(top, name, ", ".join(known)))
    return out


def clk_ns(top, chosen, settings, mhz=None):
    """Period of clk: by G_CLK_KHZ where the entity has it, for it must be right; else by mhz, or the board's, or the
    chip's default."""
    if "G_CLK_KHZ" in measure.generics_of(top, RTL):
        if mhz is not None:
            raise FlowError("{} knows its clock: give G_CLK_KHZ instead".format(top))
    elif mhz is not None:
        return round(1e3 / mhz, 3)
    else:
        chosen = settings["generics"]
    return round(1e6 / chosen.get("G_CLK_KHZ", int(measure.generics_of("psweep_top", RTL)["G_CLK_KHZ"])), 3)


def wrapper(top, settings):
    """VHDL text of entity <top>_pins (see above)."""
    ports = ports_of(top)
    known = measure.generics_of(top, RTL)
    parts = pin_wrapper(top, ports, settings) if TOPS[top]["pads"] else chain_wrapper(top, ports)
    outside, signals, body, inside = parts
    inside += [(name, "open") for name, _, _ in ports if name.startswith("dbg_")]
    generic_lines = ";\n".join("    {} : integer := {}".format(k, v) for k, v in known.items())
    return "\n".join(
        ["-- {}_pins: written by scripts/flows/project.py.".format(top),
         "library ieee;", "  use ieee.std_logic_1164.all;", "  use work.psweep_pkg.all;", "",
         "entity {}_pins is".format(top), "  generic (", generic_lines, "  );", "  port (",
         ";\n".join("    " + p for p in outside), "  );", "end entity {}_pins;".format(top), "",
         "architecture wires of {}_pins is".format(top)]
        + ["  signal {} : {};".format(*s) for s in signals] + ["begin"] + ["  " + line for line in body]
        + ["  u_{0} : entity work.{0}".format(top), "    generic map (",
           ",\n".join("      {0} => {0}".format(k) for k in known), "    )", "    port map (",
           ",\n".join("      {} => {}".format(a, b) for a, b in inside), "    );", "end architecture wires;", ""])


def pin_wrapper(top, ports, settings):
    fixed, inverted, driven = (settings.get(key, {}) for key in ("set", "invert", "drive"))
    names = {name for name, direction, _ in ports if direction == "in"}
    for name in list(fixed) + list(inverted):
        if name not in names:
            raise FlowError("board.json: {} has no input {}".format(top, name))
    outside, signals, body, inside = [], [], [], []
    for name, direction, port_type in ports:
        if name in fixed:
            value = str(fixed[name])
            if not re.match(r"[01]+\Z", value) or len(value) != (bits(port_type) or 1):
                raise FlowError("board.json: '{}' is no value of {}".format(value, name))
            inside.append((name, ("'{}'" if port_type == "std_logic" else '"{}"').format(value)))
        elif name in inverted:
            outside.append("{} : in {}".format(inverted[name], port_type))
            signals.append(("inverted_" + name, port_type))
            body.append("inverted_{} <= not {};".format(name, inverted[name]))
            inside.append((name, "inverted_" + name))
        elif not name.startswith("dbg_"):
            outside.append("{} : {} {}".format(name, direction, port_type))
            inside.append((name, name))
    for name, value in driven.items():
        if str(value) not in ("0", "1"):
            raise FlowError("board.json: drive {} to 0 or 1".format(name))
        outside.append("{} : out std_logic".format(name))
        body.append("{} <= '{}';".format(name, value))
    return outside, signals, body, inside


def chain_wrapper(top, ports):
    clocks = TOPS[top]["clocks"]
    outside, signals, body, inside = [], [], [], [(clock, clock) for clock in clocks]
    for clock in clocks:
        outside += ["{} : in std_logic".format(clock), "{}_si : in std_logic".format(clock),
                    "{}_so : out std_logic".format(clock)]
        lines, last_in, last_out = [], clock + "_si", "'0'"
        for name, direction, port_type in ports:
            if name in clocks or name.startswith("dbg_") or clock_of(top, name) != clock:
                continue
            one = port_type == "std_logic"
            if not one and not re.match(r"std_logic_vector\(.* downto 0\)\Z", port_type):
                raise FlowError("rtl/{}.vhd: no chain through port {} of type {}".format(top, name, port_type))
            if direction == "in":
                chain = "in_" + name
                lines.append("{} <= {};".format(chain, last_in if one else shifted(chain, last_in)))
                inside.append((name, chain))
                last_in = chain if one else "{0}({0}'high)".format(chain)
            else:
                wire, register, chain = "wire_" + name, "out_" + name, "chain_" + name
                signals += [(wire, port_type), (register, port_type)]
                lines.append("{} <= {};".format(register, wire))
                step = last_out if one else shifted(chain, last_out)
                lines.append("{} <= ({}) xor {};".format(chain, step, register))
                inside.append((name, wire))
                last_out = chain if one else "{0}({0}'high)".format(chain)
            signals.append((chain, port_type))
        body += ["process ({})".format(clock), "begin", "  if rising_edge({}) then".format(clock)]
        body += ["    " + line for line in lines] + ["  end if;", "end process;"]
        body.append("{}_so <= {};".format(clock, last_out))
    return outside, signals, body, inside


def shifted(chain, first):
    return "{0}({0}'high - 1 downto 0) & {1}".format(chain, first)


def clock_of(top, port):
    for start, clock in TOPS[top]["of"].items():
        if port.startswith(start):
            return clock
    return "clk"


def instances():
    """{entity: {'u_engine': 'psweep', ..}}: labels of the instances in each entity, to find units in reports."""
    rtl = measure.read_rtl(RTL)
    found = {unit: {i.label: i.entity for i in rtl.design(unit).instances} for unit in rtl.units}
    for top in TOPS:
        found[top + "_pins"] = {"u_" + top: top}
    return found


def entity_at(path, top):
    """Entity of an instance in the wrapper of top: ('u_psweep_top', 'u_engine', 'g_n[1].u_similarity') -> 'similarity'.
    None: a part of one. Generate statements may stand before a label, with whatever the tool puts between."""
    labels, entity = instances(), top + "_pins"
    for step in path:
        label = re.search(r"(u_\w+?)(?:\W*)\Z", step)
        entity = labels.get(entity, {}).get(label[1]) if label else None
        if entity is None:
            return None
    return entity


def units_of(rows, top):
    """{unit: {'instances': n, name: count}} of rows {path: {name: count, with all below it}}; a path is a tuple that
    starts below the wrapper. What lies in a unit that stands in another one counts for the inner one alone."""
    found = {path: entity_at(path, top) for path in rows}
    kept = [path for path, entity in found.items() if entity in measure.CHIP_UNITS]
    units = {}
    for path in kept:
        own = dict(rows[path])
        for other in kept:
            above = [p for p in kept if p != other and other[:len(p)] == p]
            if above and max(above, key=len) == path:
                own = {name: count - rows[other][name] for name, count in own.items()}
        unit = units.setdefault(found[path], dict.fromkeys(["instances"] + list(own), 0))
        unit["instances"] += 1
        for name, count in own.items():
            unit[name] += count
    return units


COLUMNS = (("LUT", "lut"), ("FF", "ff"), ("RAMB36", "ram36_equivalent"), ("RAMB48", "ram48"), ("RAM", "ram_blocks"),
           ("DSP", "dsp"), ("carry", "carry"), ("LUTmem", "lut_memory"))


def write_result(folder, question, counts, units, more):
    """result.json in the form of scripts/cost/measure.py --json (docs/cost.md), and its table as text. A count that the
    tool does not report is not there."""
    result = dict({"schema": measure.SCHEMA, "unit": None, "hierarchy": bool(units), "no_dsp": False}, **question)
    result["counts"] = counts
    result["units"] = {unit: {"instances": row.pop("instances"), "counts": row} for unit, row in units.items()}
    result.update(more)
    (folder / "result.json").write_text(json.dumps(result, indent=1) + "\n")
    rows = [(unit, row["counts"]) for unit, row in sorted(result["units"].items())] + [("all", counts)]
    columns = [c for c in COLUMNS if any(c[1] in row for _, row in rows)]
    lines = ["{entity} on {family}, {tool}".format(**result),
             " " * 20 + "".join("{:>9}".format(title) for title, _ in columns)]
    for name, row in rows:
        lines.append("{:20}".format(name) + "".join(
            "{:>9}".format("" if key not in row else "{:g}".format(row[key])) for _, key in columns))
    for name, clock in sorted(more.get("clocks", {}).items()):
        lines.append("clock {}: {} ns asked, {} ns reached, {} MHz".format(
            name, clock["asked_ns"], clock["reached_ns"], clock["fmax_mhz"]))
    return "\n".join(lines)
