# SPDX-License-Identifier: Apache-2.0
"""Makes every register of a converted circuit one that can be upset.

IN.v is what GHDL makes of TOP. In OUT.v
  - every instance has a module of its own, so that an upset hits one of them, however often its entity is used
    (--own: only registers of TOP itself, not those of the entities inside);
  - --both-edges: registers take their values at both edges of their clock: one evaluation each, not two;
  - the top has more inputs: at the edge at which flip_site is the number of a register, what that register takes is
    changed where flip_mask has ones. 0: nothing happens. A register of more than 64 bits: by flip_wide with --wide,
    else only its low 64 bits;
  - --rams: word flip_word of the memory whose number flip_site is, too. Else words of RAMs are no sites; what they are
    read into always is.
SITES.inc has a line for each, number 1 first, with the fields asked for: entity; name, with the path of instances
(--short-names: with the outermost common cell that it lies in, if it does); bits; words (0: a register); clock, its
place among CLOCKS. Anything that is not understood is an error: no register may get lost."""
from __future__ import annotations

import argparse
import pathlib
import re
import sys
from collections.abc import Iterable
from dataclasses import dataclass

from .. import verilog
from ..vhdl import Rtl

WIDE = 512
# Cells that stand in several places: known by what they are there.
COMMON = re.compile(r"divider|delay_line|stream_fifo|ram_")
FIELDS = ("entity", "name", "bits", "words", "clock")


class InjectError(Exception):
    """A text that is not understood."""


@dataclass(frozen=True)
class Site:
    entity: str
    name: str
    bits: int
    words: int
    clock: int

    def line(self, fields: Iterable[str]) -> str:
        values = (getattr(self, field) for field in fields)
        return "{" + ", ".join(f'"{value}"' if isinstance(value, str) else str(value) for value in values) + "},\n"


@dataclass(frozen=True)
class Options:
    top: str
    clocks: tuple[str, ...] = ()  # none: whatever clock there is
    both_edges: bool = False
    own: bool = False
    rams: bool = False
    wide: bool = False
    short_names: bool = False


@dataclass(frozen=True)
class _Place:
    """An instance: its path ('u_a.u_b.'), and what stands before the names of its registers in a list of sites."""
    path: str
    shown: str
    clocks: dict[str, int]


_ALWAYS = re.compile(r"^  always @\(posedge (\w+)( or posedge \w+)?\)\n((?:    .*\n)+)", re.M)
_PLAIN = re.compile(r"    (n\d+_q) <= (\w+);\n")
_RESET = re.compile(r"    if \((\w+)\)\n      (n\d+_q) <= ([\w']+);\n    else\n      (n\d+_q) <= (\w+);\n")
_READ = re.compile(r"    if \(([\w']+)\)\n      (n\d+_data) <= (\w+\[\w+\]);\n")
_WRITE = re.compile(r"    if \((\w+)\)\n      (\w+)\[(\w+)\] <= (\w+);\n")
_REGISTER = re.compile(r"^  reg (?:\[(\d+):0\] )?(n\d+_(?:q|data));", re.M)
_MEMORY = re.compile(r"^  reg (?:\[(\d+):0\] )?(\w+)\[(\d+):0\]", re.M)


class Injector:
    def __init__(self, modules: dict[str, str], entities: Iterable[str], options: Options) -> None:
        self.modules, self.options = modules, options
        self.entities = sorted(entities, key=len, reverse=True)
        self.sites: list[Site] = []
        self.out: list[str] = []
        self.clones = 0

    def entity_of(self, module: str) -> str:
        for entity in self.entities:
            if re.match(re.escape(entity) + r"(_\d|$)", module):
                return entity
        raise InjectError(f"module {module} is no entity of rtl/")

    def mask(self, bits: int) -> str:
        top = self.options.top
        if bits <= 64:
            return f"{top}.flip_mask[{bits - 1}:0]"
        return f"{top}.flip_wide[{bits - 1}:0]" if self.options.wide else f"{{{bits - 64}'d0, {top}.flip_mask}}"

    def site(self, entity: str, name: str, bits: int, words: int, clock: int) -> int:
        """The number of a new site."""
        if self.options.wide and bits > WIDE:
            raise InjectError(f"{name} has {bits} bits, more than {WIDE}")
        self.sites.append(Site(entity, name, bits if self.options.wide else min(bits, 64), words, clock))
        return len(self.sites)

    def emit(self, module: str, place: _Place, name: str) -> None:
        """Writes `module` as `name`, after the modules of its instances."""
        body = self.modules[module]
        if not self.options.own:
            body = self._clone_instances(body, place)
        body = _Body(self, module, body, place).edited()
        if module == self.options.top:
            ports = ["[15:0] flip_site", *(["[15:0] flip_word"] if self.options.rams else []), "[63:0] flip_mask",
                     *([f"[{WIDE - 1}:0] flip_wide"] if self.options.wide else [])]
            text = "\n  (" + "".join(f"input {port},\n   " for port in ports)
            body, number = re.subn(r"\n  \(", lambda _: text, body, count=1)
            if number != 1:
                raise InjectError(f"the ports of {module} were not understood")
        self.out.append(f"module {name}{body}endmodule\n")

    def _clone_instances(self, body: str, place: _Place) -> str:
        def instance(match: re.Match[str]) -> str:
            kind, label, ports = match.groups()
            if kind not in self.modules:
                return match[0]
            clocks = {formal: place.clocks[actual]
                      for formal, actual in re.findall(r"\.(\w+)\s*\((\w+)\)", ports) if actual in place.clocks}
            self.clones += 1
            clone = f"{kind}__{self.clones}"
            shown = f"{place.shown}{label}."
            if self.options.short_names:
                common = COMMON.match(self.entity_of(kind))
                shown = "" if not common else place.shown or f"{label}."
            self.emit(kind, _Place(f"{place.path}{label}.", shown, clocks), clone)
            return f"  {clone} {label} ({ports});"
        return re.sub(r"^  (\w+) (\w+) \(\n(.*?)\);", instance, body, flags=re.M | re.S)


class _Body:
    """One module."""

    def __init__(self, injector: Injector, module: str, body: str, place: _Place) -> None:
        self.injector, self.module, self.body, self.place = injector, module, body, place
        self.options = injector.options
        self.entity = injector.entity_of(module)
        # Signals of the VHDL by the register behind them; a port's own name beats that of a copy.
        self.names: dict[str, str] = {}
        for signal, register in re.findall(r"assign (\w+) = (n\d+_q);", body):
            if register not in self.names or self.names[register].endswith("_q"):
                self.names[register] = signal
        self.bits = {register: int(high or 0) + 1 for high, register in _REGISTER.findall(body)}
        self.memories = {name: (int(high or 0) + 1, int(last) + 1) for high, name, last in _MEMORY.findall(body)}
        self.seen: set[str] = set()

    def fail(self, text: str) -> InjectError:
        return InjectError(f"this of {self.module} was not understood:\n{text}")

    def assignment(self, register: str, value: str, clock: int) -> str:
        if register not in self.bits:
            raise InjectError(f"{self.place.path}{register} of {self.module} is no register")
        self.seen.add(register)
        shown = self.names.get(register, "rdata" if register.endswith("_data") else register)
        bits, top = self.bits[register], self.options.top
        number = self.injector.site(self.entity, self.place.shown + shown, bits, 0, clock)
        return f"{register} <= {value} ^ ({top}.flip_site == {number} ? {self.injector.mask(bits)} : {bits}'d0);"

    def write(self, match: re.Match[str], clock: int) -> str:
        """A write port of a memory; the word that is upset is changed at the same edge."""
        memory, top = match[2], self.options.top
        if not self.options.rams:
            return match[0]
        if memory not in self.memories or memory in self.seen:
            raise self.fail(match[0])
        self.seen.add(memory)
        bits, words = self.memories[memory]
        number = self.injector.site(self.entity, f"{self.place.shown}memory", bits, words, clock)
        word = f"{memory}[{top}.flip_word[{max((words - 1).bit_length(), 1) - 1}:0]]"
        return (f"{match[0]}    if ({top}.flip_site == {number})\n"
                f"      {word} <= {word} ^ {self.injector.mask(bits)};\n")

    def block(self, match: re.Match[str]) -> str:
        edge, reset, rest = match.groups()
        clocks = self.place.clocks
        if clocks and edge not in clocks:
            raise InjectError(f"clock {edge} of {self.module} at {self.place.path or self.options.top} is not known")
        clock = clocks.get(edge, 0)
        both = f" or negedge {edge}" if self.options.both_edges else ""
        sense = f"  always @(posedge {edge}{both}{reset or ''})"
        if not reset and (plain := _PLAIN.fullmatch(rest)):
            return f"{sense}\n    {self.assignment(plain[1], plain[2], clock)}\n"
        if reset and (with_reset := _RESET.fullmatch(rest)) and with_reset[2] == with_reset[4]:
            test, register, start, _, value = with_reset.groups()
            return (f"{sense}\n    if ({test})\n      {register} <= {start};\n    else\n      "
                    f"{self.assignment(register, value, clock)}\n")
        if not reset and (read := _READ.fullmatch(rest)):
            return f"{sense}\n    if ({read[1]})\n      {self.assignment(read[2], read[3], clock)}\n"
        if not reset and (write := _WRITE.fullmatch(rest)):
            text = self.write(write, clock)
            return f"{sense}\n{text}" if text == rest else f"{sense} begin\n{text}  end\n"
        raise self.fail(match[0])

    def edited(self) -> str:
        body = _ALWAYS.sub(self.block, self.body)
        if len(_ALWAYS.findall(self.body)) != len(re.findall(r"^  always @\(posedge", self.body, re.M)):
            raise self.fail("an 'always' of another form")
        lost = set(self.bits) - self.seen
        if self.options.rams:
            lost |= {name for name in self.memories if name not in self.seen and re.search(rf"{name}\[\w+\] <=", body)}
        if lost:
            raise InjectError(f"registers of {self.module} were not understood: {sorted(lost)}")
        return body


def inject(text: str, entities: Iterable[str], options: Options) -> tuple[str, list[Site]]:
    modules = verilog.modules(text)
    if options.top not in modules:
        raise InjectError(f"no module {options.top}")
    injector = Injector(modules, entities, options)
    injector.emit(options.top, _Place("", "", {name: n for n, name in enumerate(options.clocks)}), options.top)
    if not injector.sites:
        raise InjectError("no register")
    if options.own:
        injector.out = [f"module {name}{body}endmodule\n" for name, body in modules.items() if name != options.top] + \
            injector.out
    return "\n".join(injector.out), injector.sites


def main(arguments: Iterable[str]) -> int:
    parser = argparse.ArgumentParser(prog="scripts/tools.py upsets", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("source", "target", "sites"):
        parser.add_argument(name, type=pathlib.Path)
    parser.add_argument("top")
    parser.add_argument("--clocks", default="", help="clocks of the top, separated by commas")
    parser.add_argument("--fields", default=",".join(FIELDS), help="of a line of SITES.inc")
    for option in ("--both-edges", "--own", "--rams", "--wide", "--short-names"):
        parser.add_argument(option, action="store_true")
    given = parser.parse_args(list(arguments))
    fields = given.fields.split(",")
    if not set(fields) <= set(FIELDS):
        parser.error(f"fields are {', '.join(FIELDS)}")
    options = Options(given.top, tuple(filter(None, given.clocks.split(","))), given.both_edges, given.own, given.rams,
                      given.wide, given.short_names)
    try:
        text, sites = inject(given.source.read_text(), Rtl().entities, options)
    except InjectError as error:
        print(f"upsets: {given.source}: {error}", file=sys.stderr)
        return 1
    given.target.write_text(text)
    given.sites.write_text("".join(site.line(fields) for site in sites))
    return 0
