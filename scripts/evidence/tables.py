# SPDX-License-Identifier: Apache-2.0
"""Tables of the pages out of the records. Each block: the kinds it tells of, and a function of their records (those
that there are) and of where each is from, in words."""
import re
import textwrap
from collections.abc import Callable
from typing import Any

from evidence.records import Record

Records = dict[str, Record]
Origins = dict[str, str]
Maker = Callable[[Records, Origins], str]
BLOCKS: dict[str, tuple[tuple[str, ...], Maker]] = {}


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


def table(head: list[str], rows: list[list[Any]]) -> str:
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head)] +
                     ["| " + " | ".join("-" if c is None else str(c) for c in row) + " |" for row in rows])


def wrapped(text: str, width: int = 120, indent: str = "") -> str:
    return textwrap.fill(text, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def dash(number: int) -> Any:
    return number or "-"


# ---- mutants

@simple("mutants")
def mutants(r: dict[str, Any]) -> str:
    a = r["all"]
    rows = [[f"`{name}`", row["drawn"], row["tested"], dash(row["own"]), dash(row["whole"]), dash(row["no_end"]),
             dash(row["equivalent"]), dash(row["survived"]), dash(row["waiting"])]
            for name, row in [*r["entities"].items(), ("all", a)]]
    rows[-1][0] = "all"
    text = table(["entity", "drawn", "run", "found by its own test", "by those of engine or chip", "no end",
                  "equivalent", "survived", "not through all tests"], rows)
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

@simple("flips")
def flips(r: dict[str, Any]) -> str:
    configs = list(r["clocks"])
    keys = ("flips", "masked", "status", "detected", "silent", "later", "hang")
    rows = [[name, *(row[k] for k in keys), " / ".join(str(row["worst"].get(c, "-")) for c in configs)]
            for name, row in [*r["rows"].items(), ("**all**", r["all"])]]
    plain = ", ".join(f"{r['clocks'][c]} (`{c}`)" for c in configs)
    verdict = ("**No upset hung the engine**" if r["all"]["hang"] == 0 else
               f"**{r['all']['hang']} upsets hung the engine**")
    return (table(["upset in", *keys, "worst clocks, " + " / ".join(configs)], rows) + "\n\n" +
            wrapped(f"{verdict}: {r['all']['flips']} upsets. Without an upset the tile takes {plain} clocks."))


def _chip_verdict(r: dict[str, Any]) -> str:
    a = r["all"]
    silent = f"{a['silent']} silently wrong" if a.get("silent") else "none silently wrong"
    hang = f"{a['hang']} hang" if a.get("hang") else "none hangs"
    return f"{a['flips']:,}: {hang}, {silent}"


@simple("flips-chip")
def flips_chip(r: dict[str, Any]) -> str:
    names = {"resent": "of the masked: resent"}
    text = table(["upset in", *(names.get(c, c) for c in r["columns"])],
                 [[name, *(row[c] for c in r["columns"])] for name, row in [*r["rows"].items(), ("**all**", r["all"])]])
    if r["about"]:
        text += "\n\n" + wrapped(r["about"][0].upper() + r["about"][1:] + ".")
    for kind, title in (("hang", "Hung"), ("silent", "Silently wrong"), ("error", "Reported as an error")):
        if r["sites"][kind]:
            found = sorted(r["sites"][kind].items(), key=lambda pair: (pair[0] == "the engine", pair[0]))
            text += "\n\n" + wrapped(f"{title}, by register, with the number of upsets: "
                                     + ", ".join(f"{name} {n}" for name, n in found) + ".")
    return text


@simple("soak")
def soak(r: dict[str, Any]) -> str:
    keys = ("tiles", "good", "refused", "cut", "aborted", "reset", "writes", "errors")
    rows = [[name, *(row[k] for k in keys), f"{row['mclocks']:.2f}"] for name, row in r["rows"].items()]
    states = ("idle", "load", "sweep", "flush", "unload")
    left = ", ".join(f"{s} {n}" for s, n in zip(states, r["left_in"]))
    return table(["configuration", "tiles", "good", "refused", "cut or too long", "aborted", "reset", "wrong writes",
                  "errors, all counted", "M clocks"], rows) + "\n\n" + wrapped(
        f"Seed {r['seed']}, {r['tiles']} tiles and those behind bad ones, {r['seconds']} s. Aborts and resets by the "
        f"state that they met: {left}.")


@simple("sweep")
def sweep(r: dict[str, Any]) -> str:
    tiles = f"{r['good_tiles']} good tiles" if r.get("good_tiles") else f"{r['tiles']} tiles and those behind bad ones"
    return wrapped(f"Seed {r['seed']}: {r['engines']} engines, {tiles}, "
                   + ("no difference." if not r["failed"] else f"{r['failed']} engines FAILED."))


# ---- verification

_PROVED = {
    "async_fifo": ("`async_fifo`, 4 words", "order, never over- or underrun, gray pointers, resets of either side"),
    "stream_fifo": ("`stream_fifo`, 3 bits, 3 places",
                    "order, nothing lost or doubled, a shown beat holds; `few` and `more`"),
    "control": ("`control`, 1 lane, up to 3 planes of 2 x 2 cells",
                "a tile starts only with legal sizes and a written table; its pixels and samples in order; rows 8 "
                "clocks apart; no unload too early; each start ends in one tile done or one dropped; no state beyond "
                "the six"),
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
        rows.append([circuit, proved, f"{row['ms'] / 1000:.3g} s" if row["ms"] else "-",
                     row.get("number", len(row["faults"]))])
    return table(["circuit", "proved", "time, faults included", "faults found"], rows)


@simple("rules")
def rules(r: dict[str, Any]) -> str:
    return wrapped(f"`make rules`: {r['passed']} faults put into the VHDL, " + (
        "each stopped by its rule." if not r["failed"] else f"{r['failed']} more NOT stopped by their rules."))


@simple("gates")
def gates(r: dict[str, Any]) -> str:
    groups = (("LUT", r"LUT\d"), ("INV", "INV"), ("MUXF", r"MUXF\d"), ("CARRY4", "CARRY4"), ("FDRE, FDSE", "FD[RS]E"),
              ("SRL", "SRL.*"), ("RAM32M, RAM64M", r"RAM\d+\w?"), ("RAMB18", "RAMB18.*"), ("RAMB36", "RAMB36.*"),
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


@simple("gates.faults", "gates")
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
         "likewise"],
        ["STATUS, link quiet / while the map is sent, at most",
         f"{r['status_quiet']:.0f} / {r['status_loaded']:.0f} us", "50 / 500", "`test_goodput`, STATUS"],
        ["engine busy, two tiles in flight, first launch to last map beat", f"{two['busy']:.2f} %", "99 %",
         "`make link-speed`"],
        ["engine busy, one tile in flight", f"{one['busy']:.1f} %, {one['stall'] / 1e6:.1f} million clocks between two "
         "tiles", "-", "likewise"],
        ["whole pair, 1120 x 1120, 301 planes, 45 tiles, two in flight", f"{two['seconds']:.2f} s", "-",
         "likewise, from 3 tiles"],
        ["whole pair, one in flight", f"{one['seconds']:.2f} s", "-", "likewise"],
    ]
    return table(["what", "measured", "wanted", "how"], rows)


@simple("link-speed.datasheet", "link-speed")
def link_speed_datasheet(r: dict[str, Any]) -> str:
    return table(["on 100 Mbit/s MII, 166 MHz, simulated time", ""], [
        ["goodput up / down at once, full duplex", f"{_mbit(r['full_up'])} / {_mbit(r['full_down'])} Mbit/s"],
        ["goodput, half duplex, both directions, mean of six runs", f"{_mbit(r['half'])} Mbit/s"],
        ["engine busy, two tiles in flight", f"{r['flight_2']['busy']:.1f} %"],
        ["the pair, first packet to last", f"{r['flight_2']['seconds']:.2f} s"]])


@simple("link-speed.readme", "link-speed")
def link_speed_readme(r: dict[str, Any]) -> str:
    runs = f", {r['half_runs'][0]:.0f} to {r['half_runs'][1]:.0f}" if r["half_runs"] else ""
    return table(["simulated time, 166 MHz, 100 Mbit/s MII", "ours", "paper", "command"], [
        ["goodput, full duplex, both ways at once",
         f"{_mbit(r['full_up'])} up, {_mbit(r['full_down'])} down Mbit/s", "81 Mbit/s", "`make link-speed`"],
        [f"goodput, half duplex, sum of both directions, chip (mean of six runs{runs}) / with the host library",
         f"{_mbit(r['half'])} / {_mbit(r['host_half'])} Mbit/s", "-", "same"],
        ["engine busy, two tiles in flight, 256 x 130 tiles", f"{r['flight_2']['busy']:.1f} %", "-", "same"],
        ["a 1120 x 1120 x 301 pair, first packet to last, two tiles in flight / one",
         f"{r['flight_2']['seconds']:.2f} / {r['flight_1']['seconds']:.2f} s", "-",
         "same, from its first three tiles"]])


def _printed(name: str, kind: str, number: int) -> None:
    """A table as the tool printed it."""
    def make(r: dict[str, Any]) -> str:
        t = r["tables"][number]
        return table(t[0], t[1:])
    simple(name, kind)(make)


for _name, _number in (("full", 0), ("half", 1), ("rings", 2), ("lanes", 3)):
    _printed(f"link-table.{_name}", "link-table", _number)
for _name, _number in (("tiles", 0), ("bands", 1), ("losses", 2)):
    _printed(f"shape-table.{_name}", "shape-table", _number)


# ---- coverage

def _share(found: list[int]) -> str:
    return f"{100 * found[0] / found[1]:.2f}"


@simple("coverage-lines")
def coverage_lines(r: dict[str, Any]) -> str:
    rows = [[f"`{name}`", n[1], n[0], _share(n)] for name, n in r["rows"].items()]
    return table(["entity", "lines", "run", "%"], [*rows, ["all", r["all"][1], r["all"][0], _share(r["all"])]])


@simple("coverage-toggles")
def coverage_toggles(r: dict[str, Any]) -> str:
    rows = [[f"`{name}`", n[1], n[0], _share(n)] for name, n in r["rows"].items()]
    return table(["entity", "bits", "changed both ways", "%"],
                 [*rows, ["all", r["all"][1], r["all"][0], _share(r["all"])]])


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


@simple("accuracy.mean", "accuracy")
def accuracy_mean(r: dict[str, Any]) -> str:
    rows = []
    for kind, paper in _PAPER.items():
        for engine in ("float", "float + both", _FIXED, f"{_FIXED} + both"):
            mean, worst = _mean(r["scenes"], kind, engine)
            rows.append([f"{kind}, mean (worst)", engine, *(f"{m:.2f} ({w:.2f})" for m, w in zip(mean, worst))])
        rows.append([kind, "the paper", *paper])
    return table(["scenes, 3 seeds", *_SCENE[1:]], rows)


@simple("accuracy.scenes", "accuracy")
def accuracy_scenes(r: dict[str, Any]) -> str:
    return table(_SCENE + _BESIDE, _rows(r["scenes"], 12))


@simple("accuracy.unseen", "accuracy")
def accuracy_unseen(r: dict[str, Any]) -> str:
    shown = [row for row in r["unseen"] if row[1] in ("float", _FIXED, f"{_FIXED} + both")]
    rows = _rows(shown, 8)
    for kind in _PAPER:
        for engine in (_FIXED, f"{_FIXED} + both"):
            mean, _ = _mean(r["unseen"], kind, engine)
            rows.append([f"**{kind}, mean**", engine, *(f"{m:.{d}f}" for m, d in zip(mean, (2, 2, 1, 2, 1, 2)))])
    return table(_SCENE, rows)


@simple("accuracy.formats", "accuracy")
def accuracy_formats(r: dict[str, Any]) -> str:
    return table(_SCENE + _BESIDE, _rows(r["formats"], 12))


_MEASURES = (("M1, RMS of errors up to 2 cm, mm", 2), ("M2.a, larger errors, %", 2), ("M2.b, their RMS, mm", 0),
             ("M3, coverage, %", 2), ("M4, mean hole, px", 1), ("all errors, RMS, mm", 2))


def _measures(r: dict[str, Any], both_only: bool) -> list[list[Any]]:
    found = {(kind, clean): _mean(r["scenes"], kind, _FIXED + (" + both" if clean else ""))[0]
             for kind in _PAPER for clean in (False, True)}
    rows = []
    for i, (title, digits) in enumerate(_MEASURES):
        row = [title]
        for kind, paper in _PAPER.items():
            row += [f"{found[kind, clean][i]:.{digits}f}" for clean in ((True,) if both_only else (False, True))]
            row.append(f"{float(paper[i]):.0f}" if i == 4 else paper[i])
        rows.append(row)
    return rows


@simple("accuracy.readme", "accuracy")
def accuracy_readme(r: dict[str, Any]) -> str:
    return table(["", "rocky: ours", "with clean-up", "paper", "flat: ours", "with clean-up", "paper"],
                 _measures(r, False))


@simple("accuracy.datasheet", "accuracy")
def accuracy_datasheet(r: dict[str, Any]) -> str:
    return table(["", "rocky", "paper", "flat", "paper"], _measures(r, True))


# ---- this machine

@simple("fresh-machine")
def fresh_machine(r: dict[str, Any]) -> str:
    names = {"bookworm": "Debian 12", "trixie": "Debian 13"}
    return table(["bare root", "command", "seconds", "exit code"],
                 [[names.get(s, s), f"`{c}`", t, code] for s, rows in r["suites"].items() for t, code, c in rows])


# ---- stamps of what other tools fill

def _origin_of(kind: str, what: str) -> None:
    BLOCKS[kind] = ((kind,), lambda records, _: what if kind in records else "")


_origin_of("cost", "Every table of costs, in this page and in the others, and the line 'cost' of every entity's page:")


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
        ("the original VHDL in GHDL, every output port at every clock, memories unknown at the start", "sim-ghdl",
         lambda r: f"{r['configurations']} engines, no difference", "`make sim`, `make sim-ghdl`"),
        ("rules in the VHDL, each with a fault that it has to stop", "rules", lambda r: f"{r['passed']}"
         + (f", {r['failed']} FAILED" if r["failed"] else ""), "`make rules`"),
        ("the netlist for Virtex-6 at gate level, and the one that is counted", "gates",
         lambda r: f"{len(r['rows']) // 2} engines each, "
         + ("no difference" if not any(x.get("differences") for x in r["rows"].values()) else "DIFFERENCES"),
         "`make sim-gates`"),
        ("small faults put into the RTL, one at a time", "mutants", mutant_text, "`make mutants`"),
        ("lines of VHDL that the recordings run", "coverage-lines", lambda r: f"{_share(r['all'])} %",
         "`make coverage`"),
        ("proofs by induction: FIFOs, control, CRC, clock crossings", "formal",
         lambda r: f"{sum(x['proved'] for x in r['rows'].values())}, and {_faults_of(r)} faults found",
         "`make formal`"),
        ("random tiles with stalls, resets, bad packets and registers", "soak",
         lambda r: f"{r['tiles']:,}, all counted", "`make soak`"),
        ("bits flipped in control, plane table, map of the engine", "flips",
         lambda r: f"{r['all']['flips']:,}, " + (f"{r['all']['hang']} hang" if r["all"]["hang"] else "nothing hangs"),
         "`make flips`"),
        ("bits flipped in all registers of the chip, while tiles run over the link", "flips-chip",
         _chip_verdict, "`make flips-chip`"),
        ("README's commands in a bare Debian root, seconds, packages included", "fresh-machine",
         lambda r: "; ".join(f"{s}: " + " + ".join(str(t) if not code else "FAILED" for t, code, _ in rows)
                             for s, rows in r["suites"].items()), "`make fresh-machine`"),
    ]
    return table(["layer", "figure", "command", "at commit"],
                 [[what, found(kind, text), command, _at(kind, records, origins)]
                  for what, kind, text, command in rows])
