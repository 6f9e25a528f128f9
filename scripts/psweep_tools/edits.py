# SPDX-License-Identifier: Apache-2.0
"""Faults put into a text on purpose."""
from __future__ import annotations

import re
from dataclasses import dataclass

from .vhdl import Rtl
from .work import Failure


class DoesNotFit(Failure):
    """A fault whose place is not there any more."""


def edited(text: str, pattern: str, replacement: str) -> str:
    """The first match of each line (of a pattern with line ends: each match) replaced; at least one."""
    if r"\n" in pattern:
        after = re.sub(pattern, replacement, text)
    else:
        after = "\n".join(re.sub(pattern, replacement, line, count=1) for line in text.split("\n"))
    if after == text:
        raise DoesNotFit(f"the fault does not fit: {pattern}")
    return after


@dataclass(frozen=True)
class Fault:
    """A fault of an entity: what it is called, what is replaced by what."""
    entity: str
    name: str
    pattern: str
    replacement: str

    def text(self, rtl: Rtl) -> str:
        try:
            return edited(rtl.text(self.entity), self.pattern, self.replacement)
        except DoesNotFit as error:
            raise DoesNotFit(f"rtl/{rtl.name(self.entity)}: {error}") from None
