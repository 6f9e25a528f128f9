# SPDX-License-Identifier: Apache-2.0
"""Tests of the tests: small faults in a copy of the RTL, one at a time (docs/mutants.md)."""
