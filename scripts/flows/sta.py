#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Reads the SDC files with a real timing tool, OpenSTA, on gates made of the VHDL; a part of scripts/check_flows.py.

  scripts/flows/sta.py [TOP ..]      default: psweep_top, arbiter, psweep

Gates: GHDL's Verilog in a small configuration, memories cut to two words, arithmetic as an exclusive-or of its operands
(tb/flows/coarse.v), every gate 0.05 ns: who reaches whom is true, delays mean nothing. What has to come out:
  every register has a clock; inputs without a delay are those that the SDC calls asynchronous
  every end of a path has a time, but outputs without one by the SDC, and registers behind constants or such inputs
  between clk and each other clock there are paths both ways, bounded by the shorter period, and free of hold checks
  between the other two there is none
  with one crossing taken out of the SDC, or its bound changed, this would be noticed
Needs ghdl, yosys, sta (scripts/setup.sh build flows sta); a minute.
"""
import argparse
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import project  # noqa: E402

# Small: the chip as for its fastest tests, the engine likewise.
CONFIG = {"psweep_top": ("tiny_min", {}), "psweep": ("tiny", {}),
          "arbiter": ("tiny", {"G_ROW_SLOTS": 2, "G_MAP_DEPTH": 32, "G_CHUNK_BYTES": 64})}
YOSYS = """read_verilog {work}/top.v
hierarchy -check -top {top}
proc
flatten
opt_clean
techmap -map {coarse}
memory_dff
memory_collect
memory_map
opt_clean
techmap -map {coarse}
simplemap
techmap
opt_expr
opt_clean
dfflegalize -cell $_DFF_P_ x -cell $_DFF_PP1_ x
simplemap
opt_clean
write_json {work}/gates.json
"""
GATES = {"$_NOT_": ("INV", "A", "!A"), "$_AND_": ("AND2", "AB", "A*B"), "$_OR_": ("OR2", "AB", "A+B"),
         "$_XOR_": ("XOR2", "AB", "A^B"), "$_MUX_": ("MUX2", "ABS", "(A*!S)+(B*S)"), "buffer": ("BUF", "A", "A")}
REGISTERS = {"$_DFF_P_": "DFF", "$_DFF_PP1_": "DFFS"}


class StaError(Exception):
    """What does not fit."""


def need(condition, text):
    if not condition:
        raise StaError(text)


def library():
    """Liberty: gates of 0.05 ns, two flip-flops, constants."""
    def values(names, ns):
        return " ".join('{} (scalar) {{ values ("{}"); }}'.format(name, ns) for name in names)

    def arc(related, more):
        return 'timing () {{ related_pin : "{}"; {} {} {} }}'.format(
            related, more, values(("cell_rise", "cell_fall"), 0.05),
            values(("rise_transition", "fall_transition"), 0.01))

    def check(kind):
        return 'timing () {{ related_pin : "C"; timing_type : {}; {} }}'.format(
            kind, values(("rise_constraint", "fall_constraint"), 0.05))

    def pin(name, more=""):
        return "pin ({}) {{ direction : input; capacitance : 0.001; {} }}".format(name, more)
    cells = []
    for name, inputs, function in GATES.values():
        arcs = " ".join(arc(i, "timing_sense : non_unate;") for i in inputs)
        cells.append('cell ({}) {{ {} pin (Y) {{ direction : output; function : "{}"; {} }} }}'.format(
            name, " ".join(pin(i) for i in inputs), function, arcs))
    for name in REGISTERS.values():
        preset = name == "DFFS"
        parts = ['ff (IQ, IQN) {{ clocked_on : "C"; next_state : "D"; {} }}'.format('preset : "R";' if preset else ""),
                 pin("C", "clock : true;"), pin("D", check("setup_rising") + check("hold_rising"))]
        arcs = arc("C", "timing_type : rising_edge;")
        if preset:
            parts.append(pin("R", check("recovery_rising") + check("removal_rising")))
            arcs += arc("R", "timing_type : preset; timing_sense : positive_unate;")
        parts.append('pin (Q) {{ direction : output; function : "IQ"; {} }}'.format(arcs))
        cells.append("cell ({}) {{ {} }}".format(name, " ".join(parts)))
    cells += ['cell (TIE{0}) {{ pin (Y) {{ direction : output; function : "{0}"; }} }}'.format(v) for v in "01"]
    at = " ".join("{}_threshold_pct_{} : 50;".format(a, b) for a in ("input", "output") for b in ("rise", "fall"))
    at += " ".join("slew_{}_threshold_pct_{} : {};".format(a, b, n)
                   for a, n in (("lower", 20), ("upper", 80)) for b in ("rise", "fall"))
    head = 'delay_model : table_lookup; time_unit : "1ns"; voltage_unit : "1V"; current_unit : "1mA"; ' \
           "capacitive_load_unit (1, pf); nom_voltage : 1.0; nom_temperature : 25.0; nom_process : 1.0; "
    return "library (check) {{\n{}{}\n{}\n}}\n".format(head, at, "\n".join(cells))


def netlist(module, top):
    """Of Yosys' JSON: (Verilog of gates, {end of a path: its net}, function: do only constants and these inputs reach
    that net?)."""
    nets, outputs, lines, driver = {}, [], [], {}
    for name, port in module["ports"].items():
        width = len(port["bits"])
        for i, bit in enumerate(port["bits"]):
            pin = "{}[{}]".format(name, i) if width > 1 else name
            if port["direction"] == "input":
                nets[bit] = pin
            else:
                outputs.append((pin, bit))
        lines.append("  {} {}{};".format(port["direction"], "[{}:0] ".format(width - 1) if width > 1 else "", name))
    lines += ["  wire zero, one;", "  TIE0 t0 (.Y(zero));", "  TIE1 t1 (.Y(one));"]

    def net(bit):
        if isinstance(bit, str):
            return "one" if bit == "1" else "zero"
        return nets.get(bit) or "n{}".format(bit)
    ends = dict(outputs)
    for i, cell in enumerate(module["cells"].values()):
        kind, pins = cell["type"], {p: b[0] for p, b in cell["connections"].items()}
        if kind == "$scopeinfo":  # newer Yosys: names of instances
            continue
        need(kind in GATES or kind in REGISTERS, "Yosys left a cell {}".format(kind))
        lines.append("  {} u{} ({});".format(GATES[kind][0] if kind in GATES else REGISTERS[kind], i, ", ".join(
            ".{}({})".format(p, net(b)) for p, b in pins.items())))
        if kind in GATES:
            driver[pins["Y"]] = [b for p, b in pins.items() if p != "Y"]
        else:
            driver[pins["Q"]] = None
            ends.update(("u{}/{}".format(i, p), b) for p, b in pins.items() if p not in ("C", "Q"))
    lines += ["  BUF o{} (.A({}), .Y({}));".format(i, net(bit), pin) for i, (pin, bit) in enumerate(outputs)]

    def without_clock(bit, inputs):
        seen, left = set(), [bit]
        while left:
            one = left.pop()
            if isinstance(one, str) or one in seen:
                continue
            seen.add(one)
            if one in nets and one not in driver:
                if nets[one] not in inputs:
                    return False
            elif driver.get(one, None) is None:
                return False
            else:
                left += driver[one]
        return True
    text = "module {} ({});\n{}\nendmodule\n".format(top, ", ".join(module["ports"]), "\n".join(lines))
    return text, ends, without_clock


def gates(work, top):
    config, more = CONFIG[top]
    generics = dict(project.configured(top, config), **more)
    known = project.measure.generics_of(top, project.RTL)
    verilog, _ = project.measure.convert(top, {k: v for k, v in generics.items() if k in known}, project.RTL, work)
    verilog, memories = re.subn(r"(reg (?:\[\d+:0\] )?\w+)\[(\d+):0\](\s*; // memory)",
                                lambda m: "{}[{}:0]{}".format(m[1], min(int(m[2]), 1), m[3]), verilog)
    need(memories > 0, "{}: no memory in GHDL's Verilog: has its form changed?".format(top))
    (work / "top.v").write_text(verilog)
    coarse = project.ROOT / "tb" / "flows" / "coarse.v"
    (work / "gates.ys").write_text(YOSYS.format(work=work, top=top, coarse=coarse))
    run = subprocess.run(["yosys", "-q", "-s", str(work / "gates.ys")], stdout=subprocess.PIPE,
                         stderr=subprocess.STDOUT, universal_newlines=True)
    need(run.returncode == 0, "yosys: {}".format(run.stdout[-1500:]))
    module = json.loads((work / "gates.json").read_text())["modules"][top]
    text, ends, without_clock = netlist(module, top)
    (work / "gates.v").write_text(text)
    (work / "check.lib").write_text(library())
    return ends, without_clock


def sta(work, top, sdc, clocks, period):
    """Lists by check_setup, and the report of each pair of clocks."""
    pairs = [(a, b) for a in clocks for b in clocks if a != b]
    script = ["read_liberty check.lib", "read_verilog gates.v", "link_design " + top,
              "set clk_period {}".format(period), "read_sdc " + str(sdc), "check_setup -verbose"]
    for a, b in pairs:
        for kind in ("max", "min"):
            script += ['puts "== {} {} {}"'.format(a, b, kind),
                       "report_checks -digits 3 -path_delay {} -from [get_clocks {}] -to [get_clocks {}]".format(
                           kind, a, b)]
    (work / "sta.tcl").write_text("\n".join(script) + "\nexit\n")
    run = subprocess.run(["sta", "-no_splash", "-exit", "sta.tcl"], cwd=str(work), stdout=subprocess.PIPE,
                         stderr=subprocess.STDOUT, universal_newlines=True)
    need(run.returncode == 0 and "Error" not in run.stdout, "sta: {}".format(run.stdout[-1500:]))
    setup, *reports = re.split(r"^== (\w+ \w+ \w+)\n", run.stdout, flags=re.M)
    lists, current = {}, None
    for line in setup.splitlines():
        match = re.match(r"Warning: There (?:are|is) (\d+) (.+)\.\Z", line)
        if match:
            current = lists.setdefault(match[2], set())
        elif line.startswith("  ") and current is not None:
            current.add(line.strip())
        elif line.strip():
            raise StaError("sta: {}".format(line))
    return lists, dict(zip(reports[::2], reports[1::2]))


def judge(says, clocks, period, found, ends, without_clock):
    """says: .unclocked, .free of the SDC; raises StaError. Returns the number of things compared."""
    lists, reports = dict(found[0]), found[1]

    def take(what):
        return lists.pop(what, set())
    inputs = take("input ports missing set_input_delay")
    need(inputs == says.unclocked, "inputs without a delay: {}".format(sorted(inputs ^ says.unclocked)))
    outputs = {o for o in take("output ports missing set_output_delay") if not o.startswith("dbg_")}
    free = {o for o in says.free if not o.startswith("dbg_")}
    need(outputs == free, "outputs without a delay: {}".format(sorted(outputs ^ free)))
    for end in take("unconstrained endpoints"):
        need(end in free or end.startswith("dbg_") or without_clock(ends[end], says.unclocked), "no time at " + end)
    need(not lists, "sta: {}".format({name: sorted(names)[:5] for name, names in lists.items()}))
    for pair, text in reports.items():
        a, b, kind = pair.split()
        bound = re.search(r"^\s+([\d.]+)\s+[\d.]+\s+max_delay$", text, re.M)
        if kind == "max" and "clk" in (a, b):
            need(bound, "{} to {}: no bound on its paths".format(a, b))
            need(abs(float(bound[1]) - min(period, project.MII_NS)) < 0.0015, "{} to {}: bound {} ns".format(
                a, b, bound[1]))
        else:
            need("No paths found" in text, "{} to {}, {}: a path that is timed".format(a, b, kind))
    return len(ends) + len(inputs) + len(reports)


def check(top, says, period=6.024):
    """(Number of ends of paths, inputs, pairs of clocks compared, faults told). says: as of scripts/check_flows.py."""
    clocks = project.TOPS[top]["clocks"]
    sdc = project.CONSTRAINTS / "sdc" / (top + ".sdc")
    with tempfile.TemporaryDirectory(prefix="psweep-sta-") as folder:
        work = pathlib.Path(folder)
        ends, without_clock = gates(work, top)
        number = judge(says, clocks, period, sta(work, top, sdc, clocks, period), ends, without_clock)
        need(number > 100, "{}: compared {}".format(top, number))
        # Does it notice? Each change of the SDC has to be told.
        text = sdc.read_text()
        faults = [("create_clock -name clk", "# create_clock -name clk", None)]
        for clock in clocks[1:]:
            faults += [(" {} clk  ".format(clock), " ", "{} to clk".format(clock)),
                       ("clk {}\n".format(clock), "\n", "clk to {}".format(clock))]
        if len(clocks) > 1:
            faults += [("set_max_delay $crossing", "set_max_delay [expr {$crossing + 1}]", "bound"),
                       ("-hold -from", "-setup -from", "")]
        for old, new, told in faults:
            need(old in text, "{}: no '{}' to put a fault in".format(sdc, old))
            (work / "fault.sdc").write_text(text.replace(old, new, 1))
            try:
                found = sta(work, top, work / "fault.sdc", clocks, period)
                judge(says, clocks, period, found, ends, without_clock)
            except StaError as error:
                need(told is None or told in str(error), "{}: '{}' told as {}".format(top, old, error))
                continue
            raise StaError("{}: not told: '{}' became '{}'".format(top, old, new))
    return number, len(faults)


def main():
    import check_flows
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tops", nargs="*", metavar="TOP", help=", ".join(CONFIG))
    options = parser.parse_args()
    missing = [program for program in ("ghdl", "yosys", "sta", "tclsh") if shutil.which(program) is None]
    if missing:
        sys.exit("sta: missing: {}: run scripts/setup.sh build flows sta".format(", ".join(missing)))
    for top in options.tops or CONFIG:
        if top not in CONFIG:
            parser.error("no top '{}'".format(top))
        started = time.time()
        with tempfile.TemporaryDirectory() as folder:
            says, _ = check_flows.sdc(pathlib.Path(folder), top, 6.024)
        try:
            print("sta: {}: {} ends of paths, inputs, pairs of clocks; {} faults told; {:.0f} s".format(
                top, *check(top, says), time.time() - started), flush=True)
        except StaError as error:
            sys.exit("sta: {}: {}".format(top, error))


if __name__ == "__main__":
    sys.path.insert(0, str(project.ROOT / "scripts"))
    main()
