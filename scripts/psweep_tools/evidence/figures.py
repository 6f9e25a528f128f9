# SPDX-License-Identifier: Apache-2.0
"""Tables of figures that stand in the pages by hand. Each is inside a block, or its section says at which commit it was
measured ('at commit 1234abc'), or scripts/psweep_tools/evidence/not_measured.txt says why it is no measurement."""
import fnmatch
import pathlib
import re

from . import sources
from .pages import page_files

WAIVERS = "scripts/psweep_tools/evidence/not_measured.txt"
# Cells that are a figure: a number, with a unit or several of them.
_FIGURE = re.compile(r"\**[+-]?(about )?\d[\d., x/+%()-]*"
                     r"( (LUT|FF|RAMB36|DSP|Mbit/s|Mbit|ms|us|s|M|%|MHz|mm|K|clocks).*)?\**$")
_COMMIT = re.compile(r"\bcommit `?[0-9a-f]{7,}\b|\bAt commit\b", re.I)
FEWEST = 5  # figures, from which on a table is one of figures


def waivers(root: pathlib.Path = sources.ROOT) -> dict[tuple[str, str], str]:
    """{(page, beginning of the head line): reason}."""
    out = {}
    for n, line in enumerate((root / WAIVERS).read_text().splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        m = re.fullmatch(r"(\S+) (\|.*\S) \|\| (\S.*)", line)
        if not m:
            raise ValueError(f"{WAIVERS}:{n}: no 'page | head .. || reason'")
        out[m[1], m[2]] = m[3]
    return out


def tables(text: str) -> list[tuple[int, str, int]]:
    """Tables outside of blocks: line number, head, figures."""
    out: list[tuple[int, str, int]] = []
    inside, count, head, start, in_table = False, 0, "", 0, False
    lines = re.sub(r"(?m)^```.*?^```", lambda m: "\n" * m[0].count("\n"), text, flags=re.S).splitlines()
    for number, line in enumerate([*lines, ""], 1):
        if re.match(r"<!-- (evidence|cost|dse): ", line):
            inside = True
        elif re.match(r"<!-- /(evidence|cost|dse) ", line):
            inside = False
        row = line.startswith("|") and not inside
        if row and not in_table:
            in_table, head, start, count = True, line, number, 0
        elif row:
            count += sum(bool(_FIGURE.match(cell.strip())) for cell in line.strip("|").split("|")[1:])
        elif in_table:
            in_table = False
            out.append((start, head, count))
    return out


def check(root: pathlib.Path = sources.ROOT) -> list[str]:
    known = waivers(root)
    used: set[tuple[str, str]] = set()
    wrong = []
    for page in page_files(root):
        name, text = str(page.relative_to(root)), page.read_text()
        sections = re.split(r"(?m)^(?=##? )", text)
        for number, head, count in tables(text):
            entry = next((key for key in known if fnmatch.fnmatch(name, key[0]) and head.startswith(key[1])), None)
            if entry:
                used.add(entry)
                continue
            if count < FEWEST:
                continue
            at = text.splitlines()[:number]
            section = sections[sum(bool(re.match(r"##? ", line)) for line in at)]
            if not _COMMIT.search(section):
                wrong.append(f"{name}:{number}: figures that do not say at which commit they were measured: "
                             f"{head[:80]}")
    wrong += [f"{WAIVERS}: fits no table: {page} {head}" for page, head in sorted(known.keys() - used)]
    return wrong
