# SPDX-License-Identifier: Apache-2.0
"""Proofs of small circuits: what tb/formal/<name>.sv asserts holds for ever, whatever comes in. Ends with
'N passed, N failed'; exit code 1 if anything failed.

GHDL makes Verilog of the entity, Yosys joins it with the assertions, ABC's pdr looks for a proof by induction (it
finds the invariants itself) or a counterexample. Each clock edge becomes a step in which the clock's input is '1', so
that several clocks tick in any order. Start: all registers zero (tb/formal/*.sv say what they assume beyond).
Each proof is followed by faults put into the VHDL one by one: the prover has to find every one of them.
Environment: VERBOSE=1 shows the tools' messages. Work files in build/formal."""
from __future__ import annotations

import os
import pathlib
import re
import shutil
from dataclasses import dataclass

from . import work
from .edits import Fault
from .paths import ROOT
from .vhdl import Rtl
from .work import Failure

LIMIT = 100  # seconds a run
PROVED, FOUND = "proved", "found"


@dataclass(frozen=True)
class Proof:
    name: str  # behind a '-': the same properties with other generics
    top: str
    generics: dict[str, int]
    exposed: tuple[str, ...]  # signals that the assertions look at
    units: tuple[str, ...]
    faults: tuple[Fault, ...]
    bench: tuple[str, ...] = ()  # other VHDL
    # The rules of tb/formal/crossings.ys instead of assertions.
    crossings: bool = False

    @property
    def properties(self) -> str:
        return self.name.split("-")[0]


def _faults(*rows: tuple[str, str, str, str]) -> tuple[Fault, ...]:
    return tuple(Fault(*row) for row in rows)


_CONTROL = _faults(
    ("control", "start with a table too short", r"if config_bad = '1' or table_bad = '1' then",
     "if config_bad = '1' then"),
    ("control", "a tile too wide allowed", r"to_unsigned\(G_PLANE_COLS, 16\)", "to_unsigned(G_PLANE_COLS + 1, 16)"),
    ("control", "a set too many", r"plane_set >= last_set or", "plane_set > last_set or"),
    ("control", "a short row", r"to_unsigned\(C_ROW_MIN - 1, C_COL_W\)", "to_unsigned(C_ROW_MIN - 2, C_COL_W)"),
    ("control", "long packet not drained", r"(state_q <= C_SWEEP;.*\n.*\n.*)C_DRAIN", r"\1C_IDLE"),
    ("control", "map unloaded too early", r"(C_FLUSH +: integer := G_LATENCY) \+ 2", r"\1"),
    ("control", "done and dropped", r" and not tile_done and not event_short$", " and not event_short"),
    ("control", "samples after an abort", r"active +<= '0';$", "active <= active;"))


def _control(lanes: int) -> Proof:
    return Proof("control" if lanes == 1 else f"control-{lanes}", "control",
                 {"IMG_COLS": 6, "IMG_ROWS": 4, "PLANE_COLS": 2, "PLANE_ROWS": 2, "PLANES": 3, "WINDOW": 3, "MNCC_W": 4,
                  "LANES": lanes, "LATENCY": 5}, ("tile_done", "tile_drop"), ("psweep_pkg", "control"), _CONTROL)


def proofs(rtl: Rtl) -> tuple[Proof, ...]:
    return (
        Proof("async_fifo", "async_fifo", {"DATA_W": 1, "DEPTH_LOG2": 2},
              ("w_take", "r_take", "w_hold", "r_hold", "w_gray", "r_gray", "w_gray_at_r", "r_gray_at_w"),
              ("psweep_pkg", "cdc_sync", "async_fifo"), _faults(
                  ("async_fifo", "pointers in binary", r"v_count xor .*downto 1\)\)", "v_count"),
                  ("async_fifo", "written when full", r"w_take +<= w_valid and not w_full and",
                   "w_take <= w_valid and"),
                  ("async_fifo", "pointer cleared by its own reset", r"w_clear <= w_answer or",
                   "w_clear <= w_rst or w_answer or"),
                  ("async_fifo", "request ends before the jump", "w_answer = '1' and w_zero = '1'", "w_answer = '1'"),
                  ("async_fifo", "request during the last answer", "and r_answer /= '1' then", "then"),
                  ("async_fifo", "reader works during the answer", r"(r_hold +<= r_rst or r_request) or r_answer",
                   r"\1"),
                  ("async_fifo", "address without the fold", r"gray\(C_TOP\) xor gray\(C_TOP - 1\)",
                   "gray(C_TOP - 1)"))),
        Proof("stream_fifo", "stream_fifo", {"DATA_W": 3, "DEPTH_LOG2": 2}, (),
              ("psweep_pkg", "ram_sdp", "stream_fifo"), _faults(
                  ("stream_fifo", "one place too many", r"write_place \+ 1 /= read_place",
                   "write_place + 2 /= read_place"),
                  ("stream_fifo", "shown while it is written", r"to_(bit|sl)\(next_place /= write_place\);",
                   r"s_fire or \g<0>"),
                  ("stream_fifo", "beats behind are forgotten", r"more +<= s_fire or", "more <="))),
        Proof("crc_step", "crc_step", {}, (), ("eth_pkg",), _faults(
            ("eth_pkg", "one coefficient missing", "EDB88320", "EDB88300"),
            ("eth_pkg", "residue of the other bit order", "DEBB20E3", "C704DD7B")), ("tb/formal/crc_step.vhd",)),
        _control(1), _control(2),
        # All crossings of the arbiter pass through synchronisers, memories or the list of tb/formal/crossings.ys.
        Proof("crossings", "arbiter", {"PLANE_COLS": 16, "PLANE_ROWS": 16, "IMG_COLS": 40, "IMG_ROWS": 40, "PLANES": 5},
              (), tuple(rtl.up_to("arbiter")), _faults(
                  ("arbiter", "collisions past the synchroniser", "flips_last <= flips_seen", "flips_last <= flips"),
                  ("arbiter", "ticks past the synchroniser", "ticks_last <= ticks_q", "ticks_last <= ticks"),
                  ("mac_rx", "sending past the synchroniser", r"own +<= synchronised\(0\)", "own <= sending"),
                  ("packet_tx", "reset of mac_tx past the synchroniser", r"down +<= levels_q\(2\)", "down <= tx_rst"),
                  ("mac_tx", "requests past the synchroniser", r"synchronised\(4 downto 3\)", "f_request"),
                  ("arbiter", "a gate before a synchroniser", "full_duplex => duplex_q", "full_duplex => full_duplex"),
                  ("arbiter", "reset of another clock", r"rst +=> tx_rst", "rst => rst")), (), True))


class Prover:
    def __init__(self) -> None:
        work.need("ghdl", "yosys", how="see scripts/setup.sh formal")
        # Yosys brings ABC along, as a program of its own or as Debian's.
        abc = shutil.which("yosys-abc") or shutil.which("berkeley-abc")
        if abc is None:
            raise Failure("no ABC (yosys-abc, berkeley-abc)")
        self.abc, self.rtl, self.passed, self.failed = abc, Rtl(), 0, 0

    def answer(self, proof: Proof, folder: pathlib.Path, files: list[pathlib.Path]) -> str:
        """'proved', 'found' (a counterexample, a rule that is broken) or what went wrong."""
        generics = [f"-gG_{name}={value}" for name, value in proof.generics.items()]
        log = folder / "ghdl.log"
        if work.run(["ghdl", "-a", "--std=93", f"--workdir={folder}", *files], log=log, check=False):
            return f"GHDL failed: {log}"
        try:
            (folder / "raw.v").write_text(work.output(
                ["ghdl", "--synth", "--std=93", "--no-formal", f"--workdir={folder}", "--out=verilog", *generics,
                 proof.top], notes=log))
        except Failure:
            return f"GHDL failed: {log}"
        return self.check_crossings(folder) if proof.crossings else self.prove(proof, folder)

    def check_crossings(self, folder: pathlib.Path) -> str:
        rules = (ROOT / "tb" / "formal" / "crossings.ys").read_text()
        (folder / "proof.ys").write_text(f"read_verilog {folder}/raw.v\n{rules}")
        log = folder / "messages.log"
        if not work.run(["yosys", "-q", "-l", folder / "yosys.log", folder / "proof.ys"], log=log, check=False):
            return PROVED
        if "ERROR: Assertion failed" in log.read_text():
            self.show(log)
            return FOUND
        return f"Yosys failed: {log}"

    def prove(self, proof: Proof, folder: pathlib.Path) -> str:
        steps = re.sub(r"always @\(posedge (\w+)\)", r"always @($global_clock) if (\1)", (folder / "raw.v").read_text())
        if re.search("posedge|negedge", steps):
            return f"an edge in {folder}/raw.v was not understood"
        (folder / "steps.v").write_text(steps)
        script = [f"read_verilog -formal -sv {folder}/steps.v"]
        # A synchroniser of ideal flip-flops would prove too much.
        if synchroniser := re.search(r"^module (cdc_sync_\w+)", steps, re.M):
            script += [f"delete {synchroniser[1]}", "read_verilog -formal -sv tb/formal/cdc_sync_model.sv",
                       f"rename cdc_sync_model {synchroniser[1]}"]
        if proof.exposed:
            script.append("expose " + " ".join(f"{proof.top}/w:{signal}" for signal in proof.exposed))
        defines = " ".join(f"-D{name}={value}" for name, value in proof.generics.items())
        script += [f"read_verilog -formal -sv {defines} tb/formal/{proof.properties}.sv", "prep -top proof -flatten",
                   "opt -full", "setundef -init -zero", "setundef -undriven -anyseq",
                   # No assertion may get lost on the way.
                   "select -assert-min 1 t:$assert", "techmap", "opt -fast", "abc -g AND -fast", "opt_clean",
                   f"write_aiger -zinit {folder}/proof.aig"]
        (folder / "proof.ys").write_text("\n".join(script) + "\n")
        if work.run(["yosys", "-q", "-l", folder / "yosys.log", folder / "proof.ys"], quiet=True, check=False):
            return f"Yosys failed: {folder}/yosys.log"
        log = folder / "abc.log"
        work.run([self.abc, "-c", f"read_aiger {folder}/proof.aig; fold; pdr"], log=log, check=False, limit=LIMIT)
        self.show(log)
        text = log.read_text(errors="replace")
        if "Property proved" in text:
            return PROVED
        return FOUND if "was asserted in frame" in text else f"no answer: {log}"

    def show(self, log: pathlib.Path) -> None:
        if os.environ.get("VERBOSE"):
            print(log.read_text(errors="replace"))

    def report(self, wanted: str, answer: str, clock: work.Clock, text: str) -> None:
        if answer == wanted:
            self.passed += 1
            words = "fault found" if wanted == FOUND else answer
        else:
            self.failed += 1
            words = "FAILED: " + {PROVED: "fault not found", FOUND: "counterexample"}.get(answer, answer)
        print(f"formal: {text}: {words} ({clock.milliseconds} ms)", flush=True)

    def run(self, proof: Proof) -> None:
        root = ROOT / "build" / "formal"
        root.mkdir(parents=True, exist_ok=True)
        for old in root.glob(f"{proof.name}.*"):
            shutil.rmtree(old)
        files = {unit: self.rtl.path(unit) for unit in proof.units}
        others = [ROOT / name for name in proof.bench]
        clock = work.Clock()
        self.report(PROVED, self.answer(proof, work.fresh(root / proof.name), [*files.values(), *others]), clock,
                    proof.name)
        for number, fault in enumerate(proof.faults, 1):
            clock, folder = work.Clock(), work.fresh(root / f"{proof.name}.{number}")
            broken = folder / f"{fault.entity}.vhd"
            try:
                broken.write_text(fault.text(self.rtl), encoding="latin-1")
                answer = self.answer(proof, folder, [*{**files, fault.entity: broken}.values(), *others])
            except Failure as failure:
                answer = str(failure)
            self.report(FOUND, answer, clock, f"{proof.name}, {fault.name}")


def main(arguments: list[str]) -> int:
    options = work.parser("scripts/formal.sh", __doc__)
    options.add_argument("names", nargs="*", metavar="NAME", help="default: all")
    names = options.parse_args(arguments).names
    prover = Prover()
    known = {proof.name: proof for proof in proofs(prover.rtl)}
    unknown = [name for name in names if name not in known]
    if unknown:
        raise Failure(f"unknown name among: {' '.join(names)}")
    for name in names or known:
        prover.run(known[name])
    print(f"{prover.passed} passed, {prover.failed} failed")
    return 1 if prover.failed else 0
