# SPDX-License-Identifier: Apache-2.0
"""Clocks of the paper's pair against the engine's memory, for tiles of every shape: prints the tables of the page about
tiles and draws docs/images/tiles.svg (half a minute)."""
from __future__ import annotations

import pathlib
import re
import subprocess
import tempfile

from . import work
from .paths import ROOT
from .work import Failure

PICTURE = "docs/images/tiles.svg"
PLOT = """set terminal svg size 900,480 font 'sans-serif,14' background rgb 'white'
set output '@PICTURE@'
set title '1120 x 1120 x 301 planes, window 13: clocks against the memory of the engine'
set xlabel 'memory of the engine with one lane, Mbit'
set ylabel 'million clocks'
set xrange [0:12]
set yrange [0:820]
set grid
set key top right
set label 'NG-MEDIUM' at 2.8,780
set arrow from 2.7,0 to 2.7,820 nohead dt 2 lc rgb '#999999'
set label 'Virtex-5QV' at 10.6,560 right
set arrow from 10.7,0 to 10.7,820 nohead dt 2 lc rgb '#999999'
plot '@POINTS@' index 1 using 2:3 with lines lw 2 lc rgb '#b35900' title 'bands (figure 7), 1 lane', \\
     '@POINTS@' index 0 using 2:3 with lines lw 2 lc rgb '#1f5fa8' title 'tiles, 1 lane', \\
     '@POINTS@' index 0 using 2:4 with lines lw 2 lc rgb '#2c8f4e' title 'tiles, 2 lanes', \\
     '@POINTS@' index 0 using 2:5 with lines lw 2 lc rgb '#7a3fa0' title 'tiles, 4 lanes', \\
     '-' using 1:2:3 with labels point pt 7 offset 4.5,0.8 notitle
2.59 498 "30 rows"
1.91 409.1 "175 x 139"
0.98 439.3 "117 x 93"
e
"""


def main(arguments: list[str]) -> int:
    options = work.parser("scripts/shape_table.sh", __doc__)
    options.add_argument("--program", default="build/shape_table", metavar="FILE")
    program = str(pathlib.Path(options.parse_args(arguments).program).resolve())
    work.run([program])
    curve = work.output([program, "--curve"])
    if len([line for line in curve.splitlines() if line]) <= 20:
        raise Failure("no curve")
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as points:
        points.write(curve)
        points.flush()
        subprocess.run(["gnuplot"], input=PLOT.replace("@PICTURE@", PICTURE).replace("@POINTS@", points.name),
                       text=True, cwd=ROOT, check=True)
    path = ROOT / PICTURE
    # As make lint wants it.
    path.write_text(re.sub(r" +$", "", path.read_text().replace("\t", "  "), flags=re.M).rstrip("\n") + "\n")
    return 0
