# SPDX-License-Identifier: Apache-2.0
"""The tools by name."""
from __future__ import annotations

import importlib
import os
import sys

from .paths import ROOT
from .work import Failure

# Name: module in this package whose main(arguments) does it, what it does.
COMMANDS = {
    "arrows": ("lint.arrows", "which folder of sw/ and tb/ uses which"),
    "ci": ("ci", "what continuous integration runs"),
    "coverage": ("coverage.main", "lines and bits that the tests reach"),
    "demo": ("demo", "one scene through float, fixed and RTL, with a report"),
    "dse": ("dse.explore", "the design space, by Snakemake"),
    "dse-node": ("dse.node", "a command in a Slurm cluster of this machine"),
    "dse-trial": ("dse.trial", "does the workflow of the design space resume?"),
    "evidence": ("evidence.main", "what was measured on what, and what is stale"),
    "formal": ("formal", "proofs, and faults that have to be found"),
    "fresh-machine": ("flows.machine", "README's commands in a bare Debian"),
    "generics": ("generics", "generics just outside of their ranges are refused"),
    "lint": ("lint.main", "quick checks of everything that is text"),
    "mac-opinion": ("flows.opinion", "the MAC against cocotbext-eth"),
    "mutants": ("mutants.main", "small faults in a copy of the RTL"),
    "ports": ("replay.ports", "benches and recorders, written from the ports of an entity"),
    "real": ("real", "real pairs, tabled"),
    "rules": ("replay.rules", "do the assertions in the VHDL find what they are for?"),
    "same-output": ("pairs", "two folders with results, byte by byte"),
    "setup": ("setup", "installs Debian's packages and virtual environments"),
    "shapes": ("shapes", "tables and picture of tiles of every shape"),
    "sim": ("sim", "runs the tests, sums them up"),
    "sim-gates": ("flows.gates", "the netlist at gate level"),
    "sim-ghdl": ("replay.more", "more recordings on the original VHDL"),
    "sim-net": ("flows.network", "the simulated chip behind the kernel's network stack"),
    "soak": ("soak", "random tiles, good and bad"),
    "sweep": ("sweep", "engines of random sizes and formats"),
    "upsets": ("upsets.inject", "circuits whose registers can be upset"),
    "wave-pictures": ("flows.waves", "pictures of waves, by GTKWave"),
}


def main(arguments: list[str]) -> int:
    if not arguments or arguments[0] not in COMMANDS:
        wanted = bool(arguments) and arguments[0] in ("-h", "--help")
        print("usage: scripts/tools.py TOOL [ARGUMENT ..]      TOOL --help says more\n\n"
              + "\n".join(f"  {name:17}{what}" for name, (_, what) in COMMANDS.items()),
              file=sys.stdout if wanted else sys.stderr)
        return 0 if wanted else 2
    module = importlib.import_module(f"psweep_tools.{COMMANDS[arguments[0]][0]}")
    os.chdir(ROOT)  # names of files are relative to it
    try:
        return int(module.main(arguments[1:]))
    except Failure as failure:
        sys.stdout.flush()
        print("\n".join(f"{arguments[0]}: {line}" for line in str(failure).splitlines()), file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
