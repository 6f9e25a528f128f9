# SPDX-License-Identifier: Apache-2.0
"""Verilator -Wall on the converted engine and chip in every named configuration."""
from __future__ import annotations

import concurrent.futures
import os
import pathlib
import shutil
import subprocess
import tempfile

import configurations

from .tree import Skip, Tree

_WAIVERS = "scripts/cmake/ghdl_netlist.vlt"


def _one(tree: Tree, top: str, config: str, generics: dict[str, int], work: pathlib.Path) -> list[str]:
    folder = work / top / config
    commands = (
        ["cmake", "-D", "GHDL=ghdl", "-D", "STANDARD=--std=93", "-D", f"TOP={top}",
         "-D", "SOURCES=" + "|".join(f"rtl/{name}" for name in tree.rtl.files.values()),
         "-D", "GENERICS=" + "|".join(f"-g{name}={value}" for name, value in generics.items()),
         "-D", f"DIR={folder}", "-P", "scripts/cmake/VhdlToVerilog.cmake"],
        ["verilator", "--lint-only", "-Wall", "--top-module", top, _WAIVERS, f"{folder}/{top}.v"])
    for command in commands:
        done = subprocess.run(command, cwd=tree.root, capture_output=True, text=True, check=False)
        if done.returncode:
            return [*(done.stdout + done.stderr).splitlines(), f"{top} in {config}: see above"]
    return []


def check_verilog(tree: Tree) -> list[str]:
    """Verilator -Wall takes the converted engine and chip in every named configuration."""
    for program in ("ghdl", "verilator", "cmake"):
        if shutil.which(program) is None:
            raise Skip(f"{program} is not installed")
    none = tree.root / "no-build"  # users' own configurations are theirs
    try:
        work = [(top, name, configurations.find(name, kind, none).generics())
                for kind, (_, _, top) in configurations.KINDS.items() for name in configurations.files(kind, none)]
    except configurations.ConfigError as error:
        return [str(error)]
    if not work:
        return ["no configuration was found"]
    with tempfile.TemporaryDirectory() as scratch, \
            concurrent.futures.ThreadPoolExecutor(int(os.environ.get("JOBS") or os.cpu_count() or 1)) as pool:
        results = pool.map(lambda one: _one(tree, one[0], one[1], one[2], pathlib.Path(scratch)), work)
        return [line for lines in results for line in lines]
