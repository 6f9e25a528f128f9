# SPDX-License-Identifier: Apache-2.0
"""Quick checks of everything that is text; no network, nothing is built.

A check without its tool is skipped by name. Exceptions: scripts/lint_waivers.txt, each with its reason. Ends with
'N passed, N failed, N skipped'."""
from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Callable

from ..vhdl import VhdlError
from . import converted, hardware, programs, tables, text
from .trace import check_trace
from .tree import Skip, Tree

Check = Callable[[Tree], list[str]]


def trace(tree: Tree) -> list[str]:
    """What the page traceability names exists, every requirement has a test."""
    return check_trace(tree, CHECKS)


CHECKS: dict[str, Check] = {
    "layout": programs.check_layout, "text": text.check_text, "links": text.check_links,
    "files": hardware.check_files, "analyse": hardware.check_analyse, "vhdl": hardware.check_vhdl,
    "attributes": hardware.check_attributes, "units": hardware.check_units, "tables": tables.check_tables,
    "pages": programs.check_pages, "evidence": programs.check_evidence, "configurations": programs.check_configurations,
    "arrows": programs.check_arrows,
    "trace": trace, "verilog": converted.check_verilog, "format": programs.check_format,
    "shell": programs.check_shell, "python": programs.check_python, "types": programs.check_types,
    "length": programs.check_length,
}


def run(names: list[str]) -> int:
    tree = Tree()
    passed = failed = skipped = 0
    for name in names:
        try:
            lines = CHECKS[name](tree)
        except Skip as reason:
            skipped += 1
            print(f"lint: {name}: SKIPPED: {reason}")
            continue
        except VhdlError as error:
            lines = [str(error)]
        notes = [line for line in lines if line.startswith("note: ")]
        if len(notes) == len(lines):
            passed += 1
            for line in notes:
                print(line[:240])
        else:
            failed += 1
            print("\n".join([*lines, f"lint: {name}: FAILED"]))
        sys.stdout.flush()
    print(f"{passed} passed, {failed} failed, {skipped} skipped")
    return 1 if failed else 0


def lay_out() -> int:
    try:
        programs.need_clang_format()
    except Skip as reason:
        print(f"lint: {reason}", file=sys.stderr)
        return 1
    tree = Tree()
    return subprocess.run(["clang-format", "-i", *programs.cpp_files(tree)], cwd=tree.root, check=False).returncode


def main(arguments: list[str]) -> int:
    listing = "\n".join(f"  {name:11}{' '.join((check.__doc__ or '').split())}" for name, check in CHECKS.items())
    parser = argparse.ArgumentParser(prog="scripts/lint.sh", description=f"{__doc__}\n\n{listing}",
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checks", nargs="*", metavar="CHECK", help="default: all of them")
    parser.add_argument("--format", action="store_true", help="lay out the C++ with clang-format instead")
    parser.add_argument("--rows", action="store_true", help="print what the tables of the pages have to say instead")
    options = parser.parse_args(arguments)
    unknown = [name for name in options.checks if name not in CHECKS]
    if unknown:
        parser.error(f"no check '{unknown[0]}'")
    if options.rows:
        print("\n".join(tables.rows(Tree().rtl)))
        return 0
    return lay_out() if options.format else run(options.checks or list(CHECKS))
