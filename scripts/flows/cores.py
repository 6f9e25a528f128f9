#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes files and parameters of the FuseSoC cores again, after rtl/files.f or generics have changed.

  scripts/flows/cores.py      rewrites rtl/psweep.core and rtl/psweep_top.core in place; the rest of them stays

scripts/check_flows.py says when it is time, by a reading of its own.
"""
import argparse
import pathlib
import re
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import project  # noqa: E402


def rewrite(top, files):
    path = project.RTL / (top + ".core")
    generics = project.measure.generics_of(top, project.RTL)
    text = path.read_text()
    for pattern, lines in (
            (r"(?:      - [\w/]+\.vhd\n)+",
             ["      - {}\n".format(f.relative_to(project.RTL).as_posix()) for f in files]),
            (r"(?:      - G_\w+\n)+", ["      - {}\n".format(g) for g in generics]),
            (r"(?:  G_\w+: \{.*\}\n)+", ["  {}: {{datatype: int, paramtype: generic, default: {}}}\n".format(*g)
                                         for g in generics.items()])):
        text, number = re.subn(pattern, "".join(lines).replace("\\", "\\\\"), text)
        if number != 1:
            raise project.FlowError("{}: {} places for {}".format(path.name, number, lines[0].strip()))
    if text != path.read_text():
        path.write_text(text)
        print("cores: {} written".format(path))


def main():
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    engine, all_files = project.sources("psweep"), project.sources()
    rewrite("psweep", engine)
    rewrite("psweep_top", [f for f in all_files if f not in engine])


if __name__ == "__main__":
    try:
        main()
    except (project.FlowError, project.CostError) as error:
        sys.exit("cores: {}".format(error))
