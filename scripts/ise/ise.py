#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Builds the chip, or engine or arbiter for an estimate, with Xilinx ISE 14.7: xst, ngdbuild, map, par, trce, bitgen.

  scripts/ise/ise.py [--board B] [--top T] [--config NAME] [--out FOLDER] [option ..] [G_X=n ..]
    --board B       folder of constraints/ whose board.json has "tool": "ise" (default virtex5qv)
    --top T         psweep_top (default): with pins; psweep, arbiter: alone, for resources and clock
    --config NAME   as for 'make cost': rtl/configs/chip for psweep_top, else rtl/configs/engine or build/configs, or
                    a row of docs/cost.md (scripts/cost/points.py); default: that of board.json for psweep_top, else
                    tile. G_X=n overrides a generic
    --mhz F         clock of psweep; psweep_top and arbiter: G_CLK_KHZ. Default: by board.json or the configuration
    --prepare       write all files, run nothing
    --synthesise    stop after xst: estimates before map
    --report        read the reports that are there, run nothing
    --out FOLDER    default build/ise/<board>-<top>-<config>

Source the settings of ISE first: its programs are looked for on PATH. Without them everything is prepared, the commands
are shown, exit code 3. A program that fails stops the flow: exit code 1 and the name of its log. So does timing that is
not met; then there are reports, but no bitstream. There is none either for a board whose pads are a template.
Results: result.json in the form of 'make cost' (docs/cost.md), and the same as a table.
"""
import argparse
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE))
sys.path.insert(0, str(HERE.parent / "flows"))

import project  # noqa: E402  (the folders of these scripts, whatever the current one is)
import reports  # noqa: E402

RELEASE = "Xilinx ISE 14.7"
# Options of xst beside the names of files, part, top and generics; all are of UG627 (Virtex-5) and UG687 (Virtex-6).
XST = (
    ("opt_mode", "Speed"), ("opt_level", "1"), ("iuc", "No"),
    ("keep_hierarchy", "No"), ("netlist_hierarchy", "Rebuilt"),  # optimised as one, names for the table of units
    ("hierarchy_separator", "/"), ("bus_delimiter", "<>"), ("case", "Maintain"),
    ("fsm_extract", "Yes"), ("fsm_encoding", "Auto"), ("ram_extract", "Yes"), ("ram_style", "Auto"),
    ("rom_extract", "Yes"), ("rom_style", "Auto"), ("shreg_extract", "Yes"), ("use_dsp48", "Auto"),
    ("resource_sharing", "Yes"), ("async_to_sync", "No"), ("register_duplication", "Yes"),
    ("register_balancing", "No"),  # would move the flip-flops of the synchronisers' neighbours
    ("equivalent_register_removal", "Yes"), ("lc", "Auto"), ("reduce_control_sets", "Auto"),
    ("iobuf", "Yes"), ("iob", "Auto"),
)


def constraints(top, board, period):
    """UCF of this top with its periods, and the pins of the board."""
    text = (project.CONSTRAINTS / "ucf" / (top + ".ucf")).read_text()
    text, clocks = re.subn(r'(TIMESPEC "TS_clk"\s*= PERIOD "clk") [\d.]+ ns', r"\g<1> {:.3f} ns".format(period), text)
    text, bounds = re.subn(r"(FROM \S+ TO \S+) [\d.]+ ns DATAPATHONLY",
                           r"\g<1> {:.3f} ns DATAPATHONLY".format(min(period, project.MII_NS)), text)
    others = len(project.TOPS[top]["clocks"]) - 1
    if clocks != 1 or bounds != 2 * others:
        raise project.FlowError("constraints/ucf/{}.ucf: {} periods of clk, {} crossings".format(top, clocks, bounds))
    if project.TOPS[top]["pads"]:
        text += "\n" + (project.CONSTRAINTS / board / "pins.ucf").read_text()
    return text


def prepare(top, board, settings, generics, period, out):
    """Writes all files; returns {program: command}."""
    out.mkdir(parents=True, exist_ok=True)
    for folder in ("xst_work", "xst_tmp"):
        (out / folder).mkdir(exist_ok=True)
    name, entity = top, top + "_pins"
    (out / (entity + ".vhd")).write_text(project.wrapper(top, settings))
    files = project.sources(top) + [out / (entity + ".vhd")]
    (out / (name + ".prj")).write_text("".join('vhdl work "{}"\n'.format(f) for f in files))
    lines = ["set -tmpdir xst_tmp", "set -xsthdpdir xst_work", "run", "-ifn {}.prj".format(name), "-ifmt mixed",
             "-ofn {}".format(name), "-ofmt NGC", "-p {}".format(settings["part"]), "-top {}".format(entity)]
    if generics:
        lines.append("-generics {{{}}}".format(" ".join("{}={}".format(*g) for g in sorted(generics.items()))))
    lines += ["-{} {}".format(*option) for option in XST]
    (out / (name + ".xst")).write_text("\n".join(lines) + "\n")
    (out / (name + ".ucf")).write_text(constraints(top, board, period))
    part = settings["part"]
    commands = {
        "xst": ["-intstyle", "xflow", "-ifn", name + ".xst", "-ofn", name + ".syr"],
        "ngdbuild": ["-intstyle", "xflow", "-dd", "ngo", "-nt", "timestamp", "-uc", name + ".ucf", "-p", part,
                     name + ".ngc", name + ".ngd"],
        # Registers beside pads go into the pads (-pr b); -detail gives the table of units.
        "map": ["-intstyle", "xflow", "-p", part, "-w", "-detail", "-ol", "high", "-pr", "b", "-o", name + "_map.ncd",
                name + ".ngd", name + ".pcf"],
        "par": ["-intstyle", "xflow", "-w", "-ol", "high", name + "_map.ncd", name + ".ncd", name + ".pcf"],
        "trce": ["-intstyle", "xflow", "-v", "3", "-n", "3", "-xml", name + ".twx", name + ".ncd", "-o", name + ".twr",
                 name + ".pcf"],
        "bitgen": ["-intstyle", "xflow", "-w", name + ".ncd", name + ".bit", name + ".pcf"],
    }
    if settings["pads"] != "known" or not project.TOPS[top]["pads"]:
        del commands["bitgen"]
    commands = {program: [program] + arguments for program, arguments in commands.items()}
    (out / "commands.sh").write_text("# In this folder, one after the other; {}.\n".format(RELEASE) + "".join(
        " ".join(shlex.quote(a) for a in command) + "\n" for command in commands.values()))
    return commands


def run(command, out):
    program = command[0]
    started = time.time()
    print("ise: {} ..".format(program), flush=True)
    log = out / (program + ".log")
    with log.open("w") as file:
        code = subprocess.call(command, cwd=str(out), stdout=file, stderr=subprocess.STDOUT)
    if code:
        tail = "".join(log.read_text(errors="replace").splitlines(True)[-15:])
        raise project.FlowError("{}{} failed ({}): see {}".format(tail, program, code, log))
    print("ise: {} {:.0f} s".format(program, time.time() - started), flush=True)


def report(question, top, out, synthesised_only):
    """Result and table; returns whether timing was met (None: not known)."""
    def text(end):
        path = out / (top + end)
        if not path.is_file():
            raise project.FlowError("no {}: has the flow come so far?".format(path))
        return path.read_text(errors="replace"), str(path)
    if synthesised_only:
        counts, mhz = reports.synthesis_report(*text(".syr"))
        table = project.write_result(out, question, counts, {}, {"stage": "xst", "estimated_mhz": mhz})
        print(table + "\nxst's estimate before placement: {} MHz".format(mhz))
        return None
    counts, rows = reports.map_report(*text("_map.mrp"))
    units = project.units_of(rows, top)
    if not units:
        raise project.FlowError("{}: Section 13 names no unit of {}".format(text("_map.mrp")[1], top))
    whole = rows.get(("u_" + top,))
    if not project.TOPS[top]["pads"]:  # without the wrapper's registers; block RAM and DSP are all of the entity
        if whole is None:
            raise project.FlowError("{}: Section 13 has no u_{}".format(text("_map.mrp")[1], top))
        counts.update({key: whole[key] for key in ("lut", "ff")})
    timing, met = reports.timing_report(*text(".twr"))
    clocks = reports.clocks(timing, project.TOPS[top]["clocks"], text(".twr")[1])
    more = {"stage": "par", "timing_met": met, "clocks": clocks, "constraints": timing}
    print(project.write_result(out, question, counts, units, more))
    for name, row in sorted(timing.items()):
        if row["errors"]:
            print("ise: {} misses {}".format(row["errors"], name))
    return met


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--board", default="virtex5qv")
    parser.add_argument("--top", default="psweep_top", choices=sorted(project.TOPS))
    parser.add_argument("--config")
    parser.add_argument("--mhz", type=float)
    parser.add_argument("--out")
    how = parser.add_mutually_exclusive_group()
    how.add_argument("--prepare", action="store_true")
    how.add_argument("--synthesise", action="store_true")
    how.add_argument("--report", action="store_true")
    parser.add_argument("generics", nargs="*", metavar="G_X=n")
    options = parser.parse_args()
    top = options.top
    settings = project.board(options.board, "ise")
    options.config = options.config or project.config_of(settings, top)
    generics = project.generics(top, options.config, settings, options.generics)
    period = project.clk_ns(top, generics, settings, options.mhz)
    out = pathlib.Path(options.out or project.ROOT / "build" / "ise" / "-".join(
        [options.board, top, options.config])).resolve()
    question = {"entity": top, "family": settings["family"], "generics": generics, "tool": RELEASE,
                "part": settings["part"], "config": options.config, "board": options.board}
    if not options.report:
        commands = prepare(top, options.board, settings, generics, period, out)
        if options.synthesise:
            commands = {"xst": commands["xst"]}
        print("ise: {} for {} ({}), {} at {:.3f} ns: files in {}".format(
            top, options.board, settings["part"], options.config, period, out))
        if options.prepare:
            return 0
        missing = [program for program in commands if shutil.which(program) is None]
        if missing:
            print("ise: not on PATH: {}. This needs {} with a licence for {};\n"
                  "     source its settings64.sh first. Nothing was run. What would run, in {}:".format(
                      ", ".join(missing), RELEASE, settings["part"], out), file=sys.stderr)
            print("".join("     {}\n".format(" ".join(c)) for c in commands.values()), end="", file=sys.stderr)
            return 3
        for program in ("xst", "ngdbuild", "map", "par", "trce"):
            if program in commands:
                run(commands[program], out)
    met = report(question, top, out, options.synthesise)
    if met is False:
        print("ise: timing is not met: see {}; no bitstream".format(out / (top + ".twr")), file=sys.stderr)
        return 1
    if options.report or options.synthesise:
        return 0
    if "bitgen" in commands:
        run(commands["bitgen"], out)
        print("ise: {}".format(out / (top + ".bit")))
    else:
        print("ise: no bitstream: {}".format("the pads of this board are a template" if project.TOPS[top]["pads"]
                                             else "{} alone has no pads".format(top)))
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (project.FlowError, project.CostError, reports.ReportError) as error:
        sys.exit("ise: {}".format(error))
