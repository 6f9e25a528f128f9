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
    "setup": ("setup", "installs Debian's packages and virtual environments"),
    "generics": ("generics", "generics just outside of their ranges are refused"),
    "lint": ("lint.main", "quick checks of everything that is text"),
    "upsets": ("upsets.inject", "circuits whose registers can be upset"),
    "ports": ("replay.ports", "benches and recorders, written from the ports of an entity"),
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
