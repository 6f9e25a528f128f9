# SPDX-License-Identifier: Apache-2.0
"""How evidence is kept: what it was measured on, what it says, which tables of the pages it fills."""
