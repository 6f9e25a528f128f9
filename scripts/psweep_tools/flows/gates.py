# SPDX-License-Identifier: Apache-2.0
"""Gate level (make sim-gates): the netlist that Yosys makes of the engine for Virtex-6 is driven with recorded streams,
and every output port has to be as recorded before every clock (docs/gates.md). Then one cell of each kind is broken
in turn, and the simulation has to see it.

CONFIGURATION:counted is the netlist whose cells 'make cost' counts: by the Yosys of scripts/cost/requirements.txt,
debug ports left open; else it is made by the installed Yosys, with the debug ports compared too.
Environment: SEED of the recorded session (default 1), JOBS (configurations at once; default: all cores), VERBOSE=1
(Yosys' messages). Exit code 1 if anything differs, nothing was compared, or a broken cell is not noticed."""
from __future__ import annotations

import os
import pathlib
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable

from .. import setup, work
from ..paths import ROOT
from ..replay import ports, run
from ..vhdl import Rtl
from ..work import Failure

DEFAULT = ("tiny", "odd_2", "tiny:counted", "odd_2:counted")
_GOOD = re.compile(r"^replay: [1-9]\d* steps, [1-9]\d* values compared, 0 differences$", re.M)
_CELL = re.compile(r"^  ([A-Z][A-Z0-9]+) (?:#\(|\S+ \($)", re.M)


def _inverted(match: re.Match[str]) -> str:
    return "INIT(64'h" + match[1].translate(str.maketrans("0123456789abcdef", "fedcba9876543210")) + ")"


# How a cell of a kind is broken: the pattern, what stands for its first match.
FAULTS: dict[str, tuple[str, str | Callable[[re.Match[str]], str]]] = {
    "LUT6": (r"INIT\(64'h([0-9a-f]+)\)", _inverted),
    "FDRE": (r"\.D\((.*?)\),?\n", r".D(~\1),\n"),
    "CARRY4": (r"\.S\((.*?)\)\n", r".S(~\1)\n"),
    "SRL16E": (r"\.A0\(1'h([01])\)", lambda m: f".A0(1'h{1 - int(m[1])})"),
    "DSP48E1": (r"\.ALUMODE\(4'h0\)", ".ALUMODE(4'h3)"),
    "RAMB36E1": (r"\.WEBWE\(.*?\)(,?)\n", r".WEBWE(8'h00)\1\n"),
}


def count(netlist: str) -> Counter[str]:
    return Counter(_CELL.findall(netlist))


def without_unknown_starts(netlist: str) -> str:
    """Unknown start values are what the models of block_rams.v start with; others they do not have."""
    return re.sub(r"^\s*\.INITP?_[0-9A-F]{2}\(\d+.[hb]x+\),?\n", "", netlist, flags=re.M)


def usable_models(models: str) -> str:
    """Yosys' models without those of block_rams.v. A register of the DSP that is left out is a copy of its input;
    Icarus would see no change of a constant input."""
    text, rams = re.subn(r"^module RAMB(?:18|36)E1\b.*?^endmodule\n", "", models, flags=re.M | re.S)
    text, copies = re.subn(r"always @\* (\w+)\s*<?= (\w+);", r"always begin \1 = \2; @(\2); end", text)
    if rams != 2 or not copies:
        raise Failure(f"Yosys' cell models are not as they were: {rams} block RAMs, {copies} copies of DSP inputs")
    return text


def broken(netlist: str, kind: str, tenths: int) -> str:
    """With one cell of a kind broken: the one at so many tenths of all of them."""
    cells = list(re.finditer(rf"^  {kind} (?:#\(.*?\) )?\S+ +\(.*?\);\n", netlist, re.M | re.S))
    if not cells:
        raise Failure(f"there is no {kind}")
    cell = cells[len(cells) * tenths // 10]
    pattern, replacement = FAULTS[kind]
    after = re.sub(pattern, replacement, cell[0], count=1)
    if after == cell[0]:
        raise Failure(f"{kind} stays as it is")
    return netlist[:cell.start()] + after + netlist[cell.end():]


class Gates:
    def __init__(self, build: pathlib.Path, out: pathlib.Path) -> None:
        work.need("yosys", "iverilog", "vvp", how="see scripts/setup.sh gates")
        self.build, self.out, self.entity = build, out, Rtl().entity("psweep")
        # Debian's yosys comes without yosys-config; the cell models lie beside the program.
        program = pathlib.Path(shutil.which("yosys") or "").resolve()
        self.cells = self._models(program.parents[1] / "share" / "yosys")

    @staticmethod
    def _models(share: pathlib.Path) -> pathlib.Path:
        path = share / "xilinx" / "cells_sim.v"
        if not path.is_file():
            raise Failure(f"Yosys' cell models are not at {path}")
        return path

    def counted_cells(self) -> pathlib.Path:
        if not setup.venv_is_there("cost"):
            raise Failure("no Yosys of a known version: scripts/setup.sh cost")
        found = sorted(setup.venv_place("cost").glob("lib/python3*/site-packages/pyosys/share"))
        return self._models(found[0] if found else setup.venv_place("cost"))

    def folder(self, name: str) -> pathlib.Path:
        return self.out / name.replace(":", "_")

    def compile(self, program: pathlib.Path, netlist: pathlib.Path, folder: pathlib.Path) -> None:
        """Icarus has to take it without a word."""
        done = subprocess.run(["iverilog", "-g2005", "-o", str(program), "-s", "replay", str(folder / "bench.v"),
                               str(netlist), "tb/gates/block_rams.v", str(folder / "cells.v")], cwd=ROOT, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
        if done.returncode or done.stdout:
            raise Failure(f"iverilog: {done.stdout}")

    def netlist(self, name: str, counted: bool, folder: pathlib.Path, verilog: pathlib.Path) -> None:
        raw = folder / "raw.v"
        if counted:
            work.run([sys.executable, "-B", "scripts/cost/measure.py", "--config", name, "--netlist", raw],
                     log=folder / "measure.log")
            return
        (folder / "synth.ys").write_text(f"read_verilog {verilog}\nsynth_xilinx -family xc6v -flatten -noiopad -top "
                                         f"psweep\nwrite_verilog -noattr {raw}\n")
        options = [] if os.environ.get("VERBOSE") else ["-q", "-l", str(folder / "yosys.log")]
        work.run(["yosys", *options, folder / "synth.ys"],
                 log=None if os.environ.get("VERBOSE") else folder / "messages.log")

    def one(self, what: str) -> bool:
        """One configuration."""
        name, _, kind = what.partition(":")

        def say(text: str) -> None:
            print("\n".join(f"sim-gates: {what}: {line}" for line in text.splitlines()), flush=True)
        try:
            self.replay(name, kind == "counted", self.folder(what), say)
        except Failure as failure:
            say(str(failure))
            return False
        return True

    def replay(self, name: str, counted: bool, folder: pathlib.Path, say: Callable[[str], None]) -> None:
        clock, verilog = work.Clock(), self.build / "sw" / "verilated" / f"psweep_{name}" / "psweep.v"
        if not verilog.is_file():
            raise Failure(f"there is no {verilog}")
        work.fresh(folder)
        recording, log = folder / "recording.txt", folder / "record.log"
        if run.record(self.build, log, recording, name, seed=os.environ.get("SEED") or "1"):
            raise Failure(log.read_text(errors="replace"))
        say("\n".join(line for line in log.read_text().splitlines() if "clocks" in line))
        say("Yosys at work")
        self.netlist(name, counted, folder, verilog)
        raw = (folder / "raw.v").read_text()
        say(f"netlist after {clock}:")
        say("\n".join(f"  {kind:<9} {number}" for kind, number in sorted(count(raw).items())))
        (folder / "netlist.v").write_text(without_unknown_starts(raw))
        models = self.counted_cells() if counted else self.cells
        (folder / "cells.v").write_text(usable_models(models.read_text()))
        (folder / "bench.v").write_text(ports.gates(verilog.read_text(), "psweep", self.entity,
                                                    ROOT / "tb" / "gates" / "replay.v.in", "clk",
                                                    "dbg_" if counted else ""))
        self.compile(folder / "gates.vvp", folder / "netlist.v", folder)
        said = self.simulate(folder / "gates.vvp", recording)
        say(said)
        if not _GOOD.search(said):
            raise Failure("FAILED: the netlist differs")
        say(f"the netlist is bit-exact ({clock})")

    def simulate(self, program: pathlib.Path, recording: pathlib.Path, *more: str) -> str:
        done = subprocess.run(["vvp", "-n", str(program), f"+recording={recording}", *more], cwd=ROOT, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
        return done.stdout + ("" if done.returncode == 0 else f"vvp ended with {done.returncode}\n")

    def notices(self, kind: str, folder: pathlib.Path) -> bool:
        """Breaks one cell of a kind, the middle one; if nobody ever sees what that one does, up to four others."""
        netlist = (folder / "netlist.v").read_text()
        for tenths in (5, 3, 7, 2, 8):
            (folder / "broken.v").write_text(broken(netlist, kind, tenths))
            self.compile(folder / "broken.vvp", folder / "broken.v", folder)
            said = self.simulate(folder / "broken.vvp", folder / "recording.txt", "+first").splitlines()
            found = [line for line in said if line.startswith("mismatch")]
            if found or said[-1].startswith("vvp ended"):
                print(f"{kind} broken: found: {(found or said[-2:])[0]}", flush=True)
                return True
        print(f"FAILED: five broken {kind} are not noticed", flush=True)
        return False


def main(arguments: list[str]) -> int:
    options = work.parser("scripts/sim_gates.sh", __doc__)
    options.add_argument("--build", default="build", metavar="DIR",
                         help="folder with tb/replay/record_engine and sw/verilated/psweep_*/psweep.v")
    options.add_argument("--out", type=pathlib.Path, metavar="DIR", help="where to write (default: build/sim-gates)")
    options.add_argument("--no-faults", action="store_true", help="without the broken cells")
    options.add_argument("names", nargs="*", metavar="CONFIGURATION[:counted]", help=f"default: {' '.join(DEFAULT)}")
    given = options.parse_args(arguments)
    names, clock = given.names or list(DEFAULT), work.Clock()
    build = run.build_folder(given.build)
    gates = Gates(build, (given.out or build / "sim-gates").resolve())
    if any(name.endswith(":counted") for name in names):
        gates.counted_cells()
    failed = work.in_parallel(gates.one, names).count(False)
    if not failed and not given.no_faults:
        print(f"sim-gates: broken cells in {names[0]}", flush=True)
        failed = [gates.notices(kind, gates.folder(names[0])) for kind in FAULTS].count(False)
    print(f"sim-gates: {len(names)} configurations, {failed} failed, {clock}")
    return 1 if failed else 0
