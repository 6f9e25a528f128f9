#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tables of docs/dse.md from docs/dse/*.csv, between their markers.

  scripts/dse/pages.py               writes them
  scripts/dse/pages.py --check       compares them only; exit code 1 if they differ
  scripts/dse/pages.py --take DIR    first copies tables and plots of a run there: make dse PAGES=1

Needs no package of Python's. plots.py makes the same tables for the page of a run.
"""
import csv
import datetime
import html
import json
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PAGE = ROOT / "docs" / "dse.md"
NAMES = ("resources", "clocks", "accuracy")
PLOTS = ("resources", "pareto", "clocks", "accuracy")
# The paper: table 4 (LUT, FF, RAMB36, DSP), section 5.4 (3.1 s at 166 MHz).
PAPER = {"lut": 5448, "ff": 5747, "ramb36": 100, "dsp": 53, "clocks": 515e6}
BITS_RAMB36 = 36864


def read(folder):
    """{name: rows} of the tables of a folder."""
    tables = {}
    for name in NAMES:
        with open(pathlib.Path(folder) / f"{name}.csv", newline="") as file:
            tables[name] = list(csv.DictReader(file))
    return tables


def mega(value):
    return f"{float(value) / 1e6:.1f}"


def engine(row):
    return f"{row['img_rows']}-{row['plane_rows']}-{row['window']}-{row['mncc']}"


def resources(tables):
    head = ["image rows - plane rows - window - MNCC bits", "columns", "lanes", "LUT", "FF", "RAMB36", "DSP",
            "RAM Mbit", "M clocks"]
    return head, [[engine(r), r["plane_cols"], r["lanes"], r["lut"], r["ff"], f"{float(r['ramb36']):g}", r["dsp"],
                   f"{int(r['memory_bits']) / 1e6:.2f}", mega(r["clocks"])] for r in tables["resources"]]


def front(rows):
    """Those that no other beats in clocks, LUT and RAM bits at once."""
    def key(r):
        return int(r["clocks"]), int(r["lut"]), int(r["memory_bits"])
    return [r for r in rows if not any(key(o) != key(r) and all(a <= b for a, b in zip(key(o), key(r))) for o in rows)]


def pareto(tables):
    def efficiency(useful, clocks, lut):
        return f"{float(useful) / float(clocks) / (float(lut) / 1000):.2f}"
    rows = sorted(front(tables["resources"]), key=lambda r: int(r["clocks"]))
    out = [[f"{engine(r)}, {r['plane_cols']} columns", r["lanes"], mega(r["clocks"]), r["lut"],
            f"{int(r['memory_bits']) / 1e6:.2f}", f"{float(r['ramb36']):g}",
            efficiency(r["useful"], r["clocks"], r["lut"])] for r in rows]
    bands = [r for r in tables["resources"] if engine(r) == "44-30-13-13" and r["lanes"] == "1"]
    out.append(["the paper, 44-30-13-13, ISE 14.7", "", f"about {PAPER['clocks'] / 1e6:.0f}", PAPER["lut"],
                f"{PAPER['ramb36'] * BITS_RAMB36 / 1e6:.2f} (blocks)", PAPER["ramb36"],
                efficiency(bands[0]["useful"], PAPER["clocks"], PAPER["lut"]) if bands else ""])
    return ["not beaten in clocks, LUT and RAM bits at once", "lanes", "M clocks", "LUT", "RAM Mbit", "RAMB36",
            "evaluations a clock and kLUT"], out


def clocks(tables):
    windows = sorted({int(r["window"]) for r in tables["clocks"]})
    tiles = {}
    for r in tables["clocks"]:
        tiles.setdefault((r["plane_cols"], r["plane_rows"]), {})[int(r["window"])] = r
    head = ["columns x rows", "tiles"] + [f"window {w}" for w in windows]
    return head, [[" x ".join(tile), next(iter(of.values()))["tiles"]] +
                  [mega(of[w]["clocks_1"]) if w in of else "" for w in windows] for tile, of in tiles.items()]


def mean(rows, key):
    return sum(float(r[key]) for r in rows) / len(rows)


def series(rows):
    """Rows of all scenes by window, engine and bits, in order. Bits that do not matter to an engine are -1."""
    matter = {"fixed": ("mncc", "interp", "frac"), "mncc": ("mncc", "frac"), "float": ()}
    found = {}
    for r in rows:
        bits = (int(r[b]) if b in matter[r["engine"]] else -1 for b in ("mncc", "interp", "frac"))
        found.setdefault((int(r["window"]), list(matter).index(r["engine"]), *bits), []).append(r)
    names = ("bit-true", "MNCC alone", "float")
    return {(key[0], names[key[1]], *key[2:]): found[key] for key in sorted(found)}


def accuracy(tables):
    head = ["window", "engine", "MNCC", "interpolation", "depth fraction", "> 0.25 mm %", "> 1 mm %", "> 5 mm %",
            "> 2 cm %", "holes gained", "lost", "M1 mm", "M2.a %", "M3 %"]
    out = []
    for (window, who, *bits), rows in series(tables["accuracy"]).items():
        out.append([window, who, *("" if b < 0 else b for b in bits),
                    *(f"{mean(rows, f'over_{k}_percent'):.3f}" for k in ("quarter_mm", "1mm", "5mm", "2cm")),
                    *(sum(int(r[k]) for r in rows) for k in ("holes_gained", "holes_lost")),
                    *(f"{mean(rows, k):.3f}" for k in ("M1_mm", "M2a_percent", "M3_percent"))])
    return head, out


def accuracy_short(tables):
    """For the page: every window as shipped, window 13 with other interpolations; the CSV has the rest."""
    shipped = ("bit-true", 13, 2, 8)
    out = []
    for (window, who, *bits), rows in series(tables["accuracy"]).items():
        if (who, *bits) != shipped and (window != 13 or (who, bits[0], bits[2]) != ("bit-true", 13, 8)):
            continue
        out.append([window, " ".join([who, "-".join(str(b) for b in bits if b >= 0)]).strip(),
                    *(f"{mean(rows, f'over_{k}_percent'):.2f}" for k in ("quarter_mm", "2cm")),
                    *(f"{mean(rows, k):.2f}" for k in ("M1_mm", "M2a_percent"))])
    return ["window", "engine", "> 0.25 mm %", "> 2 cm %", "M1 mm", "M2.a %"], out


TABLES = {"resources": resources, "pareto": pareto, "clocks": clocks, "accuracy": accuracy}
IN_PAGE = {"accuracy": accuracy_short}


def markdown(head, rows):
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head)] +
                     ["| " + " | ".join(str(c) for c in row) + " |" for row in rows])


def as_html(head, rows):
    def line(cells, tag):
        return "<tr>" + "".join(f"<{tag}>{html.escape(str(c))}</{tag}>" for c in cells) + "</tr>\n"
    return "<table>" + line(head, "th") + "".join(line(row, "td") for row in rows) + "</table>\n"


def run_line():
    with open(PAGE.parent / "dse" / "run.csv", newline="") as file:
        r = next(csv.DictReader(file))
    return (f"Grid `{r['grid']}`, VHDL of commit `{r['vhdl']}`, {r['tool']}, {r['date']}: {r['resources']} engines, "
            f"{r['clocks']} shapes, {r['accuracy']} rows of accuracy.")


def git(*arguments):
    return subprocess.run(["git", "-c", "safe.directory=*", "-C", str(ROOT), *arguments], check=True, text=True,
                          capture_output=True).stdout.strip()


def take(run):
    """Tables and plots of a run become those of the repository, with what they were made from."""
    if git("status", "--porcelain", "--", "rtl"):
        sys.exit("pages.py: rtl/ is not as it was committed: the tables would belong to no commit")
    tables = read(run)
    tools = {re.sub(r" \(.*", "", json.loads(p.read_text())["tool"]) for p in (run / "cost").glob("*.json")}
    for name in NAMES:
        shutil.copy(run / f"{name}.csv", PAGE.parent / "dse" / f"{name}.csv")
    for name in PLOTS:
        shutil.copy(run / f"dse_{name}.svg", PAGE.parent / "images" / f"dse_{name}.svg")
    with open(PAGE.parent / "dse" / "run.csv", "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["grid", "vhdl", "tool", "date", *NAMES])
        out.writerow(["default.yaml", git("log", "-1", "--format=%h", "--", "rtl"), " and ".join(sorted(tools)),
                      datetime.date.today().isoformat(), *(len(tables[name]) for name in NAMES)])


def main():
    arguments = sys.argv[1:]
    check = arguments == ["--check"]
    if len(arguments) == 2 and arguments[0] == "--take":
        take(pathlib.Path(arguments[1]))
    elif arguments and not check:
        sys.exit(__doc__)
    tables, text, found = read(PAGE.parent / "dse"), PAGE.read_text(), []

    def fill(match):
        found.append(match[1])
        body = run_line() if match[1] == "run" else markdown(*IN_PAGE[match[1]](tables))
        return f"<!-- dse: {match[1]} -->\n{body}\n<!-- /dse -->"
    new = re.sub(r"<!-- dse: (\w+) -->\n.*?<!-- /dse -->", fill, text, flags=re.S)
    if sorted(found) != sorted(["run", *IN_PAGE]):
        sys.exit(f"pages.py: docs/dse.md has the tables {', '.join(found)}, not each of {', '.join(['run', *IN_PAGE])}")
    if check and new != text:
        sys.exit("pages.py: docs/dse.md is not what docs/dse/*.csv say: scripts/dse/pages.py writes it")
    if new != text:
        PAGE.write_text(new)
    print(f"{len(found)} tables {'are as' if check else 'written from'} docs/dse/*.csv")


if __name__ == "__main__":
    main()
