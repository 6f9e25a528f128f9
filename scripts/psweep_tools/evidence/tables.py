# SPDX-License-Identifier: Apache-2.0
"""Tables of the pages out of the records. Each block: the kinds it tells of, and a function of their records (those
that there are) and of where each is from, in words."""
import functools
import json
import re
import textwrap
from collections.abc import Callable
from typing import Any

from . import sources
from .records import Record

Records = dict[str, Record]
Origins = dict[str, str]
Maker = Callable[[Records, Origins], str]
BLOCKS: dict[str, tuple[tuple[str, ...], Maker]] = {}
# Complete tables, too long for the pages: {name: (kind, title, maker)}. `scripts/evidence.py full` writes them.
FULL: dict[str, tuple[str, str, Callable[[dict[str, Any]], str]]] = {}


def block(name: str, *kinds: str) -> Callable[[Maker], Maker]:
    def register(make: Maker) -> Maker:
        BLOCKS[name] = (kinds or (name,), make)
        return make
    return register


def simple(name: str, kind: str = "") -> Callable[[Callable[[dict[str, Any]], str]], Callable[[dict[str, Any]], str]]:
    """A block of the results of one kind; without a record it says nothing but that."""
    def register(make: Callable[[dict[str, Any]], str]) -> Callable[[dict[str, Any]], str]:
        one = kind or name
        BLOCKS[name] = ((one,), lambda records, _: make(records[one].results) if one in records else "")
        return make
    return register


def complete(name: str, kind: str, title: str) -> Callable[[Callable[[dict[str, Any]], str]],
                                                           Callable[[dict[str, Any]], str]]:
    """A complete table of the results of one kind."""
    def register(make: Callable[[dict[str, Any]], str]) -> Callable[[dict[str, Any]], str]:
        FULL[name] = (kind, title, make)
        return make
    return register


def table(head: list[str], rows: list[list[Any]]) -> str:
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head)] +
                     ["| " + " | ".join("-" if c is None else str(c) for c in row) + " |" for row in rows])


def wrapped(text: str, width: int = 120, indent: str = "") -> str:
    return textwrap.fill(text, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def dash(number: int) -> Any:
    return number or "-"


def grouped(rows: dict[str, dict[str, Any]], groups: tuple[tuple[str, str], ...], rest: str) \
        -> dict[str, list[dict[str, Any]]]:
    """The rows by group: the first pattern that the whole name matches."""
    out: dict[str, list[dict[str, Any]]] = {}
    for name, row in rows.items():
        title = next((title for title, pattern in groups if re.fullmatch(pattern, name)), rest)
        out.setdefault(title, []).append(row)
    order = [title for title, _ in groups] + [rest]
    return {title: out[title] for title in order if title in out}


# ---- mutants

_ENTITIES = (
    ("the engine", "psweep|psweep_pkg|control|address_generator|storage|interpolation|similarity|updating|divider.*"),
    ("the chip around it", "arbiter|psweep_top|eth_pkg|mac_.*|packet_.*|responder.*|session.*|scheduler|counters|"
     "row_buffer|map_buffer"),
)
_MUTANT_KEYS = ("drawn", "tested", "own", "whole", "no_end", "equivalent", "survived", "waiting")
_MUTANT_HEAD = ["drawn", "run", "found by its own test", "found by engine or chip tests", "no end", "equivalent",
                "survived", "not through all tests"]


@complete("mutants", "mutants", "Mutants by entity")
def mutants_full(r: dict[str, Any]) -> str:
    return table(["entity", *_MUTANT_HEAD],
                 [[f"`{name}`", *(dash(row[k]) for k in _MUTANT_KEYS)] for name, row in r["entities"].items()])


@simple("mutants")
def mutants(r: dict[str, Any]) -> str:
    a = r["all"]
    rows = [[title, *(dash(sum(row[k] for row in found)) for k in _MUTANT_KEYS)]
            for title, found in [*grouped(r["entities"], _ENTITIES, "common cells").items(), ("all", [a])]]
    text = table(["entities of", *_MUTANT_HEAD], rows)
    text += "\n\n" + wrapped(f"Seed {r['seed']}; {a['invalid']} more could not be built and were replaced." + (
        "" if r["complete"] else f" The run is not finished: {a['drawn'] - a['tested']} have met no test, "
        f"{a['waiting']} only the cheap ones."))
    for title, key in (("Survived, a test is missing:", "survivors"), ("Equivalent, with the reason:", "equivalents")):
        if r[key]:
            text += f"\n\n{title}\n" + "\n".join(_mutant(m) for m in r[key])
    return text


def _mutant(m: dict[str, str]) -> str:
    before, _, after = m["text"].partition("  ")[2].partition("  ->  ")
    text = f"- `{m['id']}`" + (f": `{before}` becomes `{after}`" if before else "")
    return wrapped(text + (f": {m['reason']}" if "reason" in m else ""), 120, "  ")


# ---- robustness

_FLIPS = ("flips", "masked", "status", "detected", "silent", "later", "hang")
_REGISTERS = (
    ("plane table", r"RAM u_table\..*"),
    ("offsets", r"RAM u_offsets\..*"),
    ("map", r"RAM u_map\..*"),
    ("state, commands, strobes", "control (state_q|active|(abort|start|drop)_q|m_valid|m_lanes|since_last|window_seen|"
     "m_(row|plane)_(first|last)|(row|plane)_first|(table|offset)_we)"),
    ("position counters", "control (at_.*|col|row|plane_set|m_plane|one_col)"),
    ("sizes", "control (last_.*|.*_last_(col|row)(_q)?|.*_ok)"),
    ("bounds, threshold", "control ((left|right)_[xy]_(lo|hi)|threshold)"),
    ("register writes on their way", "control (cfg_.*|(offset|table)_addr|table_words)"),
    ("error bits, counters", "control (error_.*|event_.*|new_events|samples_lost|tiles?_(done|dropped|clocks)_q|"
     "window_errors_q)"),
)


@complete("flips", "flips", "Upsets in the engine, by register")
def flips_full(r: dict[str, Any]) -> str:
    configs = list(r["clocks"])
    return table(["upset in", *_FLIPS, "worst clocks, " + " / ".join(configs)],
                 [[name, *(row[k] for k in _FLIPS), " / ".join(str(row["worst"].get(c, "-")) for c in configs)]
                  for name, row in r["rows"].items()])


@simple("flips")
def flips(r: dict[str, Any]) -> str:
    configs = list(r["clocks"])
    rows = [[title, *(sum(row[k] for row in found) for k in _FLIPS[:-1])]
            for title, found in [*grouped(r["rows"], _REGISTERS, "other registers").items(), ("all", [r["all"]])]]
    plain = ", ".join(f"{r['clocks'][c]} (`{c}`)" for c in configs)
    verdict = ("**No upset hung the engine**" if r["all"]["hang"] == 0 else
               f"**{r['all']['hang']} upsets hung the engine**")
    return (table(["upset in", *_FLIPS[:-1]], rows) + "\n\n" +
            wrapped(f"{verdict}: {r['all']['flips']} upsets. Without an upset the tile takes {plain} clocks, with "
                    f"one at most {max(r['all']['worst'].values())}."))


def _chip_verdict(r: dict[str, Any]) -> str:
    a = r["all"]
    silent = f"{a['silent']} silently wrong" if a.get("silent") else "none silently wrong"
    hang = f"{a['hang']} hang" if a.get("hang") else "none hangs"
    return f"{a['flips']:,}: {hang}, {silent}"


_PARTS = (
    ("engine: control", "engine: control"),
    ("engine: data path", "engine: rest"),
    ("MAC", "mac_.*"),
    ("packets", "packet_.*"),
    ("responder", "responder.*|session.*"),
    ("row buffer, map buffer, scheduler", "row_buffer|map_buffer|scheduler"),
    ("crossings, resets", "crossings and resets|reset_.*"),
    ("words read from RAMs", "words read from RAMs.*"),
)


@simple("flips-chip")
def flips_chip(r: dict[str, Any]) -> str:
    columns = [c for c in r["columns"] if c not in ("resent", "clocks", "silence") and (
        r["all"][c] or c not in ("error", "hang"))]
    text = table(["upset in", *columns],
                 [[title, *(sum(row[c] for row in found) for c in columns)] for title, found in
                  [*grouped(r["rows"], _PARTS, "arbiter, counters").items(), ("all", [r["all"]])]])
    a, also = r["all"], ""
    if "silence" in a:
        also = (f" Of the masked ones {a['resent']} made the host send something again. A run took at most "
                f"{a['clocks']} clocks longer, and the longest silence was {a['silence']} clocks.")
    hang = "**No upset hung the chip**" if not a["hang"] else f"**{a['hang']} upsets hung the chip**"
    return text + "\n\n" + wrapped(f"{hang}: {a['flips']} upsets; {a.get('error', 0)} ended with an error.{also} "
                                   + (f" {r['about'][0].upper()}{r['about'][1:]}." if r["about"] else ""))


@complete("flips-chip", "flips-chip", "Upsets in the chip, by entity")
def flips_chip_full(r: dict[str, Any]) -> str:
    names = {"resent": "of the masked: resent"}
    text = table(["upset in", *(names.get(c, c) for c in r["columns"])],
                 [[name, *(row[c] for c in r["columns"])] for name, row in r["rows"].items()])
    for kind, title in (("hang", "Hung"), ("silent", "Silently wrong"), ("error", "Reported as an error")):
        if r["sites"][kind]:
            found = sorted(r["sites"][kind].items(), key=lambda pair: (pair[0] == "the engine", pair[0]))
            text += "\n\n" + wrapped(f"{title}, by register, with the number of upsets: "
                                     + ", ".join(f"{name} {n}" for name, n in found) + ".")
    return text


@complete("soak", "soak", "Random tiles by configuration")
def soak_full(r: dict[str, Any]) -> str:
    keys = ("tiles", "good", "refused", "cut", "aborted", "reset", "writes", "errors")
    rows = [[name, *(row[k] for k in keys), f"{row['mclocks']:.2f}"] for name, row in r["rows"].items()]
    return table(["configuration", "tiles", "good", "refused", "cut or too long", "aborted", "reset", "wrong writes",
                  "errors, all counted", "M clocks"], rows)


@simple("soak")
def soak(r: dict[str, Any]) -> str:
    def all_of(key: str) -> str:
        return f"{sum(row[key] for row in r['rows'].values()):,}"
    states = ("idle", "load", "sweep", "flush", "unload")
    left = ", ".join(f"{s} {n}" for s, n in zip(states, r["left_in"]))
    return wrapped(
        f"Seed {r['seed']}, {len(r['rows'])} engines, {r['tiles']:,} tiles and the good tile after each bad one, "
        f"{r['seconds']} s: {all_of('good')} good, {all_of('refused')} refused, {all_of('cut')} cut or too long, "
        f"{all_of('aborted')} aborted, {all_of('reset')} reset, {all_of('writes')} wrong writes; {all_of('errors')} "
        f"errors, all counted. Aborts and resets by the state that they met: {left}.")


@simple("sweep")
def sweep(r: dict[str, Any]) -> str:
    tiles = f"{r['good_tiles']} good tiles" if r.get("good_tiles") else \
        f"{r['tiles']} tiles and the good tile after each bad one"
    return wrapped(f"Seed {r['seed']}: {r['engines']} engines, {tiles}, "
                   + ("no difference." if not r["failed"] else f"{r['failed']} engines FAILED."))


# ---- verification

_PROVED = {
    "async_fifo": ("`async_fifo`, 4 words", "order, never over- or underrun, gray pointers, resets of either side"),
    "stream_fifo": ("`stream_fifo`, 3 bits, 3 places",
                    "order, nothing lost or doubled, a shown beat holds; `few` and `more`"),
    "control": ("`control`, 1 lane, up to 3 planes of 2 x 2 cells",
                "legal sizes and a written table only; samples in order; rows 8 clocks apart; no unload too early; "
                "one tile done or dropped per start; no seventh state"),
    "control-2": ("`control`, 2 lanes", "the same"),
    "crc_step": ("the CRC of a nibble",
                 "equal to four steps of the definition; a frame with its own FCS leaves the residue"),
    "crossings": ("crossings of the arbiter",
                  "every path between clocks passes a synchroniser, a memory or a listed exception"),
}


@simple("formal")
def formal(r: dict[str, Any]) -> str:
    rows = []
    for name, row in r["rows"].items():
        circuit, what = _PROVED.get(name, (f"`{name}`", f"`tb/formal/{name}.sv`"))
        proved = what if row["proved"] else f"**not proved**: {'; '.join(row['failed'])}"
        rows.append([circuit, proved, row.get("number", len(row["faults"]))])
    return table(["circuit", "proved", "faults found"], rows)


@simple("rules")
def rules(r: dict[str, Any]) -> str:
    return wrapped(f"`make rules`: {r['passed']} faults put into the VHDL, " + (
        "each stopped by its rule." if not r["failed"] else f"{r['failed']} more NOT stopped by their rules."))


@complete("gates", "gates", "Gate level")
def gates(r: dict[str, Any]) -> str:
    groups = (("LUT", r"LUT\d"), ("FDRE, FDSE", "FD[RS]E"), ("RAMB18", "RAMB18.*"), ("RAMB36", "RAMB36.*"),
              ("DSP48E1", "DSP48E1"))
    rows = []
    for name, row in r["rows"].items():
        cells = [row["groups"][title] if "groups" in row else
                 sum(n for cell, n in row["cells"].items() if re.fullmatch(pattern, cell))
                 for title, pattern in groups]
        rows.append([name, row.get("clocks", row.get("steps")), row["values"], row.get("differences", 0), *cells])
    return table(["configuration", "clocks", "values", "differences", *(t for t, _ in groups)], rows)


_BROKEN = {"LUT6": "INIT inverted", "FDRE": "D inverted", "CARRY4": "S inverted", "SRL16E": "one stage more or less",
           "DSP48E1": "subtracts", "RAMB36E1": "write enables 0"}


@complete("gates.faults", "gates", "Gate level: broken cells")
def gates_faults(r: dict[str, Any]) -> str:
    rows = []
    for cell, text in r["faults"].items():
        m = re.search(r"clock (\d+) port (\w+)", text)
        rows.append([cell, _BROKEN.get(cell, ""), f"clock {m[1]}, `{m[2]}`" if m else text])
    return table(["cell", "fault", "found with tiny"], rows)


@simple("sim-ghdl")
def sim_ghdl(r: dict[str, Any]) -> str:
    if not r.get("replays"):
        return wrapped(f"`make sim-ghdl`: {r['configurations']} configurations, {r['steps'][0]} to {r['steps'][1]} "
                       "steps each, no difference.")
    return wrapped(f"`make sim-ghdl`: {r['replays']} of {r['of']} replays without a difference: {r['configurations']} "
                   f"configurations, seeds {', '.join(map(str, r['seeds']))}, {r['steps'][0]} to {r['steps'][1]} steps "
                   f"each, {r['values']:,} values compared.")


# ---- link

def _mbit(value: float) -> str:
    return f"{value:.1f}"


@simple("link-speed")
def link_speed(r: dict[str, Any]) -> str:
    one, two = r["flight_1"], r["flight_2"]
    runs = f" ({r['half_runs'][0]:.1f} to {r['half_runs'][1]:.1f}: who wins a collision is chance)" \
        if r["half_runs"] else ""
    rows = [
        ["full duplex, rows up and map down at once", f"{_mbit(r['full_up'])} up, {_mbit(r['full_down'])} Mbit/s down",
         "90 each way", "`test_goodput`, rows up and map down"],
        [f"half duplex, both directions together, mean of six runs{runs}", f"{_mbit(r['half'])} Mbit/s", "81",
         "`test_goodput`, both directions"],
        ["host library, full duplex, map of one-plane tiles", f"{_mbit(r['host_full'])} Mbit/s", "90",
         "`test_goodput`, host library"],
        ["host library, half duplex, rows and map, from OPEN to CLOSE", f"{_mbit(r['host_half'])} Mbit/s", "81",
         "same"],
        ["STATUS, link quiet / while the map is sent, at most",
         f"{r['status_quiet']:.0f} / {r['status_loaded']:.0f} us", "50 / 500", "`test_goodput`, STATUS"],
        ["engine busy, two tiles in flight, first launch to last map beat", f"{two['busy']:.2f} %", "99 %",
         "`make link-speed`"],
        ["engine busy, one tile in flight", f"{one['busy']:.1f} %, {one['stall'] / 1e6:.1f} million clocks between two "
         "tiles", "-", "same"],
        ["whole pair, 1120 x 1120, 301 planes, 45 tiles, two in flight", f"{two['seconds']:.2f} s", "-",
         "same, from three tiles"],
        ["whole pair, one in flight", f"{one['seconds']:.2f} s", "-", "same"],
    ]
    return table(["what", "measured", "wanted", "how"], rows)


@simple("link-speed.datasheet", "link-speed")
def link_speed_datasheet(r: dict[str, Any]) -> str:
    return table(["on 100 Mbit/s MII, 166 MHz, simulated time", ""], [
        ["goodput up / down at once, full duplex", f"{_mbit(r['full_up'])} / {_mbit(r['full_down'])} Mbit/s"],
        ["goodput, half duplex, both directions, mean of six runs", f"{_mbit(r['half'])} Mbit/s"],
        ["engine busy, two tiles in flight", f"{r['flight_2']['busy']:.1f} %"],
        ["the pair, first packet to last", f"{r['flight_2']['seconds']:.2f} s"]])


def _printed(name: str, kind: str, number: int, without: tuple[str, ...] = ()) -> None:
    """A table as the tool printed it, some columns and rows left out."""
    def make(r: dict[str, Any]) -> str:
        head, *rows = r["tables"][number]
        kept = [i for i, title in enumerate(head) if title not in without]
        return table([head[i] for i in kept], [[row[i] for i in kept] for row in rows if row[0] not in without])
    complete(name, kind, f"{kind}, {name.partition('.')[2]}")(
        lambda r: table(r["tables"][number][0], r["tables"][number][1:]))
    simple(name, kind)(make)


for _name, _number in (("full", 0), ("half", 1), ("rings", 2), ("lanes", 3)):
    _printed(f"link-table.{_name}", "link-table", _number, ("bands",))
for _name, _number in (("tiles", 0), ("losses", 2)):
    _printed(f"shape-table.{_name}", "shape-table", _number, ("tiles", "of them map"))
complete("shape-table.bands", "shape-table", "shape-table, bands")(
    lambda r: table(r["tables"][1][0], r["tables"][1][1:]))


# ---- coverage

def _share(found: list[int]) -> str:
    return f"{100 * found[0] / found[1]:.2f}"


def _coverage(r: dict[str, Any], head: list[str], below: float) -> str:
    """Entities with a share below this, and all."""
    rows = [[f"`{name}`", n[1], n[0], _share(n)] for name, n in r["rows"].items() if 100 * n[0] / n[1] < below]
    return table(head, [*rows, ["all", r["all"][1], r["all"][0], _share(r["all"])]])


def _coverage_text(r: dict[str, Any], what: str, below: float) -> str:
    low = [f"`{name}` {_share(n)}" for name, n in r["rows"].items() if 100 * n[0] / n[1] < below]
    return wrapped(f"{_share(r['all'])} % of {r['all'][1]:,} {what}; below {below:g} %: {', '.join(low) or 'none'}.")


_LINES = ["entity", "lines", "run", "%"]
_TOGGLES = ["entity", "bits", "changed both ways", "%"]
simple("coverage-lines")(lambda r: _coverage_text(r, "lines run", 100))
simple("coverage-toggles")(lambda r: _coverage_text(r, "bits changed both ways", 92))
complete("coverage-lines", "coverage-lines", "Lines by entity")(lambda r: _coverage(r, _LINES, 101))
complete("coverage-toggles", "coverage-toggles", "Toggled bits by entity")(lambda r: _coverage(r, _TOGGLES, 101))


# ---- accuracy

_SCENE = ["scene", "engine", "M1 mm", "M2.a %", "M2.b mm", "M3 %", "M4 px", "RMS mm"]
_BESIDE = ["<= 0.25 mm of float %", "> 2 cm %", "float's holes kept %", "hole or depth as float %"]
_FIXED = "fixed 8.2, MNCC 13, weight 8"
# The paper's means, of its section 3.2 and table 2.
_PAPER = {"rocky": ["7.50", "2.54", "102", "98.57", "87.96", "17.87"],
          "flat": ["7.86", "3.94", "124", "84.44", "101.99", "25.88"]}


def _mean(rows: list[list[str]], kind: str, engine: str) -> tuple[list[float], list[float]]:
    """Means and worst of the six measures over the scenes of a kind."""
    found = [[float(x) for x in row[2:8]] for row in rows if row[0].split()[0] == kind and row[1] == engine]
    columns = list(zip(*found))
    # A half is rounded up.
    return [sum(c) / len(c) + 1e-9 for c in columns], [min(c) if i == 3 else max(c) for i, c in enumerate(columns)]


def _rows(rows: list[list[str]], width: int) -> list[list[Any]]:
    return [[*row, *[""] * width][:width] for row in rows]


_SHORT = {"float": "float", _FIXED: "bit-true", f"{_FIXED} + both": "bit-true, cleaned up"}


def _mean_rows(scenes: list[list[str]], engines: tuple[str, ...]) -> list[list[Any]]:
    """Mean (worst) over the scenes of a kind, and how many depths are within 0.25 mm of float."""
    rows: list[list[Any]] = []
    for kind, paper in _PAPER.items():
        for engine in engines:
            mean, worst = _mean(scenes, kind, engine)
            close = [float(row[8]) for row in scenes
                     if row[0].split()[0] == kind and row[1] == engine and len(row) > 8 and row[8]]
            rows.append([kind, _SHORT[engine], *(f"{m:.2f} ({w:.2f})" for m, w in zip(mean, worst)),
                         f"{min(close)} to {max(close)}" if close else ""])
        rows.append([kind, "the paper", *paper, ""])
    return rows


_MEAN = ["scenes", *_SCENE[1:], "within 0.25 mm of float, %"]


@simple("accuracy.mean", "accuracy")
def accuracy_mean(r: dict[str, Any]) -> str:
    return table(_MEAN, _mean_rows(r["scenes"], ("float", _FIXED, f"{_FIXED} + both")))


@simple("accuracy.unseen", "accuracy")
def accuracy_unseen(r: dict[str, Any]) -> str:
    rows = [row for row in _mean_rows(r["unseen"], (f"{_FIXED} + both",)) if row[1] != "the paper"]
    return wrapped("; ".join(f"{row[0]}: " + ", ".join(f"{title} {cell}" for title, cell in zip(_MEAN[2:], row[2:-1]))
                             for row in rows) + ".")


def _all_columns(key: str, r: dict[str, Any]) -> str:
    return table(_SCENE + _BESIDE, _rows(r[key], 12))


for _name, _title in (("scenes", "Every scene"), ("unseen", "Scenes with seeds that nobody looked at"),
                      ("formats", "Every number format")):
    complete(f"accuracy.{_name}", "accuracy", _title)(functools.partial(_all_columns, _name))


_MEASURES = (("M1, RMS of errors up to 2 cm, mm", 2), ("M2.a, larger errors, %", 2), ("M2.b, their RMS, mm", 0),
             ("M3, coverage, %", 2), ("M4, mean hole, px", 1), ("all errors, RMS, mm", 2))


@simple("accuracy.datasheet", "accuracy")
def accuracy_datasheet(r: dict[str, Any]) -> str:
    """With clean-up."""
    means = [_mean(r["scenes"], kind, f"{_FIXED} + both")[0] for kind in _PAPER]
    rows = []
    for i, (title, digits) in enumerate(_MEASURES):
        row = [title]
        for mean, paper in zip(means, _PAPER.values()):
            row += [f"{mean[i]:.{digits}f}", f"{float(paper[i]):.0f}" if i == 4 else paper[i]]
        rows.append(row)
    return table(["", "rocky", "paper", "flat", "paper"], rows)


# ---- this machine

@complete("fresh-machine", "fresh-machine", "Bare machines")
def fresh_machine(r: dict[str, Any]) -> str:
    names = {"bookworm": "Debian 12", "trixie": "Debian 13"}
    return table(["bare root", "command", "seconds", "exit code"],
                 [[names.get(s, s), f"`{c}`", t, code] for s, rows in r["suites"].items() for t, code, c in rows])


# ---- stamps of what other tools fill

def _origin_of(kind: str, what: str) -> None:
    BLOCKS[kind] = ((kind,), lambda records, _: what if kind in records else "")


_origin_of("cost", "Tables of cost in all pages, and the line 'cost' of each entity's page:")


# ---- several kinds at once

def _at(kind: str, records: Records, origins: Origins) -> str:
    """A cell: which commit, and whether it is still so."""
    if kind not in records:
        return "not measured"
    stamp = records[kind].stamp
    since = re.search(r"; (?:the RTL has|its sources have) changed since", origins[kind])
    return f"{stamp.commit}{'' if stamp.passed else ', with failures'}{since[0] if since else ''}"


def _faults_of(r: dict[str, Any]) -> int:
    return sum(row.get("number", len(row["faults"])) for row in r["rows"].values())


@block("summary", "sim-ghdl", "gates", "mutants", "coverage-lines", "formal", "soak", "flips", "flips-chip", "rules",
       "fresh-machine")
def summary(records: Records, origins: Origins) -> str:
    def found(kind: str, text: Callable[[dict[str, Any]], str]) -> str:
        return text(records[kind].results) if kind in records else "-"

    def mutant_text(r: dict[str, Any]) -> str:
        a = r["all"]
        text = f"{a['tested']}: {a['own'] + a['whole'] + a['no_end']} found, {a['equivalent']} equivalent"
        text += f", {a['survived']} survived" if a["survived"] else ""
        return text + (f", {a['waiting']} not through all tests" if a["waiting"] else "")
    rows = [
        ("sim-ghdl", lambda r: f"{r['configurations']} engines, no difference", "`make sim-ghdl`"),
        ("rules", lambda r: f"{r['passed']} faults stopped" + (f", {r['failed']} NOT" if r["failed"] else ""),
         "`make rules`"),
        ("gates", lambda r: f"{len(r['rows']) // 2} engines as two netlists each, "
         + ("no difference" if not any(x.get("differences") for x in r["rows"].values()) else "DIFFERENCES"),
         "`make sim-gates`"),
        ("mutants", mutant_text, "`make mutants`"),
        ("coverage-lines", lambda r: f"{_share(r['all'])} % of the lines", "`make coverage`"),
        ("formal", lambda r: f"{sum(x['proved'] for x in r['rows'].values())} circuits proved, {_faults_of(r)} faults "
         "found", "`make formal`"),
        ("soak", lambda r: f"{r['tiles']:,} random tiles, all counted", "`make soak`"),
        ("flips", lambda r: f"{r['all']['flips']:,} upsets, "
         + (f"{r['all']['hang']} hang" if r["all"]["hang"] else "nothing hangs"), "`make flips`"),
        ("flips-chip", lambda r: _chip_verdict(r).replace(":", " upsets:"), "`make flips-chip`"),
        ("fresh-machine", lambda r: "; ".join(f"{s}: " + " + ".join(str(t) if not code else "FAILED"
                                                                   for t, code, _ in rows) + " s"
                                              for s, rows in r["suites"].items()), "`make fresh-machine`"),
    ]
    return table(["command", "latest result", "at commit"],
                 [[command, found(kind, text), _at(kind, records, origins)] for kind, text, command in rows])


@block("readme", "cost", "accuracy", "link-speed", "mutants")
def readme(records: Records, origins: Origins) -> str:
    """README.md: the figures that say most, beside the paper's."""
    rows: list[tuple[str, str, str, str, str]] = []
    if "cost" in records:
        base = json.loads((sources.ROOT / "scripts" / "cost" / "baseline.json").read_text())
        c = base["points"]["bands"]["xc6v"]["flat"]["counts"]
        clocks = [f"{base['frames'][name]['clocks'] / 1e6:.1f}" for name in ("bands", "tile", "tile_2", "tile_4")]
        rows += [("one lane, 44-30-13-13, Virtex-6", f"{c['lut']:,} LUT, {c['ff']:,} FF, {c['ram36_equivalent']:g} "
                  f"RAMB36, {c['dsp']} DSP (Yosys)", "5,448 LUT, 5,747 FF, 100 RAMB36, 53 DSP (ISE)", "cost",
                  "`make cost`"),
                 ("M clocks for a pair, full-width bands of 30 rows", clocks[0], "about 515", "cost", "same"),
                 ("M clocks, 256 x 130 tiles, 1 / 2 / 4 lanes", " / ".join(clocks[1:]), "-", "cost", "same")]
    if "accuracy" in records:
        found = [_mean(records["accuracy"].results["scenes"], kind, _FIXED)[0] for kind in _PAPER]
        for i, title in ((0, "RMS of errors up to 2 cm, mm, rocky / flat"), (1, "larger errors, %"),
                         (3, "coverage, %")):
            rows.append((title, " / ".join(f"{mean[i]:.2f}" for mean in found),
                         " / ".join(paper[i] for paper in _PAPER.values()), "accuracy", "`make accuracy`"))
    if "link-speed" in records:
        r = records["link-speed"].results
        rows += [("goodput on 100 Mbit/s MII, up / down at once, Mbit/s",
                  f"{_mbit(r['full_up'])} / {_mbit(r['full_down'])}", "81", "link-speed", "`make link-speed`"),
                 ("a pair over the link at 166 MHz, s", f"{r['flight_2']['seconds']:.2f}", "3.1 (sweep alone)",
                  "link-speed", "same")]
    if "mutants" in records:
        a = records["mutants"].results["all"]
        rows.append(("faults put into the RTL one at a time",
                     f"{a['tested']}: {a['own'] + a['whole'] + a['no_end']} found, {a['equivalent']} equivalent", "-",
                     "mutants", "`make mutants`"))
    cells, last = [], ""
    for what, ours, paper, kind, command in rows:
        again = kind == last
        cells.append([what, ours, paper, "same" if again else command,
                      "same" if again else _at(kind, records, origins)])
        last = kind
    return table(["1120 x 1120 pixels, 301 planes, M = 13", "psweep", "the paper", "command", "at commit"], cells)
