# SPDX-License-Identifier: Apache-2.0
"""The blocks of the pages: between `<!-- evidence: NAME -->` and `<!-- /evidence -->` stands what tables.py makes of
the records, and at which commit it was measured. Never edited by hand."""
import pathlib
import re
from dataclasses import dataclass

from . import sources
from .manifest import BY_NAME
from .records import Record, Status
from .tables import BLOCKS, FULL, wrapped

_BLOCK = re.compile(r"^<!-- evidence: ([\w.-]+) -->\n(.*?)^<!-- /evidence -->", re.S | re.M)
# Changes with every edit of the RTL, so it does not count when a block is compared with its results.
SINCE = re.compile(r"; (?:the RTL has|its sources have) changed since")


def page_files(root: pathlib.Path = sources.ROOT) -> list[pathlib.Path]:
    return [root / "README.md", *sorted((root / "docs").rglob("*.md"))]


def kinds_of(block: str) -> tuple[str, ...]:
    """The kinds that a block tells of."""
    if block in BLOCKS:
        return BLOCKS[block][0]
    return ()


def since(status: Status) -> str:
    """'; the RTL has changed since', or nothing."""
    if status.record is None or not status.changed:
        return ""
    rtl = any(name.startswith("rtl/") for name in status.changed)
    return f"; {'the RTL has' if rtl else 'its sources have'} changed since"


def origin(status: Status) -> str:
    """Where a figure is from, in words."""
    if status.record is None:
        return "never measured"
    stamp = status.record.stamp
    at = f"commit {stamp.commit}" + (" with changes of its own" if stamp.edited else "")
    return f"{at} ({stamp.date}){'' if stamp.passed else ', with failures'}{since(status)}"


def generate(block: str, status: dict[str, Status]) -> str:
    """What has to stand in a block."""
    kinds, make = BLOCKS[block]
    records: dict[str, Record] = {name: s.record for name in kinds if (s := status[name]).record is not None}
    text = make(records, {name: origin(status[name]) for name in kinds})
    if len(kinds) == 1:
        line = "Not measured yet." if not records else f"Measured at {origin(status[kinds[0]])}."
        text = f"{text}\n\n{wrapped(line)}" if text and records else wrapped(line)
    return f"<!-- evidence: {block} -->\n{text}\n<!-- /evidence -->"


def full(status: dict[str, Status]) -> str:
    """The complete tables, as one page."""
    parts = ["# Complete tables of the evidence", "Written from `docs/evidence/*.json`. The pages show them in short."]
    for kind, title, make in FULL.values():
        record = status[kind].record
        parts.append(f"## {title}")
        parts += [make(record.results), wrapped(f"Measured at {origin(status[kind])}.")] if record else \
            ["Not measured yet."]
    return "\n\n".join(parts) + "\n"


def same(a: str, b: str) -> bool:
    """Equal but for the words of what has changed since, and line breaks that go with them."""
    return re.sub(r"\s+", " ", SINCE.sub("", re.sub(r"\s+", " ", a))) == \
        re.sub(r"\s+", " ", SINCE.sub("", re.sub(r"\s+", " ", b)))


@dataclass
class Findings:
    wrong: list[str]  # blocks that are not what their results make
    dated: list[str]  # right, but what they say about changes since is not
    written: list[str]  # pages


def check(status: dict[str, Status], write: bool, root: pathlib.Path = sources.ROOT) -> Findings:
    out = Findings([], [], [])
    used: set[str] = set()
    for page in page_files(root):
        text = page.read_text()
        name = str(page.relative_to(root))

        def fill(match: re.Match[str]) -> str:
            block = match[1]
            used.add(block)
            if block not in BLOCKS:
                out.wrong.append(f"{name}: there is no block '{block}'")
                return match[0]
            unstamped = [k for k in kinds_of(block) if status[k].record is None]
            new = generate(block, status)
            if not same(new, match[0]):
                out.wrong.append(f"{name}: block '{block}' is not what "
                                 f"docs/evidence/{', '.join(kinds_of(block))}.json makes of it")
            elif unstamped and any(re.search(r"\d", line) for line in match[2].splitlines() if line.startswith("|")
                                   and len(kinds_of(block)) == 1):
                out.wrong.append(f"{name}: block '{block}' has figures and no stamp")
            elif new != match[0]:
                out.dated.append(f"{name}: block '{block}'")
            return new
        new = _BLOCK.sub(fill, text)
        if len(re.findall(r"^<!-- evidence: ", text, re.M)) != len(_BLOCK.findall(text)):
            out.wrong.append(f"{name}: a block that is not closed")
        if write and new != text:
            page.write_text(new)
            out.written.append(name)
    for block in sorted(BLOCKS.keys() - used):
        out.wrong.append(f"block '{block}' is in no page")
    return out


def kinds_without_block() -> list[str]:
    shown = {kind for kinds, _ in BLOCKS.values() for kind in kinds}
    return [name for name in BY_NAME if name not in shown]
