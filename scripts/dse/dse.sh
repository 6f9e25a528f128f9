#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Explores the design space by Snakemake (docs/dse.md). scripts/dse/dse.sh --help says more.
exec "$(dirname "$0")/../tools.py" dse "$@"
