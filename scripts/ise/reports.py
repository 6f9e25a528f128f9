# SPDX-License-Identifier: Apache-2.0
"""Reads the reports of ISE 14.7: xst (.syr), map (.mrp), trce (.twr).

Their form is that of public reports of this release for Virtex-5, Virtex-6 and Spartan-6; tb/flows/ has short ones
of the same form. A line that must be there and is not is an error: no count is zero because it was not found.
"""
import re


class ReportError(Exception):
    """Names the report and what is missing in it."""


def number(text, label, report, optional=False):
    """Number behind 'label:' at the start of a line."""
    match = re.search(r"^\s*{}:\s+([\d,]+)".format(re.escape(label)), text, re.M)
    if not match:
        if optional:
            return None
        raise ReportError("{}: no line '{}:'".format(report, label))
    return int(match[1].replace(",", ""))


def slices(text, report):
    """Counts that xst and map write in the same words, for both families. Virtex-5 leaves out lines of what is unused;
    Virtex-6 writes 0."""
    counts = {"lut": number(text, "Number of Slice LUTs", report),
              "ff": number(text, "Number of Slice Registers", report)}
    shift = number(text, "Number used as Shift Register", report, True)
    shift = shift if shift is not None else number(text, "Number used as SRL", report, True)
    memory = number(text, "Number used as Memory", report, True) or 0
    counts["srl"] = shift or 0
    counts["lutram"] = memory - counts["srl"]
    counts["lut_memory"] = memory
    return counts


def map_report(text, report=".mrp"):
    """(counts of the whole, {path: counts with all below}) of a map report made with -detail."""
    if "Xilinx Mapping Report File" not in text:
        raise ReportError("{}: no map report".format(report))
    counts = slices(text, report)
    if re.search(r"Number of RAMB36E1/FIFO36E1s", text):
        counts["ram36"] = number(text, "Number of RAMB36E1/FIFO36E1s", report)
        counts["ram18"] = number(text, "Number of RAMB18E1/FIFO18E1s", report)
        counts["dsp"] = number(text, "Number of DSP48E1s", report)
    elif re.search(r"^Target Device\s*:\s*x[cq]r?5v", text, re.M):
        counts["ram36"] = number(text, "Number of 36k BlockRAM used", report, True) or 0
        counts["ram18"] = number(text, "Number of 18k BlockRAM used", report, True) or 0
        if number(text, "Number of BlockRAM/FIFO", report, True) and not counts["ram36"] + counts["ram18"]:
            raise ReportError("{}: block RAM without its sizes".format(report))
        counts["dsp"] = number(text, "Number of DSP48Es", report, True) or 0
    else:
        raise ReportError("{}: neither Virtex-5 nor Virtex-6".format(report))
    counts["ram36_equivalent"] = counts["ram36"] + counts["ram18"] / 2
    return counts, hierarchy(text, report)


def hierarchy(text, report):
    """Section 13, 'own/with all below': {('u_psweep_top', 'u_engine'): {'lut': n, ..}} below the top."""
    sections = text.split("Section 13 - Utilization by Hierarchy\n")
    rows = [line for line in sections[-1].splitlines() if line.startswith("|")]
    if len(sections) < 2 or len(rows) < 2:
        raise ReportError("{}: no Section 13: map needs -detail".format(report))
    cells = [[cell.strip() for cell in row.strip().strip("|").split("|")] for row in rows]
    head = cells[0]
    wanted = {"lut": "LUTs", "ff": "Slice Reg", "lut_memory": "LUTRAM", "ram_blocks": "BRAM/FIFO",
              "dsp": next((title for title in head if title.startswith("DSP48")), "DSP48")}
    for title in list(wanted.values()) + ["Module"]:
        if title not in head:
            raise ReportError("{}: Section 13 has no column '{}'".format(report, title))
    found, path = {}, []
    for row in cells[1:]:
        module = row[head.index("Module")]
        depth = len(module) - len(module.lstrip("+"))
        name = module.lstrip("+").strip().rstrip("/")
        if depth > len(path) or (depth == 0 and path):
            raise ReportError("{}: Section 13: '{}' stands nowhere".format(report, module))
        path = path[:depth] + [name]
        counts = {}
        for key, title in wanted.items():
            match = re.match(r"\d+/(\d+)\Z", row[head.index(title)])
            if not match:
                raise ReportError("{}: Section 13: '{}' of {}".format(report, row[head.index(title)], name))
            counts[key] = int(match[1])
        found[tuple(path[1:])] = counts
    return found


def timing_report(text, report=".twr"):
    """({constraint: {'asked_ns', 'reached_ns', 'errors'}}, all met). A constraint without paths has no 'reached_ns'."""
    if not re.search(r"^Release .* Trace", text, re.M):
        raise ReportError("{}: no report of trce".format(report))
    found = {}
    for block in text.split("\nTiming constraint: ")[1:]:
        title = re.sub(r"\s+", " ", block.split(";")[0])
        name = re.match(r"(TS_\w+) = |", title)[1] or title
        asked = re.search(r"\s([\d.]+) (ns|MHz)\b", title)
        reached = re.search(r"^ (?:Minimum period|Maximum delay|Minimum allowable offset) is\s+([\d.]+)ns", block, re.M)
        errors = re.search(r"(\d+) timing errors? detected", block)
        found[name] = {"errors": int(errors[1]) if errors else 0}
        if asked:
            value = float(asked[1])
            found[name]["asked_ns"] = round(value if asked[2] == "ns" else 1e3 / value, 3)
        if reached:
            found[name]["reached_ns"] = float(reached[1])
    if not found:
        raise ReportError("{}: no timing constraint".format(report))
    met = bool(re.search(r"^All constraints were met\.", text, re.M))
    missed = re.search(r"^(\d+) constraints? not met\.", text, re.M)
    if met == bool(missed):
        raise ReportError("{}: does not say whether the constraints were met".format(report))
    return found, met


def clocks(constraints, names, report=".twr"):
    """{'clk': {'asked_ns', 'reached_ns', 'fmax_mhz'}} of these clocks, by the PERIOD constraints TS_<clock>."""
    found = {}
    for name in names:
        row = constraints.get("TS_" + name, {})
        if "reached_ns" not in row or "asked_ns" not in row:
            raise ReportError("{}: no minimum period by TS_{}".format(report, name))
        found[name] = {"asked_ns": row["asked_ns"], "reached_ns": row["reached_ns"],
                       "fmax_mhz": round(1e3 / row["reached_ns"], 1)}
    return found


def synthesis_report(text, report=".syr"):
    """(counts, estimated MHz) of xst, before map: for --synthesise."""
    if "Final Report" not in text:
        raise ReportError("{}: xst did not come to its end".format(report))
    text = text[text.rindex("Device utilization summary"):] if "Device utilization summary" in text else text
    counts = slices(text, report)
    counts["ram36_equivalent"] = number(text, "Number of Block RAM/FIFO", report, True) or 0
    dsp = re.search(r"^\s*Number of DSP48E1?s:\s+(\d+)", text, re.M)
    counts["dsp"] = int(dsp[1]) if dsp else 0
    period = re.search(r"Minimum period:\s+([\d.]+)ns", text)
    return counts, round(1e3 / float(period[1]), 1) if period else None
