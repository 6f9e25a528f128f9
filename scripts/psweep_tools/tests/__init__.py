# SPDX-License-Identifier: Apache-2.0
"""Tests of the tools: python3 -B -m unittest discover -t scripts scripts/psweep_tools/tests. Nothing is built."""
