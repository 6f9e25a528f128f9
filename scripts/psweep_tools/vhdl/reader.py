# SPDX-License-Identifier: Apache-2.0
"""What a VHDL file declares."""
from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from .tokens import Token, VhdlError, tokens


def squeezed(text: str) -> str:
    """With single blanks."""
    return " ".join(text.split())


def code_only(text: str) -> str:
    """The text with blanks instead of comments: every character stays where it is."""
    out = text
    for token in tokens(text):
        if token.kind == "comment":
            out = out[:token.start] + " " * len(token.text) + out[token.end:]
    return out


@dataclass(frozen=True)
class Generic:
    name: str
    type: str
    default: str  # as it is written; '' if there is none
    comment: str


@dataclass(frozen=True)
class Port:
    name: str
    mode: str  # in, out, inout, buffer
    type: str
    comment: str

    @property
    def is_input(self) -> bool:
        return self.mode == "in"

    @property
    def range(self) -> str:
        """Of a std_logic_vector, as it is written; '' of a std_logic."""
        if self.type.lower() == "std_logic":
            return ""
        match = re.fullmatch(r"std_logic_vector ?\((.*)\)", self.type, re.I)
        if match is None:
            raise VhdlError(f"port {self.name}: type {self.type} is not understood")
        return match[1].strip()


@dataclass(frozen=True)
class Assertion:
    line: int
    condition: str
    message: str  # strings joined; {X} stands for the image of X

    @property
    def of_generic(self) -> tuple[str, str, str] | None:
        """(entity, generic, rule) of 'entity: G_X={G_X} rule'."""
        match = re.fullmatch(r"(\w+): (G_\w+)=\{\2\} (.*)", self.message)
        return (match[1], match[2], match[3]) if match else None


@dataclass(frozen=True)
class Instance:
    label: str
    entity: str
    generics: dict[str, str]
    ports: dict[str, str]


@dataclass(frozen=True)
class Attribute:
    name: str
    signals: tuple[str, ...]
    value: str  # as it is written


@dataclass
class Entity:
    name: str
    generics: list[Generic] = field(default_factory=list)
    ports: list[Port] = field(default_factory=list)


@dataclass
class Design:
    """A file."""
    entities: list[Entity] = field(default_factory=list)
    packages: list[str] = field(default_factory=list)
    assertions: list[Assertion] = field(default_factory=list)
    instances: list[Instance] = field(default_factory=list)
    attributes: list[Attribute] = field(default_factory=list)
    signals: set[str] = field(default_factory=set)
    constants: dict[str, tuple[str, str]] = field(default_factory=dict)  # name: type and value
    uses: set[str] = field(default_factory=set)  # packages and entities of library work

    @property
    def entity(self) -> Entity:
        if len(self.entities) != 1:
            raise VhdlError(f"{len(self.entities)} entities, not one")
        return self.entities[0]


class _Reader:
    def __init__(self, text: str) -> None:
        every = tokens(text)
        self.all = [token for token in every if token.kind != "comment"]
        self.comments = {token.line: token.text[2:].strip() for token in every if token.kind == "comment"}
        self.code = code_only(text)
        self.design = Design()

    def text(self, first: int, last: int) -> str:
        """Of the tokens from `first` up to, not including, `last`."""
        return squeezed(self.code[self.all[first].start:self.all[last - 1].end]) if last > first else ""

    def word(self, at: int, *words: str) -> bool:
        return at < len(self.all) and self.all[at].is_word(*words)

    def find(self, at: int, *words: str) -> int:
        """Place of the next of these words outside of brackets."""
        depth, begun = 0, at
        while at < len(self.all):
            if depth == 0 and self.word(at, *words):
                return at
            depth += self.word(at, "(") - self.word(at, ")")
            at += 1
        raise VhdlError(f"line {self.all[min(begun, len(self.all) - 1)].line}: no {' or '.join(words)} behind this")

    def bracket(self, at: int) -> int:
        """Place of the bracket that closes the one at `at`."""
        if not self.word(at, "("):
            raise VhdlError(f"line {self.all[min(at, len(self.all) - 1)].line}: no bracket")
        return self.find(at + 1, ")")

    def split(self, first: int, last: int, separator: str) -> Iterator[tuple[int, int]]:
        """Pieces (from, to) between separators outside of brackets."""
        depth, begun = 0, first
        for at in range(first, last):
            depth += self.word(at, "(") - self.word(at, ")")
            if depth == 0 and self.word(at, separator):
                yield begun, at
                begun = at + 1
        if begun < last:
            yield begun, last

    def names(self, first: int, last: int) -> list[str]:
        out = []
        for begin, end in self.split(first, last, ","):
            if end - begin != 1 or self.all[begin].kind != "name":
                raise VhdlError(f"line {self.all[begin].line}: {self.text(begin, end)!r} is no name")
            out.append(self.all[begin].text)
        return out

    def elements(self, first: int, last: int) -> Iterator[tuple[list[str], str, str, str, str]]:
        """(names, mode, type, default, comment) of a list of generics or ports."""
        for begin, end in self.split(first, last, ";"):
            colon = self.find(begin, ":")
            if colon >= end:
                raise VhdlError(f"line {self.all[begin].line}: {self.text(begin, end)!r} declares nothing")
            names = self.names(begin + self.word(begin, "signal", "constant"), colon)
            at = colon + 1
            mode = ""
            if self.word(at, "in", "out", "inout", "buffer"):
                mode = self.all[at].text.lower()
                at += 1
            assign = next((i for i in range(at, end) if self.word(i, ":=")), end)
            default = self.text(assign + 1, end) if assign < end else ""
            if assign <= at:
                raise VhdlError(f"line {self.all[begin].line}: {self.text(begin, end)!r} has no type")
            yield names, mode, self.text(at, assign), default, self.comments.get(self.all[end - 1].line, "")

    def entity(self, at: int) -> int:
        entity = Entity(self.all[at + 1].text)
        at += 3
        while not self.word(at, "end", "begin"):
            what = self.all[at].text.lower() if at < len(self.all) else "nothing"
            if what not in ("generic", "port"):
                raise VhdlError(f"entity {entity.name}: {what!r} is not understood")
            close = self.bracket(at + 1)
            for names, mode, kind, default, comment in self.elements(at + 2, close):
                for name in names:
                    if what == "generic":
                        entity.generics.append(Generic(name, kind, default, comment))
                    elif not mode or default:
                        raise VhdlError(f"entity {entity.name}: port {name} without a mode, or with a default")
                    else:
                        entity.ports.append(Port(name, mode, kind, comment))
            at = close + 1
            if not self.word(at, ";"):
                raise VhdlError(f"entity {entity.name}: no semicolon behind the {what}s")
            at += 1
        self.design.entities.append(entity)
        return at

    def message(self, first: int, last: int) -> str:
        out, at = "", first
        while at < last:
            token = self.all[at]
            if token.kind == "string":
                out += token.text[1:-1].replace('""', '"')
            elif self.word(at + 1, "'") and self.word(at + 2, "image"):
                close = self.bracket(at + 3)
                out += "{" + self.text(at + 4, close) + "}"
                at = close
            elif not token.is_word("&"):
                out += "{" + token.text + "}"
            at += 1
        return out

    def assertion(self, at: int) -> int:
        end = self.find(at, ";")
        report = self.find(at, "report", ";")
        if report < end:
            severity = self.find(report, "severity", ";")
            self.design.assertions.append(Assertion(self.all[at].line, self.text(at + 1, report),
                                                    self.message(report + 1, severity)))
        return end

    def associations(self, at: int) -> tuple[dict[str, str], int]:
        """{formal: actual} of '( a => b, .. )'; the place behind it."""
        close, out = self.bracket(at), {}
        for begin, end in self.split(at + 1, close, ","):
            arrow = next((i for i in range(begin, end) if self.word(i, "=>")), end)
            if arrow == end:
                raise VhdlError(f"line {self.all[begin].line}: no formal in {self.text(begin, end)!r}")
            out[self.text(begin, arrow)] = self.text(arrow + 1, end)
        return out, close + 1

    def instance(self, at: int) -> int:
        """`label : entity work . name`, at the label."""
        label, entity = self.all[at].text, self.all[at + 5].text
        generics: dict[str, str] = {}
        ports: dict[str, str] = {}
        at += 6
        if self.word(at, "(") and self.word(at + 2, ")"):  # the architecture
            at += 3
        while self.word(at, "generic", "port") and self.word(at + 1, "map"):
            found, after = self.associations(at + 2)
            (generics if self.word(at, "generic") else ports).update(found)
            at = after
        self.design.instances.append(Instance(label, entity, generics, ports))
        return at

    def attribute(self, at: int) -> int:
        """`attribute name of signals : signal is value ;`"""
        end = self.find(at, ";")
        colon = self.find(at, ":")
        if self.word(colon + 1, "signal"):
            self.design.attributes.append(Attribute(self.all[at + 1].text, tuple(self.names(at + 3, colon)),
                                                    self.text(colon + 3, end)))
        return end

    def object(self, at: int) -> int:
        """A signal or a constant that is declared."""
        colon, end = self.find(at, ":"), self.find(at, ";", ")")
        names = self.names(at + 1, colon)
        if self.word(at, "signal"):
            self.design.signals.update(names)
        else:
            assign = next((i for i in range(colon, end) if self.word(i, ":=")), end)
            for name in names:
                self.design.constants[name] = (self.text(colon + 1, assign), self.text(assign + 1, end))
        return colon

    def read(self) -> Design:
        at = 0
        while at < len(self.all):
            before: Token | None = self.all[at - 1] if at else None
            named = at + 2 < len(self.all) and self.all[at + 1].kind == "name"
            if self.word(at, "entity") and named and self.word(at + 2, "is"):
                at = self.entity(at)
            elif self.word(at, "package") and named and self.word(at + 2, "is"):
                self.design.packages.append(self.all[at + 1].text)
            elif self.word(at, "assert"):
                at = self.assertion(at)
            elif self.word(at, "attribute") and named and self.word(at + 2, "of"):
                at = self.attribute(at)
            elif self.word(at, "signal", "constant") and named and not (before and before.text == ":"):
                at = self.object(at)
            elif self.word(at, "work") and self.word(at + 1, ".") and at + 2 < len(self.all):
                self.design.uses.add(self.all[at + 2].text)
                if self.word(at - 1, "entity") and self.word(at - 2, ":"):
                    at = self.instance(at - 3)
                    continue
            at += 1
        return self.design


def parse(text: str) -> Design:
    return _Reader(text).read()


def width_of(port: Port) -> str:
    """Bits of a port, as it is written: 'X - 1 downto 0' has X bits."""
    if port.range == "":
        return "1"
    match = re.fullmatch(r"(.*) downto 0", port.range, re.I)
    if match is None:
        raise VhdlError(f"port {port.name}: range {port.range} does not go down to 0")
    left = match[1].strip()
    if less := re.fullmatch(r"(.*) - 1", left):
        return less[1]
    if left.isdigit():
        return str(int(left) + 1)
    if more := re.fullmatch(r"(.*) \+ (\d+)", left):
        return f"{more[1]} + {int(more[2]) + 1}"
    return f"{left} + 1"


def range_of(generic: str, condition: str) -> str:
    """What an assertion allows: 'a .. b', 'a .. b, odd', 'from a', 'a, b', or the condition itself in backticks."""
    g = re.escape(generic)
    if m := re.fullmatch(rf"{g} >= (\w+) and {g} <= (\w+)(?: and {g} mod 2 = ([01]))?", condition):
        return f"{m[1]} .. {m[2]}" + ("" if m[3] is None else ", odd" if m[3] == "1" else ", even")
    if m := re.fullmatch(rf"{g} >= (\w+)", condition):
        return f"from {m[1]}"
    parts = [re.fullmatch(rf"{g} = (\w+)", part) for part in condition.split(" or ")]
    values = [m[1] for m in parts if m]
    return ", ".join(values) if len(values) == len(parts) else f"`{condition}`"
