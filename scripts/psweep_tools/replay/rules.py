# SPDX-License-Identifier: Apache-2.0
"""Do the assertions in the VHDL find what they are for (docs/verification.md)? One fault at a time is put into a copy
of the RTL, a recorded session is replayed on it in GHDL (docs/replay.md), and the rule named has to stop it.

Ends with 'N passed, N failed'; exit code 1 if a rule did not speak, or if nothing was tried.
Environment: JOBS (default: all cores), GHDL (the program)."""
from __future__ import annotations

import pathlib
import shutil

from .. import work
from ..edits import DoesNotFit, Fault
from ..vhdl import Rtl
from ..work import Failure
from . import run

# Entity, the beginning of the message that has to come, what is replaced by what.
RULES = tuple(Fault(*row) for row in (
    ("stream_fifo", "stream_fifo: a beat that waited at m_*", "m_valid = '1' and m_tready = '1'", "m_valid = '1'"),
    ("updating", "updating: a cell that leaves finds no place", "G_DEPTH_LOG2 => 4", "G_DEPTH_LOG2 => 2"),
    ("address_generator", "address_generator: a position is unknown", "and s_plane_first = '0'$",
     "and s_plane_first = '1'"),
    ("control", "address_generator: the plane changed within a row", "if is_sweep = '1' and at_last = '1' then$",
     "if is_sweep = '1' then"),
    ("control", "address_generator: a row without a sample, or too close", r"to_unsigned\(C_ROW_MIN - 1, C_COL_W\)",
     "to_unsigned(C_ROW_MIN - 2, C_COL_W)"),
    ("address_generator", "address_generator: a usable sample lies outside",
     r"return to_(bit|sl)\(position\(31 downto C_POS_FRAC\) < .*", "return '1';"),
    ("storage", "storage: a pixel of a usable", r"write_row <= write_row \+ C_PITCH;",
     "write_row <= write_row + C_PITCH + 1;"),
    ("control", "storage: a pixel is written while", "load_valid +<= pix_fire;", "load_valid <= pix_fire or is_sweep;"),
    ("interpolation", "interpolation: the upper row's sum", "(s1_upper_start.*)'0' & p00", r"\1'0' & p10"),
    ("interpolation", "interpolation: the lower row's sum", "(s1_lower_start.*)'0' & p01", r"\1'0' & p11"),
    ("interpolation", "interpolation: the sum between the rows", r"s4_start <= shift_left\(resize\(s3_upper",
     "s4_start <= shift_left(resize(s3_lower"),
    ("similarity", "similarity: the sample M rows above", r"raddr => std_logic_vector\(next_line\)",
     "raddr => s2_line"),
    ("similarity", "similarity: the sum of l", r"s8_l <= v_l \+", "s8_l <= v_l + v_l +"),
    ("similarity", "similarity: the covariance is larger", r"s12_half  <= s11_x \+ ", "s12_half <= s11_x - "),
    ("similarity", "similarity: the quotient's operands", r"v_s15_den := s14_den\(C_NORM downto 1\)",
     "v_s15_den := s14_den(C_NORM - 1 downto 0)"),
    ("similarity", "similarity: the sums of a column", "raddr => s2_col", "raddr => s7_col"),
    ("psweep", "updating: unloading begins while", r"\+ updating_latency\(G_FRAC_W, G_LANES\);", ";"),
    ("updating", "updating: a cell of the map is unknown", "(s1_first <=) first;", r"\1 '0';"),
    ("updating", "updating: the parabola's quotient", "old_best - lower;", "lower - old_best;"),
    ("control", "control: a state that cannot be", "state_q <= C_FLUSHING;", 'state_q <= "0001";'),
))


class Trial:
    def __init__(self, build: pathlib.Path) -> None:
        self.build, self.rtl = build, Rtl()
        self.out = work.fresh(build / "rules")
        self.recording = self.out / "tiny.txt"
        if run.record(build, self.out / "record.log", self.recording, "tiny"):
            raise Failure(f"no recording: {self.out}/record.log")

    def told(self, numbered: tuple[int, Fault]) -> bool:
        number, fault = numbered
        folder = work.fresh(self.out / str(number))
        try:
            text = fault.text(self.rtl)
        except DoesNotFit as error:
            print(f"rules: FAILED: {error}", flush=True)
            return False
        broken = folder / f"{fault.entity}.vhd"
        broken.write_text(text, encoding="latin-1")
        sources = [broken if unit == fault.entity else self.rtl.path(unit) for unit in self.rtl.up_to("psweep")]
        log = folder / "log"
        code = run.replay(self.build, sources, self.recording, folder / "work", log, 100)
        if code and fault.name in log.read_text(errors="replace"):
            print(f"rules: {fault.name}: told", flush=True)
            shutil.rmtree(folder)
            return True
        print(f"rules: FAILED: not told: {fault.name} (code {code}, {log})", flush=True)
        return False


def main(arguments: list[str]) -> int:
    options = work.parser("scripts/rules.sh", __doc__)
    options.add_argument("--build", default="build", metavar="DIR")
    options.add_argument("text", nargs="?", default="", help="only the faults with this text; default: all")
    given = options.parse_args(arguments)
    wanted = [rule for rule in RULES if given.text in f"{rule.entity} {rule.pattern} {rule.replacement} {rule.name}"]
    trial = Trial(run.build_folder(given.build))
    told = sum(work.in_parallel(trial.told, list(enumerate(wanted))))
    print(f"{told} passed, {len(wanted) - told} failed")
    return 0 if wanted and told == len(wanted) else 1
