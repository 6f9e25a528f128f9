# SPDX-License-Identifier: Apache-2.0
"""Recordings of Verilated models, replayed on VHDL and on netlists (docs/replay.md, docs/gates.md)."""
