# SPDX-License-Identifier: Apache-2.0
"""Runs Yosys commands, one a line of standard input, in the Yosys of this Python (package pyosys).

measure.py starts it with the Python of the virtual environment. --version prints Yosys' version.
"""
import sys

from pyosys import libyosys as yosys

if sys.argv[1:] == ["--version"]:
    import importlib.metadata
    print("Yosys " + importlib.metadata.version("pyosys"))
    sys.exit(0)
design = yosys.Design()
for line in sys.stdin:
    if line.strip():
        print("# " + line.strip(), flush=True)
        if line.strip() == "new design":
            design = yosys.Design()
        else:
            yosys.run_pass(line.strip(), design)
