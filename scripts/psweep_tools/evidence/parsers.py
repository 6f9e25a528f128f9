# SPDX-License-Identifier: Apache-2.0
"""Results of each kind out of what its tool printed or wrote. A parser that finds nothing to tell fails: evidence that
compared nothing is none."""
import json
import pathlib
import re
from collections.abc import Callable
from typing import Any

from . import sources
from .manifest import Kind

Results = dict[str, Any]


class NothingFound(Exception):
    """The output does not hold what it should."""


def _need(found: Any, what: str) -> Any:
    if not found:
        raise NothingFound(f"no {what} in the output")
    return found


def markdown_tables(text: str) -> list[list[list[str]]]:
    """Tables of a text, as rows of cells; the head is the first row, the line of dashes is left out."""
    tables: list[list[list[str]]] = []
    inside = False
    for line in text.splitlines():
        if not line.startswith("|"):
            inside = False
            continue
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if not inside:
            tables.append([])
        inside = True
        if not all(re.fullmatch(r":?-+:?", cell) for cell in cells):
            tables[-1].append(cells)
    return tables


def mutants(text: str) -> Results:
    data: dict[str, Any] = json.loads(text)
    if not data["all"].get("tested"):
        raise NothingFound("no mutant was tested")
    data["problems"] = [p for p in data["problems"] if not p.startswith(("survived", "not finished"))]
    return data


_FLIPS = ("flips", "masked", "status", "detected", "silent", "later", "hang")


def flips(text: str) -> Results:
    rows: dict[str, dict[str, Any]] = {}
    clocks: dict[str, int] = {}
    config = ""
    for line in text.splitlines():
        if re.fullmatch(r"\w+", line):
            config = line
        elif m := re.fullmatch(r"(.{34}) +" + r" +".join([r"(\d+)"] * 8), line):
            name = m[1].strip()
            row = rows.setdefault(name, {**dict.fromkeys(_FLIPS, 0), "worst": {}})
            for key, value in zip(_FLIPS, m.groups()[1:]):
                row[key] += int(value)
            row["worst"][config] = int(m[9])
        elif m := re.search(r"a tile without an upset: (\d+) clocks", line):
            clocks[config] = int(m[1])
    whole = rows.pop("all", None)
    _need(whole and whole["flips"], "upsets")
    return {"rows": rows, "all": whole, "clocks": clocks}


def flips_chip(text: str) -> Results:
    """Rows '<what> <number> ..' under a head 'upset in ..', then the registers of those that went wrong."""
    columns: list[str] = []
    rows: dict[str, dict[str, int]] = {}
    for line in text.splitlines():
        if line.startswith("upset in "):
            columns = line.split()[2:]
        elif columns and (m := re.fullmatch(r"(.+?)((?:\s+\d+){%d})" % len(columns), line)):
            rows.setdefault(m[1].strip(), dict(zip(columns, map(int, m[2].split()))))
    whole = rows.pop("all", None)
    _need(whole and whole.get("flips"), "upsets")
    sites: dict[str, dict[str, int]] = {"hang": {}, "silent": {}, "error": {}}
    for m in re.finditer(r"^(hang|silent|error): (\S+) (\S+): (.*?)(?:; again: .*)?$", text, re.M):
        bits = [re.search(r"\((\d+) times\)", bit) for bit in m[4].split(", ")]
        # Those of the engine, whose own campaign is finer, are only counted.
        name = "the engine" if m[3].startswith("u_engine.") else f"`{m[3].replace('u_arbiter.', '')}`"
        sites[m[1]][name] = sites[m[1]].get(name, 0) + sum(int(b[1]) if b else 1 for b in bits)
    about = re.search(r"^flips_chip: (\d+ registers; .*)$", text, re.M)
    return {"about": about[1] if about else "", "columns": columns, "rows": rows, "all": whole, "sites": sites}


_SOAK = re.compile(
    r"soak: (\w+): (\d+) tiles and (\d+) behind bad ones: (\d+) good, (\d+) refused, (\d+) cut or too long, (\d+) "
    r"aborted, (\d+) in a reset; (\d+) wrong writes; (\d+) errors, all counted; ([\d.]+) M clocks")
_SOAK_KEYS = ("tiles", "behind", "good", "refused", "cut", "aborted", "reset", "writes", "errors")


def soak(text: str) -> Results:
    rows = {m[1]: {**{k: int(v) for k, v in zip(_SOAK_KEYS, m.groups()[1:])}, "mclocks": float(m[11])}
            for m in _SOAK.finditer(text)}
    _need(rows, "tiles")
    left = [sum(int(m[i]) for m in re.finditer(
        r"aborts and resets in idle (\d+), load (\d+), sweep (\d+), flush (\d+), unload (\d+)", text))
        for i in range(1, 6)]
    last = _need(re.search(r"soak: (\d+) of (\d+) configurations, (\d+) tiles, seed (\d+), (\d+) s", text), "summary")
    return {"rows": rows, "left_in": left, "tiles": int(last[3]), "seed": int(last[4]), "seconds": int(last[5])}


def formal(text: str) -> Results:
    rows: dict[str, dict[str, Any]] = {}
    for m in re.finditer(r"^formal: ([\w-]+)(?:, (.*))?: (proved|fault found|FAILED.*?) \((\d+) ms\)$", text, re.M):
        row = rows.setdefault(m[1], {"proved": False, "ms": 0, "faults": [], "failed": []})
        row["ms"] += int(m[4])
        if m[3] == "proved":
            row["proved"] = True
        elif m[3] == "fault found":
            row["faults"].append(m[2])
        else:
            row["failed"].append(f"{m[2] or 'the proof'}: {m[3]}")
    _need([r for r in rows.values() if r["proved"]], "proof")
    return {"rows": rows}


def rules(text: str) -> Results:
    told = re.findall(r"^rules: (.*): told$", text, re.M)
    last = _need(re.search(r"^(\d+) passed, (\d+) failed$", text, re.M), "summary")
    _need(told, "rule")
    return {"told": sorted(told), "passed": int(last[1]), "failed": int(last[2])}


def gates(text: str) -> Results:
    rows: dict[str, dict[str, Any]] = {}
    for m in re.finditer(r"^sim-gates: ([\w:]+): (.*)$", text, re.M):
        row = rows.setdefault(m[1], {"cells": {}})
        if n := re.fullmatch(r" +([A-Z]\w+) +(\d+)", m[2]):
            row["cells"][n[1]] = int(n[2])
        elif n := re.match(r"replay: (\d+) steps, (\d+) values compared, (\d+) differences", m[2]):
            row.update(steps=int(n[1]), values=int(n[2]), differences=int(n[3]))
        elif n := re.search(r"(\d+) clocks", m[2]):
            row.setdefault("clocks", int(n[1]))
    rows = {name: row for name, row in rows.items() if "values" in row}
    _need(rows, "replay")
    faults = {m[1]: m[2] for m in re.finditer(r"^(\w+) broken: found: (.*)$", text, re.M)}
    return {"rows": rows, "faults": faults}


def sim_ghdl(text: str) -> Results:
    found = [(m[1], int(m[2]), int(m[3]), int(m[4])) for m in re.finditer(
        r"^sim-ghdl: (\w+), seed (\d+): (\d+) steps, (\d+) values compared, 0 differences", text, re.M)]
    _need(found, "replay")
    last = _need(re.search(r"sim-ghdl: (\d+) of (\d+) replays", text), "summary")
    steps = [f[2] for f in found]
    return {"configurations": len({f[0] for f in found}), "seeds": sorted({f[1] for f in found}),
            "replays": int(last[1]), "of": int(last[2]), "steps": [min(steps), max(steps)],
            "values": sum(f[3] for f in found)}


def link_speed(text: str) -> Results:
    def number(pattern: str, within: str = text) -> float:
        return float(_need(re.search(pattern, within), pattern)[1])
    out: Results = {}
    for n in (1, 2):
        part = _need(re.search(rf"^{n} in flight.*?(?=^\d in flight|^full duplex|\Z)", text, re.M | re.S),
                     f"'{n} in flight'")[0]
        out[f"flight_{n}"] = {"busy": number(r"busy ([\d.]+) %", part),
                              "seconds": number(r"whole pair +([\d.]+) s", part),
                              "stall": number(r"stall per tile change +(\d+)", part),
                              "before": number(r"before the first launch +([\d.]+) ms", part),
                              "after": number(r"last map beat to end +([\d.]+) ms", part)}
    out["full_up"] = number(r"full duplex: ([\d.]+) Mbit/s up")
    out["full_down"] = number(r"full duplex: [\d.]+ Mbit/s up, ([\d.]+) Mbit/s down")
    runs = [float(x) for x in re.findall(r"half duplex: .* = ([\d.]+);", text)]
    out["half"] = number(r"half duplex, mean of \d+ runs: ([\d.]+)")
    out["half_runs"] = [min(runs), max(runs), len(runs)] if runs else []
    out["host_full"] = number(r"host library, full duplex: ([\d.]+)")
    out["host_half"] = number(r"host library, half duplex: ([\d.]+)")
    out["status_quiet"] = number(r"STATUS on a quiet link: [\d.]+ \.\. ([\d.]+) us")
    out["status_loaded"] = number(r"STATUS while the map is sent: [\d.]+ \.\. ([\d.]+) us")
    return out


def tables(text: str) -> Results:
    found = markdown_tables(text)
    _need(found and all(len(t) > 1 for t in found), "table")
    return {"tables": found}


def sweep(text: str) -> Results:
    good = re.findall(r"^sweep: (\w+): (.*): good: (.*)$", text, re.M)
    bad = re.findall(r"^sweep: (\w+): .*FAILED", text, re.M)
    _need(good, "engine")
    tiles = sum(int(m[1]) for m in (re.match(r"(\d+) good", g[2]) for g in good) if m)
    return {"engines": len(good) + len(bad), "failed": len(bad), "good_tiles": tiles, "seed": int(
        (re.match(r"s(\d+)_", good[0][0]) or [0, 1])[1])}


def coverage(text: str) -> Results:
    rows = {m[1]: [int(m[2]), int(m[3])] for m in re.finditer(r"^(\w+) +(\d+) of +(\d+) +[\d.]+ %$", text, re.M)}
    whole = _need(rows.pop("all", None), "line 'all'")
    holes = re.findall(r"^(rtl/\S+:\d+: .*)$", text, re.M)
    silent = re.findall(r"^(\w+\.\S+)$", text.partition("Signals of which no bit")[2], re.M)
    return {"rows": rows, "all": whole, "holes": len(holes), "silent": len(silent)}


def accuracy(text: str) -> Results:
    """Three runs, each behind a line 'accuracy: NAME' (make accuracy)."""
    runs = {}
    for m in re.finditer(r"^accuracy: (\w+)$(.*?)(?=^accuracy: |\Z)", text, re.M | re.S):
        runs[m[1]] = [row for t in markdown_tables(m[2]) for row in t if row[0] != "scene"]
    for name in ("scenes", "unseen", "formats"):
        _need(runs.get(name), f"table '{name}'")
    return runs


def fresh_machine(text: str) -> Results:
    suites: dict[str, list[Any]] = {}
    for m in re.finditer(r"^fresh-machine: (\w+): summary\n((?: *\d+ s  exit \d+  .*\n?)+)", text, re.M):
        suites[m[1]] = [[int(n[1]), int(n[2]), n[3]] for n in re.finditer(r" *(\d+) s  exit (\d+)  (.*)", m[2])]
    _need(suites, "summary")
    return {"suites": suites}


def baseline(text: str) -> Results:
    """Of cost and pnr: the tables are made of the file itself, by scripts/cost/report.py."""
    data = json.loads(text)
    flat = {name: point["xc6v"]["flat"]["counts"] for name, point in data["points"].items()
            if "flat" in point.get("xc6v", {})}
    _need(flat, "count")
    keys = [name for name in ("bands", "tile", "tile_2", "tile_4", "arbiter", "arbiter_double", "chip") if name in flat]
    return {"tool": data["tool"], "ghdl": data["ghdl"].split(" (")[0],
            "lut_ff": {name: [flat[name]["lut"], flat[name]["ff"]] for name in keys}}


PARSERS: dict[str, Callable[[str], Results]] = {
    "mutants": mutants, "flips": flips, "flips-chip": flips_chip, "soak": soak, "formal": formal, "rules": rules,
    "cost": baseline, "pnr": baseline, "gates": gates, "link-speed": link_speed, "sim-ghdl": sim_ghdl,
    "link-table": tables, "shape-table": tables, "sweep": sweep, "coverage-lines": coverage,
    "coverage-toggles": coverage, "accuracy": accuracy, "fresh-machine": fresh_machine}


def results(kind: Kind, printed: pathlib.Path) -> Results:
    """Of the latest run of a kind: of the file it wrote, else of what it printed."""
    at = sources.ROOT / kind.output if kind.output else printed
    if not at.is_file():
        raise NothingFound(f"there is no {at.relative_to(sources.ROOT)}")
    return PARSERS[kind.name](at.read_text(errors="replace"))
