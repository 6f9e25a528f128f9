# SPDX-License-Identifier: Apache-2.0
"""The tools of this repository: everything that reads VHDL, configurations, netlists and reports. scripts/tools.py
runs them. Python 3.11 (Debian 12), the standard library only."""
