#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Does the workflow of 'make dse' do what it is for? scripts/dse/test_workflow.sh --help says more.
exec "$(dirname "$0")/../tools.py" dse-trial "$@"
