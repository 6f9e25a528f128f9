#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs a tool of scripts/psweep_tools: scripts/tools.py --help lists them."""
import pathlib
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

from psweep_tools import cli  # noqa: E402

if __name__ == "__main__":
    sys.exit(cli.main(sys.argv[1:]))
