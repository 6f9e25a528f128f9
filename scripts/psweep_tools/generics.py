# SPDX-License-Identifier: Apache-2.0
"""Every range that an entity asserts of a generic is tried just outside: GHDL has to stop with the entity's own
message, which names the generic; in simulation, with one value an entity, it has to stop as well, and most say the
value. The values follow from the message, so no new range is forgotten.

Ends with 'N values of N generics refused'; exit code 1 if one was not, if a message is not understood, or if an entity
of several generics asserts nothing."""
from __future__ import annotations

import argparse
import pathlib
import re
import subprocess
import sys
from collections.abc import Iterable

from .vhdl import Rtl, VhdlError

# Messages that are not about a range, and values that they are for.
SPECIAL = {
    "is not 1, 2 or 4": (3, 5, 8),
    "is neither 0 nor 1": (-1, 2),
    "is neither 2 nor 4": (3, 5),
    "is neither 0 nor from 2 on": (-1, 1),
    "holds no pair or no cell": (1,),
    "is no multiple of 9 up to G_DATA_W": (8,),
    "is neither G_CELLS nor one or more chunks": (7,),
}


def outside(rule: str, defaults: dict[str, str]) -> list[int]:
    """Values that a message is for."""
    if rule in SPECIAL:
        return list(SPECIAL[rule])
    if m := re.fullmatch(r"below (-?\d+)", rule):
        return [int(m[1]) - 1]
    if m := re.fullmatch(r"outside (\w+)\.\.(\w+)( or odd| or even| or over .*)?", rule):
        low, high = (int(defaults.get(value, value)) for value in (m[1], m[2]))
        return [low - 1, high + 1] + ([low + 1] if re.search("odd|even", m[3] or "") else [])
    raise VhdlError(f"'{rule}' is not understood")


class Trial:
    """GHDL with values that have to be refused."""

    def __init__(self, ghdl: str, work: pathlib.Path, rtl: Rtl) -> None:
        self.ghdl, self.work, self.rtl = ghdl, work, rtl
        self.values = self.failed = 0
        self.generics: set[tuple[str, str]] = set()
        self.simulated: set[str] = set()
        self.told: set[str] = set()

    def run(self, *arguments: str) -> tuple[int, str]:
        done = subprocess.run([self.ghdl, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
        return done.returncode, done.stdout.decode("latin-1")

    def problem(self, entity: str, generic: str, rule: str, value: int) -> str:
        """'' if this value is refused as it should be."""
        options = ("--std=93", f"--workdir={self.work}")
        code, said = self.run("--synth", *options, f"-g{generic}={value}", "--out=none", entity)
        wanted = rf"{entity}: {generic}(?:={re.escape(str(value))})? {re.escape(rule)}"
        bad = ""
        if code == 0:
            bad = "is not refused\n"
        elif not re.search(wanted, said):
            bad = "stops, but with another message:\n" + re.sub("^", "  ", said, flags=re.M)[:600]
        # A simulator must stop, too; what the value breaks may be noticed before the assertion. One value an entity.
        if entity not in self.simulated:
            self.simulated.add(entity)
            code, said = self.run("-r", *options, entity, f"-g{generic}={value}", "--stop-time=1ns")
            if code == 0:
                bad += "does not stop a simulation\n"
            if f"{entity}: {generic}={value} {rule}" in said:
                self.told.add(entity)
        return bad

    def entity(self, unit: str) -> None:
        design, file = self.rtl.design(unit), self.rtl.path(unit)
        defaults = {g.name: g.default for g in self.rtl.entity(unit).generics}
        stated = [a.of_generic for a in design.assertions if a.of_generic]
        for who, generic, rule in stated:
            if who != unit:
                raise VhdlError(f"{file}: a message of {who}")
            self.generics.add((unit, generic))
            for value in outside(rule, defaults):
                self.values += 1
                bad = self.problem(unit, generic, rule, value)
                if bad:
                    print(f"{unit}: {generic}={value} {bad}", end="")
                    self.failed += 1
        if len(defaults) > 1 and not stated:
            print(f"{file}: generics without an assertion")
            self.failed += 1


def main(arguments: Iterable[str]) -> int:
    parser = argparse.ArgumentParser(prog="scripts/tools.py generics", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", type=pathlib.Path, help="folder for GHDL's files")
    parser.add_argument("--ghdl", default="ghdl")
    parser.add_argument("--rtl", type=pathlib.Path, help="folder with files.f (default: rtl)")
    options = parser.parse_args(list(arguments))
    options.work.mkdir(parents=True, exist_ok=True)
    try:
        rtl = Rtl(options.rtl) if options.rtl else Rtl()
        trial = Trial(options.ghdl, options.work, rtl)
        code, said = trial.run("-a", "--std=93", f"--workdir={options.work}", *map(str, rtl.sources()))
        if code:
            raise VhdlError(f"GHDL failed\n{said}")
        for unit in rtl.entities:
            trial.entity(unit)
    except VhdlError as error:
        print(f"generics: {error}", file=sys.stderr)
        return 1
    print(f"{trial.values - trial.failed} of {trial.values} values of {len(trial.generics)} generics refused")
    print(f"{len(trial.told)} of {len(trial.simulated)} entities say so in simulation, with the value")
    return 1 if trial.failed or not trial.values or not trial.told else 0
