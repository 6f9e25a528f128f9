#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Joins the points of the design space: collect.py RESOURCES.csv CLOCKS.csv ACCURACY.csv POINT ... (Snakefile)."""
import csv
import json
import pathlib
import re
import sys

if len(sys.argv) < 5 or "--help" in sys.argv:
    sys.exit(__doc__)
points = [pathlib.Path(p) for p in sys.argv[4:]]
shapes = {p.stem: json.loads(p.read_text()) for p in points if p.parent.name == "shape"}


def shape_of(name):
    """Of a cost point: its shape may not be among the clocks' grid, but it was made for the point."""
    if name not in shapes:
        shapes[name] = json.loads(pathlib.Path("shape", f"{name}.json").read_text())
    return shapes[name]


def write(path, rows):
    if not rows:
        sys.exit(f"collect.py: nothing for {path}")
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, rows[0], lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


resources, clocks, accuracy = [], [], []
for p in points:
    if p.parent.name == "cost":
        cols, rows, window, mncc, lanes = map(int, re.findall(r"\d+", p.stem))
        found, s = json.loads(p.read_text()), shape_of(f"{cols}x{rows}-w{window}")
        c = found["counts"]
        resources.append({"plane_cols": cols, "plane_rows": rows, "img_cols": s["buffer"][0],
                          "img_rows": s["buffer"][1], "window": window, "mncc": mncc, "lanes": lanes, "lut": c["lut"],
                          "ff": c["ff"], "ramb36": c["ram36_equivalent"], "dsp": c["dsp"],
                          "memory_bits": found["memory_bits"], "clocks": s["clocks"][str(lanes)],
                          "useful": s["useful"]})
    elif p.parent.name == "shape":
        s = shapes[p.stem]
        clocks.append({"plane_cols": s["tile"][0], "plane_rows": s["tile"][1], "window": s["window"],
                       "img_cols": s["buffer"][0], "img_rows": s["buffer"][1], "tiles": s["tiles"], "bits": s["bits"],
                       "useful": s["useful"], **{f"clocks_{n}": s["clocks"][n] for n in ("1", "2", "4")}})
    else:
        kind, seed = p.stem.split("-")[:2]
        with open(p, newline="") as file:
            accuracy += [{"kind": kind, "seed": seed, **row} for row in csv.DictReader(file)]
for path, rows in zip(sys.argv[1:4], (resources, clocks, accuracy)):
    write(path, rows)
