# SPDX-License-Identifier: Apache-2.0
"""What continuous integration runs: lint and the whole regression, set-up included. Ends with the sum of both as one
line 'N passed, N failed, N skipped'; exit code 1 if anything failed."""
from __future__ import annotations

import re
import subprocess
import sys

from . import work
from .paths import ROOT

_SUM = re.compile(r"(\d+) passed, (\d+) failed, (\d+) skipped\n")


def main(arguments: list[str]) -> int:
    work.parser(".ci/run", __doc__).parse_args(arguments)
    sums, code = [0, 0, 0], 0
    for target in ("lint", "sim"):
        with subprocess.Popen(["make", target], cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, errors="replace") as process:
            for line in process.stdout or ():
                sys.stdout.write(line)
                sys.stdout.flush()
                if match := _SUM.fullmatch(line):
                    sums = [a + int(b) for a, b in zip(sums, match.groups(), strict=True)]
        code = code or process.returncode
    # A target that died before its closing line has failed as one.
    if code and not sums[1]:
        sums[1] = 1
    print("{} passed, {} failed, {} skipped".format(*sums))
    return 1 if code else 0
