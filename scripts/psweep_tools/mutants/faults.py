# SPDX-License-Identifier: Apache-2.0
"""Where a fault can be put into a VHDL file, and which of these are drawn.

A mutant is drawn by the hash of its text, not by its place in a list: editing one line leaves the draw elsewhere."""
import hashlib
import pathlib
import re
from dataclasses import dataclass, field

# Left alone: declarations of entities (defaults of generics, ports), of signals and types, assertions (illegal
# generics have tests of their own) and what is not synthesised.
_DECLARATION = re.compile(
    r"^\s*(signal|type|subtype|attribute|port|use|library|function|procedure|architecture|package|end|shared|variable)"
    r"\b", re.I)
_TOKEN = re.compile(
    r"""(\s+)|(x?"[^"]*"|'[01XZ-]'|\d+\#\w+\#|[a-zA-Z]\w*'\w+|[a-zA-Z]\w*|\d+|<=|>=|/=|=>|:=|\*\*|.)""")
_WHEN = re.compile(r"(\s*\w+\s*(?:<=|:=)\s*)([^;]+?)\s+when\s+([^;]+?)\s+else\s+([^;]+?)\s*;\s*$", re.I)
_COMPARE = {"=": "/=", "/=": "=", "<": "<=", ">": ">=", ">=": ">"}
_WORDS = {"and": ("logic", "or"), "or": ("logic", "and"), "xor": ("logic", "or"), "not": ("logic", ""),
          "true": ("constant", "false"), "false": ("constant", "true"), "'0'": ("constant", "'1'"),
          "'1'": ("constant", "'0'")}


def md5(text: str) -> str:
    return hashlib.md5(text.encode("latin-1")).hexdigest()


def trimmed(text: str) -> str:
    """A line without comment and superfluous blanks."""
    return re.sub(r"\s+", " ", re.sub(r"--.*", "", text)).strip()


@dataclass
class Mutant:
    entity: str
    line: int  # from 0
    rule: str
    before: str
    after: str
    nth: int  # the first such line of the file: 0
    hash: str
    id: str = ""

    @property
    def key(self) -> str:
        """As an entry of the list of equivalents has it."""
        return f"{self.entity}|{self.nth}|{trimmed(self.before)}|{trimmed(self.after)}"

    def shown(self) -> str:
        return f"{self.entity}.vhd:{self.line + 1}  {trimmed(self.before)}  ->  {trimmed(self.after)}"


@dataclass
class _Statement:
    condition: bool = False
    assigned: bool = False
    depth: int = 0


def _token_faults(line: str, code: str, state: _Statement, is_clock: bool) -> list[tuple[str, str]]:
    """(rule, line with the fault) of the tokens of a line; brings the state of the statement up to date."""
    tokens = [(m[2], m.start(2)) for m in _TOKEN.finditer(code) if m[2] is not None]
    found: list[tuple[str, str]] = []

    def put(rule: str, i: int, new: str) -> None:
        text, at = tokens[i]
        found.append((rule, line[:at] + new + line[at + len(text):]))

    for i, (s, _) in enumerate(tokens):
        previous = tokens[i - 1][0] if i else ""
        following = tokens[i + 1][0] if i + 1 < len(tokens) else ""
        low = s.lower()
        if s == "(":
            state.depth += 1
        elif s == ")":
            state.depth -= 1
        if low in ("if", "elsif", "when", "while", "return"):
            state.condition = True
        elif s == ";" or low in ("then", "loop", "generate", "begin"):
            state.condition = state.assigned = False
            if s == ";":
                state.depth = 0
        elif low == "else":
            state.condition = False
        if is_clock:
            continue
        if s in _COMPARE:
            put("compare", i, _COMPARE[s])
        elif s == "<=":
            if state.condition or state.assigned or state.depth > 0:
                put("compare", i, "<")
            state.assigned = True
        elif s == ":=":
            state.assigned = True
        elif s in "+-" and re.fullmatch(r"\w+|\)|\w+'\w+", previous) and not (
                i + 2 < len(tokens) and tokens[i + 2][0].lower() in ("downto", "to")):
            put("arithmetic", i, "-" if s == "+" else "+")
        elif low in _WORDS:
            put(_WORDS[low][0], i, _WORDS[low][1])
        elif m := re.fullmatch(r'"([01]+)"', s):
            bit = int(md5(f"{line}{i}")[:4], 16) % len(m[1])
            put("constant", i, f'"{m[1][:bit]}{"10"[int(m[1][bit])]}{m[1][bit + 1:]}"')
        elif m := re.fullmatch(r'x"([0-9A-F]+)"', s, re.I):
            at = int(md5(f"{line}{i}")[:4], 16) % len(m[1])
            put("constant", i, f'x"{m[1][:at]}{int(m[1][at], 16) ^ 1:X}{m[1][at + 1:]}"')
        elif s.isdigit() and previous.lower() not in ("downto", "to") and following.lower() not in ("downto", "to"):
            put("number", i, str(int(s) + 1))
            if int(s) > 0:
                put("number", i, str(int(s) - 1))
        elif low == "downto" and previous.isdigit() and following.isdigit() and i > 1 and tokens[i - 2][0] == "(":
            # Both bounds, or the widths would differ.
            begin, end = tokens[i - 1][1], tokens[i + 1][1] + len(following)
            for d in (1, -1):
                if int(following) + d >= 0:
                    bounds = f"{int(previous) + d} downto {int(following) + d}"
                    found.append(("slice", f"{line[:begin]}{bounds}{line[end:]}"))
    return found


def candidates(entity: str, text: list[str], seed: int) -> list[Mutant]:
    """All places of a file, in its order."""
    found: list[Mutant] = []
    seen: dict[str, int] = {}
    skip, hidden, process, state = "", False, False, _Statement()
    for number, line in enumerate(text):
        hidden = hidden or "translate_off" in line
        if hidden:
            hidden = "translate_on" not in line
            continue
        code = re.sub(r"--.*", "", line)
        if not code.strip():
            continue
        if skip:
            if re.search(skip, code, re.I):
                skip = ""
            continue
        if re.match(r"\s*entity\s+\w+\s+is", code, re.I):
            skip = r"^\s*end\s+entity"
            continue
        if re.match(r"\s*assert\b", code, re.I):
            skip = "" if re.search(r";\s*$", code) else r";\s*$"
            continue
        if _DECLARATION.match(code):
            is_body = re.match(r"\s*(function|procedure)\b", code, re.I)
            if re.match(r"\s*end\s+(process|function)", code, re.I):
                process = False
            if re.match(r"\s*function\b", code, re.I) and re.search(r"\bis\b", code, re.I):
                process = True
            if not is_body and not re.search(r";\s*$", code) and not re.search(r"\b(is|port)\b", code, re.I):
                skip = r";\s*$"
            continue
        if re.search(r"\bprocess\b", code, re.I):
            process = True
            continue
        nth = seen.get(trimmed(line), 0)
        seen[trimmed(line)] = nth + 1
        is_clock = bool(re.search(r"(rising|falling)_edge", code))
        faults = _token_faults(line, code, state, is_clock)
        if not is_clock:
            if (process and re.match(r"\s*[a-z]\w*(\([^<]*\))?\s*(<=|:=)[^;]*;\s*$", code, re.I)
                    and not re.match(r"\s*constant\b", code, re.I)):
                faults.append(("deletion", code[:len(code) - len(code.lstrip())] + "null;"))
            if m := re.match(r"(\s*)(if|elsif)\s+(.*\S)\s+then\s*$", code, re.I):
                faults += [("branch", f"{m[1]}{m[2]} false then"), ("branch", f"{m[1]}{m[2]} true then")]
            if m := _WHEN.match(code):
                faults.append(("branch", f"{m[1]}{m[4]} when {m[3]} else {m[2]};"))
        found += [Mutant(entity, number, rule, line, after, nth, md5(f"{seed}|{entity}|{line}|{nth}|{after}"))
                  for rule, after in faults if trimmed(after) != trimmed(line)]
    return found


def drawn_order(found: list[Mutant]) -> list[Mutant]:
    """In the order of the draw: one fault a line, then the second of each line, and so on."""
    by_line: dict[int, dict[str, list[Mutant]]] = {}
    for m in sorted(found, key=lambda m: m.hash):
        by_line.setdefault(m.line, {}).setdefault(m.rule, []).append(m)
    rounds: list[list[Mutant]] = []
    for by_rule in by_line.values():
        rules = sorted(by_rule, key=lambda rule: md5(by_rule[rule][0].hash + rule))
        turn = 0
        while rules:
            for rule in rules:
                if turn == len(rounds):
                    rounds.append([])
                rounds[turn].append(by_rule[rule].pop(0))
                turn += 1
            rules = [rule for rule in rules if by_rule[rule]]
    ordered = [m for group in rounds for m in sorted(group, key=lambda m: m.hash)]
    for number, m in enumerate(ordered):
        m.id = f"{m.entity}.{number + 1}"
    return ordered


def quota(lines: int) -> int:
    """How many of a file: one for each 50 lines, at least ten of a file of more than 200, else at least two."""
    return max(10 if lines > 200 else 2, round(lines / 50))


@dataclass
class Equivalent:
    where: str
    reason: list[str] = field(default_factory=list)


def equivalents(path: pathlib.Path) -> dict[str, Equivalent]:
    """{key: entry} of the list. Blocks: file ('#2' behind its name: the second such line), '- ' line before, '+ ' line
    after, the reason."""
    found: dict[str, Equivalent] = {}
    place, before, entry = "", None, None
    for n, line in enumerate(path.read_text().splitlines() if path.exists() else [], 1):
        if line.startswith("#") or not line.strip():
            continue
        if m := re.fullmatch(r"rtl/(?:\w+/)*(\w+)\.vhd(?: #(\d+))?", line):
            place, before, entry = f"{m[1]}|{int(m[2] or 1) - 1}", None, None
        elif line.startswith("- ") and place:
            before = trimmed(line[2:])
        elif line.startswith("+ ") and before is not None:
            key = f"{place}|{before}|{trimmed(line[2:])}"
            if key in found:
                raise ValueError(f"{path.name}:{n}: twice")
            found[key] = entry = Equivalent(f"{path.name}:{n}")
        elif line.startswith("  ") and entry is not None:
            entry.reason.append(line.strip())
        else:
            raise ValueError(f"{path.name}:{n}: not understood")
    for entry in found.values():
        if not entry.reason:
            raise ValueError(f"{entry.where}: no reason")
    return found
