#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs the Debian packages of scripts/packages.txt that are missing, and nothing else.
#
#   scripts/setup.sh [--check | --list] [GROUP ...]   groups: build (default), lint, formal, gates, opinion,
#                                                     net, wire, waves, plots, cost, flows, sta, dse, docs,
#                                                     evidence
#     --check  install nothing, name what is missing (exit code 1 if anything is)
#     --list   print the package names
#
# When nothing is missing it returns at once, without network or root. Otherwise it needs root or sudo, and the
# network unless apt has the packages in its cache. Exit code 1, and the missing names, when it cannot install them.
# SETUP=no in the environment skips everything: for systems other than Debian, where CMake names what it does not find.
set -euo pipefail
cd "$(dirname "$0")/.."

usage() { sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; }
say() { printf 'setup: %s\n' "$*"; }
die() { printf 'setup: %s\n' "$@" >&2; exit 1; }

mode=install
groups=()
for arg in "$@"; do
  case "$arg" in
    --check) mode=check ;;
    --list) mode=list ;;
    -h | --help) usage; exit 0 ;;
    build | lint | formal | gates | opinion | net | wire | waves | plots | cost | flows | sta | dse | docs | \
      evidence)
      groups+=("$arg") ;;
    *) die "unknown argument '$arg'; see scripts/setup.sh --help" ;;
  esac
done
[ ${#groups[@]} -gt 0 ] || groups=(build)
# Groups cost, dse and docs also have Python packages, in virtual environments.
finish() {
  local group check=()
  [ "$mode" != check ] || check=(--check)
  for group in cost dse docs; do
    case " ${groups[*]} " in *" $group "*) "scripts/$group/venv.sh" "${check[@]}" || exit 1 ;; esac
  done
  exit 0
}
[ "${SETUP:-yes}" != no ] || finish

packages=()
declare -A program
while read -r group package command _; do
  case "$group" in '' | '#'*) continue ;; esac
  for wanted in "${groups[@]}"; do
    if [ "$wanted" = "$group" ]; then
      packages+=("$package")
      program[$package]=$command
    fi
  done
done < scripts/packages.txt
if [ "$mode" = list ]; then
  printf '%s\n' "${packages[@]}"
  exit 0
fi

# Fills `missing`: packages that dpkg does not have installed and whose program is not found either.
find_missing() {
  local installed='' package command
  if command -v dpkg-query > /dev/null; then
    installed=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "${packages[@]}" 2> /dev/null || true)
  fi
  missing=()
  for package in "${packages[@]}"; do
    command=${program[$package]}
    if [ "$command" != - ] && command -v "$command" > /dev/null; then continue; fi
    if grep -qxF "installed $package" <<< "$installed"; then continue; fi
    missing+=("$package")
  done
}

find_missing
[ ${#missing[@]} -gt 0 ] || finish
[ "$mode" = install ] || die "missing: ${missing[*]}"

by_hand="As root: apt-get install --no-install-recommends ${missing[*]}"
command -v apt-get > /dev/null ||
  die "missing: ${missing[*]}" "This is no Debian (there is no apt-get): install their like, run make with SETUP=no."
as_root=(env DEBIAN_FRONTEND=noninteractive)
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo > /dev/null || die "missing: ${missing[*]}" "Neither root nor sudo to install them. $by_hand"
  if [ -t 0 ]; then as_root=(sudo "${as_root[@]}"); else as_root=(sudo -n "${as_root[@]}"); fi
fi
apt=("${as_root[@]}" apt-get -q -o DPkg::Lock::Timeout=300)

say "missing: ${missing[*]}"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
give_up() {
  tail -n 15 "$log" >&2
  find_missing
  die "$1" "missing: ${missing[*]}" "$by_hand"
}

# apt-get update ends with 0 even when it reaches nobody; what counts is whether the packages are known afterwards.
SECONDS=0
"${apt[@]}" update > "$log" 2>&1 || say "the package lists could not be renewed, trying with the old ones"
known=$(apt-cache policy "${missing[@]}" 2> /dev/null | awk '/^[^ ]/ { sub(/:$/, ""); name = $0 }
  /^  Candidate: [^(]/ { print name }')
unknown=()
for package in "${missing[@]}"; do
  if ! grep -qxF "$package" <<< "$known"; then unknown+=("$package"); fi
done
[ ${#unknown[@]} -eq 0 ] || give_up "apt does not know (no network, or not Debian 12 or 13): ${unknown[*]}"

# In two steps, to tell the network's time from the machine's.
"${apt[@]}" install -y --no-install-recommends --download-only "${missing[@]}" > "$log" 2>&1 ||
  give_up "the packages could not be downloaded"
say "downloaded in $SECONDS s"
SECONDS=0
"${apt[@]}" install -y --no-install-recommends "${missing[@]}" > "$log" 2>&1 ||
  give_up "the packages could not be installed"
find_missing
[ ${#missing[@]} -eq 0 ] || give_up "apt-get reported success, but packages are still missing"
say "installed in $SECONDS s"
finish
