# SPDX-License-Identifier: Apache-2.0
"""Where things lie."""
import pathlib

SCRIPTS = pathlib.Path(__file__).resolve().parents[1]
ROOT = SCRIPTS.parent
RTL = ROOT / "rtl"
START = pathlib.Path.cwd()  # where the user stands; the tools work at the root
