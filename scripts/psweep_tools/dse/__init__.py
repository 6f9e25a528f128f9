# SPDX-License-Identifier: Apache-2.0
"""The design space, by Snakemake (scripts/dse, docs/dse.md)."""
