# SPDX-License-Identifier: Apache-2.0
"""An independent opinion on the MAC: mac_rx and mac_tx (as the Verilog that GHDL makes of them) in Icarus, against the
MII source and sink of cocotbext-eth. Ends with 'N passed, N failed'; exit code 1 if any failed, or none ran.

cocotb and cocotbext-eth are installed by pip into build/opinion/venv (PYTHON_VENV names a ready one instead); this
needs the network once. Everything else is of the package group 'opinion'."""
from __future__ import annotations

import os
import pathlib
from xml.etree import ElementTree

from .. import work
from ..paths import ROOT
from ..vhdl import Rtl
from ..work import Failure

VERSIONS = ("cocotb==2.1.0", "cocotbext-eth==0.1.28")


def environment_of_python(venv: pathlib.Path, out: pathlib.Path) -> None:
    python = venv / "bin" / "python3"
    if python.exists() and not work.run([python, "-c", "import cocotb, cocotbext.eth"], quiet=True, check=False):
        return
    print(f"mac-opinion: installing {' '.join(VERSIONS)} into {venv}", flush=True)
    work.run(["python3", "-m", "venv", venv])
    work.run([venv / "bin" / "pip", "install", "-q", "--disable-pip-version-check", *VERSIONS], log=out / "pip.log")


def main(arguments: list[str]) -> int:
    work.parser("scripts/mac_opinion.sh", __doc__).parse_args(arguments)
    out = ROOT / "build" / "opinion"
    out.mkdir(parents=True, exist_ok=True)
    venv = (ROOT / (os.environ.get("PYTHON_VENV") or out / "venv")).absolute()
    environment_of_python(venv, out)
    folder = work.fresh(out / "work")
    work.run(["ghdl", "-a", "--std=93", f"--workdir={folder}", *Rtl().sources("mac_tx")])
    for unit in ("mac_rx", "mac_tx"):
        (out / f"{unit}.v").write_text(work.output(["ghdl", "--synth", "--std=93", f"--workdir={folder}",
                                                    "--out=verilog", unit], notes=out / f"{unit}.log"))
    work.run(["iverilog", "-g2012", "-s", "mac_wrapper", "-o", out / "mac.vvp", "tb/flows/mac_wrapper.v",
              out / "mac_rx.v", out / "mac_tx.v"])

    def ask(*options: str) -> str:
        return work.output([venv / "bin" / "cocotb-config", *options]).strip()
    library = pathlib.Path(ask("--lib-name-path", "vpi", "icarus"))
    # vvp 11 knows modules by the ending .vpi only.
    link = out / "cocotb.vpi"
    link.unlink(missing_ok=True)
    link.symlink_to(library.resolve())
    results = out / "results.xml"
    results.unlink(missing_ok=True)
    path = os.environ.get("LD_LIBRARY_PATH")
    work.run(["vvp", "-M", out, "-m", "cocotb", out / "mac.vvp"], log=out / "run.log", check=False, environment={
        "GPI_USERS": f"{ask('--libpython')};{ask('--pygpi-entry-point')}",
        "PYGPI_PYTHON_BIN": str(venv / "bin" / "python3"), "COCOTB_TEST_MODULES": "mac_opinion",
        "COCOTB_TOPLEVEL": "mac_wrapper", "COCOTB_RESULTS_FILE": str(results),
        "PYTHONPATH": str(ROOT / "tb" / "flows"), "PYTHONDONTWRITEBYTECODE": "1", "COCOTB_LOG_LEVEL": "WARNING",
        "LD_LIBRARY_PATH": str(library.parent) + (f":{path}" if path else "")})
    if not results.is_file() or not results.stat().st_size:
        raise Failure(f"{work.tail(out / 'run.log', 30)}\nthe simulation did not end")
    cases = list(ElementTree.parse(results).getroot().iter("testcase"))
    failed = sum(1 for case in cases if case.find("failure") is not None or case.find("error") is not None)
    if failed:
        print(work.tail(out / "run.log", 40))
    print(f"mac-opinion: log: {out}/run.log\n{len(cases) - failed} passed, {failed} failed")
    return 0 if cases and not failed else 1
