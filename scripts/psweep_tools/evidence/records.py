# SPDX-License-Identifier: Apache-2.0
"""What is kept of a kind of evidence: docs/evidence/<kind>.json, a stamp and the results.

Stamp: commit, its date and subject; whether files that count had changes beyond it; when and on what machine it was
measured; hash and hashes of what it depended on, file by file."""
import datetime
import json
import os
import pathlib
import platform
import re
from dataclasses import dataclass, field
from typing import Any

from . import sources
from .manifest import Kind

FOLDER = sources.ROOT / "docs" / "evidence"


@dataclass
class Stamp:
    commit: str
    subject: str
    date: str  # of the measurement; of the commit, if that is all that is known
    hash: str
    files: dict[str, str]
    edited: bool = False  # files that count were not as in the commit
    machine: str = ""
    seconds: float = 0
    passed: bool = True

    @property
    def name(self) -> str:
        return self.commit + (" with changes" if self.edited else "")


@dataclass
class Record:
    kind: str
    stamp: Stamp
    results: dict[str, Any] = field(default_factory=dict)


def path(kind: str) -> pathlib.Path:
    return FOLDER / f"{kind}.json"


def load(kind: str) -> Record | None:
    if not path(kind).is_file():
        return None
    data = json.loads(path(kind).read_text())
    stamp = data["stamp"]
    stamp["files"] = dict(pair.rsplit(" ", 1) for pair in stamp["files"])
    return Record(kind, Stamp(**stamp), data["results"])


def load_all(names: list[str]) -> dict[str, Record]:
    return {name: record for name in names if (record := load(name)) is not None}


def save(record: Record) -> None:
    stamp = {**vars(record.stamp), "files": [f"{k} {v}" for k, v in sorted(record.stamp.files.items())]}
    data = {"kind": record.kind, "stamp": stamp, "results": record.results}
    FOLDER.mkdir(parents=True, exist_ok=True)
    path(record.kind).write_text(layout(data) + "\n")


def layout(value: Any, indent: int = 0, width: int = 118) -> str:
    """JSON in which what fits stands on one line."""
    flat = json.dumps(value)
    if len(flat) + indent <= width or not isinstance(value, (dict, list)) or not value:
        return flat
    inner, outer = " " * (indent + 1), " " * indent
    if isinstance(value, dict):
        parts = [f"{inner}{json.dumps(k)}: {layout(v, indent + 1, width - len(k) - 5)}" for k, v in value.items()]
        return "{\n" + ",\n".join(parts) + f"\n{outer}}}"
    if all(not isinstance(v, (dict, list)) for v in value):
        lines = [inner]
        for n, v in enumerate(value):
            part = json.dumps(v) + ("," if n + 1 < len(value) else "")
            if lines[-1] != inner and len(lines[-1]) + 1 + len(part) > width:
                lines.append(inner)
            lines[-1] += (" " if lines[-1] != inner else "") + part
        return "[\n" + "\n".join(lines) + f"\n{outer}]"
    return "[\n" + ",\n".join(f"{inner}{layout(v, indent + 1, width)}" for v in value) + f"\n{outer}]"


def machine() -> str:
    """The class of this machine."""
    about = pathlib.Path("/etc/os-release")
    found = dict(re.findall(r'^(ID|VERSION_ID)="?([^"\n]*)', about.read_text(), re.M)) if about.is_file() else {}
    name = f"{found.get('ID', platform.system()).capitalize()} {found.get('VERSION_ID', '')}".strip()
    return f"{os.cpu_count()} cores, {name}"


def stamp_of(files: dict[str, str], commit: str = "HEAD") -> Stamp:
    """For what was measured with these files; `commit`: the one that they are thought to be of."""
    said = sources.git("log", "-1", "--format=%h%x00%s%x00%cs", commit)
    if said is None:
        if commit != "HEAD":
            raise ValueError(f"git knows no commit {commit}")
        return Stamp("unknown", "", str(datetime.date.today()), sources.combined(files), files, machine=machine())
    short, subject, date = said.decode().strip().split("\0")
    if commit != "HEAD":
        return Stamp(short, subject, date, sources.combined(files), files)
    places = [re.sub(r"^rtl/(\w+\.vhd)$", r":(glob)rtl/**/\1", name) for name in files]
    changed = sources.git("status", "--porcelain", "--", *places) if files else b""
    return Stamp(short, subject, str(datetime.date.today()), sources.combined(files), files,
                 edited=bool((changed or b"").strip()), machine=machine())


@dataclass
class Status:
    kind: Kind
    record: Record | None
    changed: list[str]  # files that are not as they were

    @property
    def stale(self) -> bool:
        return self.record is None or bool(self.changed)

    def text(self) -> str:
        if self.record is None:
            return "never measured"
        stamp = self.record.stamp
        if not self.changed:
            return f"as of {stamp.name}" + ("" if stamp.passed else ", FAILED")
        rtl = [name for name in self.changed if name.startswith("rtl/")]
        rest = len(self.changed) - len(rtl)
        shown = ", ".join(name.removeprefix("rtl/") for name in rtl[:8]) + (", .." if len(rtl) > 8 else "")
        parts = ([f"{len(rtl)} files of the RTL ({shown})"] if rtl else []) + \
            ([f"{rest} other files ({', '.join([n for n in self.changed if n not in rtl][:3])}{', ..' * (rest > 3)})"]
             if rest else [])
        return f"STALE, of {stamp.name}; changed since: " + ", ".join(parts)


def status(kind: Kind, tree: sources.Tree, record: Record | None = None) -> Status:
    record = record or load(kind.name)
    if record is None:
        return Status(kind, None, [])
    now = tree.hashes(kind.depends)
    then = record.stamp.files
    return Status(kind, record, sorted(name for name in now.keys() | then.keys() if now.get(name) != then.get(name)))
