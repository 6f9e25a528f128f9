# SPDX-License-Identifier: Apache-2.0
"""Other simulators and machines: netlists, kernel, cocotb, a bare Debian."""
