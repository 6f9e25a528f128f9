#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Evidence that says what it was measured on: scripts/evidence.py --help."""
import sys

import tools

if __name__ == "__main__":
    sys.exit(tools.cli.main(["evidence", *sys.argv[1:]]))
