#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Quick checks of everything that is text; no network, nothing is built. Ends with 'N passed, N failed, N skipped'.
#
#   scripts/lint.sh [CHECK ...]      default: all of the checks below
#   scripts/lint.sh --format         lay out the C++ with clang-format instead
#
#   layout     what lies at the top level; a README in each folder
#   text       ASCII, LF, no tabs, no trailing blanks, 120 columns, SPDX line (lint_text.pl)
#   links      relative links in Markdown lead somewhere; docs/README.md lists all pages
#   files      rtl/files.f lists every VHDL file once
#   analyse    GHDL takes all files of rtl/files.f as VHDL-93, warnings are errors
#   vhdl       no construct that the conversion to Verilog breaks (lint_text.pl)
#   attributes those for the FPGA tools are the ones that docs/flows.md lists (lint_attributes.pl)
#   units      every entity has a golden model, a test and a page
#   tables     docs/<entity>.md: contract, diagram; generics and ports are those of the entity (lint_tables.pl)
#   pages      tables of docs/dse.md are those of docs/dse/*.csv (scripts/dse/pages.py)
#   evidence   blocks of README and docs are what docs/evidence/*.json makes of them, figures beyond them name their
#              commit; what is stale is named, which is no failure (scripts/evidence.py)
#   configurations  rtl/configs against the schemas, the schemas against VHDL, C++ and pages (configurations.py)
#   arrows     folders of sw/ and tb/ use only those above them, CMake links what they include (lint_arrows.py)
#   trace      what docs/traceability.md names exists, every requirement has a test (lint_trace.pl)
#   verilog    Verilator -Wall on the converted engine and chip in every named configuration
#              (scripts/cmake/ghdl_netlist.vlt)
#   format     clang-format 14 leaves the C++ as it is
#   shell      shellcheck on the scripts
#
# Exceptions: scripts/lint_waivers.txt, each with its reason. A check without its tool is skipped by name.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 1
export LC_ALL=C

# Tracked files and new ones that git does not ignore, deleted ones left out. Without git: all but builds.
list_files() {
  if git -c safe.directory='*' rev-parse --git-dir > /dev/null 2>&1; then
    git -c safe.directory='*' ls-files -co --exclude-standard
  else
    find . -type f -not -path './build*' -not -path './.git/*' | sed 's|^\./||'
  fi | sort -u | while read -r file; do if [ -f "$file" ]; then echo "$file"; fi; done
}
mapfile -t all_files < <(list_files)
select_files() { printf '%s\n' "${all_files[@]}" | grep -E "$1" || true; }
mapfile -t vhdl_files < <(select_files '^rtl/.*\.vhd$')
mapfile -t cpp_files < <(select_files '\.(cpp|hpp|inc)$')
mapfile -t listed_files < <(sed 's/#.*//; s/[[:space:]]*$//; /^$/d; s|^|rtl/|' rtl/files.f)

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

skip() { reason=$1; return 77; }

check_layout() {
  local extra bad=0 folder
  extra=$(printf '%s\n' "${all_files[@]}" | cut -d/ -f1 | sort -u |
    grep -vxE 'rtl|tb|sw|constraints|scripts|docs|CMakeLists\.txt|CMakePresets\.json|Makefile|README\.md|LICENSE|\..*')
  if [ -n "$extra" ]; then echo "at the top level, beyond the agreed layout:" "$extra"; bad=1; fi
  for folder in . rtl tb sw constraints scripts docs; do
    if [ ! -f "$folder/README.md" ]; then echo "$folder/README.md is missing"; bad=1; fi
  done
  return $bad
}
check_text() { scripts/lint_text.pl text "${all_files[@]}"; }
check_links() {
  local pages
  mapfile -t pages < <(select_files '\.md$')
  scripts/lint_text.pl links "${pages[@]}"
}
check_files() {
  local difference
  difference=$(diff <(printf '%s\n' "${listed_files[@]}" | sort) <(printf '%s\n' "${vhdl_files[@]}" | sort))
  [ -z "$difference" ] || { printf 'rtl/files.f (<) is not rtl/*.vhd (>):\n%s\n' "$difference"; return 1; }
}
check_analyse() {
  command -v ghdl > /dev/null || skip "ghdl is not installed" || return
  mkdir "$scratch/work"
  ghdl -a --std=93 --warn-error --workdir="$scratch/work" "${listed_files[@]}"
}
check_vhdl() { scripts/lint_text.pl vhdl "${vhdl_files[@]}"; }
check_attributes() { scripts/lint_attributes.pl; }
check_units() { scripts/lint_text.pl units "${vhdl_files[@]}"; }
check_tables() {
  local units
  mapfile -t units < <(printf '%s\n' "${vhdl_files[@]}" | grep -v '_pkg\.vhd$')
  scripts/lint_tables.pl "${units[@]}"
}
check_pages() {
  command -v python3 > /dev/null || skip "python3 is not installed" || return
  scripts/dse/pages.py --check
}
check_evidence() {
  command -v python3 > /dev/null || skip "python3 is not installed" || return
  scripts/evidence.py lint
}
check_configurations() {
  command -v python3 > /dev/null || skip "python3 is not installed" || return
  scripts/configurations.py check
}
check_arrows() {
  command -v python3 > /dev/null || skip "python3 is not installed" || return
  scripts/lint_arrows.py --self-test && scripts/lint_arrows.py
}
check_trace() { scripts/lint_trace.pl; }

# verilog_of TOP CONFIGURATION GENERIC ..
verilog_of() {
  local top=$1 config=$2 dir
  shift 2
  dir=$scratch/$top/$(basename "$config" .json)
  if cmake -D GHDL=ghdl -D STANDARD=--std=93 -D TOP="$top" -D "SOURCES=$(IFS='|'; echo "${listed_files[*]}")" \
    -D "GENERICS=$(IFS='|'; echo "$*")" -D "DIR=$dir" -P scripts/cmake/VhdlToVerilog.cmake &&
    verilator --lint-only -Wall --top-module "$top" scripts/cmake/ghdl_netlist.vlt "$dir/$top.v"; then
    return 0
  fi
  echo "$top in $config: see above"
  return 1
}
check_verilog() {
  command -v ghdl > /dev/null || skip "ghdl is not installed" || return
  command -v verilator > /dev/null || skip "verilator is not installed" || return
  local config bad=0 generics kind top
  for kind in engine:psweep chip:psweep_top; do
    top=${kind#*:}
    for config in rtl/configs/"${kind%:*}"/*.json; do
      mapfile -t generics < <(scripts/configurations.py generics --kind "${kind%:*}" "$(basename "$config" .json)")
      verilog_of "$top" "$config" "${generics[@]/#/-g}" || bad=1
    done
  done
  return $bad
}
# Versions differ in the spaces around '::*' and behind 'operator delete', which no option settles; so one decides.
need_clang_format() {
  command -v clang-format > /dev/null || skip "clang-format is not installed" || return
  clang-format --version | grep -q 'version 14\.' ||
    skip "clang-format 14 (Debian 12) decides, this is $(clang-format --version)"
}
check_format() {
  need_clang_format || return
  local file bad=0
  for file in "${cpp_files[@]}"; do
    if ! clang-format --dry-run --Werror "$file" > /dev/null 2>&1; then
      echo "$file: not laid out by .clang-format; 'make format' does it"
      bad=1
    fi
  done
  return $bad
}
check_shell() {
  command -v shellcheck > /dev/null || skip "shellcheck is not installed" || return
  local scripts
  mapfile -t scripts < <(grep -lE '^#!.*\b(ba)?sh$' "${all_files[@]}")
  shellcheck --severity=warning "${scripts[@]}"
}

checks=(layout text links files configurations analyse vhdl attributes units tables pages evidence arrows trace verilog format shell)
case "${1:-}" in
  -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
  --format)
    reason=
    need_clang_format || { echo "lint: $reason" >&2; exit 1; }
    exec clang-format -i "${cpp_files[@]}"
    ;;
  '') ;;
  *) checks=("$@") ;;
esac

passed=0 failed=0 skipped=0
for check in "${checks[@]}"; do
  if ! declare -F "check_$check" > /dev/null; then echo "lint: no check '$check'; see --help" >&2; exit 2; fi
  reason=
  # Not in a subshell: skip() leaves its reason.
  "check_$check" > "$scratch/output" 2>&1
  case $? in
    0) passed=$((passed + 1)); grep '^note: ' "$scratch/output" | cut -c1-240 ;;
    77) skipped=$((skipped + 1)); echo "lint: $check: SKIPPED: $reason" ;;
    *) failed=$((failed + 1)); cat "$scratch/output"; echo "lint: $check: FAILED" ;;
  esac
done
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
