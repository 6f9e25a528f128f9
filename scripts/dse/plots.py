#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws the tables of the current folder by gnuplot and writes index.html: plots.py (Snakefile)."""
import pathlib
import re
import subprocess
import sys

sys.dont_write_bytecode = True
import pages  # noqa: E402

if len(sys.argv) > 1:
    sys.exit(__doc__)
BLUE, ORANGE, GREEN, VIOLET = "#1f5fa8", "#b35900", "#2c8f4e", "#7a3fa0"
COLOURS = (BLUE, ORANGE, GREEN, VIOLET, "#999999", "#000000")


def plot(name, title, commands, blocks, height=480):
    """blocks: data by name, each a list of rows."""
    text = f"set terminal svg size 900,{height} font 'sans-serif,14' background rgb 'white'\n"
    text += f"set output 'dse_{name}.svg'\nset title '{title}'\nset grid\n"
    for block, rows in blocks.items():
        text += f"${block} << EOD\n" + "".join(" ".join(str(v) for v in row) + "\n" for row in rows) + "EOD\n"
    subprocess.run(["gnuplot"], input=text + commands, text=True, check=True)
    path = pathlib.Path(f"dse_{name}.svg")
    lines = path.read_text().replace("\t", "  ").splitlines()
    path.write_text(re.sub(r"\n+\Z", "\n", "\n".join(line.rstrip() for line in lines) + "\n"))


tables = pages.read(".")
resources, clocks, accuracy = (tables[name] for name in pages.NAMES)

bars = [(f'"{r["img_rows"]}-{r["plane_rows"]}-{r["window"]}-{r["mncc"]}\\n{r["plane_cols"]} cols, {r["lanes"]}"',
         r["lut"], r["ff"], r["ramb36"], r["dsp"]) for r in resources]
plot("resources", "image rows - plane rows - window - MNCC bits; columns, lanes (xc6v, Yosys)", f"""
set style data histograms
set style fill solid
set logscale y
set yrange [5:20000]
set xtics font ',9'
set key top left horizontal
plot $d using 2:xtic(1) lc rgb '{BLUE}' title 'LUT', '' using 3 lc rgb '{ORANGE}' title 'FF', \\
     '' using 4 lc rgb '{GREEN}' title 'RAMB36', '' using 5 lc rgb '{VIOLET}' title 'DSP'
""", {"d": bars})

widest = max(int(r["plane_cols"]) for r in clocks)
bands = {}
for r in clocks:
    if int(r["plane_cols"]) == widest:
        bands.setdefault(r["window"], []).append((int(r["plane_rows"]), int(r["clocks_1"]) / 1e6))
plot("clocks", f"1120 x 1120 x 301, bands of {widest} columns, one lane (planner)",
     "set xlabel 'rows of a band'\nset ylabel 'million clocks'\nset yrange [0:*]\nplot "
     + ", ".join(f"$w{w} using 1:2 with linespoints lw 2 pt 7 ps 0.5 lc rgb '{COLOURS[n % 6]}' title 'window {w}'"
                 for n, w in enumerate(bands)) + "\n", {f"w{w}": sorted(rows) for w, rows in bands.items()})

# Bit-true engines against float: one number moves, the others are the shipped ones: window 13, 13, 2 and 8 bits.
SHARES = (("quarter_mm", "0.25 mm"), ("1mm", "1 mm"), ("5mm", "5 mm"), ("2cm", "2 cm"))
judged = pages.series(accuracy)
fixed = [key for key in judged if key[1] == "bit-true"]
shared = (13, "bit-true", 13, 2, 8)
if shared not in judged:
    shared = fixed[-1]
blocks, panels = {}, []


def shares(rows):
    return [max(pages.mean(rows, f"over_{k}_percent"), 1e-4) for k, _ in SHARES]


for n, label in ((0, "window"), (2, "MNCC bits"), (3, "interpolation bits"), (4, "depth-fraction bits")):
    def others(key):
        return [v for m, v in enumerate(key) if m != n]
    blocks[f"f{n}"] = [(key[n], *shares(judged[key])) for key in fixed if others(key) == others(shared)]
    parts = [f"$f{n} using 1:{k + 2} with linespoints lw 2 pt 7 ps 0.5 lc rgb '{COLOURS[k]}' "
             f"title 'over {name}'" for k, (_, name) in enumerate(SHARES)]
    if n == 2:
        alone = [(key[2], *shares(judged[key])) for key in judged
                 if key[1] == "MNCC alone" and (key[0], key[4]) == (shared[0], shared[4])]
        if alone:
            blocks["alone"] = alone
            parts += [f"$alone using 1:{k + 2} with lines lw 1 dt 2 lc rgb '{COLOURS[k]}' title "
                      f"'{'MNCC alone' if k == 0 else ''}'" for k in range(len(SHARES))]
    panels.append(f"set xlabel '{label}'\nset xtics {2 if n in (0, 2, 4) else 1}\nplot " + ", ".join(parts) + "\n")
plot("accuracy", "", f"""
set multiplot layout 2,2 title 'bit-true depths that differ from float; window {shared[0]}, MNCC {shared[2]}, \
interpolation {shared[3]}, depth fraction {shared[4]} bits; mean of {len(judged[shared])} scenes'
unset title
set logscale y
set yrange [0.001:1000]
set ylabel 'percent of depths'
set key top left horizontal font ',10' samplen 1
""" + "".join(panels) + "unset multiplot\n", blocks, 760)

points, labels = {}, ""
for r in resources:
    x, y, mbit = int(r["clocks"]) / 1e6, int(r["lut"]), int(r["memory_bits"]) / 1e6
    points.setdefault(int(r["lanes"]), []).append((x, y, mbit))
    below = any(abs(int(o["clocks"]) / 1e6 - x) < 30 and int(o["lut"]) > y for o in resources)
    labels += f"set label '{mbit:.1f}' at {x},{y} center offset 0,{-1.3 if below else 1.3} font ',10'\n"
points = dict(sorted(points.items()))
plot("pareto", "clocks, LUT and RAM of a 1120 x 1120 x 301 frame (area and number: Mbit of RAM)", labels + """
set xlabel 'million clocks'
set ylabel 'LUT'
set logscale y
set yrange [1500:60000]
set ytics (2000, 5000, 10000, 20000, 50000)
set xrange [0:*]
set key right center
set label 'NG-MEDIUM: 34,272 LUT4, 56 RAMB48 (2.75 Mbit)' at graph 0.02, first 40000
plot 34272 lc rgb '#999999' dt 2 notitle, """ + ", ".join(
    f"$l{n} using 1:2:(sqrt($3)*0.9) with points pt 7 ps variable lc rgb '{COLOURS[k]}' "
    f"title '{n} lane{'' if n == 1 else 's'}'" for k, n in enumerate(points))
     + ", $paper using 1:2 with points pt 5 ps 1.5 lc rgb 'black' title 'the paper (100 RAMB36: 3.7)'\n",
     {**{f"l{n}": rows for n, rows in points.items()}, "paper": [(pages.PAPER["clocks"] / 1e6, pages.PAPER["lut"])]})


page = ("<!DOCTYPE html><html lang='en'><meta charset='utf-8'><title>psweep: design space</title>"
        "<style>body{font-family:sans-serif;margin:2em}td,th{padding:0 .5em;text-align:right}img{max-width:100%}"
        "</style><h1>psweep: design space</h1>\n<p>What the columns mean: docs/dse.md of the source.</p>\n")
for name, source in (("resources", "resources"), ("pareto", "resources"), ("clocks", "clocks"),
                     ("accuracy", "accuracy")):
    page += (f"<h2>{name}</h2><p><img src='dse_{name}.svg' alt=''></p>\n"
             f"<details open><summary><a href='{source}.csv'>{source}.csv</a></summary>"
             f"{pages.as_html(*pages.TABLES[name](tables))}</details>\n")
pathlib.Path("index.html").write_text(page)
