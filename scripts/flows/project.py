# SPDX-License-Identifier: Apache-2.0
"""What the vendor flows have in common: sources, entities, generics of a configuration, boards, the top with pins.

Nothing is listed twice: files come from rtl/files.f, generics and ports from the VHDL, configurations from
tb/configs and tb/chip/configs as for scripts/cost/measure.py, boards from constraints/<board>/board.json.

The pins: outputs dbg_* of psweep and psweep_top are for waves and would take hundreds of pads. So a flow builds
<top>_pins, an entity without logic that wrapper() writes: <top> with dbg_* open, and what board.json asks for:
  "set"    inputs that have no pin: {"phy_full_duplex": 1}
  "invert" inputs whose pin has the other level: {"arst_n": "cpu_reset"}, name of the pin
  "drive"  outputs that the board needs besides: {"phy_reset_n": 1}
Runs in Python 3.6 and later: the tools bring their own.
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

CostError = measure.CostError
RTL = ROOT / "rtl"
CONSTRAINTS = ROOT / "constraints"
# What a flow can build. With pads: through wrapper and pins of a board. Without: alone, its ports are wires.
TOPS = {"psweep_top": True, "arbiter": False, "psweep": False}


class FlowError(Exception):
    """Says what to do, without a trace."""


def sources(top=None):
    """Files of rtl/files.f in its order, absolute; up to and including <top>.vhd."""
    files = measure.all_entities(RTL)
    if top is not None:
        if top + ".vhd" not in files:
            raise FlowError("rtl/files.f has no {}.vhd".format(top))
        files = files[:files.index(top + ".vhd") + 1]
    missing = [f for f in files if not (RTL / f).is_file()]
    if missing:
        raise FlowError("rtl/files.f: missing " + " ".join(missing))
    return [RTL / f for f in files]


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
    text = re.sub(r"--.*", "", (RTL / (entity + ".vhd")).read_text())
    block = re.search(r"entity {} is(.*?)end entity".format(entity), text, re.S | re.I)
    start = re.search(r"\bport\s*\(", block[1]) if block else None
    if not start:
        raise FlowError("rtl/{0}.vhd declares no entity {0} with ports".format(entity))
    body = block[1][start.end():block[1].rindex(")")]
    found = []
    for declaration in body.split(";"):
        match = re.match(r"\s*([\w\s,]+?)\s*:\s*(in|out)\s+(.*?)\s*\Z", declaration, re.S)
        if not match:
            raise FlowError("rtl/{}.vhd: port not understood: {}".format(entity, declaration.strip()))
        for name in re.split(r"\s*,\s*", match[1]):
            found.append((name, match[2], re.sub(r"\s+", " ", match[3])))
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


def generics(top, config, settings, given=()):
    """{'G_X': n}: by the configuration, then by the board, then as given ('G_X=n'). Unknown names are errors."""
    known = measure.generics_of(top, RTL)
    out = dict(measure.config_generics(top, config, RTL))
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


def clk_ns(top, chosen):
    """Period of clk: by G_CLK_KHZ, which the chip must have right; as by default where it is not set."""
    known = measure.generics_of("psweep_top", RTL)
    return round(1e6 / chosen.get("G_CLK_KHZ", int(known["G_CLK_KHZ"])), 3)


def wrapper(top, settings):
    """VHDL text of entity <top>_pins (see above)."""
    fixed = settings.get("set", {})
    inverted = settings.get("invert", {})
    driven = settings.get("drive", {})
    ports = ports_of(top)
    names = {name for name, direction, _ in ports if direction == "in"}
    for name in list(fixed) + list(inverted):
        if name not in names:
            raise FlowError("board.json: {} has no input {}".format(top, name))
    known = measure.generics_of(top, RTL)
    outside, inside = [], []
    for name, direction, port_type in ports:
        if name.startswith("dbg_"):
            inside.append((name, "open"))
        elif name in fixed:
            value = str(fixed[name])
            if not re.match(r"[01]+\Z", value) or len(value) != (bits(port_type) or 1):
                raise FlowError("board.json: '{}' is no value of {}".format(value, name))
            inside.append((name, ("'{}'" if port_type == "std_logic" else '"{}"').format(value)))
        elif name in inverted:
            outside.append("{} : in {}".format(inverted[name], port_type))
            inside.append((name, "inverted_" + name))
        else:
            outside.append("{} : {} {}".format(name, direction, port_type))
            inside.append((name, name))
    outside += ["{} : out std_logic".format(name) for name in driven]
    types = dict((name, port_type) for name, _, port_type in ports)
    lines = ["-- {}_pins: written by scripts/flows/project.py; {} with its debug ports open.".format(top, top),
             "library ieee;", "  use ieee.std_logic_1164.all;", "  use work.psweep_pkg.all;", "",
             "entity {}_pins is".format(top), "  generic ("]
    lines += [";\n".join("    {} : integer := {}".format(k, v) for k, v in known.items()), "  );", "  port ("]
    lines += [";\n".join("    " + p for p in outside), "  );", "end entity {}_pins;".format(top), "",
              "architecture wires of {}_pins is".format(top)]
    lines += ["  signal inverted_{} : {};".format(name, types[name]) for name in inverted]
    lines += ["begin"]
    lines += ["  inverted_{} <= not {};".format(name, pin) for name, pin in inverted.items()]
    for name, value in driven.items():
        if str(value) not in ("0", "1"):
            raise FlowError("board.json: drive {} to 0 or 1".format(name))
        lines.append("  {} <= '{}';".format(name, value))
    lines += ["  u_{0} : entity work.{0}".format(top), "    generic map ("]
    lines += [",\n".join("      {0} => {0}".format(k) for k in known), "    )", "    port map ("]
    lines += [",\n".join("      {} => {}".format(a, b) for a, b in inside), "    );", "end architecture wires;", ""]
    return "\n".join(lines)


def instances():
    """{'u_engine': 'psweep', ..}: labels of all instances, to find units in the tools' reports."""
    found = {}
    for path in sources():
        text = re.sub(r"--.*", "", path.read_text())
        found.update(re.findall(r"\b(u_\w+)\s*:\s*entity\s+work\.(\w+)", text))
    return found


def write_result(folder, question, counts, units, more):
    """result.json in the form of scripts/cost/measure.py --json, and its table as text."""
    result = dict({"schema": measure.SCHEMA, "unit": None, "hierarchy": bool(units), "no_dsp": False}, **question)
    result["counts"] = counts
    result["units"] = {unit: {"instances": row.pop("instances", 1), "counts": row} for unit, row in units.items()}
    result.update(more)
    (folder / "result.json").write_text(json.dumps(result, indent=1) + "\n")
    lines = ["{entity} on {family}, {tool}".format(**result), measure.HEAD_TEXT]
    for unit, row in sorted(result["units"].items()):
        lines.append(measure.row_text(unit, row["counts"]))
    lines.append(measure.row_text("all", counts))
    for name, clock in sorted(more.get("clocks", {}).items()):
        lines.append("clock {}: {} ns asked, {} ns reached, {} MHz".format(
            name, clock["asked_ns"], clock["reached_ns"], clock["fmax_mhz"]))
    return "\n".join(lines)


def no_counts():
    return dict.fromkeys(("lut", "ff", "ram36", "ram18", "ram36_equivalent", "ram48", "rf", "dsp", "carry", "srl",
                          "lutram"), 0)
