# SPDX-License-Identifier: Apache-2.0
"""How much of the circuit the tests reach (docs/coverage.md)."""
