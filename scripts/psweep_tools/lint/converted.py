# SPDX-License-Identifier: Apache-2.0
"""Verilator -Wall on the converted engine and chip in every named configuration."""
from __future__ import annotations

import concurrent.futures
import os
import pathlib
import shutil
import subprocess
import tempfile

from .. import configs
from .tree import Skip, Tree

_WAIVERS = "scripts/cmake/ghdl_netlist.vlt"


def _one(tree: Tree, top: str, config: pathlib.Path, generics: dict[str, int], work: pathlib.Path) -> list[str]:
    folder = work / top / config.stem
    commands = (
        ["cmake", "-D", "GHDL=ghdl", "-D", "STANDARD=--std=93", "-D", f"TOP={top}",
         "-D", "SOURCES=" + "|".join(f"rtl/{name}" for name in tree.rtl.files.values()),
         "-D", "GENERICS=" + "|".join(f"-g{name}={value}" for name, value in generics.items()),
         "-D", f"DIR={folder}", "-P", "scripts/cmake/VhdlToVerilog.cmake"],
        ["verilator", "--lint-only", "-Wall", "--top-module", top, _WAIVERS, f"{folder}/{top}.v"])
    for command in commands:
        done = subprocess.run(command, cwd=tree.root, capture_output=True, text=True, check=False)
        if done.returncode:
            return [*(done.stdout + done.stderr).splitlines(), f"{top} in {config.name}: see above"]
    return []


def check_verilog(tree: Tree) -> list[str]:
    """Verilator -Wall takes the converted engine and chip in every named configuration."""
    for program in ("ghdl", "verilator", "cmake"):
        if shutil.which(program) is None:
            raise Skip(f"{program} is not installed")
    rtl = tree.root / "rtl"
    try:
        work = [("psweep", path, configs.engine(path)) for path in configs.engines(rtl)]
        work += [("psweep_top", path, configs.chip(path, rtl)) for path in configs.chips(rtl)]
    except configs.ConfigurationError as error:
        return [str(error)]
    if not work:
        return ["no configuration was found"]
    with tempfile.TemporaryDirectory() as scratch, \
            concurrent.futures.ThreadPoolExecutor(int(os.environ.get("JOBS") or os.cpu_count() or 1)) as pool:
        results = pool.map(lambda one: _one(tree, one[0], one[1], one[2], pathlib.Path(scratch)), work)
        return [line for lines in results for line in lines]
