# SPDX-License-Identifier: Apache-2.0
"""Reads what nxpython leaves behind: logsPython/hierarchy.json and the .timing report of the analyser.

No report of this design exists. The fields of hierarchy.json are those that public scripts for NG-MEDIUM read; the
table 'Reporting timing constraints' is known from public scripts that read it too. tb/flows/ has short files of this
form.
"""
import json
import re

FIELDS = {"lut": "count4Lut", "ff": "countDff", "carry": "count1Cy", "rf": "countRegFileBlock",
          "ram48": "countMemBlock", "dsp": "countDsp"}


class ReportError(Exception):
    """Names the report and what is missing in it."""


def hierarchy(text, entities, report="hierarchy.json"):
    """(counts of the whole, {entity: {'instances': n, count ..}}). The first module is the top. Which field of a module
    has its name is not known: any text in it that starts with the name of an entity, alone or before a bracket. Whether
    the counts of a unit contain those of what stands in it is not known either: they are handed on as they are."""
    try:
        modules = json.loads(text)["m_moduleCollection"]
        counts = {key: int(modules[0]["contentReport"][field]) for key, field in FIELDS.items()}
    except (ValueError, KeyError, IndexError, TypeError) as error:
        raise ReportError("{}: not of the known form ({!r})".format(report, error))
    units = {}
    for module in modules[1:]:
        texts = [value for value in module.values() if isinstance(value, str)]
        names = {name for value in texts for name in re.findall(r"\A(\w+)(?:\(\w+\))?\Z", value) if name in entities}
        if len(names) == 1 and "contentReport" in module:
            unit = units.setdefault(names.pop(), dict.fromkeys(["instances"] + list(FIELDS), 0))
            unit["instances"] += 1
            for key, field in FIELDS.items():
                unit[key] += int(module["contentReport"].get(field, 0))
    return counts, units


def tables(text):
    """Tables of '|' and '+--', each as a list of rows."""
    found, rows = [], []
    for line in text.splitlines() + [""]:
        line = line.strip()
        if line.startswith("|"):
            rows.append([cell.strip() for cell in line.strip("|").split("|")])
        elif not line.startswith("+-") and rows:
            found.append(rows)
            rows = []
    return found


def timing(text, periods, report=".timing"):
    """({clock: {'asked_ns', 'reached_ns', 'fmax_mhz'}}, all met) by the slack in column 'Setup/Recovery'."""
    found = {}
    behind = text.partition("Reporting timing constraints")[2]
    rows = next((table for table in tables(behind) if any("Setup/Recovery" in row for row in table)), None)
    if rows is None:
        raise ReportError("{}: no table 'Reporting timing constraints'".format(report))
    head = next(i for i, row in enumerate(rows) if "Setup/Recovery" in row)
    column = rows[head].index("Setup/Recovery")
    met = True
    for row in rows[head + 1:]:
        slack = re.match(r"(-?[\d.]+)\s*(ns|ps)\Z", row[column]) if len(row) > column else None
        if not slack:
            continue
        value = float(slack[1]) / (1 if slack[2] == "ns" else 1e3)
        met = met and value >= 0
        name = next((cell for cell in row if cell in periods), None)
        if name:
            reached = round(periods[name] - value, 3)
            found[name] = {"asked_ns": periods[name], "reached_ns": reached, "fmax_mhz": round(1e3 / reached, 1)}
    if set(found) != set(periods):
        raise ReportError("{}: no slack of {}".format(report, ", ".join(sorted(set(periods) - set(found)))))
    return found, met
