# SPDX-License-Identifier: Apache-2.0
"""Circuits whose registers can be upset (docs/robustness.md)."""
