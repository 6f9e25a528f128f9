#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Types README's commands in a bare Debian. scripts/fresh_machine.sh --help says more.
exec "$(dirname "$0")/tools.py" fresh-machine "$@"
