#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws the tables of the current folder by gnuplot and writes index.html: plots.py (Snakefile)."""
import csv
import html
import pathlib
import re
import subprocess
import sys

if len(sys.argv) > 1:
    sys.exit(__doc__)
BLUE, ORANGE, GREEN, VIOLET = "#1f5fa8", "#b35900", "#2c8f4e", "#7a3fa0"
COLOURS = (BLUE, ORANGE, GREEN, VIOLET, "#999999", "#000000")
# The paper: table 4 (LUT), section 5.4 (3.1 s at 166 MHz).
PAPER_LUT, PAPER_CLOCKS = 5448, 515


def table(name):
    with open(f"{name}.csv", newline="") as file:
        return list(csv.DictReader(file))


def plot(name, title, commands, blocks):
    """blocks: data by name, each a list of rows."""
    text = f"set terminal svg size 900,480 font 'sans-serif,14' background rgb 'white'\nset output 'dse_{name}.svg'\n"
    text += f"set title '{title}'\nset grid\n"
    for block, rows in blocks.items():
        text += f"${block} << EOD\n" + "".join(" ".join(str(v) for v in row) + "\n" for row in rows) + "EOD\n"
    subprocess.run(["gnuplot"], input=text + commands, text=True, check=True)
    path = pathlib.Path(f"dse_{name}.svg")
    lines = path.read_text().replace("\t", "  ").splitlines()
    path.write_text(re.sub(r"\n+\Z", "\n", "\n".join(line.rstrip() for line in lines) + "\n"))


resources, clocks, accuracy = table("resources"), table("clocks"), table("accuracy")

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

window = max(accuracy, key=lambda r: int(r["window"]))["window"]
series = {}
for r in accuracy:
    if r["window"] == window and r["engine"] != "float" and (r["interp"], r["frac"]) == ("2", "8"):
        series.setdefault((r["engine"], int(r["mncc"])), []).append(r)
lines = {}
for (engine, bits), rows in sorted(series.items()):
    def mean(key):
        return max(sum(float(r[key]) for r in rows) / len(rows), 1e-4)
    lines.setdefault(engine, []).append((bits, *(mean(f"over_{k}_percent")
                                                 for k in ("quarter_mm", "1mm", "5mm", "2cm"))))
parts = [f"${engine} using 1:{n + 2} with linespoints lw 2 pt 7 ps 0.5 dt {1 if engine == 'fixed' else 2} "
         f"lc rgb '{COLOURS[n]}' title '{'bit-true' if engine == 'fixed' else 'MNCC alone'}, over {label}'"
         for engine in lines for n, label in enumerate(("0.25 mm", "1 mm", "5 mm", "2 cm"))]
plot("accuracy", f"depths that differ from float, window {window}, mean of {len(next(iter(series.values())))} scenes",
     "set logscale y\nset xlabel 'MNCC bits'\nset ylabel 'percent of depths'\nset key outside right\nplot "
     + ", ".join(parts) + "\n", lines)

points = {}
for r in resources:
    points.setdefault(r["lanes"], []).append((int(r["clocks"]) / 1e6, r["lut"], int(r["memory_bits"]) / 1e6,
                                              f'"{int(r["memory_bits"]) / 1e6:.1f} Mbit"'))
plot("pareto", "clocks, LUT and RAM bits of a 1120 x 1120 x 301 frame (area: RAM bits)", f"""
set xlabel 'million clocks'
set ylabel 'LUT'
set logscale y
set yrange [1500:60000]
set xrange [0:*]
set label 'NG-MEDIUM: 34,272 LUT4, 56 RAMB48 (2.75 Mbit)' at graph 0.3, first 40000
plot 34272 lc rgb '#999999' dt 2 notitle, """ + ", ".join(
    f"$l{n} using 1:2:(sqrt($3)*0.9) with points pt 7 ps variable lc rgb '{COLOURS[k]}' "
    f"title '{n} lane{'' if n == '1' else 's'}', "
    f"$l{n} using 1:2:4 with labels offset 0,1.2 font ',9' notitle" for k, n in enumerate(points))
     + f", $paper using 1:2 with points pt 5 ps 1.5 lc rgb 'black' title 'the paper (100 RAMB36)'\n",
     {**{f"l{n}": rows for n, rows in points.items()}, "paper": [(PAPER_CLOCKS, PAPER_LUT)]})


def rows_of(rows):
    head = "".join(f"<th>{html.escape(k)}</th>" for k in rows[0])
    body = "".join("<tr>" + "".join(f"<td>{html.escape(v)}</td>" for v in r.values()) + "</tr>\n" for r in rows)
    return f"<table><tr>{head}</tr>\n{body}</table>\n"


page = ("<!DOCTYPE html><html lang='en'><meta charset='utf-8'><title>psweep: design space</title>"
        "<style>body{font-family:sans-serif;margin:2em}td,th{padding:0 .5em;text-align:right}img{max-width:100%}"
        "</style><h1>psweep: design space</h1>\n")
for name, rows in (("resources", resources), ("clocks", clocks), ("accuracy", accuracy)):
    page += f"<h2>{name}</h2><p><img src='dse_{name}.svg' alt=''></p>\n"
    if name == "resources":
        page += "<p><img src='dse_pareto.svg' alt=''></p>\n"
    page += f"<details><summary><a href='{name}.csv'>{name}.csv</a></summary>{rows_of(rows)}</details>\n"
pathlib.Path("index.html").write_text(page)
