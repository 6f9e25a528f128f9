#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Builds the chip, or engine or arbiter for an estimate, with NanoXplore's tools by their Python module nxpython.

  scripts/nxmap/nxmap.py [--board B] [--top T] [--config NAME] [--out FOLDER] [option ..] [G_X=n ..]
    --board B       folder of constraints/ whose board.json has "tool": "nxmap" (default ng_medium)
    --top T         psweep_top (default): with pins; psweep, arbiter: alone, for resources and clock
    --config NAME   as for 'make cost': rtl/configs/chip for psweep_top, else rtl/configs/engine or build/configs, or
                    a row of docs/cost.md (scripts/cost/points.py); default: that of board.json for psweep_top, else
                    tile. G_X=n overrides a generic
    --mhz F         clock of psweep; psweep_top and arbiter: G_CLK_KHZ. Default: by board.json or the configuration
    --prepare       write the wrapper and the list of what is given to the tool, run nothing
    --synthesise    stop after synthesis
    --report        read the reports that are there, run nothing
    --out FOLDER    default build/nxmap/<board>-<top>-<config>

Written for nxpython of NXmap 22 and of Impulse (times in ns). Runs inside nxpython3 or nxpython, or looks for one of
them on PATH; without, everything is prepared and shown, exit code 3. A step that fails stops the flow: exit code 1.
So does timing that is not met. No bitstream is made for a board whose pads are a template, nor of engine or arbiter.
Results: result.json in the form of 'make cost' (docs/cost.md), and the same as a table.
"""
import argparse
import importlib.util
import os
import pathlib
import pprint
import shutil
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE))
sys.path.insert(0, str(HERE.parent / "flows"))

import project as flow  # noqa: E402  (the folders of these scripts, whatever the current one is)
import reports  # noqa: E402

TOOL = "NanoXplore nxpython (NXmap 22 or later, or Impulse)"
OPTIONS = {
    "MappingEffort": "High", "TimingDriven": "Yes", "DensityEffort": "Medium", "RoutingEffort": "High",
    # Memories by size into RAM blocks or register files; none is read without a clock but async_fifo's, below.
    "DefaultRAMMapping": "AUTO", "DefaultROMMapping": "AUTO", "ManageAsynchronousReadPort": "No",
    # Products, the adders behind them and the registers around them into DSP blocks.
    "DisableDSPFullRecognition": "No", "DisableDSPAluOperator": "No", "DisableDSPPreOperator": "No",
    "DisableDSPRegisters": "No",
    # Output registers into the RAM blocks.
    "DisableRAMRegisters": "No", "DisableRAMAlternateForm": "No",
    # The VHDL leaves nothing undriven: say so if it does.
    "ManageUnconnectedOutputs": "Error", "ManageUnconnectedSignals": "Error",
    "ManageUninitializedLoops": "No", "UnusedPads": "Floating",
}
# Where the tool must not choose by itself. The array of async_fifo is read without a clock, by another clock domain:
# flip-flops. With ECC (docs/cost.md says what it takes) the RAMs behind ram_sdp, ram_2r and ram_dc would be 'RAM_ECC'.
# Entity, kind, target; for those that the top contains.
MAPPING = (("async_fifo", "RAM", "DFF"),)


def load(path):
    spec = importlib.util.spec_from_file_location(path.stem, str(path))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def pads_of(top, board, settings):
    """(banks, pads) of the board; engine and arbiter have none."""
    if not flow.TOPS[top]["pads"]:
        return {}, {}
    module = load(flow.CONSTRAINTS / board / "pads.py")
    wanted = {name.replace("<", "[").replace(">", "]") for name in flow.pin_bits(top, settings)}
    if set(module.PADS) != wanted:
        raise flow.FlowError("constraints/{}/pads.py: pads and ports differ: {}".format(
            board, ", ".join(sorted(set(module.PADS) ^ wanted))))
    return module.BANKS, module.PADS


def build(nx, job, out, synthesise_only):
    """The whole flow; nx is the module nxpython. Returns the project, routed."""
    def step(name, action):
        print("nxmap: {} ..".format(name), flush=True)
        if not action():
            raise flow.FlowError("{} failed: see the logs in {}".format(name, out))
    # One folder for the project; the tool puts its logs into it.
    project = nx.createProject(str(out / "project"))
    project.setVariantName(job["part"])
    project.setTopCellName("work", job["top"] + "_pins")
    project.addFiles("work", job["files"])
    project.addParameters({name: str(value) for name, value in job["generics"].items()})
    project.setOptions(OPTIONS)
    for entity, kind, target in MAPPING:
        if str(flow.measure.read_rtl(flow.RTL).path(entity)) in job["files"]:
            project.addMappingDirective(nx.getModels("*" + entity + "*"), kind, target)
    if job["banks"]:
        project.addBanks(job["banks"])
    if job["pads"]:
        project.addPads(job["pads"])
    load(flow.CONSTRAINTS / job["board"] / "timing.py").apply(project, job["top"], job["clk_ns"], job["pads"])
    project.save(str(out / "native.nym"))
    step("synthesize", project.synthesize)
    project.save(str(out / "synthesized.nym"))
    if not synthesise_only:
        step("place", project.place)
        step("route", project.route)
        project.save(str(out / "routed.nym"))
    project.reportInstances()
    if not synthesise_only:
        analyzer = project.createAnalyzer()
        analyzer.launch({"conditions": "worstcase", "maximumSlack": 500, "searchPathsLimit": 10})
    if nx.getErrorCount():
        raise flow.FlowError("{} errors: see the logs in {}".format(nx.getErrorCount(), out))
    return project


def find(out, pattern):
    found = sorted(out.glob("**/" + pattern), key=lambda path: path.stat().st_mtime)
    if not found:
        raise flow.FlowError("no {} below {}: has the flow come so far?".format(pattern, out))
    return found[-1].read_text(errors="replace"), str(found[-1])


def report(job, question, out, synthesised_only):
    text, path = find(out, "hierarchy.json")
    counts, units = reports.hierarchy(text, flow.measure.CHIP_UNITS + (job["top"],), path)
    whole = units.pop(job["top"], None)
    if not flow.TOPS[job["top"]]["pads"]:
        if whole is None:
            raise flow.FlowError("{}: no module {}: without it the wrapper would count".format(path, job["top"]))
        counts = {key: whole[key] for key in counts}
    more = {"stage": "synthesize"}
    met = None
    if not synthesised_only:
        periods = dict.fromkeys(flow.TOPS[job["top"]]["clocks"], flow.MII_NS)
        periods["clk"] = job["clk_ns"]
        text, path = find(out, "*.timing")
        clocks, met = reports.timing(text, periods, path)
        more = {"stage": "route", "timing_met": met, "clocks": clocks}
    print(flow.write_result(out, question, counts, units, more))
    return met


def interpreter():
    return shutil.which("nxpython3") or shutil.which("nxpython")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--board", default="ng_medium")
    parser.add_argument("--top", default="psweep_top", choices=sorted(flow.TOPS))
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
    settings = flow.board(options.board, "nxmap")
    options.config = options.config or flow.config_of(settings, top)
    generics = flow.generics(top, options.config, settings, options.generics)
    out = pathlib.Path(options.out or flow.ROOT / "build" / "nxmap" / "-".join(
        [options.board, top, options.config])).resolve()
    out.mkdir(parents=True, exist_ok=True)
    wrapper = out / (top + "_pins.vhd")
    wrapper.write_text(flow.wrapper(top, settings))
    banks, pads = pads_of(top, options.board, settings)
    job = {"top": top, "board": options.board, "part": settings["part"], "generics": generics, "banks": banks,
           "pads": pads, "clk_ns": flow.clk_ns(top, generics, settings, options.mhz),
           "files": [str(f) for f in flow.sources(top)] + [str(wrapper)]}
    question = {"entity": top, "family": settings["family"], "generics": generics, "tool": TOOL,
                "part": settings["part"], "config": options.config, "board": options.board}
    project = None
    if not options.report:
        (out / "job.txt").write_text(pprint.pformat(job) + "\n")
        print("nxmap: {} for {} ({}), {} at {:.3f} ns: files in {}".format(
            top, options.board, settings["part"], options.config, job["clk_ns"], out))
        if options.prepare:
            return 0
        try:
            import nxpython as nx
        except ImportError:
            if interpreter() and "PSWEEP_NXPYTHON" not in os.environ:
                os.environ["PSWEEP_NXPYTHON"] = "1"  # once: if the module is not there either, say so below
                os.execv(interpreter(), [interpreter(), str(pathlib.Path(__file__).resolve())] + sys.argv[1:])
            print("nxmap: no Python module nxpython here, no nxpython3 or nxpython on PATH. This needs {}\n"
                  "       with a licence for {}. Nothing was run. What would be given to it: {}\n"
                  "       and then: synthesize, place, route, reportInstances, timing analysis{}".format(
                      TOOL, settings["part"], out / "job.txt",
                      ", generateBitstream" if bitstream(top, settings) else ""), file=sys.stderr)
            return 3
        project = build(nx, job, out, options.synthesise)
    met = report(job, question, out, options.synthesise)
    if met is False:
        print("nxmap: timing is not met: see the .timing files below {}; no bitstream".format(out), file=sys.stderr)
        return 1
    if project is not None and not options.synthesise:
        if bitstream(top, settings):
            bits = out / (top + ".nxb")
            project.generateBitstream(str(bits))
            if not bits.is_file():
                raise flow.FlowError("generateBitstream wrote no {}: see the logs in {}".format(bits, out))
            print("nxmap: {}".format(bits))
        else:
            print("nxmap: no bitstream: {}".format("the pads of this board are a template" if flow.TOPS[top]["pads"]
                                                   else "{} alone has no pads".format(top)))
    return 0


def bitstream(top, settings):
    return flow.TOPS[top]["pads"] and settings["pads"] == "known"


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (flow.FlowError, flow.CostError, reports.ReportError) as error:
        sys.exit("nxmap: {}".format(error))
