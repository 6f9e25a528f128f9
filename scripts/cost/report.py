#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tables of what the engine costs: per unit beside the paper's, and whole, by Yosys, in four families (make cost).

  scripts/cost/report.py                     the engines of the datasheet on Virtex-6 (some minutes)
  scripts/cost/report.py --all               every configuration and family of scripts/cost/points.py
  scripts/cost/report.py --config NAME ..    these: of points.py, rtl/configs/engine or build/configs (make config)
    --family F,..      in these families: xc6v, xc5v, ecp5, ng_medium (default xc6v)
  scripts/cost/report.py --check [--quick]   measures anew and compares with scripts/cost/baseline.json; growth fails
  scripts/cost/report.py --update            measures all and writes baseline.json, the tables of docs/cost.md and
                                             docs/datasheet.md, docs/images/cost.svg
  scripts/cost/report.py --pages [--check]   only writes (compares) the pages from baseline.json
  scripts/cost/report.py --full [FILE]       the complete tables as one page: build/cost/full.md
  scripts/cost/report.py --pnr               place and route into baseline.json and the pages (half an hour)

Everything is written to build/cost/ as JSON, with the plot cost.svg. JOBS: measurements at once. COST_PROGRAMS: folder
of shape_table and link_table (default build).

Fields of the JSON, which scripts/cost/measure.py --json writes, too:
  schema            1
  entity, unit, family, generics, hierarchy, no_dsp
                    the question; generics with those by default
  tool              Yosys and its version
  counts            lut, ff, ram36, ram18, ram36_equivalent, ram48 (NX_RAM as Yosys maps), rf, dsp, alu, carry, mux,
                    srl, lutram (cells)
  cells             primitives by name
  memories          unit, path, words, bits, reads, writes; nx_ram48, nx_ram48_ecc: blocks of NG-MEDIUM by modes
  memory_bits       sum of words x bits
  products          unit; bits of both operands and of the result; signed
  levels            longest (lut, carry, start, end), by_unit (unit of the end), histogram (LUTs: ends); flat, not ecp5
  units             with --hierarchy: counts, cells, instances, longest path of each; "" is what lies between them
  registers_merged  FF that became a block's own
  signed_products_repaired, seconds, cached
                    of this run
"""
import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import families  # noqa: E402
import measure as cost  # noqa: E402
import pnr  # noqa: E402
from points import (BITS, PAPER_ALL, PAPER_CLOCKS, PAPER_UNITS, PEERS, PNR, POINTS, SHIPPED,  # noqa: E402
                    SIZES, V5QV)

OUT = cost.ROOT / "build" / "cost"
BASELINE = cost.HERE / "baseline.json"
PAGES = [cost.ROOT / "README.md", *sorted((cost.ROOT / "docs").rglob("*.md"))]
PICTURE = cost.ROOT / "docs" / "images" / "cost.svg"
FAMILY_NAMES = {"xc6v": "Virtex-6", "xc5v": "Virtex-5", "ecp5": "ECP5", "ng_medium": "NG-MEDIUM"}
# The same RTL gives the same counts with the same tools; another GHDL writes other Verilog for the same circuit, and
# renaming a signal changes the order in which ABC sees it. So this much is not called growth: a share and a few more.
# RAM and DSP do not wander.
TOLERANCE = {"lut": (0.015, 4), "ff": (0.01, 4), "carry": (0.03, 4), "ram36_equivalent": (0, 0), "ram48": (0, 0),
             "dsp": (0, 0)}
_print = threading.Lock()


def say(text):
    with _print:
        print(f"cost: {text}", file=sys.stderr, flush=True)


def measure_point(name, point, family, hierarchy, rtl=None):
    entity = point.get("entity", "psweep")
    generics = {}
    if "config" in point:
        generics = cost.config_generics(entity, point["config"], pathlib.Path(rtl or cost.ROOT / "rtl"))
    generics.update(point.get("generics", {}))
    result = cost.measure(entity, family, generics, hierarchy, point.get("no_dsp", False), rtl, unit=point.get("unit"))
    kind = "units" if hierarchy else "flat"
    took = "kept" if result["cached"] else f"{result['seconds']} s"
    say(f"{name}, {family}, {kind}: {result['counts']['lut']} LUT ({took})")
    OUT.mkdir(parents=True, exist_ok=True)
    (OUT / f"{name}-{family}-{kind}.json").write_text(json.dumps(result, indent=1) + "\n")
    return result


def run(questions, rtl=None):
    """{(point, family, hierarchy): result} of a list of such keys, several at once."""
    jobs = int(os.environ.get("JOBS") or os.cpu_count() or 1)
    with ThreadPoolExecutor(jobs) as pool:
        futures = {q: pool.submit(measure_point, q[0], POINTS[q[0]], q[1], q[2], rtl) for q in questions}
        return {q: f.result() for q, f in futures.items()}


def short(result):
    """What the baseline keeps of a result."""
    out = {"counts": result["counts"], "generics": result["generics"], "cells": result["cells"]}
    if "levels" in result:
        out["levels"] = {"longest": result["levels"]["longest"], "by_unit": result["levels"]["by_unit"]}
    if "units" in result:
        out["units"] = {u: {k: row[k] for k in ("counts", "cells", "levels", "instances") if k in row}
                        for u, row in result["units"].items()}
    if result["family"] == "ng_medium" and "units" not in result:
        out["memories"] = result["memories"]
    return out


def run_program(name, *arguments):
    """What a program of the build prints."""
    program = pathlib.Path(os.environ.get("COST_PROGRAMS", cost.ROOT / "build")) / name
    if not program.is_file():
        raise cost.CostError(f"no {program}: run scripts/build.sh {name} (make cost does)")
    run_ = subprocess.run([str(program), *map(str, arguments)], capture_output=True, text=True)
    if run_.returncode:
        raise cost.CostError(f"{name}: {run_.stderr}")
    return run_.stdout


def clocks_of(name):
    """Clocks of the frame of a point, by the planner: shape_table of the build."""
    point = POINTS[name]
    if not point.get("tile"):
        return None
    numbers = point["tile"]
    if "pixels" in point:
        numbers += (point["pixels"], point["planes"])
    plan = json.loads(run_program("shape_table", "--tile", *numbers))
    lanes = point.get("generics", {}).get("G_LANES", 1)
    frame = {"clocks": plan["clocks"][str(lanes)], "useful": plan["useful"], "pixels": plan["pixels"],
             "planes": plan["planes"], "tiles": plan["tiles"], "lanes": lanes}
    if "link_mhz" in point:
        numbers = [point["generics"][g] for g in ("G_IMG_COLS", "G_IMG_ROWS", "G_PLANE_COLS", "G_PLANE_ROWS", "G_LANES",
                                                  "G_ROW_SLOTS", "G_MAP_DEPTH")] + [point["link_mhz"]]
        frame["link"] = json.loads(run_program("link_table", "--chip", *numbers))
    return frame


# ---- tables ---------------------------------------------------------------------------------------------------------

def num(value):
    return f"{value:g}"


def markdown(head, rows):
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head)] +
                     ["| " + " | ".join(str(c) for c in row) + " |" for row in rows])


def flat(base, name, family="xc6v"):
    return base["points"].get(name, {}).get(family, {}).get("flat")


def efficiency(frame, lut):
    return frame["useful"] / frame["clocks"] / (lut / 1000)


def mega(clocks):
    return f"{clocks / 1e6:.1f}"


def table_engines(base):
    rows = []
    paper = ["**the paper, 44-30-13-13, ISE 14.7**", *PAPER_ALL, "about 515",
             f"{base['frames']['bands']['useful'] / PAPER_CLOCKS / PAPER_ALL[0] * 1000:.2f}"]
    for name, point in POINTS.items():
        found = flat(base, name)
        if not found or name in [f"{g}_{v}" for g, vs in BITS.items() for v in vs] or "unit" in point:
            continue
        c, frame = found["counts"], base["frames"].get(name)
        title = point["title"] + ("; the paper's arbiter: 3K LUT, 55 RAMB36" if name == "arbiter_double" else "") + \
            ("; the paper: 12.6K LUT" if point.get("no_dsp") else "")
        rows.append([title, c["lut"], c["ff"], num(c["ram36_equivalent"]), c["dsp"],
                     mega(frame["clocks"]) if frame else "",
                     f"{efficiency(frame, c['lut']):.2f}" if frame and point.get("entity") is None else ""])
        if name == "bands":
            rows.append(paper)
    return markdown(["Virtex-6 (xc6v)", "LUT", "FF", "RAMB36", "DSP48E1", "M clocks", "efficiency"], rows)


def table_units(base, family="xc6v"):
    found = base["points"]["bands"][family]["units"]
    head = ["44-30-13-13", "LUT", "paper", "FF", "paper", "RAMB36", "paper", "DSP", "paper"]
    rows = []
    for unit, paper in PAPER_UNITS.items():
        c = found["units"][unit]["counts"]
        ours = (c["lut"], c["ff"], num(c["ram36_equivalent"]), c["dsp"])
        rows.append([unit] + [x for pair in zip(ours, paper) for x in pair])
    rest = found["units"][""]["counts"]
    rows.append(["between them", rest["lut"], "", rest["ff"], "", num(rest["ram36_equivalent"]), "", rest["dsp"], ""])
    whole = flat(base, "bands", family)["counts"]
    for title, c in (("all, hierarchy kept", found["counts"]), ("**all, flat**", whole)):
        ours = (c["lut"], c["ff"], num(c["ram36_equivalent"]), c["dsp"])
        rows.append([title] + [x for pair in zip(ours, PAPER_ALL) for x in pair])
    return markdown(head, rows)


def table_cells(base):
    found = base["points"]["bands"]["xc6v"]["units"]["units"]
    kinds = ["INV"] + [f"LUT{n}" for n in range(2, 7)]
    rows = []
    for unit in [*PAPER_UNITS, ""]:
        cells, c = found[unit]["cells"], found[unit]["counts"]
        rows.append([unit or "between them"] + [cells.get(k, 0) for k in kinds] +
                    [c["srl"], c["lutram"], c["carry"], c["mux"], c["ram36"], c["ram18"]])
    return markdown(["xc6v, bands", *kinds, "SRL", "LUT RAM", "CARRY4", "MUXF", "RAMB36E1", "RAMB18E1"], rows)


def nx_rows(memories):
    """Blocks of memories that are no register files."""
    blocks = [m for m in memories if m["words"] > 64]
    return sum(m["nx_ram48"] for m in blocks), sum(m["nx_ram48_ecc"] for m in blocks)


def table_families(base, complete=False):
    rows = []
    for name, point in POINTS.items():
        for family in families.FAMILIES:
            found = flat(base, name, family)
            if not found or family == "xc6v" and len(base["points"][name]) == 1 or name.startswith("G_"):
                continue
            c = found["counts"]
            if not complete and (name == "tile_split" or point["title"].startswith("unit ")):
                continue
            ram = num(c["ram36_equivalent"]) + " RAMB36"
            if family == "ng_medium":
                ram = f"{nx_rows(found['memories'])[0]} RAMB48"
                if complete:
                    ram += f" by modes, {c['ram48']} by Yosys"
            if family == "ecp5":
                ram = f"{c['ram18']} DP16KD"
            rows.append([point["title"], FAMILY_NAMES[family], c["lut"], c["ff"], ram, c["dsp"]])
            if complete:
                rows[-1] += [c["carry"], c["srl"] or "", c["lutram"] or c["rf"] or ""]
    return markdown(["", "family", "LUT", "FF", "RAM", "DSP"] + (
        ["carry", "SRL", "LUT RAM or RF"] if complete else []), rows)


# Engines whose longest paths are told: one, two and four lanes.
LEVELS = ("bands", "tile", "tile_2", "tile_4")


def table_levels(base):
    """Most LUTs on a path that ends in each unit."""
    rows = []
    for name, family in (("bands", "xc6v"), ("bands", "xc5v"), *((name, "xc6v") for name in LEVELS if name != "bands")):
        found = flat(base, name, family)["levels"]["by_unit"]
        rows.append([POINTS[name]["title"].split(" (")[0].split(":")[0], FAMILY_NAMES[family],
                     *(found[unit]["lut"] for unit in PAPER_UNITS)])
    return markdown(["LUTs on the longest path", "family", *PAPER_UNITS], rows)


def table_paths(base):
    rows = []
    for name, family in (("bands", "xc6v"), ("bands", "xc5v"), *((name, "xc6v") for name in LEVELS if name != "bands")):
        found = flat(base, name, family)["levels"]["by_unit"]
        for unit in PAPER_UNITS:
            path = found[unit]
            rows.append([POINTS[name]["title"].split(" (")[0], family, f"{unit}",
                         f"**{path['lut']}**" if path["lut"] > 5 else path["lut"], path["carry"],
                         f"`{tidy(path['start'])}`", f"`{tidy(path['end'])}`"])
    return markdown(["engine", "family", "unit of the end", "LUTs", "carry", "from", "to"], rows)


def tidy(name):
    name = re.sub(r"^dsp (?:.*u_)?(\w+)\.$", r"a DSP of \1", name)
    return re.sub(r"^(ram36|ram18|srl|dsp|lutram) ", r"\1: ", name.replace("g_address_n1_u_", "").replace(
        "g_similarity_n1_u_", ""))


def table_five(base):
    rows = [[who, ram, pds, eff, "", source] for who, ram, pds, eff, source in PEERS]
    for name in ("bands", "tile", "tile_2", "tile_4", "tile_4_mul", "mbit", "integer"):
        c, frame = flat(base, name)["counts"], base["frames"][name]
        seconds = frame["clocks"] / 300e6
        pds = frame["pixels"] ** 2 * frame["planes"] / seconds
        rows.append([f"ours: {POINTS[name]['title']}", f"{num(c['ram36_equivalent'])} / {c['lut'] / 1000:.1f}K",
                     f"{pds / 1e6:,.0f} M", f"{pds / c['lut'] / 1000:.0f}K", f"{1 / seconds:.2f}", "table above"])
    return markdown(["", "RAMB36 / LUT", "PDS", "PDS / LUT", "frames a second", "source"], rows)


def table_bits(base):
    start = flat(base, "tile")["counts"]
    rows = []
    for generic, values in BITS.items():
        for value in values:
            c = start if value == SHIPPED[generic] else flat(base, f"{generic}_{value}")["counts"]
            rows.append([generic, f"**{value}**" if value == SHIPPED[generic] else value, c["lut"], c["ff"],
                         num(c["ram36_equivalent"]), c["dsp"], f"{c['lut'] - start['lut']:+d}",
                         f"{c['ff'] - start['ff']:+d}"])
    return markdown(["`tile`, xc6v", "bits", "LUT", "FF", "RAMB36", "DSP", "LUT more", "FF more"], rows)


def table_headline(base):
    """docs/datasheet.md: engines and chip beside the paper's."""
    rows = []
    for name, title in (("bands", "44-30-13-13, one plane at once"), ("tile", "256 x 130 tiles, one"),
                        ("tile_2", "256 x 130 tiles, two"), ("tile_4", "256 x 130 tiles, four"),
                        ("tile_4_mul", "four, division in DSP slices (`G_DIVIDER`)"),
                        ("tile_rectified", "one, rectified pairs only (`G_RECTIFIED`)"),
                        ("mbit", "117 x 93 tiles, one"),
                        ("integer", "1950 x 1950 pixels, 128 integer depths, rectified, two")):
        c, frame = flat(base, name)["counts"], base["frames"][name]
        rows.append([title, f"{c['lut']:,}", f"{c['ff']:,}", num(c["ram36_equivalent"]), c["dsp"],
                     mega(frame["clocks"]), f"{efficiency(frame, c['lut']):.2f}"])
        if name == "bands":
            lut, ff, ram, dsp = PAPER_ALL
            rows.append(["the paper's, 44-30-13-13 (ISE 14.7)", f"{lut:,}", f"{ff:,}", ram, dsp,
                         f"{PAPER_CLOCKS / 1e6:.0f}",
                         f"{frame['useful'] / PAPER_CLOCKS / (lut / 1000):.2f}"])
    for name, title in (("arbiter", "MAC, stack, arbiter, smallest buffers (the paper's: 3K LUT)"),
                        ("arbiter_double", "the same, both buffers of 44-30-13-13 (the paper's: 3K LUT, 55 RAMB36)"),
                        ("chip", "whole chip, 256 x 130 tiles, one lane")):
        c = flat(base, name)["counts"]
        rows.append([title, f"{c['lut']:,}", f"{c['ff']:,}", num(c["ram36_equivalent"]), c["dsp"], "", ""])
    return markdown(["Virtex-6", "LUT", "FF", "RAMB36", "DSP", "M clocks", "efficiency"], rows)


def table_changes(base):
    """docs/psweep.md: one generic of `tile` changed."""
    start, rows = flat(base, "tile")["counts"], []
    changes = [(g, old, new, f"{g}_{new}") for g, (old, values) in SIZES.items() for new in values]
    changes += [(g, SHIPPED[g], new, f"{g}_{new}") for g, values in BITS.items() for new in values
                if new == max(values)]
    changes += [("G_LANES", 1, 2, "tile_2"), ("G_LANES", 1, 4, "tile_4"), ("G_RECTIFIED", 0, 1, "tile_rectified"),
                ("G_DIVIDER", 0, 1, "tile_mul"), ("G_SPLIT", 0, 1, "tile_split")]
    for generic, old, new, name in changes:
        c = flat(base, name)["counts"]
        rows.append([generic, old, new, *(f"{c[k] - start[k]:+g}" for k in ("lut", "ff", "ram36_equivalent", "dsp"))])
    head = markdown(["changed", "from", "to", "LUT", "FF", "RAMB36", "DSP"], rows)
    return (f"`tile`: {start['lut']} LUT, {start['ff']} FF, {num(start['ram36_equivalent'])} RAMB36, {start['dsp']} "
            f"DSP48E1.\n\n{head}")


def table_nx(base):
    """Blocks by unit."""
    units = {}
    for m in flat(base, "chip_ng", "ng_medium")["memories"]:
        if m["words"] > 64:
            units.setdefault(m["unit"] or "frames of packet_tx", []).append(m)
    rows = [[unit, sum(m["nx_ram48"] for m in ms), sum(m["nx_ram48_ecc"] for m in ms)] for unit, ms in units.items()]
    return markdown(["unit", "RAMB48 without ECC", "with ECC"],
                    [*rows, ["all", *nx_rows(flat(base, "chip_ng", "ng_medium")["memories"])]])


def table_nx_rams(base):
    rows, groups = [], {}
    for m in flat(base, "chip_ng", "ng_medium")["memories"]:
        name = re.sub(r"_?\d+$", "", re.sub(r"^(.*_)?u_", "", m["path"].split(".")[-1]))
        groups.setdefault((m["unit"], name, m["words"], m["bits"], m["reads"]), []).append(m)
    for (unit, name, words, bits, reads), ms in groups.items():
        small = words <= 64
        rows.append([unit or "arbiter", name, len(ms), f"{words} x {bits}", reads,
                     "register file" if small else len(ms) * ms[0]["nx_ram48"],
                     "register file" if small else len(ms) * ms[0]["nx_ram48_ecc"]])
    total = nx_rows(flat(base, "chip_ng", "ng_medium")["memories"])
    rows.append(["**all**", "", "", "", "", f"**{total[0]}**", f"**{total[1]}**"])
    return markdown(["unit", "memory", "number", "words x bits", "read ports", "RAMB48 without ECC", "with ECC"], rows)


def table_targets(base):
    def verdict(good):
        return "met" if good else "**missed**"

    rows = []

    def row(what, target, value, good):
        rows.append([what, target, value, verdict(good)])
    c = flat(base, "bands")["counts"]
    row("one lane, 44-30-13-13, xc6v", "2,800 LUT, 3,000 FF, 84 RAMB36, 16 DSP",
        f"{c['lut']:,} LUT, {c['ff']:,} FF, {num(c['ram36_equivalent'])} RAMB36, {c['dsp']} DSP",
        c["lut"] <= 2800 and c["ff"] <= 3000 and c["ram36_equivalent"] <= 84 and c["dsp"] <= 16)
    c, t = flat(base, "similarity")["counts"], flat(base, "similarity_tile")["counts"]
    row("similarity alone, xc6v", "1,000 LUT, 10 DSP, 11 RAMB36; 4 RAMB36 on 256 x 130",
        f"{c['lut']:,} LUT, {c['dsp']} DSP, {num(c['ram36_equivalent'])} RAMB36; {num(t['ram36_equivalent'])} RAMB36",
        c["lut"] <= 1000 and c["dsp"] <= 10 and c["ram36_equivalent"] <= 11 and t["ram36_equivalent"] <= 4)
    for name, target, prize in (("tile_2", 0.38, 0.6), ("tile_4", 0.5, 1.0)):
        found = [(efficiency(base["frames"][n], flat(base, n)["counts"]["lut"]), flat(base, n)["counts"])
                 for n in (name, f"{name}_mul")]
        row(f"efficiency, {base['frames'][name]['lanes']} lanes, 256 x 130", f"{target} (prize {prize})",
            "; with `G_DIVIDER` = 1 ".join(f"{v:.3f} with {c['lut']:,} LUT, {c['dsp']} DSP" for v, c in found),
            max(v for v, _ in found) >= target)
    found = flat(base, "chip_ng", "ng_medium")
    c, blocks = found["counts"], nx_rows(found["memories"])[0]
    sweep, link = base["frames"]["chip_ng"]["clocks"], base["frames"]["chip_ng"]["link"]
    row("one NG-MEDIUM: chip, two lanes",
        "56 RAMB48 by modes, 26K LUT, 26K FF, 112 DSP, 220 M clocks, 0.6 s waiting for the link",
        f"{blocks} RAMB48 by modes ({c['ram48']} by Yosys), {c['lut']:,} LUT, {c['ff']:,} FF, {c['dsp']} DSP, "
        f"{mega(sweep)} M clocks, {link['wait']:.2f} s at {link['mhz']} MHz", blocks <= 56 and c["lut"] <= 26000
        and c["ff"] <= 26000 and c["dsp"] <= 112 and sweep <= 220e6 and link["wait"] <= 0.6)
    c, frame = flat(base, "chip_v5qv", "xc5v")["counts"], base["frames"]["chip_v5qv"]
    shares = [c["lut"] / V5QV["lut"], c["ram36_equivalent"] / V5QV["ram"], c["dsp"] / V5QV["dsp"]]
    row("one Virtex-5QV: chip, four lanes, both buffers", "60 % of LUT, RAM, DSP; 115 M clocks",
        f"{c['lut']:,} LUT ({shares[0]:.0%}), {num(c['ram36_equivalent'])} RAMB36 ({shares[1]:.0%}), {c['dsp']} DSP "
        f"({shares[2]:.0%}), {mega(frame['clocks'])} M clocks".replace("%", " %"),
        max(shares) <= 0.6 and frame["clocks"] <= 115e6)
    for name in LEVELS:
        levels = flat(base, name)["levels"]
        worst = levels["longest"]["lut"]
        over = [u for u, p in levels["by_unit"].items() if p["lut"] > 5]
        row(f"LUTs on a path, xc6v, {POINTS[name]['title'].split(':')[0].split(' (')[0]}", "5",
            f"{worst}" + (": " + ", ".join(over) if over else ""), worst <= 5)
    for name, (title, _) in PNR.items():
        two = base.get("pnr", {}).get(name)
        if two and "two lanes" in title:
            row(f"ECP5-85, speed 8, {title}, placed and routed", "150 MHz",
                f"{two['best']:.1f} MHz (best), {two['median']:.1f} (median of {len(two['mhz'])})",
                two["median"] >= 150)
    return markdown(["what", "target", "measured", ""], rows)


def table_pnr(base):
    rows = []
    for name in PNR:  # units: complete tables
        r = base.get("pnr", {}).get(name)
        if r:
            rows.append([PNR[name][0], f"{r['best']:.1f}", f"{r['median']:.1f}",
                         *(r["used"].get(k, 0) for k in ("TRELLIS_COMB", "TRELLIS_FF", "DP16KD", "MULT18X18D"))])
    return markdown(["ECP5-85, speed 8", "best, MHz", "median", "LUT4", "FF", "DP16KD", "MULT18"], rows)


def table_pnr_full(base):
    order = [*cost.ENGINE_UNITS, *PNR]
    return pnr.table({name: base["pnr"][name] for name in order if name in base.get("pnr", {})})


def row_of(base, title, name, clocks=True):
    c, frame = flat(base, name)["counts"], base["frames"].get(name)
    return [title, c["lut"], c["ff"], num(c["ram36_equivalent"]), c["dsp"],
            mega(frame["clocks"]) if frame and clocks else ""]


COUNTS = ["LUT", "FF", "RAMB36", "DSP"]


def table_decisions(base):
    """Alternatives of docs/architecture.md, and units beside the paper's."""
    def times(number, title):
        c = flat(base, "tile")["counts"]
        return [title, *(num(number * c[k]) for k in ("lut", "ff", "ram36_equivalent", "dsp")), ""]
    rows = [times(2, "two engines"), times(4, "four engines"),
            row_of(base, "similarity of the bands, rows of 1104 samples", "similarity"),
            ["the paper's similarity", *PAPER_UNITS["similarity"], ""],
            row_of(base, "similarity of `tile`, rows of 268 samples", "similarity_tile"),
            row_of(base, "divider of 16 bits, 13 bits of quotient", "entity_divider"),
            row_of(base, "divider in products, 13 bits of quotient", "entity_divider_mul")]
    return markdown(["Virtex-6", *COUNTS], [row[:5] for row in rows])


def table_rectified(base):
    """docs/psweep.md."""
    return markdown(["Virtex-6", *COUNTS, "M clocks"],
                    [row_of(base, "`tile`", "tile"), row_of(base, "`tile`, rectified", "tile_rectified")])


def table_division(base):
    """docs/psweep.md."""
    return markdown(["Virtex-6", *COUNTS, "M clocks"], [
        row_of(base, f"`tile`, {lanes}" + (", `G_DIVIDER` = 1" if mul else ""), name + ("_mul" if mul else ""))
        for name, lanes in (("tile", "one lane"), ("tile_2", "two lanes"), ("tile_4", "four lanes"))
        for mul in (False, True)])


def table_arbiter(base):
    """docs/arbiter.md; its entities have a line in their own pages."""
    rows = [row_of(base, "default generics", "entity_arbiter", False)[:5],
            row_of(base, "both buffers of 44-30-13-13", "arbiter_double", False)[:5],
            row_of(base, "smallest buffers: G_ROW_SLOTS = 2, G_MAP_DEPTH = 704", "arbiter", False)[:5],
            ["the paper's arbiter (section 5.4, Virtex-5QV, ISE 14.7)", 3000, "", 55, ""]]
    return markdown(["`arbiter`, flat", *COUNTS], rows)


TABLES = {"units": table_units, "families": table_families,
          "pnr": table_pnr, "changes": table_changes,
          "headline": table_headline, "rectified": table_rectified,
          "division": table_division, "arbiter": table_arbiter}
# Too long for the pages: --full.
COMPLETE = {"Targets": table_targets, "Engines and entities": table_engines, "Cost of each bit": table_bits,
            "Beside the paper's table 5 (PDS: pixels x disparities a second, at 300 MHz)": table_five,
            "Cells of each unit": table_cells, "All families": lambda base: table_families(base, True),
            "Longest paths by unit": table_levels, "Longest paths": table_paths, "Placed and routed": table_pnr_full,
            "What was decided against": table_decisions,
            "NG-MEDIUM: memories by unit": table_nx, "NG-MEDIUM: every memory": table_nx_rams}


def full(base):
    """The complete tables as one page."""
    parts = ["# Complete tables of cost", "Written from `scripts/cost/baseline.json`."]
    for title, make in COMPLETE.items():
        parts += [f"## {title}", make(base)]
    return "\n\n".join(parts) + "\n"


def cost_line(base, entity):
    """Of the page of an entity."""
    found = flat(base, f"entity_{entity}")
    if found is None:
        raise cost.CostError(f"{entity} is not in baseline.json: scripts/cost/report.py --update")
    c = found["counts"]
    parts = [f"{c['lut']} LUT", f"{c['ff']} FF"]
    parts += [f"{num(c['ram36_equivalent'])} RAMB36"] if c["ram36_equivalent"] else []
    parts += [f"{c['dsp']} DSP48E1"] if c["dsp"] else []
    return f"| cost | {', '.join(parts)} (Yosys, xc6v, generics as by default)"


def pages(base, check):
    """Puts tables between their markers, costs into the pages of the entities; with check only compares. Number of
    tables found."""
    number, lines, wrong = 0, 0, []
    for page in PAGES:
        text = page.read_text()

        def fill(match):
            nonlocal number
            number += 1
            if match[1] not in TABLES:
                raise cost.CostError(f"{page.name}: no table '{match[1]}'")
            return f"<!-- cost: {match[1]} -->\n{TABLES[match[1]](base)}\n<!-- /cost -->"

        def line(match):
            nonlocal lines
            lines += 1
            return cost_line(base, page.stem) + match[1]
        new = re.sub(r"<!-- cost: (\w+) -->\n.*?<!-- /cost -->", fill, text, flags=re.S)
        new = re.sub(r"^\| cost \| .*?\(Yosys, xc6v, generics as by default\)(.*\|)$", line, new, flags=re.M)
        if new != text:
            wrong.append(page.name)
            if not check:
                page.write_text(new)
    if number < len(TABLES):
        raise cost.CostError(f"only {number} tables in the pages, there should be {len(TABLES)}")
    missing = [name for name in base["points"] if name.startswith("entity_")]
    if lines < len(missing):
        raise cost.CostError(f"only {lines} of {len(missing)} pages of entities have a line 'cost'")
    if check and wrong:
        raise cost.CostError(f"tables of {', '.join(wrong)} are not those of baseline.json: "
                             "scripts/cost/report.py --pages writes them")
    return number


def plot(units, whole, path):
    """Bars: units of the engine beside the paper's."""
    data = []
    for unit, paper in {**PAPER_UNITS, "all": PAPER_ALL}.items():
        c = whole["counts"] if unit == "all" else units["units"][unit]["counts"]
        data.append(" ".join(str(v) for v in (
            unit.replace("address_generator", "address").replace("interpolation", "interpol."),
            c["lut"], paper[0], c["ff"], paper[1], c["ram36_equivalent"], paper[2], c["dsp"], paper[3])))
    script = """set terminal svg size 900,560 font 'sans-serif,13' background rgb 'white'
set output '%s'
$data << EOD
%s
EOD
set multiplot layout 2,2 title '44-30-13-13 on Virtex-6: ours (Yosys; all: flat) and the paper (ISE 14.7)'
set style data histograms
set style histogram clustered gap 1
set style fill solid 0.9 noborder
set xtics rotate by -30 nomirror
set ytics nomirror
set grid ytics
set yrange [0:*]
set key top left
""" % (path, "\n".join(data))
    for n, title in enumerate(("LUT", "FF", "RAMB36", "DSP")):
        script += (f"set title '{title}'\nplot $data using {2 * n + 2}:xtic(1) lc rgb '#1f5fa8' title 'ours', "
                   f"'' using {2 * n + 3} lc rgb '#b35900' title 'the paper'\n")
    done = subprocess.run(["gnuplot"], input=script, text=True, capture_output=True)
    if done.returncode:
        raise cost.CostError(f"gnuplot: {done.stderr}")
    text = re.sub(r" +$", "", path.read_text().replace("\t", "  "), flags=re.M).rstrip("\n") + "\n"
    path.write_text(text)


# ---- baseline -------------------------------------------------------------------------------------------------------

def all_questions(quick=False):
    for name, point in POINTS.items():
        for family in point.get("quick", ()) if quick else point["flat"]:
            yield name, family, False
        for family in () if quick else point.get("units", ()):
            yield name, family, True


def ghdl_version():
    return subprocess.run(["ghdl", "--version"], capture_output=True, text=True).stdout.splitlines()[0]


def baseline():
    if not BASELINE.exists():
        raise cost.CostError("no scripts/cost/baseline.json: scripts/cost/report.py --update makes it")
    return json.loads(BASELINE.read_text())


def collect(results, base):
    for (name, family, hierarchy), result in results.items():
        base["points"].setdefault(name, {}).setdefault(family, {})["units" if hierarchy else "flat"] = short(result)


def pack(items, width=100):
    """Items joined to lines of about this width; an item is never broken."""
    lines = [""]
    for item in items:
        if lines[-1] and len(lines[-1]) + len(item) > width:
            lines.append("")
        lines[-1] += (" " if lines[-1] else "") + item
    return "\n".join(lines)


def write_baseline(base):
    text = json.dumps(base, indent=0, sort_keys=True)
    # Innermost objects on few lines: a change is a line.
    text = re.sub(r"\{\n([^{}\[\]]*?)\n\}", lambda m: "{" + pack(m[1].split("\n")) + "}", text)
    assert json.loads(text) == json.loads(json.dumps(base))
    BASELINE.write_text(text + "\n")


def compare(base, results, rtl):
    """Number of counts compared; prints what differs. Growth and shrinkage apart."""
    grown, shrunk, number = [], [], 0
    for (name, family, hierarchy), result in results.items():
        kept = base["points"].get(name, {}).get(family, {}).get("units" if hierarchy else "flat")
        if kept is None:
            raise cost.CostError(f"{name}, {family} is not in baseline.json: scripts/cost/report.py --update")
        rows = [("", kept["counts"], result["counts"])]
        rows += [(unit, row["counts"], result["units"].get(unit, {}).get("counts"))
                 for unit, row in kept.get("units", {}).items()]
        for unit, old, new in rows:
            if new is None:
                raise cost.CostError(f"{name}, {family}: there is no {unit} any more: scripts/cost/report.py --update")
            for key, (share, few) in TOLERANCE.items():
                number += 1
                slack = old[key] * share + few
                text = f"{name}, {family}{', ' + unit if unit else ''}: {key} {num(old[key])} -> {num(new[key])}"
                if new[key] > old[key] + slack:
                    grown.append(text)
                elif new[key] < old[key] - slack:
                    shrunk.append(text)
    for text in grown:
        print("grown:  " + text)
    for text in shrunk:
        print("shrunk: " + text)
    return number, grown, shrunk


# ---- command line ---------------------------------------------------------------------------------------------------

def check(quick, rtl):
    base = baseline()
    if quick and not (cost.venv() / "bin" / "python3").exists():
        print("SKIPPED: no Yosys of a known version: scripts/setup.sh cost")
        return False
    if base["tool"] != cost.tool_version():
        raise cost.CostError(f"baseline.json is of {base['tool']}, this is {cost.tool_version()}")
    number, grown, shrunk = compare(base, run(list(all_questions(quick)), rtl), rtl)
    if not number:
        raise cost.CostError("nothing was compared")
    if ghdl_version() != base["ghdl"]:
        print(f"The baseline was converted by {base['ghdl']}, this is {ghdl_version()}.")
    print(f"cost-check: {number} counts compared, {len(grown)} grown, {len(shrunk)} shrunk")
    if grown or shrunk:
        print("If this is meant: make cost-update writes baseline, tables and picture.")
    return bool(grown) or bool(shrunk) and not quick


def update(rtl):
    base = baseline() if BASELINE.exists() else {}
    new = {"schema": cost.SCHEMA, "tool": cost.tool_version(), "ghdl": ghdl_version(), "points": {},
           "frames": {}, "pnr": base.get("pnr", {})}
    collect(run(list(all_questions()), rtl), new)
    frames = {name: clocks_of(name) for name in POINTS if not name.startswith(("G_", "entity_"))}
    new["frames"] = {name: frame for name, frame in frames.items() if frame}
    write_baseline(new)
    plot(new["points"]["bands"]["xc6v"]["units"], flat(new, "bands"), PICTURE)
    number = pages(baseline(), False)
    print(f"wrote {BASELINE.relative_to(cost.ROOT)}, {PICTURE.relative_to(cost.ROOT)}, {number} tables")


def route(rtl):
    base = baseline()
    seeds, tile = (1, 2, 3), cost.config_generics("psweep", "tile", cost.ROOT / "rtl")
    jobs = int(os.environ.get("JOBS") or os.cpu_count() or 1)
    base["pnr"] = {}
    questions = [(unit, {"G_SPLIT": 1}, unit) for unit in cost.ENGINE_UNITS]
    questions += [(name, generics, None) for name, (_, generics) in PNR.items()]
    for name, generics, unit in questions:
        base["pnr"][name] = pnr.run_seeds("psweep", {**tile, **generics}, seeds, 200, rtl, jobs, unit)
        write_baseline(base)  # what is there, is there
    print(f"wrote {BASELINE.relative_to(cost.ROOT)}, {pages(baseline(), False)} tables")


def show(results):
    """What was measured, as tables: units beside the paper's, then the whole ones."""
    for (name, family, hierarchy), result in results.items():
        if not hierarchy:
            continue
        print(f"\n{name}, {FAMILY_NAMES[family]}, hierarchy kept; the paper's row (44-30-13-13, Virtex-6) under each\n")
        print(cost.HEAD_TEXT)
        for unit, row in result["units"].items():
            print(cost.row_text(unit or "(between)", row["counts"]))
            if unit in PAPER_UNITS and POINTS[name].get("entity", "psweep") == "psweep":
                lut, ff, ram, dsp = PAPER_UNITS[unit]
                print(f"{'  the paper':20} {lut:>8} {ff:>8} {ram:>8} {'':8} {dsp:>8}")
        print(cost.row_text("all", result["counts"]))
        if POINTS[name].get("entity", "psweep") == "psweep":
            lut, ff, ram, dsp = PAPER_ALL
            print(f"{'  the paper':20} {lut:>8} {ff:>8} {ram:>8} {'':8} {dsp:>8}")
        sizes = sorted(k for k in result["cells"] if re.match(r"LUT|NX_LUT|INV|SRL|RAM\d", k))
        print("\nLUT by size\n\n" + markdown(["", *sizes], [
            [unit or "(between)"] + [row["cells"].get(k, 0) for k in sizes] for unit, row in result["units"].items()]))
    rows = []
    for (name, family, hierarchy), result in results.items():
        if hierarchy:
            continue
        c, frame = result["counts"], None
        try:
            frame = clocks_of(name)
        except cost.CostError:
            pass
        ram = num(c["ram36_equivalent"])
        if family == "ng_medium":
            ram = f"{c['ram48']} ({nx_rows(result['memories'])[0]} by modes)"
        if family == "ecp5":
            ram = f"{c['ram18']} DP16KD"
        path = result.get("levels", {}).get("longest")
        rows.append([POINTS[name]["title"], family, c["lut"], c["ff"], ram, c["dsp"], c["carry"],
                     f"{path['lut']} + {path['carry']}" if path else "",
                     mega(frame["clocks"]) if frame else "",
                     f"{efficiency(frame, c['lut']):.2f}" if frame and not POINTS[name].get("entity") else ""])
    if rows:
        print("\n" + markdown(["", "family", "LUT", "FF", "RAM", "DSP", "carry", "LUTs + carry on the longest path",
                               "M clocks", "efficiency"], rows))
    for (name, family, hierarchy), result in results.items():
        over = {u: p for u, p in result.get("levels", {}).get("by_unit", {}).items() if p["lut"] > 5}
        if over and family in ("xc6v", "xc5v"):
            print(f"\n{name}, {family}: more than 5 LUTs on a path in " + ", ".join(
                f"{u} ({p['lut']}: {tidy(p['start'])} -> {tidy(p['end'])})" for u, p in over.items()))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--config", nargs="+")
    parser.add_argument("--family")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--update", action="store_true")
    parser.add_argument("--pages", action="store_true")
    parser.add_argument("--pnr", action="store_true")
    parser.add_argument("--full", nargs="?", const=str(OUT / "full.md"))
    parser.add_argument("--rtl", help="another folder instead of rtl/ (--check, --update, --pnr)")
    options = parser.parse_args()
    try:
        if options.full:
            pathlib.Path(options.full).parent.mkdir(parents=True, exist_ok=True)
            pathlib.Path(options.full).write_text(full(baseline()))
            return 0
        if options.pages:
            number = pages(baseline(), options.check)
            print(f"cost: {number} tables {'are those of baseline.json' if options.check else 'written'}")
            return 0
        if options.check:
            return int(check(options.quick, options.rtl))
        if options.update:
            return update(options.rtl)
        if options.pnr:
            return route(options.rtl)
        wanted = options.family.split(",") if options.family else None
        for family in wanted or ():
            if family not in families.FAMILIES:
                raise cost.CostError(f"unknown family '{family}': " + ", ".join(families.FAMILIES))
        if options.config:
            for name in options.config:
                if name not in POINTS:
                    entity = "psweep_top" if (cost.ROOT / "rtl/configs/chip" / f"{name}.json").exists() and \
                        not (cost.ROOT / "rtl/configs/engine" / f"{name}.json").exists() else "psweep"
                    cost.config_generics(entity, name, cost.ROOT / "rtl")
                    POINTS[name] = {"title": name, "entity": entity, "config": name, "flat": ()}
                    if entity == "psweep":
                        del POINTS[name]["entity"]
            questions = [(n, f, h) for n in options.config for f in wanted or ["xc6v"]
                         for h in ((False,) if "unit" in POINTS[n] else (True, False))]
        elif options.all:
            questions = [q for q in all_questions() if not wanted or q[1] in wanted]
        else:
            questions = [(n, f, False) for n, p in POINTS.items() if p.get("default") for f in wanted or ["xc6v"]]
            questions += [("bands", f, True) for f in wanted or ["xc6v"]]
        results = run(questions)
        show(results)
        if ("bands", "xc6v", True) in results and ("bands", "xc6v", False) in results:
            plot(results["bands", "xc6v", True], results["bands", "xc6v", False], OUT / "cost.svg")
        print(f"\nJSON: {OUT.relative_to(cost.ROOT)}/*.json; {cost.tool_version()}, {ghdl_version()}")
        return 0
    except cost.CostError as error:
        print(f"cost: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
