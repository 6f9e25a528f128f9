#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks of the vendor flows, constraints and FuseSoC cores that need none of the vendors' tools.

  scripts/check_flows.py [CHECK ..]     default: all of these, some 10 s
    sources      the same files in the same order in rtl/files.f, ISE, nxpython, FuseSoC, CMake
    analyse      GHDL takes each flow's list in its order as VHDL-93; every configuration elaborates in the wrapper
    generics     what the flows pass on exists; FuseSoC's parameters and defaults are those of the VHDL
    ucf          grammar; every port exists and is constrained; pads and standards; both directions of each crossing
    sdc          the same, read by Tcl, and what no notation may say otherwise than the SDC
    nxpython     the flow against a stand-in that knows the real module's methods, arguments and options
    ise          the flow against stand-ins of xst .. bitgen; failing programs, missed timing, no programs
    reports      the readers of reports on short ones, whole and damaged
    scripts      syntax for the tools' Pythons (3.8); --help
  scripts/check_flows.py --faults       a fault each into a copy of the tree: does its check tell? (20 s)
  scripts/check_flows.py --fusesoc      FuseSoC itself (from the Python Package Index, into build/flows/venv): cores are
                                        found, analysed and elaborated by GHDL, a wrong parameter is refused

Stand-ins and reports: tb/flows/. Needs ghdl, cmake, tclsh (scripts/setup.sh build flows). Exit code 1 if anything is
wrong, or if a check compared nothing.
"""
import argparse
import ast
import importlib.util
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent
BENCH = ROOT / "tb" / "flows"
REPORTS = BENCH / "reports"
ISE_PROGRAMS = ("xst", "ngdbuild", "map", "par", "trce", "bitgen")
sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE / "flows"))

import project  # noqa: E402


class Wrong(Exception):
    """What a check found."""


def need(condition, text):
    if not condition:
        raise Wrong(text)


def load(name, path):
    spec = importlib.util.spec_from_file_location(name, str(path))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def call(command, code=0, says="", **more):
    """Runs; Wrong unless it ends with code and says that. Returns what it printed."""
    more.setdefault("cwd", str(ROOT))
    run = subprocess.run([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                         universal_newlines=True, **more)
    name = " ".join(pathlib.Path(c).name if "/" in str(c) else str(c) for c in command[:6])
    need(run.returncode == code, "{}: exit code {} instead of {}\n{}".format(name, run.returncode, code,
                                                                             run.stdout[-2000:]))
    need(says in run.stdout, "{}: does not say '{}'\n{}".format(name, says, run.stdout[-2000:]))
    return run.stdout


def environment(**more):
    """Without the vendors' programs, should they be here."""
    path = [p for p in os.environ["PATH"].split(":")
            if not any(os.access(os.path.join(p, program), os.X_OK)
                       for program in ISE_PROGRAMS + ("nxpython", "nxpython3"))]
    out = dict(os.environ, PATH=":".join(path))
    out.pop("PYTHONPATH", None)
    front = more.pop("FRONT", None)
    if front:
        out["PATH"] = "{}:{}".format(front, out["PATH"])
    out.update({key: str(value) for key, value in more.items()})
    return out


def configurations():
    """[(top, configuration)]: all that are named in the repository."""
    engine = sorted(p.stem for p in (ROOT / "rtl" / "configs" / "engine").glob("*.json"))
    chip = sorted(p.stem for p in (ROOT / "rtl" / "configs" / "chip").glob("*.json"))
    chip += sorted({settings["config"] for settings in project.boards().values()} - set(chip))
    return [("psweep", name) for name in engine] + [("psweep_top", name) for name in chip] + [("arbiter", "tile")]


def prepared(work, top, board, config="tile"):
    """Folder of what ise.py writes (in this process: for many configurations; check_ise runs it as users do)."""
    out = work / "ise-{}-{}-{}".format(board, top, config)
    settings = project.board(board, "ise")
    generics = project.generics(top, config, settings)
    period = project.clk_ns(top, generics, settings)
    load("ise", HERE / "ise" / "ise.py").prepare(top, board, settings, generics, period, out)
    return out


def project_files(out, top):
    lines = (out / (top + ".prj")).read_text().splitlines()
    return [re.match(r'vhdl work "(.*)"\Z', line)[1] for line in lines]


# --- sources ---

def core(name):
    """(files, {parameter: default}, parameters of the targets, depends, toplevels) of rtl/<name>.core, which is written
    in a small part of YAML."""
    text = (ROOT / "rtl" / (name + ".core")).read_text()
    need(text.startswith("CAPI=2:\n"), "{}.core: no CAPI=2".format(name))
    files = re.findall(r"^      - (\S+\.vhd)$", text, re.M)
    default = dict(re.findall(r"^  (\w+): \{datatype: int, paramtype: generic, default: (-?\d+)\}$", text, re.M))
    listed = re.findall(r"^      - (G_\w+)$", text, re.M)
    return files, default, listed, re.findall(r"depend: \[(\S+)\]", text), re.findall(r"toplevel: (\w+)", text)


def check_sources(work):
    listed = [line.split("#")[0].strip() for line in (ROOT / "rtl" / "files.f").read_text().splitlines()]
    listed = [str(ROOT / "rtl" / line) for line in listed if line]
    need(len(listed) > 10, "rtl/files.f: {} files".format(len(listed)))
    compared = 0
    cmake = (HERE / "cmake" / "RtlModel.cmake").read_text()
    function = re.search(r"^function\(psweep_rtl_sources .*?^endfunction\(\)", cmake, re.M | re.S)
    need(function, "scripts/cmake/RtlModel.cmake: no function psweep_rtl_sources")
    for top in project.TOPS:
        wanted = listed[:[pathlib.Path(name).stem for name in listed].index(top) + 1]
        lists = {}
        for board in project.boards("ise"):
            lists["ISE, " + board] = project_files(prepared(work, top, board), top)
        for board in project.boards("nxmap"):
            out = work / "nx-{}-{}".format(board, top)
            call([sys.executable, HERE / "nxmap" / "nxmap.py", "--top", top, "--board", board, "--prepare",
                  "--out", out])
            lists["nxpython, " + board] = ast.literal_eval((out / "job.txt").read_text())["files"]
        for name, files in lists.items():
            need(files[-1].endswith("/{}_pins.vhd".format(top)), "{}: {} is not the wrapper".format(name, files[-1]))
            need(files[:-1] == wanted, "{}: files of {} differ from rtl/files.f: {}".format(
                name, top, sorted(set(files[:-1]) ^ set(wanted)) or "order"))
            compared += len(files)
        script = work / "sources.cmake"
        script.write_text('set(CMAKE_SOURCE_DIR "{}")\n{}\npsweep_rtl_sources({} out)\nmessage("${{out}}")\n'.format(
            ROOT, function[0], top))
        files = call(["cmake", "-P", script]).strip().split(";")
        need(files == wanted, "CMake: files of {} differ from rtl/files.f".format(top))
        compared += len(files)
    engine, chip = core("psweep"), core("psweep_top")
    need([str(ROOT / "rtl" / f) for f in engine[0] + chip[0]] == listed,
         "FuseSoC: files differ from rtl/files.f: {} (run scripts/flows/cores.py)".format(
             sorted({str(ROOT / "rtl" / f) for f in engine[0] + chip[0]} ^ set(listed)) or "order"))
    need(pathlib.Path(engine[0][-1]).name == "psweep.vhd", "FuseSoC: the engine ends with {}".format(engine[0][-1]))
    name = re.search(r"^name: (\S+)$", (ROOT / "rtl" / "psweep.core").read_text(), re.M)[1]
    need(chip[3] == [name] and not engine[3], "FuseSoC: the chip depends on {}".format(chip[3]))
    return compared + len(listed), "files"


# --- analyse, generics ---

def ghdl(work, files, top, generics, label):
    folder = work / "ghdl-{}".format(label)
    folder.mkdir()
    call(["ghdl", "-a", "--std=93", "--workdir={}".format(folder)] + files)
    return folder


def elaborate(folder, top, generics, code=0):
    run = subprocess.run(["ghdl", "--synth", "--std=93", "--workdir={}".format(folder), "--out=verilog", "--no-formal"]
                         + ["-g{}={}".format(*g) for g in sorted(generics.items())] + [top + "_pins"], cwd=str(ROOT),
                         stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, universal_newlines=True)
    need((run.returncode == 0) == (code == 0), "{} with {}: GHDL ends with {}\n{}".format(
        top, generics, run.returncode, run.stderr[-1500:]))


def check_analyse(work):
    number = 0
    for board, settings in project.boards().items():
        for top in project.TOPS:
            if board != "virtex5qv" and not project.TOPS[top]["pads"]:
                continue  # the same wrapper on every board; that the lists are the same is check_sources' business
            out = work / "{}-{}".format(board, top)
            out.mkdir()
            if settings["tool"] == "ise":
                files = project_files(prepared(work, top, board), top)
            else:
                wrapper = out / (top + "_pins.vhd")
                wrapper.write_text(project.wrapper(top, settings))
                files = [str(f) for f in project.sources(top)] + [str(wrapper)]
            folder = ghdl(work, files, top, {}, "{}-{}".format(board, top))
            for of, config in configurations():
                # Every configuration once, and each board and top with one of them.
                if of == top and (board == "virtex5qv" or config in ("tile", settings["config"])):
                    elaborate(folder, top, project.generics(top, config, settings))
                    number += 1
            if board == "virtex5qv" and top != "arbiter":
                elaborate(folder, top, dict(project.generics(top, "tile", settings), G_WINDOW=8), code=1)
                number += 1
    return number, "elaborations"


def check_generics(work):
    number = 0
    for name in ("psweep", "psweep_top"):
        known = project.measure.generics_of(name, project.RTL)
        _, default, listed, _, toplevels = core(name)
        need(set(toplevels) == {name} and toplevels, "{}.core: top {}".format(name, toplevels))
        need(default == known, "{}.core: parameters differ from the VHDL (run scripts/flows/cores.py): {}".format(
            name, sorted(set(default.items()) ^ set(known.items()))))
        need(sorted(listed) == sorted(known), "{}.core: parameters of the targets differ from the VHDL: {}".format(
            name, sorted(set(listed) ^ set(known))))
        number += len(known)
    for top, config in configurations():
        for board in project.boards("ise"):
            text = (prepared(work, top, board, config) / (top + ".xst")).read_text()
            given = re.search(r"^-generics \{(.*)\}$", text, re.M)
            need(given, "ISE: no generics of {}".format(config))
            known = project.measure.generics_of(top, project.RTL)
            for pair in given[1].split():
                need(re.match(r"G_\w+=-?\d+\Z", pair) and pair.split("=")[0] in known,
                     "ISE: {}: {}".format(config, pair))
                number += 1
    for arguments, says in ((["G_NONE=1"], "has no generic G_NONE"), (["G_LANES"], "is not G_X=n"),
                            (["--config", "none"], "no configuration 'none'"),
                            (["--board", "none"], "no board 'none'")):
        for script in (HERE / "ise" / "ise.py", HERE / "nxmap" / "nxmap.py"):
            call([sys.executable, script, "--prepare", "--out", work / "none"] + arguments, code=1, says=says)
            number += 1
    # The cores are written again from files.f and the VHDL, byte by byte, after being spoilt.
    tree = copy_tree(work / "cores")
    for name in ("psweep", "psweep_top"):
        spoilt = tree / "rtl" / (name + ".core")
        change(spoilt, "      - " + core(name)[0][1] + "\n", "")
        change(spoilt, "G_WINDOW: {datatype: int, paramtype: generic, default: 13}",
               "G_WINDOW: {datatype: int, paramtype: generic, default: 9}")
        change(spoilt, "      - G_PLANES\n", "")
    call([sys.executable, tree / "scripts" / "flows" / "cores.py"], says="psweep_top.core written")
    for name in ("psweep", "psweep_top"):
        need((tree / "rtl" / (name + ".core")).read_text() == (ROOT / "rtl" / (name + ".core")).read_text(),
             "scripts/flows/cores.py: {}.core is not as before".format(name))
    return number, "generics"


# --- constraints: what each notation says, in the same words ---

class Says(object):
    """Clocks {port: ns}; crossings {(from, to): ns}; unclocked and free: bits of inputs and outputs without a time;
    inside {bit: (clock, ns before, ns after)}: when inputs are stable; outside {bit: (clock, ns after)}: when outputs
    are to be sent."""

    def __init__(self):
        self.clocks, self.crossings, self.unclocked, self.free, self.inside, self.outside = {}, {}, set(), set(), {}, {}

    def complete(self, bits, where, bound):
        """Every port has its constraint, and only one kind of it."""
        for bit, direction in sorted(bits.items()):
            kinds = [bit in self.clocks, bit in self.unclocked, bit in self.inside] if direction == "in" \
                else [bit in self.free, bit in self.outside]
            need(sum(kinds) == 1, "{}: port {} has {} constraints".format(where, bit, sum(kinds)))
        clocks = set(self.clocks)
        wanted = {(a, b) for a in clocks for b in clocks if a != b and "clk" in (a, b)}
        need(set(self.crossings) == wanted, "{}: crossings differ: {}".format(
            where, sorted(set(self.crossings) ^ wanted)))
        for pair, delay in self.crossings.items():
            need(abs(delay - bound) < 0.0015, "{}: crossing {} to {} has {} ns instead of {}".format(
                where, pair[0], pair[1], delay, bound))
        return len(bits) + len(wanted)

    def same(self, other, bits, where):
        """As the other says, for these bits."""
        for name in ("unclocked", "free"):
            mine, yours = getattr(self, name) & set(bits), getattr(other, name) & set(bits)
            need(mine == yours, "{}: differs from the SDC: {}".format(where, sorted(mine ^ yours)))
        for name in ("clocks", "inside", "outside"):
            mine, yours = ({k: v for k, v in getattr(x, name).items() if k in bits} for x in (self, other))
            different = sorted(k for k in set(mine) | set(yours)
                               if repr(mine.get(k)) != repr(yours.get(k)))
            need(not different, "{}: differs from the SDC: {}".format(where, ", ".join(
                "{} {} instead of {}".format(k, mine.get(k), yours.get(k)) for k in different)))


def entity_bits(top):
    """{bit: direction} of the entity itself; of a port whose width is no number only bit 0."""
    out = {}
    for name, direction, port_type in project.ports_of(top):
        width = re.match(r"std_logic_vector\((\d+) downto 0\)\Z", port_type)
        number = int(width[1]) + 1 if width else 1
        for bit in [""] if port_type == "std_logic" else ["[{}]".format(i) for i in range(number)]:
            out[name + bit] = direction
    return out


def sdc(work, top, period=None):
    bits = entity_bits(top)
    ports = work / (top + ".ports")
    ports.write_text("\n".join(bits) + "\n")
    where = "constraints/sdc/{}.sdc".format(top)
    text = call(["tclsh", BENCH / "sdc.tcl", ROOT / where, ports] + ([str(period)] if period else []))
    says, limits = Says(), {}

    def names(field):
        return re.findall(r"[^\s{}]+", field)
    for line in text.splitlines():
        fields = line.split("\t")
        split = fields.index("")
        command, options, rest = fields[0], dict(zip(fields[1:split:2], fields[2:split:2])), fields[split + 1:]
        if command == "create_clock":
            need(rest == [options["-name"]], "{}: clock {} at {}".format(where, options["-name"], rest))
            says.clocks[rest[0]] = float(options["-period"])
        elif command == "set_max_delay":
            pair = tuple(names(options[o])[0][len("clock:"):] for o in ("-from", "-to"))
            need(pair not in says.crossings, "{}: {} twice".format(where, pair))
            says.crossings[pair] = float(rest[0])
        elif command == "set_false_path":
            ends = [names(options.get(o, "")) for o in ("-from", "-to")]
            if any(name.startswith("clock:") for end in ends for name in end):
                pair = tuple(end[0][len("clock:"):] for end in ends)
                need("-hold" in options or "clk" not in pair, "{}: {} has no limit at all".format(where, pair))
            else:
                says.unclocked.update(ends[0])
                says.free.update(ends[1])
        else:
            for bit in names(rest[1]):
                if "-min" not in options:
                    limits[command, bit, "max"] = (options["-clock"], float(rest[0]))
                if "-max" not in options:
                    limits[command, bit, "min"] = (options["-clock"], float(rest[0]))
    for (command, bit, kind), (clock, value) in limits.items():
        if kind == "max":
            need((command, bit, "min") in limits, "{}: {} without -min".format(where, bit))
            length = says.clocks[clock]
            if command == "set_input_delay":
                says.inside[bit] = (clock, round(length - value, 3), limits[command, bit, "min"][1])
            else:
                says.outside[bit] = (clock, round(length - value, 3))
    directions = {bit: bits[bit] for bit in says.unclocked | says.free | set(says.inside) | set(says.outside)}
    for bit, direction in directions.items():
        need((direction == "in") == (bit in says.unclocked or bit in says.inside),
             "{}: direction of {}".format(where, bit))
    return says, bits


def check_sdc(work):
    number = 0
    for top, settings in project.TOPS.items():
        for period in (None, 6.024, 50.0):
            says, bits = sdc(work, top, period)
            clk = period or 10.0
            need(says.clocks == dict({c: project.MII_NS for c in settings["clocks"]}, clk=clk),
                 "constraints/sdc/{}.sdc: clocks {}".format(top, says.clocks))
            number += says.complete(bits, "constraints/sdc/{}.sdc".format(top), min(clk, project.MII_NS))
    return number, "ports and crossings"


STANDARDS = {"xc5v": {"LVCMOS12", "LVCMOS15", "LVCMOS18", "LVCMOS25", "LVCMOS33", "LVTTL"},
             "xc6v": {"LVCMOS12", "LVCMOS15", "LVCMOS18", "LVCMOS25"}}
# Balls of a package: so many rows (letters without I, O, Q, S, X, Z: A .. Y, AA .. AY, BA ..), as many columns.
PACKAGES = {"ff1156": 34, "cf1752": 42}
LETTERS = "ABCDEFGHJKLMNPRTUVWY"
ITEM = {
    "LOC": r'LOC = "(\w+)"', "IOSTANDARD": r"IOSTANDARD = (\w+)", "SLEW": r"SLEW = (FAST|SLOW)",
    "DRIVE": r"DRIVE = (2|4|6|8|12|16|24)", "TIG": r"(TIG)", "TNM_NET": r'TNM_NET = "(\w+)"',
    "CLOCK_DEDICATED_ROUTE": r"CLOCK_DEDICATED_ROUTE = (FALSE)",
    "IN": r'OFFSET = (IN [\d.]+ ns VALID [\d.]+ ns BEFORE "\w+" RISING)',
    "OUT": r'OFFSET = (OUT [\d.]+ ns AFTER "\w+" RISING)',
}


def is_ball(location, part):
    number = PACKAGES.get(part.split("-")[-1])
    need(number, "no package {} in PACKAGES of scripts/check_flows.py".format(part.split("-")[-1]))
    rows = [first + letter for first in ("", "A", "B") for letter in LETTERS][:number]
    match = re.match(r"([A-Z]+)([1-9]\d?)\Z", location)
    return bool(match) and match[1] in rows and int(match[2]) <= number


def read_ucf(text, bits, where):
    """(nets {bit: {item: value}}, periods {group: ns}, crossings {(from, to): ns}, groups)."""
    nets, periods, crossings = {}, {}, {}
    statements = re.sub(r"#.*", "", text).split(";")
    need(not statements[-1].strip(), "{}: ends within a statement".format(where))
    for statement in statements[:-1]:
        statement = re.sub(r"\s+", " ", statement).strip()
        net = re.match(r'NET "([\w<>*]+)" (.*)\Z', statement)
        period = re.match(r'TIMESPEC "TS_(\w+)" = PERIOD "(\w+)" ([\d.]+) ns HIGH 50 %\Z', statement)
        path = re.match(r'TIMESPEC "TS_(\w+)" = FROM "(\w+)" TO "(\w+)" ([\d.]+) ns DATAPATHONLY\Z', statement)
        if period:
            need(period[1] == period[2], "{}: {}".format(where, statement))
            periods[period[2]] = float(period[3])
        elif path:
            need((path[2], path[3]) not in crossings, "{}: {} twice".format(where, statement))
            crossings[path[2], path[3]] = float(path[4])
        else:
            need(net, "{}: not understood: {}".format(where, statement))
            pattern = re.escape(net[1]).replace(r"\*", r"\d+")
            found = [bit for bit in bits if re.match(pattern + r"\Z", bit)]
            need(found, "{}: no port {}".format(where, net[1]))
            for item in net[2].split(" | "):
                kinds = [(k, re.match(r + r"\Z", item)) for k, r in ITEM.items() if re.match(r + r"\Z", item)]
                need(kinds, "{}: {}: not understood: {}".format(where, net[1], item))
                for bit in found:
                    need(kinds[0][0] not in nets.setdefault(bit, {}), "{}: {} twice: {}".format(where, bit, item))
                    nets[bit][kinds[0][0]] = kinds[0][1][1]
    return nets, periods, crossings


def check_ucf(work):
    number = 0
    for board, settings in project.boards("ise").items():
        for top in project.TOPS:
            where = "UCF of {} on {}".format(top, board)
            text = (prepared(work, top, board) / (top + ".ucf")).read_text()
            bits = project.pin_bits(top, settings)
            nets, periods, crossings = read_ucf(text, bits, where)
            period = project.clk_ns(top, project.generics(top, "tile", settings), settings)
            says = Says()
            says.crossings = crossings
            for bit, items in nets.items():
                if "TNM_NET" in items:
                    need(items["TNM_NET"] == bit and bit in periods, "{}: {} has no PERIOD".format(where, bit))
                    says.clocks[bit] = periods[bit]
                if "TIG" in items:
                    (says.unclocked if bits[bit] == "in" else says.free).add(bit)
                if "IN" in items:
                    need(bits[bit] == "in", "{}: OFFSET IN of output {}".format(where, bit))
                    before, valid, clock = re.match(
                        r'IN (\S+) ns VALID (\S+) ns BEFORE "(\w+)"', items["IN"]).groups()
                    says.inside[bit] = (clock, float(before), round(float(valid) - float(before), 3))
                if "OUT" in items:
                    need(bits[bit] == "out", "{}: OFFSET OUT of input {}".format(where, bit))
                    after, clock = re.match(r'OUT (\S+) ns AFTER "(\w+)"', items["OUT"]).groups()
                    says.outside[bit] = (clock, float(after))
            need(set(periods) == set(says.clocks) == set(project.TOPS[top]["clocks"]), "{}: clocks {} {}".format(
                where, sorted(periods), sorted(says.clocks)))
            need(abs(says.clocks["clk"] - period) < 0.0015, "{}: clk has {} ns".format(where, says.clocks["clk"]))
            for clock in set(periods) - {"clk"}:
                need(periods[clock] == project.MII_NS, "{}: {} has {} ns".format(where, clock, periods[clock]))
            if not project.TOPS[top]["pads"]:
                wanted = {(a, b) for a in periods for b in periods if a != b and "clk" in (a, b)}
                need(set(crossings) == wanted, "{}: crossings {}".format(where, sorted(set(crossings) ^ wanted)))
                need(all(abs(ns - min(period, project.MII_NS)) < 0.0015 for ns in crossings.values()),
                     "{}: crossings {}".format(where, crossings))
                number += len(wanted) + len(periods)
                continue
            number += says.complete(bits, where, min(period, project.MII_NS))
            # In the names of the entity, as the SDC.
            pins = {pin: port for port, pin in settings.get("invert", {}).items()}
            driven = set(settings.get("drive", {}))
            def plain(bit):
                return pins.get(bit, bit).replace("<", "[").replace(">", "]")
            other, _ = sdc(work, top, periods["clk"])
            says.unclocked = {plain(b) for b in says.unclocked}
            says.free = {plain(b) for b in says.free - driven}
            for name in ("inside", "outside", "clocks"):
                setattr(says, name, {plain(k): v for k, v in getattr(says, name).items()})
            says.same(other, {plain(b) for b in bits if b not in driven}, where)
            balls = {}
            for bit in bits:
                items = nets.get(bit, {})
                need(items.get("IOSTANDARD") in STANDARDS[settings["family"]], "{}: {}: IOSTANDARD {}".format(
                    where, bit, items.get("IOSTANDARD")))
                if settings["pads"] == "known":
                    need(is_ball(items.get("LOC", ""), settings["part"]), "{}: {}: LOC {}".format(
                        where, bit, items.get("LOC")))
                    need(items["LOC"] not in balls, "{}: {} and {} on {}".format(
                        where, bit, balls.get(items["LOC"]), items["LOC"]))
                    balls[items["LOC"]] = bit
                else:
                    need("LOC" not in items, "{}: {} has a pad on a template".format(where, bit))
    return number, "ports and crossings"


# --- nxpython ---

def run_nx(work, name, arguments, code=0, says="", root=None, **more):
    """Runs the flow against the stand-in; returns the calls."""
    log, out = work / (name + ".log"), work / name
    more.setdefault("NX_TIMING", REPORTS / "ng_medium.timing")
    if log.exists():
        log.unlink()
    call([sys.executable, (root or ROOT) / "scripts" / "nxmap" / "nxmap.py", "--out", out] + arguments, code=code,
         says=says, env=environment(PYTHONPATH=BENCH, NX_LOG=log, NX_REPORTS=REPORTS, **more))
    return [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else []


def nx_says(calls, where):
    """What the recorded calls say."""
    says = Says()
    for method, _, named in calls:
        if method == "createClock":
            need(named["target"] == "getClockNet({})".format(named["name"]), "{}: {}".format(where, named))
            says.clocks[named["name"]] = named["period"]
        elif method in ("setMaxDelay", "setFalsePath"):
            ends = [re.match(r"(\w*)\(?([^()]*)\)?\Z", named[end]).groups() for end in ("source", "target")]
            if ends[0][0] == "getRegistersByClock":
                pair = (ends[0][1], ends[1][1])
                if method == "setMaxDelay":
                    says.crossings[pair] = named["delay"]
                else:
                    need("clk" not in pair, "{}: {} has no limit at all".format(where, pair))
            else:
                need(method == "setFalsePath", "{}: {}".format(where, named))
                says.unclocked.update(e[1] for e in ends[:1] if e[1])
                says.free.update(e[1] for e in ends[1:] if e[1])
        elif method in ("setInputDelay", "setOutputDelay"):
            clock = named["clock"][len("getClock("):-1]
            bit, length = named["ports"][len("getPort("):-1], says.clocks[clock]
            if method == "setInputDelay":
                says.inside[bit] = (clock, round(length - named["max"], 3), named["min"])
            else:
                says.outside[bit] = (clock, round(length - named["max"], 3))
    return says


def pads_fit(calls, settings, where):
    """A template has no locations; on a board every pad has one of its own, in a bank with a voltage."""
    pads = [c[1][0] for c in calls if c[0] == "addPads"]
    banks = [c[1][0] for c in calls if c[0] == "addBanks"]
    need(len(pads) == 1, "{}: pads {} times".format(where, len(pads)))
    taken = {}
    for name, pad in pads[0].items():
        location = pad.get("location")
        need((location is not None) == (settings["pads"] == "known"), "{}: {} has location {}".format(
            where, name, location))
        if location is not None:
            need(location not in taken, "{}: {} and {} on {}".format(where, name, taken.get(location), location))
            need(banks and location.split("_")[0] in banks[0], "{}: no voltage for the bank of {}".format(where, name))
            taken[location] = name


def check_nxpython(work):
    number = 0
    for board, settings in project.boards("nxmap").items():
        for top in project.TOPS:
            where = "nxpython, {} on {}".format(top, board)
            whole = project.TOPS[top]["pads"]
            calls = run_nx(work, top, ["--top", top, "--board", board])
            generics = project.generics(top, project.config_of(settings, top), settings)
            period = project.clk_ns(top, generics, settings)
            says = nx_says(calls, where)
            need(abs(says.clocks.get("clk", 0) - period) < 0.0015, "{}: clk {}".format(where, says.clocks))
            bits = {b.replace("<", "[").replace(">", "]"): d for b, d in project.pin_bits(top, settings).items()}
            if whole:
                number += says.complete(bits, where, min(period, project.MII_NS))
                says.same(sdc(work, top, period)[0], bits, where)
            else:
                wanted = {(a, b) for a in says.clocks for b in says.clocks if a != b and "clk" in (a, b)}
                need(set(says.crossings) == wanted, "{}: crossings {}".format(where, sorted(says.crossings)))
                need(set(says.clocks) == set(project.TOPS[top]["clocks"]), "{}: clocks {}".format(where, says.clocks))
            done = [c[0] for c in calls]
            order = ["createProject", "setVariantName", "setTopCellName", "addFiles", "addParameters", "setOptions",
                     "synthesize", "place", "route", "reportInstances", "createAnalyzer", "launch"]
            need([m for m in done if m in order] == order, "{}: steps {}".format(where, done))
            fifo = [c[1][1:] for c in calls if c[0] == "addMappingDirective" and c[1][0] == "*async_fifo*"]
            need(fifo == ([] if top == "psweep" else [["RAM", "DFF"]]),
                 "{}: async_fifo must go into flip-flops".format(where))
            if whole:
                pads_fit(calls, settings, where)
                need("generateBitstream" not in done or settings["pads"] == "known",
                     "{}: a bitstream of a template".format(where))
            # Of the entity alone the wrapper does not count.
            result = json.loads((work / top / "result.json").read_text())
            need(result["counts"]["lut"] == (7000 if whole else 6990)
                 and result["units"]["similarity"]["counts"]["dsp"] == 18
                 and abs(result["clocks"]["clk"]["reached_ns"] - period + 1.024) < 0.001
                 and set(result["clocks"]) == set(project.TOPS[top]["clocks"]), "{}: result.json".format(where))
            short = run_nx(work, top + "-short", ["--top", top, "--board", board, "--synthesise"])
            need("place" not in [c[0] for c in short], "{}: --synthesise goes on".format(where))
            number += len(calls)
    for step in ("synthesize", "place", "route"):
        calls = run_nx(work, "failing", [], code=1, says="nxmap: {} failed".format(step), NX_FAIL=step)
        need([c[0] for c in calls if c[0] in ("synthesize", "place", "route")][-1] == step, "goes on after " + step)
        number += 1
    missed = work / "missed.timing"
    missed.write_text((REPORTS / "ng_medium.timing").read_text().replace("32.000ns", "-1.000ns"))
    run_nx(work, "missed", [], code=1, says="timing is not met", NX_TIMING=missed)
    # A board with pads: its bitstream is made.
    tree = copy_tree(work / "known")
    folder = tree / "constraints" / "ng_medium"
    change(folder / "board.json", '"template"', '"known"')
    with (folder / "pads.py").open("a") as file:
        file.write('BANKS = {"IOB12": {"voltage": "2.5"}}\n'
                   'for _n, _name in enumerate(sorted(PADS)):\n'
                   '    PADS[_name] = dict(PADS[_name], location="IOB12_D%02d%s" % (_n // 2 + 1, "PN"[_n % 2]))\n')
    calls = run_nx(work, "bitstream", [], root=tree, says="psweep_top.nxb")
    need([c[0] for c in calls][-1] == "generateBitstream", "no bitstream of a board with pads")
    pads_fit(calls, {"pads": "known"}, "nxpython, a board with pads")
    # The reports alone, by a Python without the module.
    call([sys.executable, HERE / "nxmap" / "nxmap.py", "--report", "--out", work / "psweep_top"],
         says="clock mii_tx_clk", env=environment())
    # The tool's own Python is found on PATH; one without the module is told as no tool at all.
    script = HERE / "nxmap" / "nxmap.py"
    for name, path, code, says in (("tool", BENCH, 0, "no bitstream"), ("broken", work, 3, "This needs NanoXplore")):
        (work / name).mkdir()
        (work / name / "nxpython3").write_text("#!/bin/sh\nPYTHONPATH={} exec {} \"$@\"\n".format(
            path, sys.executable))
        (work / name / "nxpython3").chmod(0o755)
        call([sys.executable, script, "--out", work / (name + "-out")], code=code, says=says, env=environment(
            FRONT=work / name, NX_LOG=work / "tool.log", NX_REPORTS=REPORTS, NX_TIMING=REPORTS / "ng_medium.timing"))
    call([sys.executable, script, "--out", work / "bare"], code=3, says="This needs NanoXplore nxpython",
         env=environment())
    return number + 6, "calls and cases"


# --- ise ---

def run_ise(work, name, arguments, code=0, says="", **more):
    """Runs the flow against the stand-ins; returns the programs that were called."""
    programs, log = work / "programs", work / (name + ".log")
    if not programs.exists():
        programs.mkdir()
        for program in ISE_PROGRAMS:
            file = programs / program
            file.write_text("#!/bin/sh\nexec {} -S -E {} \"$0\" \"$@\"\n".format(sys.executable,
                                                                           BENCH / "ise_tools.py"))
            file.chmod(0o755)
    call([sys.executable, HERE / "ise" / "ise.py", "--out", work / name] + arguments, code=code, says=says,
         env=environment(FRONT=programs, ISE_LOG=log, ISE_REPORTS=REPORTS, **more))
    return [json.loads(line)[0] for line in log.read_text().splitlines()]


def check_ise(work):
    number = 0
    for board, settings in project.boards("ise").items():
        timing = {"ISE_TWR": "virtex6.twr" if settings["family"] == "xc6v" else "virtex5.twr"}
        top = "psweep_top" if settings["family"] == "xc6v" else "psweep"  # of which there are reports
        known = settings["pads"] == "known" and top == "psweep_top"
        called = run_ise(work, board, ["--board", board, "--top", top], **timing)
        need(called == list(ISE_PROGRAMS[:6 if known else 5]), "{}: programs {}".format(board, called))
        need((work / board / (top + ".bit")).is_file() == known, "{}: bitstream".format(board))
        result = json.loads((work / board / "result.json").read_text())
        wanted = {"xc6v": (4800, 133.5, 15, 125.0), "xc5v": (3000, 81.0, 15, 133.3)}[settings["family"]]
        got = (result["counts"]["lut"], result["counts"]["ram36_equivalent"], result["counts"]["dsp"],
               result["clocks"]["clk"]["fmax_mhz"])
        need(got == wanted, "{}: result.json has {} instead of {}".format(board, got, wanted))
        call([sys.executable, HERE / "ise" / "ise.py", "--report", "--board", board, "--top", top, "--out",
              work / board], says="clock clk", env=environment())
        need(json.loads((work / board / "result.json").read_text()) == result, "{}: --report differs".format(board))
        for other in set(project.TOPS) - {top}:
            called = run_ise(work, "{}-{}".format(board, other), ["--board", board, "--top", other, "--synthesise"])
            need(called == ["xst"], "{}: programs {}".format(board, called))
            number += 1
        number += 1
    for stage, program in enumerate(ISE_PROGRAMS):
        name = "fail-" + program
        called = run_ise(work, name, ["--board", "ml605"], code=1,
                         says="see {}".format(work / name / (program + ".log")), ISE_FAIL=program)
        need(called == list(ISE_PROGRAMS[:stage + 1]), "goes on after {}: {}".format(program, called))
        number += 1
    called = run_ise(work, "missed", ["--board", "ml605"], code=1, says="timing is not met", ISE_TWR="missed.twr")
    need("bitgen" not in called, "a bitstream although timing is not met")
    for top in project.TOPS:
        text = call([sys.executable, HERE / "ise" / "ise.py", "--top", top, "--out", work / "bare"], code=3,
                    says="This needs Xilinx ISE 14.7", env=environment())
        for program in ISE_PROGRAMS[:5]:
            need("     {} -intstyle".format(program) in text, "without ISE: does not show {}".format(program))
            number += 1
    return number + 1, "runs"


# --- reports ---

def check_reports(work):
    ise, nx = load("ise_reports", HERE / "ise" / "reports.py"), load("nx_reports", HERE / "nxmap" / "reports.py")
    texts = {p.name: p.read_text() for p in REPORTS.iterdir()}
    number = 0

    def equal(what, got, wanted):
        need(got == wanted, "{}: {} instead of {}".format(what, got, wanted))

    def refused(what, reader, text, *more):
        try:
            reader(text, *more)
        except (ise.ReportError, nx.ReportError):
            return
        raise Wrong("{}: read without a word".format(what))
    counts, rows = ise.map_report(texts["virtex6_map.mrp"])
    equal("Virtex-6", counts, {"lut": 4800, "ff": 3900, "srl": 230, "lutram": 20, "lut_memory": 250, "ram36": 120,
                               "ram18": 27, "dsp": 15, "ram36_equivalent": 133.5})
    units = project.units_of(rows, "psweep_top")
    equal("units", sorted(units), ["async_fifo", "control", "interpolation", "mac_rx", "responder", "similarity",
                                   "updating"])
    equal("interpolation", (units["interpolation"]["instances"], units["interpolation"]["dsp"]), (2, 6))
    equal("similarity", units["similarity"]["lut"], 800)
    counts, rows = ise.map_report(texts["virtex5_map.mrp"])
    equal("Virtex-5", counts, {"lut": 3100, "ff": 3300, "srl": 194, "lutram": 6, "lut_memory": 200, "ram36": 71,
                               "ram18": 20, "dsp": 15, "ram36_equivalent": 81.0})
    equal("engine", rows[("u_psweep",)]["lut"], 3000)
    timing, met = ise.timing_report(texts["virtex6.twr"])
    equal("met", met, True)
    equal("clocks", ise.clocks(timing, ("clk", "mii_rx_clk", "mii_tx_clk"))["mii_tx_clk"],
          {"asked_ns": 40.0, "reached_ns": 6.25, "fmax_mhz": 160.0})
    equal("crossing", timing["TS_rx_to_clk"], {"errors": 0, "asked_ns": 15.152, "reached_ns": 3.2})
    equal("constraints", len(timing), 5)
    timing, met = ise.timing_report(texts["missed.twr"])
    equal("missed", (met, timing["TS_clk"]["errors"]), (False, 7))
    equal("MHz", ise.clocks(ise.timing_report(texts["virtex5.twr"])[0], ("clk",))["clk"]["asked_ns"], 8.0)
    counts, mhz = ise.synthesis_report(texts["virtex6.syr"])
    equal("xst", (counts["lut"], counts["srl"], counts["lutram"], counts["ram36_equivalent"], counts["dsp"], mhz),
          (2100, 10, 20, 55, 0, 160.0))
    counts, units = nx.hierarchy(texts["hierarchy.json"], ("similarity", "psweep_top"))
    equal("hierarchy", (counts["lut"], counts["rf"], units["similarity"]["instances"]), (7000, 12, 2))
    periods = {"clk": 6.024, "mii_rx_clk": 40.0, "mii_tx_clk": 40.0}
    clocks, met = nx.timing(texts["ng_medium.timing"], periods)
    equal("nxpython", (clocks["clk"]["reached_ns"], clocks["mii_tx_clk"]["reached_ns"], met), (5.0, 9.0, True))
    number += 14
    for what, reader, name, old, new, more in (
            ("no LUTs", ise.map_report, "virtex6_map.mrp", "Number of Slice LUTs", "Number of LUTs", ()),
            ("no DSP", ise.map_report, "virtex6_map.mrp", "Number of DSP48E1s", "Number of DSPs", ()),
            ("another family", ise.map_report, "virtex5_map.mrp", ": xqr5vfx130", ": xc6slx75l", ()),
            ("sizes of RAM", ise.map_report, "virtex5_map.mrp", "k BlockRAM used", "k used", ()),
            ("no Section 13", ise.map_report, "virtex6_map.mrp", "Section 13 - U", "Section 12 - U", ()),
            ("no column", ise.map_report, "virtex6_map.mrp", "| LUTs ", "| LUT  ", ()),
            ("a cell", ise.map_report, "virtex6_map.mrp", "600/600 ", "many    ", ()),
            ("depth", ise.map_report, "virtex6_map.mrp", "++u_engine ", "++++++u_engine ", ()),
            ("no verdict", ise.timing_report, "virtex6.twr", "All constraints were met.", "", ()),
            ("no constraint", ise.timing_report, "virtex6.twr", "Timing constraint: ", "Constraint: ", ()),
            ("not trce", ise.timing_report, "virtex6.twr", "Trace", "Map", ()),
            ("broken off", ise.synthesis_report, "virtex6.syr", "Final Report", "", ()),
            ("no modules", nx.hierarchy, "hierarchy.json", "m_moduleCollection", "modules", ((),)),
            ("no count", nx.hierarchy, "hierarchy.json", "countMemBlock", "countMem", ((),)),
            ("no table", nx.timing, "ng_medium.timing", "Reporting timing", "Timing", (periods,)),
            ("a clock", nx.timing, "ng_medium.timing", "mii_tx_clk", "tx", (periods,))):
        need(old in texts[name], "{}: {} has no '{}'".format(what, name, old))
        refused(what, reader, texts[name].replace(old, new), *more)
        number += 1
    timing, _ = ise.timing_report(texts["virtex6.twr"].replace("Minimum period is", "Period is"))
    refused("no period", ise.clocks, timing, ("clk",))
    refused("another clock", ise.clocks, ise.timing_report(texts["virtex5.twr"])[0], ("clk", "mii_rx_clk"))
    return number + 2, "reports"


# --- scripts ---

def check_scripts(work):
    files = [f for folder in ("scripts/flows", "scripts/ise", "scripts/nxmap") for f in (ROOT / folder).glob("*.py")]
    files += [HERE / "cost" / name for name in ("measure.py", "families.py", "netlist.py", "points.py")]
    files += [HERE / "psweep_tools" / name for name in ("__init__.py", "paths.py")]
    files += (HERE / "psweep_tools" / "vhdl").glob("*.py")
    files += sorted((ROOT / "constraints").glob("*/*.py"))
    for file in files:
        try:
            ast.parse(file.read_text(), str(file), feature_version=(3, 8))
        except SyntaxError as error:
            raise Wrong("{}: not for Python 3.8: {}".format(file, error))
    for script in ("ise/ise.py", "nxmap/nxmap.py"):
        call([sys.executable, HERE / script, "--help"], says="--board", cwd=str(work))
    boards = project.boards()
    need({"ise", "nxmap"} == {b["tool"] for b in boards.values()}, "boards: {}".format(sorted(boards)))
    for name, settings in boards.items():
        need(set(settings) == {"description", "tool", "part", "family", "pads", "config", "generics", "invert", "set",
                               "drive"}, "constraints/{}/board.json: fields".format(name))
        need(settings["pads"] in ("known", "template"), "constraints/{}/board.json: pads".format(name))
        known = project.measure.generics_of("psweep_top", project.RTL)
        need(set(settings["generics"]) <= set(known), "constraints/{}/board.json: generics".format(name))
    page = (ROOT / "constraints" / "crossings.md").read_text()
    for pattern in ("*/psweep_top.*", "*/timing.py"):
        for file in (ROOT / "constraints").glob(pattern):
            need("{}/{}".format(file.parent.name, file.name) in page,
                 "constraints/crossings.md does not name {}".format(file))
    return len(files) + len(boards), "files"


CHECKS = {name[len("check_"):]: value for name, value in list(globals().items()) if name.startswith("check_")}


# --- faults ---

def copy_tree(to):
    for folder in ("rtl", "constraints", "scripts", "tb/flows"):
        shutil.copytree(str(ROOT / folder), str(to / folder))
    return to


def change(file, old, new):
    text = file.read_text()
    need(old in text, "{}: no '{}' to put a fault in".format(file, old))
    file.write_text(text.replace(old, new, 1))


# check that has to tell, file, what, by what, what it has to say
FAULTS = (
    ("sources", "rtl/psweep_top.core", "      - ethernet/mac_tx.vhd\n", "", "FuseSoC: files differ"),
    ("sources", "rtl/psweep.core", "      - common/ram_sdp.vhd\n      - common/ram_2r.vhd\n",
     "      - common/ram_2r.vhd\n      - common/ram_sdp.vhd\n", "FuseSoC: files differ from rtl/files.f: order"),
    ("sources", "scripts/flows/project.py", "    return files\n",
     '    return [f for f in files if f.name != "divider.vhd"]\n', "differ from rtl/files.f"),
    ("sources", "scripts/cmake/RtlModel.cmake", "list(APPEND sources ${CMAKE_SOURCE_DIR}/rtl/${line})",
     "list(INSERT sources 0 ${CMAKE_SOURCE_DIR}/rtl/${line})", "CMake: files of"),
    ("analyse", "rtl/files.f", "common/divider_mul.vhd\nengine/similarity.vhd\n",
     "engine/similarity.vhd\ncommon/divider_mul.vhd\n", "divider_mul"),
    ("analyse", "rtl/configs/engine/tile.json", '"window": 13', '"window": 12', "GHDL ends with 1"),
    ("generics", "rtl/psweep_top.core", "G_RX_SLOTS: {datatype: int, paramtype: generic, default: 2}",
     "G_RX_SLOTS: {datatype: int, paramtype: generic, default: 4}", "parameters differ from the VHDL"),
    ("generics", "rtl/psweep.core", "      - G_LANES\n", "      - G_LANE\n", "parameters of the targets differ"),
    ("ucf", "constraints/ml605/pins.ucf", 'NET "mii_crs"    LOC', 'NET "mii_csr"    LOC', "no port mii_csr"),
    ("ucf", "constraints/ml605/pins.ucf", 'LOC = "AF14"', 'LOC = "AN13"', "mii_rxd<1> and mii_rxd<0> on AN13"),
    ("ucf", "constraints/ml605/pins.ucf", 'LOC = "AF14"', 'LOC = "AI14"', "LOC AI14"),
    ("ucf", "constraints/ml605/pins.ucf", 'LOC = "AF14"', 'LOC = "AV14"', "LOC AV14"),
    ("ucf", "constraints/ml605/pins.ucf", 'NET "mii_col"    TIG;\n', "", "port mii_col has 0 constraints"),
    ("ucf", "constraints/ml605/pins.ucf", "IOSTANDARD = LVCMOS25;", "IOSTANDARD = LVCMOS33;", "IOSTANDARD LVCMOS33"),
    ("ucf", "constraints/virtex5qv/pins.ucf", "SLEW = FAST", "SLEW = QUICK", "not understood: SLEW = QUICK"),
    ("ucf", "constraints/ucf/psweep_top.ucf", 'FROM "mii_rx_clk" TO "clk"', 'FROM "mii_tx_clk" TO "clk"', "twice"),
    ("ucf", "constraints/ucf/arbiter.ucf",
     'TIMESPEC "TS_clk_to_tx" = FROM "clk" TO "tx_clk" 10 ns DATAPATHONLY;\n', "", "crossings"),
    ("ucf", "constraints/ucf/psweep_top.ucf", "BEFORE \"mii_rx_clk\"", "BEFORE \"mii_tx_clk\"", "differs from the SDC"),
    ("ucf", "constraints/ucf/psweep_top.ucf", "OUT 25 ns", "OUT 35 ns", "differs from the SDC"),
    ("sdc", "constraints/sdc/psweep_top.sdc", "mii_tx_clk clk         clk mii_tx_clk", "mii_tx_clk clk",
     "crossings differ"),
    ("sdc", "constraints/sdc/psweep_top.sdc", "set_max_delay $crossing -from", "set_max_delay 30.0 -from",
     "instead of"),
    ("sdc", "constraints/sdc/psweep_top.sdc", "mii_crs mii_col phy", "mii_crs phy", "port mii_col has 0 constraints"),
    ("sdc", "constraints/sdc/psweep.sdc", "s_pix_tlast", "s_pix_last", "no port s_pix_last"),
    ("sdc", "constraints/sdc/arbiter.sdc", "create_clock -name rx_clk", "create_clok -name rx_clk", "create_clok"),
    ("sdc", "constraints/sdc/psweep_top.sdc", "set_input_delay -clock mii_rx_clk -min 10.0 $mii_in", "",
     "without -min"),
    ("nxpython", "constraints/ng_medium/timing.py", '(rx, "clk"), ("clk", rx), (tx, "clk"), ("clk", tx)',
     '(rx, "clk"), ("clk", rx), (tx, "clk")', "crossings"),
    ("nxpython", "constraints/ng_medium/timing.py", "project.setMaxDelay(", "project.setMaximumDelay(",
     "setMaximumDelay"),
    ("nxpython", "constraints/ng_medium/timing.py", "MII_NS - 10.0", "MII_NS - 15.0", "differs from the SDC"),
    ("nxpython", "constraints/ng_medium/pads.py", '"mii_rx_er"', '"mii_rx_err"', "pads and ports differ"),
    ("nxpython", "constraints/ng_medium/pads.py", '"standard": "LVCMOS"', '"standard": "LVCMOZ"', "LVCMOZ"),
    ("nxpython", "constraints/ng_medium/pads.py", '"clk": _INPUT', '"clk": dict(_INPUT, location="IOB12_D09P")',
     "clk has location IOB12_D09P"),
    ("nxpython", "scripts/check_flows.py", "_n // 2 + 1", "_n // 4 + 1", "and mii_"),
    ("nxpython", "scripts/check_flows.py", '"IOB12": {"voltage"', '"IOB11": {"voltage"', "no voltage for the bank"),
    ("nxpython", "scripts/nxmap/nxmap.py", '"MappingEffort": "High"', '"MappingEffort": "Hihg"', "Hihg"),
    ("nxpython", "scripts/nxmap/nxmap.py", '"TimingDriven"', '"TimeDriven"', "no option TimeDriven"),
    ("nxpython", "scripts/nxmap/nxmap.py", '("async_fifo", "RAM", "DFF")', '("async_fifo", "RAM", "RAM")',
     "async_fifo must go into flip-flops"),
    ("nxpython", "scripts/nxmap/nxmap.py", 'project.setTopCellName("work", job["top"] + "_pins")',
     'project.setTopCellName(job["top"] + "_pins")', "setTopCellName"),
    ("nxpython", "scripts/nxmap/nxmap.py", 'step("route", project.route)', "project.route()", "exit code"),
    ("ise", "scripts/ise/ise.py", '("shreg_extract", "Yes")', '("shreg_extract", "Yse")', "value: -shreg_extract Yse"),
    ("ise", "scripts/ise/ise.py", '("fsm_encoding", "Auto")', '("fsm_encodings", "Auto")', "option: -fsm_encodings"),
    ("ise", "scripts/ise/ise.py", '"-w", "-detail", "-ol"', '"-w", "-details", "-ol"', "unknown option -details"),
    ("ise", "scripts/ise/ise.py", '"-top {}".format(entity)', '"-top {}".format(name + "_pin")', "no entity"),
    ("ise", "scripts/ise/ise.py", "    if code:\n", "    if code > 99:\n", "does not say 'see"),
    ("ise", "constraints/virtex5qv/board.json", "xqr5vfx130-1-cf1752", "xqr5vfx130", "part xqr5vfx130"),
    ("reports", "scripts/ise/reports.py", "r\"\\d+/(\\d+)\\Z\"", "r\"(\\d+)/\\d+\\Z\"", "instead of"),
    ("reports", "scripts/ise/reports.py", "counts[\"ram36\"] + counts[\"ram18\"] / 2", "counts[\"ram36\"]", "Virtex-6"),
    ("scripts", "scripts/ise/ise.py", "missing = [program",
     "match 1:\n            case _:\n                pass\n        missing = [program",
     "not for Python 3.8"),
    ("scripts", "constraints/ml605/board.json", '"known"', '"sure"', "board.json: pads"),
)


def faults(work):
    found = 0
    for number, (check, file, old, new, says) in enumerate(FAULTS):
        tree = copy_tree(work / "fault-{}".format(number))
        change(tree / file, old, new)
        run = subprocess.run([sys.executable, str(tree / "scripts" / "check_flows.py"), check], stdout=subprocess.PIPE,
                             stderr=subprocess.STDOUT, universal_newlines=True)
        told = run.returncode == 1 and says in run.stdout and "check-flows: {} FAILED".format(check) in run.stdout
        print("check-flows: {:3} {:9} {}: {}".format(number + 1, check, file, "told" if told else "NOT TOLD"),
              flush=True)
        if not told:
            print(run.stdout[-1500:])
        found += told
        shutil.rmtree(str(tree))
    print("check-flows: {} of {} faults told".format(found, len(FAULTS)))
    return 0 if found == len(FAULTS) else 1


# --- FuseSoC itself ---

def fusesoc(work):
    wanted = HERE / "flows" / "requirements.txt"
    venv = ROOT / "build" / "flows" / "venv"
    program = venv / "bin" / "fusesoc"
    if not (venv / "requirements.txt").is_file() or (venv / "requirements.txt").read_text() != wanted.read_text():
        print("check-flows: making {}".format(venv), flush=True)
        shutil.rmtree(str(venv), ignore_errors=True)
        call([sys.executable, "-m", "venv", venv])
        call([venv / "bin" / "python3", "-m", "pip", "install", "-q", "--disable-pip-version-check", "-r", wanted])
        shutil.copy(str(wanted), str(venv / "requirements.txt"))
    env = environment(XDG_CONFIG_HOME=work / "config", XDG_CACHE_HOME=work / "cache", XDG_DATA_HOME=work / "data")
    number = 0

    def run(target, name, *parameters, setup=(), **expected):
        out = work / "{}-{}".format(name, target)
        call([program, "--cores-root", ROOT / "rtl", "run", "--work-root", out, *setup, "--target=" + target,
              "psweep:stereo:" + name, *parameters], env=env, **expected)
        return out
    for name, top in (("engine", "psweep"), ("chip", "psweep_top")):
        run("lint", name, says="ghdl -m")
        run("lint", name, "--G_WINDOW", "9", says="-gG_WINDOW=9")
        run("lint", name, "--G_WINDOW", "8", code=1, says="simulation failed")
        run("sim", name, says="ghdl -r")
        out = run("synth", name, setup=["--setup"])
        text = "".join(p.read_text() for p in out.glob("*.tcl"))
        files = re.findall(r"^xfile add \S*?(\w+\.vhd)$", text, re.M)
        need(files == [p.name for p in project.sources(top)], "FuseSoC: files of the ISE project of {}".format(name))
        need('project set top "{}"'.format(top) in text and "G_WINDOW=13" in text,
             "FuseSoC: ISE project of {}".format(name))
        number += 5
    # A core of somebody else's that depends on the engine gets its files.
    user = work / "user"
    user.mkdir()
    (user / "user.core").write_text(
        "CAPI=2:\nname: somebody:else:user:1.0\nfilesets:\n  rtl:\n    depend: [psweep:stereo:engine]\n"
        "    files: [user.vhd]\n    file_type: vhdlSource-93\ntargets:\n  default:\n    filesets: [rtl]\n"
        "    toplevel: user\n    default_tool: ghdl\n    tools: {ghdl: {run_options: [--ieee-asserts=disable]}}\n")
    ports = [(n, d, t) for n, d, t in project.ports_of("psweep") if d == "in"]
    (user / "user.vhd").write_text(
        "library ieee;\n  use ieee.std_logic_1164.all;\nentity user is end entity;\narchitecture a of user is\nbegin\n"
        "  u : entity work.psweep port map (\n"
        + ",\n".join("    {} => {}".format(n, "'0'" if t == "std_logic" else "(others => '0')") for n, _, t in ports)
        + ");\nend architecture;\n")
    call([program, "--cores-root", ROOT / "rtl", "--cores-root", user, "run", "--work-root", work / "somebody",
          "--tool=ghdl", "somebody:else:user"], env=env, says="ghdl -r")
    print("check-flows: fusesoc: {} runs of {}".format(number + 1, call([program, "--version"]).strip()))
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    how = parser.add_mutually_exclusive_group()
    how.add_argument("--faults", action="store_true")
    how.add_argument("--fusesoc", action="store_true")
    parser.add_argument("checks", nargs="*", metavar="CHECK")
    options = parser.parse_args()
    for name in options.checks:
        if name not in CHECKS:
            parser.error("no check '{}': {}".format(name, ", ".join(CHECKS)))
    missing = [program for program in ("ghdl", "cmake", "tclsh") if shutil.which(program) is None]
    if missing:
        sys.exit("check-flows: missing: {}: run scripts/setup.sh build flows".format(", ".join(missing)))
    failed = 0
    with tempfile.TemporaryDirectory(prefix="psweep-flows-") as folder:
        work = pathlib.Path(folder)
        if options.faults or options.fusesoc:
            try:
                return (faults if options.faults else fusesoc)(work)
            except Wrong as error:
                print("check-flows: {}".format(error))
                return 1
        for name in options.checks or CHECKS:
            started = time.time()
            mine = work / name
            mine.mkdir()
            try:
                number, what = CHECKS[name](mine)
                need(number > 0, "compared nothing")
                print("check-flows: {:9} {} {}, {:.1f} s".format(name, number, what, time.time() - started), flush=True)
            except (Wrong, project.FlowError, project.CostError) as error:
                failed += 1
                print("check-flows: {} FAILED: {}".format(name, error), flush=True)
    print("check-flows: {} failed".format(failed) if failed else "check-flows: all passed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
