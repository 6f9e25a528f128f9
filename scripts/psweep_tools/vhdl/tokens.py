# SPDX-License-Identifier: Apache-2.0
"""The words of a VHDL file."""
from __future__ import annotations

import re
from dataclasses import dataclass


class VhdlError(Exception):
    """A text that is not understood."""


@dataclass(frozen=True)
class Token:
    kind: str  # name, number, string, character, comment or symbol
    text: str
    start: int
    line: int  # from 1

    @property
    def end(self) -> int:
        return self.start + len(self.text)

    def is_word(self, *words: str) -> bool:
        return self.kind in ("name", "symbol") and self.text.lower() in words


_TOKEN = re.compile(r"""
    (?P<comment>--[^\n]*)
  | (?P<string>[xXoObB]?"(?:[^"\n]|"")*")
  | (?P<name>[A-Za-z]\w*)
  | (?P<number>\d+(?:\#\w+\#|[\w.]*))
  | (?P<symbol>:=|<=|>=|/=|=>|\*\*|<>|[-+*/&=<>()|;:,.\[\]])
""", re.X)
_CHARACTER = re.compile(r"'[^\n]'")


def tokens(text: str) -> list[Token]:
    """All tokens, comments among them; an attribute's tick is a symbol, 'x' a character."""
    found: list[Token] = []
    at, line = 0, 1
    while at < len(text):
        if text[at].isspace():
            line += text[at] == "\n"
            at += 1
            continue
        if text[at] == "'":
            before = found[-1] if found else None
            # Behind a name or a bracket a tick asks for an attribute (or qualifies an expression).
            ticks = before is not None and before.end == at and (before.kind == "name" or before.text in (")", "]"))
            character = None if ticks else _CHARACTER.match(text, at)
            token = Token("character" if character else "symbol", character[0] if character else "'", at, line)
        else:
            match = _TOKEN.match(text, at)
            if match is None or match.lastgroup is None:
                raise VhdlError(f"line {line}: {text[at:at + 20]!r} is not understood")
            token = Token(match.lastgroup, match[0], at, line)
        found.append(token)
        at = token.end
    return found
