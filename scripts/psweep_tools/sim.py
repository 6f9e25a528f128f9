# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of build/ and ends with one line 'N passed, N failed, N skipped', failed and skipped ones by name.

Environment: T (regular expression: only tests of these names), SEED (seed of the random stimuli, default 1), JOBS,
VERBOSE=1 (all output of all tests). Exit code 1 if a test failed or none ran.

Skipped is a test that asked for it by a line 'SKIPPED: <reason>' (property SKIP_REGULAR_EXPRESSION) or by its exit code
(SKIP_RETURN_CODE), or that is disabled. A test that could not be started failed, and so did a test with a failed
assertion, whatever else it printed."""
from __future__ import annotations

import os
import pathlib
from xml.etree import ElementTree

from . import work
from .paths import ROOT


def _reason(case: ElementTree.Element, output: str) -> tuple[str, bool]:
    """Why a test did not run, and whether it asked for that."""
    skipped = case.find("skipped")
    reason = skipped.get("message", "") if skipped is not None else ""
    asked = reason.startswith("SKIP_")
    if case.get("status") == "notrun":
        for line in output.splitlines():
            if "SKIPPED: " in line:
                reason = line.rpartition("SKIPPED: ")[2]
    return reason, asked


def summary(results: pathlib.Path) -> tuple[list[str], int]:
    """Lines about what ctest --output-junit left, the exit code."""
    if not results.is_file() or not results.stat().st_size:
        return ["summary: ctest left no results", "0 passed, 1 failed, 0 skipped"], 1
    passed, failed, skipped = 0, [], []
    for case in ElementTree.parse(results).getroot().iter("testcase"):
        name, status, output = case.get("name", ""), case.get("status"), case.findtext("system-out") or ""
        reason, asked = _reason(case, output)
        broken = "FAILED:" in output
        if status == "run":
            passed += 1
        elif status == "disabled" or (status == "notrun" and asked and not broken):
            skipped.append(f"skipped: {name}: {reason}")
        else:
            failed.append(f"failed:  {name}"
                          + (f": could not be run: {reason}" if status == "notrun" and not broken else ""))
    lines, number = failed + skipped, len(failed)
    if not passed and not failed:
        lines.append("summary: no test ran")
        number = 1
    return [*lines, f"{passed} passed, {number} failed, {len(skipped)} skipped"], 1 if number else 0


def main(arguments: list[str]) -> int:
    options = work.parser("scripts/sim.sh", __doc__)
    options.add_argument("--summary", metavar="RESULTS.xml", type=pathlib.Path,
                         help="only sums up what ctest --output-junit wrote")
    given = options.parse_args(arguments)
    results = given.summary or ROOT / "build" / "tests.xml"
    if not given.summary:
        results.unlink(missing_ok=True)
        # Outputs are kept in full: the summary looks into those of skipped tests.
        command = ["ctest", "--parallel", str(work.jobs()), "--timeout", "600", "--no-tests=error", "--output-junit",
                   str(results), "--test-output-size-passed", "1000000", "--test-output-size-failed", "1000000",
                   "--verbose" if os.environ.get("VERBOSE") else "--output-on-failure"]
        if os.environ.get("T"):
            command += ["--tests-regex", os.environ["T"]]
        seed = {"PSWEEP_SEED": os.environ["SEED"]} if os.environ.get("SEED") else {}
        work.run(command, cwd=ROOT / "build", environment=seed, check=False)  # the summary judges
    lines, code = summary(results)
    print("\n".join(lines))
    return code
