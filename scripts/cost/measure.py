#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What one entity costs in one FPGA family: LUT, FF, block RAM, DSP, carry, longest path in LUTs; as a table or JSON.

  scripts/cost/measure.py --entity E --family F [G_X=n ...]
    --entity E        an entity of rtl/files.f; generics that are not given are as by default
    --unit U          of all that, only unit U (similarity, ..) with the generics that it has there
    --config NAME     generics of rtl/configs/engine/NAME.json or build/configs/NAME.json; rtl/configs/chip/NAME.json
                      for psweep_top. G_X=n overrides one of them
    --family F        xc6v, xc5v, ecp5, ng_medium
    --hierarchy       also module by module: hierarchy is kept at the units of engine and arbiter
    --no-dsp          multipliers in LUTs
    --json FILE       everything as JSON ('-': standard output); docs/cost.md says what the fields mean
    --rtl FOLDER      another folder instead of rtl/ (with its files.f)
    --no-cache        measure anew
    --netlist FILE    writes the netlist as Verilog instead (whole, flattened), for a simulation of what is counted

VHDL is converted by GHDL, synthesised by the Yosys of the virtual environment (scripts/setup.sh cost). Debug outputs
dbg_* are left open. Results are kept in build/cost/cache, by the converted Verilog, tool, family and these scripts: the
same question again costs a second. From Python: measure(entity, family, generics, hierarchy=False, ..) -> dict.
Environment: COST_VENV names another virtual environment, COST_CACHE another cache.
"""
import argparse
import ast
import functools
import hashlib
import inspect
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.dont_write_bytecode = True
sys.path[:0] = [str(HERE), str(HERE.parent)]

import configurations  # noqa: E402
import families  # noqa: E402  (the folder of this script, whatever the current one is)
import netlist as netlists  # noqa: E402

from psweep_tools import vhdl  # noqa: E402

SCHEMA = 1
# Where --hierarchy keeps the hierarchy, as the paper's table 4 does: units of the engine, then of the arbiter.
ENGINE_UNITS = ("control", "address_generator", "storage", "interpolation", "similarity", "updating")
CHIP_UNITS = ENGINE_UNITS + ("mac_rx", "async_fifo", "packet_rx", "responder", "counters", "packet_tx", "mac_tx",
                             "row_buffer", "scheduler", "map_buffer")


class CostError(Exception):
    """Says what to do, without a trace."""


def venv():
    return pathlib.Path(os.environ.get("COST_VENV", ROOT / "build" / "cost" / "venv"))


def venv_python():
    python = venv() / "bin" / "python3"
    if not python.exists():
        raise CostError(f"no virtual environment in {venv()}: run scripts/setup.sh cost")
    return str(python)


@functools.lru_cache(maxsize=None)
def tool_version():
    run = subprocess.run([venv_python(), str(HERE / "yosys_run.py"), "--version"], capture_output=True, text=True)
    if run.returncode:
        raise CostError(f"{venv()} has no pyosys: run scripts/setup.sh cost\n{run.stderr.strip()}")
    return run.stdout.strip()


@functools.lru_cache(maxsize=None)
def read_rtl(rtl):
    return vhdl.Rtl(pathlib.Path(rtl))


def all_entities(rtl):
    return [f"{unit}.vhd" for unit in read_rtl(rtl).units]


def generics_of(entity, rtl):
    """Names of the generics of an entity, with defaults, read from its declaration."""
    try:
        return {generic.name: generic.default for generic in read_rtl(rtl).entity(entity).generics}
    except vhdl.VhdlError as error:
        raise CostError(str(error)) from None


def config_generics(entity, config, rtl):
    """Generics of a named configuration that the entity has; of psweep_top: of a chip, else of an engine."""
    known = generics_of(entity, rtl)
    kind = "chip" if entity == "psweep_top" and config in configurations.files("chip", ROOT / "build") else "engine"
    try:
        found = configurations.find(config, kind)
    except configurations.ConfigError as error:
        raise CostError(str(error)) from error
    return {generic: value for generic, value in found.generics().items() if generic in known}


def repair(verilog):
    """GHDL 2.0 writes a signed product as an unsigned one of sign-extended operands: the value is right, but it takes
    up to five DSP blocks instead of one. Says that the operands are signed; Yosys then drops the extension."""
    text, number = re.subn(r"(assign \S+ = )(?!\$signed)(\S+) \* (\S+); // smul",
                           r"\1$signed(\2) * $signed(\3); // smul", verilog)
    if "// smul" in text and re.search(r"= [^$;]*\* [^;]*; // smul", text):
        raise CostError("a signed product of a form that scripts/cost/measure.py does not know")
    return text, number


def name_registers(verilog):
    """GHDL calls a register n123_q and then assigns it to the signal of the source: gives the register the name of the
    signal, so that paths can be named. All other names of this kind get underscores at both ends, which makes them
    private for Yosys; of two public names for one net it would keep the alphabetically first."""
    def module(match):
        text = match[0]
        registers = set(re.findall(r"^  reg (?:\[\d+:0\] )?(n\d+_[oq]);$", text, re.M))
        wires = set(re.findall(r"^  wire (?:\[\d+:0\] )?(\w+);$", text, re.M))
        new = {}
        for signal, register in re.findall(r"^  assign (\w+) = (n\d+_[oq]); // \(signal\)$", text, re.M):
            if register in registers and signal in wires and register not in new:
                new[register] = signal
        taken = set(new.values())
        text = re.sub(r"^  wire (?:\[\d+:0\] )?(\w+);\n", lambda m: "" if m[1] in taken else m[0], text, flags=re.M)
        text = re.sub(r"^  assign (\w+) = (n\d+_[oq]); // \(signal\)\n",
                      lambda m: "" if new.get(m[2]) == m[1] else m[0], text, flags=re.M)
        # Declared before it is used: registers come last in GHDL's text.
        lines = [m[0] for m in re.finditer(r"^  reg (?:\[\d+:0\] )?(n\d+_[oq]);\n", text, re.M) if m[1] in new]
        for line in lines:
            text = text.replace(line, "", 1)
        head = re.match(r"module .*?\);\n", text, re.S)
        text = head[0] + "".join(lines) + text[head.end():]
        return re.sub(r"\bn\d+_[oq]\b", lambda m: new.get(m[0], f"_{m[0]}_"), text)
    return re.sub(r"^module .*?^endmodule", module, verilog, flags=re.M | re.S)


def convert(entity, generics, rtl, work):
    """VHDL to one Verilog text, by GHDL."""
    known = generics_of(entity, rtl)
    for name in generics:
        if name not in known:
            raise CostError(f"{entity} has no generic {name}: " + ", ".join(known))
    sources = [str(path) for path in read_rtl(rtl).sources(entity)]
    (work / "ghdl").mkdir()
    options = ["--std=93", f"--workdir={work}/ghdl"]

    def ghdl(*arguments):
        run = subprocess.run(["ghdl", *arguments], capture_output=True, text=True)
        if run.returncode:
            raise CostError(f"ghdl: {entity} {generics}:\n{run.stderr}")
        return run.stdout
    ghdl("-a", *options, *sources)
    verilog = ghdl("--synth", *options, "--no-formal", *[f"-g{k}={v}" for k, v in sorted(generics.items())],
                   "--out=verilog", entity)
    verilog, repaired = repair(verilog)
    # Without GHDL's /* file:line:column */, which would make every comment in the VHDL a new question.
    return name_registers(re.sub(r"^ */\*[^*]*\*/\n", "", verilog, flags=re.M)), repaired


def run_yosys(commands, work):
    with open(work / "yosys.log", "w") as log:
        run = subprocess.run([venv_python(), str(HERE / "yosys_run.py")], input="\n".join(commands), text=True,
                             stdout=log, stderr=subprocess.STDOUT)
    if run.returncode:
        tail = "".join((work / "yosys.log").read_text().splitlines(True)[-15:])
        raise CostError(f"Yosys failed ({run.returncode}):\n{tail}")


def take_unit(verilog, unit, entities):
    """(text, name) of the module of this unit, with those that it instantiates."""
    modules = {m[1]: m[0] for m in re.finditer(r"^module (\S+).*?^endmodule\n", verilog, re.M | re.S)}
    found = [m for m in modules if netlists.entity_of(m, entities) == unit]
    if not found:
        raise CostError(f"there is no {unit} in it")
    wanted = [found[0]]
    for name in wanted:
        wanted += [m for m in modules if m not in wanted and re.search(rf"^  {re.escape(m)} ", modules[name], re.M)]
    return "".join(text for name, text in modules.items() if name in wanted), found[0]


def script_hash(family):
    digest = hashlib.sha256(families.fingerprint(family).encode())
    for name in ("netlist.py", "yosys_run.py"):
        digest.update((HERE / name).read_bytes())
    digest.update(SYNTHESISE)
    return digest.hexdigest()


def measure(entity, family, generics=None, hierarchy=False, no_dsp=False, rtl=None, cache=True, units=CHIP_UNITS,
            unit=None):
    """Returns a dictionary (docs/cost.md, 'JSON'). Raises CostError."""
    rtl = pathlib.Path(rtl or ROOT / "rtl").resolve()
    generics = {k: int(v) for k, v in (generics or {}).items()}
    if family not in families.FAMILIES:
        raise CostError(f"unknown family '{family}': " + ", ".join(families.FAMILIES))
    if entity not in read_rtl(rtl).files:
        raise CostError(f"{rtl}/files.f has no {entity}.vhd")
    with tempfile.TemporaryDirectory(prefix="psweep-cost-") as folder:
        work = pathlib.Path(folder)
        verilog, repaired = convert(entity, generics, rtl, work)
        top = entity
        if unit:
            verilog, top = take_unit(verilog, unit, read_rtl(rtl).units)
        question = [verilog, top, family, hierarchy, no_dsp, list(units), tool_version(), script_hash(family)]
        key = hashlib.sha256(json.dumps(question).encode()).hexdigest()
        kept = pathlib.Path(os.environ.get("COST_CACHE", ROOT / "build" / "cost" / "cache")) / f"{key}.json"
        result = None
        if cache and kept.exists():
            try:
                result = json.loads(kept.read_text())
            except ValueError:
                result = None
        fresh = result is None
        if fresh:
            (work / "top.v").write_text(verilog)
            result = synthesise(top, family, hierarchy, no_dsp, rtl, units, work)
            result["signed_products_repaired"] = repaired
            kept.parent.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(dir=kept.parent)
            with os.fdopen(handle, "w") as file:
                json.dump(result, file)
            os.chmod(name, 0o644)
            os.replace(name, kept)
    defaults = {k: int(v) for k, v in generics_of(entity, rtl).items() if re.fullmatch(r"-?\d+", v)}
    return {"schema": SCHEMA, "entity": entity, "unit": unit, "family": family, "generics": {**defaults, **generics},
            "hierarchy": hierarchy, "no_dsp": no_dsp, "tool": tool_version(), "cached": not fresh, **result}


def netlist(entity, family, generics, rtl, path):
    """Writes the circuit whose cells are counted as Verilog, for a simulation (scripts/sim_gates.sh)."""
    rtl = pathlib.Path(rtl or ROOT / "rtl").resolve()
    with tempfile.TemporaryDirectory(prefix="psweep-cost-") as folder:
        work = pathlib.Path(folder)
        (work / "top.v").write_text(convert(entity, generics, rtl, work)[0])
        run_yosys(counted(entity, family, False, work) + [f"write_json {work}/netlist.json"], work)
        merged = json.loads((work / "netlist.json").read_text())
        netlists.merge_output_registers(merged)
        (work / "netlist.json").write_text(json.dumps(merged))
        run_yosys([f"read_json {work}/netlist.json", f"write_verilog -noattr {work}/netlist.v"], work)
        pathlib.Path(path).write_text((work / "netlist.v").read_text())


# Nobody uses a word that a RAM of these reads while it is written. The template that synthesis sees returns the old
# one, which Yosys would build around blocks that do not (ECP5, NG-MEDIUM).
UNUSED_READS = "setattr -set no_rw_check 1 ram_sdp*/m:* ram_2r*/m:*"


def source(top, work):
    return [f"read_verilog {work}/top.v", f"delete -output {top}/w:dbg_*", UNUSED_READS]


def counted(top, family, no_dsp, work, rows=()):
    """Yosys commands to the netlist whose cells are counted; rows: modules that stay as they are."""
    return (source(top, work) + [f"setattr -mod -set keep_hierarchy 1 {m}" for m in rows]
            + families.commands(family, top, no_dsp, work))


def synthesise(top, family, hierarchy, no_dsp, rtl, units, work):
    started = time.time()
    entities = [f[:-4] for f in all_entities(rtl)]
    modules = re.findall(r"^module (\S+)", (work / "top.v").read_text(), re.M)
    rows = [m for m in modules if netlists.entity_of(m, entities) in units and strip_top(m) != top] \
        if hierarchy else []
    commands = source(top, work) + [
        f"hierarchy -check -top {top}", "proc", "opt_clean", "memory -nomap", "wreduce t:$mul", "opt_clean",
        f"write_json {work}/memories.json", "new design"]
    commands += counted(top, family, no_dsp, work, rows) + [f"write_json {work}/netlist.json"]
    run_yosys(commands, work)
    found = json.loads((work / "netlist.json").read_text())
    merged = netlists.merge_output_registers(found)
    if family == "ecp5":
        merged += netlists.merge_multiplier_registers(found)
    memories, products = netlists.memories(json.loads((work / "memories.json").read_text()), top, units)
    parts = {}

    def total(module):
        cells, children = netlists.tally(found, family, module)
        whole = cells.copy()
        for child, number in children.items():
            for cell, count in total(child).items():
                whole[cell] += number * count
            parts.setdefault(netlists.entity_of(child, entities), []).extend([child] * number)
        return whole
    whole = total(top)
    counts = netlists.summary(family, whole)
    if not counts["lut"] and not counts["ff"] and not any(counts[k] for k in ("ram36", "ram18", "ram48")):
        raise CostError(f"{top}: nothing is left of it after synthesis")
    result = {"counts": counts, "cells": plain(whole), "memories": memories, "products": products,
              "memory_bits": sum(m["words"] * m["bits"] for m in memories), "registers_merged": merged}
    if family != "ecp5" and not hierarchy:
        best, histogram = netlists.longest(netlists.Levels(family, found["modules"][top]), units)
        result["levels"] = {"longest": best.pop(""), "by_unit": dict(sorted(best.items())), "histogram": histogram}
    if hierarchy:
        result["units"] = {}
        rest = netlists.tally(found, family, top)[0]
        result["units"][""] = {"instances": 1, "counts": netlists.summary(family, rest),
                               "cells": plain(rest)}
        for unit, names in parts.items():
            cells = sum((netlists.tally(found, family, n)[0] for n in names), netlists.Counter())
            row = {"instances": len(names), "counts": netlists.summary(family, cells),
                   "cells": plain(cells)}
            if family != "ecp5":
                paths = [netlists.longest(netlists.Levels(family, found["modules"][n]), ())[0][""] for n in set(names)]
                row["levels"] = max(paths, key=lambda p: (p["lut"], p["carry"]))
            result["units"][unit] = row
    result["seconds"] = round(time.time() - started, 1)
    return result


def plain(cells):
    """Primitives only, sorted."""
    return {name: number for name, number in sorted(cells.items()) if not name.startswith("$")}


# Its text when this started: a file that changes meanwhile must not name results of the old one.
SYNTHESISE = "".join(
    ast.dump(ast.parse(inspect.getsource(part))) for part in (source, counted, synthesise)).encode()


def strip_top(module):
    return netlists.strip(module)


def row_text(name, counts):
    return f"{name:20} " + " ".join(
        f"{counts[key]:>8g}" for key in ("lut", "ff", "ram36_equivalent", "ram48", "dsp", "carry", "srl", "lutram"))


HEAD_TEXT = " " * 21 + " ".join(
    f"{title:>8}" for title in ("LUT", "FF", "RAMB36", "RAMB48", "DSP", "carry", "SRL", "LUTRAM"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--entity", default="psweep")
    parser.add_argument("--family", default="xc6v", choices=families.FAMILIES)
    parser.add_argument("--unit")
    parser.add_argument("--config")
    parser.add_argument("--hierarchy", action="store_true")
    parser.add_argument("--no-dsp", action="store_true")
    parser.add_argument("--json")
    parser.add_argument("--netlist")
    parser.add_argument("--rtl")
    parser.add_argument("--no-cache", action="store_true")
    parser.add_argument("generics", nargs="*", metavar="G_X=n")
    options = parser.parse_args()
    try:
        given = {}
        if options.config:
            given = config_generics(options.entity, options.config, pathlib.Path(options.rtl or ROOT / "rtl"))
        for pair in options.generics:
            if not re.fullmatch(r"G_\w+=-?\d+", pair):
                raise CostError(f"'{pair}' is not G_X=n")
            given[pair.split("=")[0]] = int(pair.split("=")[1])
        if options.netlist:
            netlist(options.entity, options.family, given, options.rtl, options.netlist)
            return
        result = measure(options.entity, options.family, given, options.hierarchy, options.no_dsp, options.rtl,
                         not options.no_cache, unit=options.unit)
    except CostError as error:
        sys.exit(f"measure: {error}")
    if options.json:
        text = json.dumps(result, indent=1) + "\n"
        if options.json == "-":
            sys.stdout.write(text)
            return
        pathlib.Path(options.json).parent.mkdir(parents=True, exist_ok=True)
        pathlib.Path(options.json).write_text(text)
    print(f"{options.unit or options.entity} on {options.family}, {result['tool']}"
          f"{' (kept)' if result['cached'] else ''}, {result['seconds']} s")
    print(HEAD_TEXT)
    for unit, row in sorted(result.get("units", {}).items()):
        print(row_text(unit or "(between)", row["counts"]))
    print(row_text("all", result["counts"]))
    if "levels" in result:
        path = result["levels"]["longest"]
        print(f"longest path: {path['lut']} LUTs, {path['carry']} carry cells, {path['start']} -> {path['end']}")


if __name__ == "__main__":
    main()
