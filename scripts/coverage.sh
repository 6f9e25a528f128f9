#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# How much of the circuit the tests reach. Two measures, merged over all runs:
#   lines    statements of the original VHDL, counted by GHDL while it replays recordings of engines and chips
#            (tb/replay). Needs GHDL 4 or newer, as in Debian 13; with an older one: exit code 2, nothing is measured.
#   toggles  bits of registers, wires and ports that were seen to change both ways, counted by Verilator in the tests of
#            units, engine and chip. Of the converted Verilog, whose signals have the names of the VHDL.
#
#   scripts/coverage.sh [lines | toggles] ...      default: both
#
# A line that is never run has to be in scripts/coverage_holes.txt, with a reason; a bit that never changes is listed.
# Report: build/coverage/index.txt, lines.txt, toggles.txt, lines.lcov (for genhtml and editors).
# Environment: GHDL (the program, default ghdl), JOBS, NO_BUILD=yes (recordings as they are), BUILD (default build),
# ONLY (toggles: regular expression of the test programs that count, default all; building all takes half an hour).
# Exit code 1 if a test failed, if less than 95 % of the lines were run, if a hole is not in the list or an entry of the
# list is none, or if nothing was counted; 2 if GHDL is too old.
set -euo pipefail
cd "$(dirname "$0")/.."
parts=()
for arg in "$@"; do
  case "$arg" in
    -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
    lines | toggles) parts+=("$arg") ;;
    *) echo "coverage: unknown argument '$arg'; see scripts/coverage.sh --help" >&2; exit 1 ;;
  esac
done
[ ${#parts[@]} -gt 0 ] || parts=(lines toggles)
export LC_ALL=C
root=$PWD
out=$root/build/coverage
build=${BUILD:-build}
jobs=${JOBS:-$(nproc)}
ghdl=${GHDL:-ghdl}
mkdir -p "$out"
rm -f "$out"/{index,lines,toggles}.txt "$out/lines.lcov"
say() { printf 'coverage: %s\n' "$*"; }
wants() { printf '%s\n' "${parts[@]}" | grep -qx "$1"; }

if wants lines; then
  version=$("$ghdl" --version | sed -nE '1s/^GHDL ([0-9]+)\..*/\1/p')
  if [ -z "$version" ] || [ "$version" -lt 4 ]; then
    say "$("$ghdl" --version | head -n 1): too old to count lines; nothing was measured."
    say "GHDL 4 or newer is needed. Debian 13 has 5.0: run this there, in a container"
    say "  docker run --rm -v $root:/psweep -w /psweep debian:trixie \\"
    say "    sh -c 'apt-get update; apt-get install -y make; make coverage'"
    say "or in a root of debootstrap --variant=minbase trixie (see scripts/fresh_machine.sh); or name one by GHDL=."
    say "Toggles need no newer one: scripts/coverage.sh toggles"
    exit 2
  fi
fi

# lines: every recording is replayed on a build that counts. (No 'set -e' in functions that are called with '||'.)
recordings='^replay: .*, record'
count_lines() {
  if [ "${NO_BUILD:-no}" != yes ]; then
    scripts/build.sh record_engine record_chip record_messages psweep_replay psweep_top_replay || return 1
    say "recording"
    (cd "$build" && ctest -C coverage --parallel "$jobs" --no-tests=error -R "$recordings" --output-on-failure) \
      > "$out/recording.log" 2>&1 || { tail -n 30 "$out/recording.log"; return 1; }
  fi
  local work=$out/lines bench recording name entity
  rm -rf "$work"
  mkdir -p "$work"
  # The recordings that the tests replay, by the list of the tests.
  mapfile -t names < <(cd "$build" && ctest -C coverage -N -R "$recordings" |
    sed -nE 's/.*: replay: (\w+), record.*/\1/p')
  [ ${#names[@]} -gt 0 ] || { say "no recordings in the build"; return 1; }
  mapfile -t sources < <(sed 's/#.*//; s/[[:space:]]*$//; /^$/d; s|^|rtl/|' rtl/files.f)
  # Relative names make the report the same everywhere.
  for entity in psweep psweep_top; do
    bench=$build/tb/replay/${entity}_replay.vhd
    mkdir -p "$work/$entity"
    "$ghdl" -a --std=93 --coverage --workdir="$work/$entity" "${sources[@]}" &&
      "$ghdl" -a --std=93 --workdir="$work/$entity" "$bench" || return 1
  done
  export -f replay_one
  export ghdl work build
  # The longest first.
  for name in "${names[@]}"; do
    recording=$build/tb/replay/$name.txt
    [ -s "$recording" ] || { say "no recording $recording"; return 1; }
    stat -c "%s $name" "$recording"
  done | sort -rn | cut -d' ' -f2 | xargs -P "$jobs" -I{} bash -c 'replay_one {}' || return 1
  local counted=("$work"/*.json)
  [ ${#counted[@]} -eq ${#names[@]} ] || { say "${#counted[@]} counts of ${#names[@]} replays"; return 1; }
  perl scripts/coverage.pl lines "$out" "${counted[@]}"
}
replay_one() {
  local name=$1 entity=psweep recording=$build/tb/replay/$1.txt generics begun=$SECONDS
  case $name in chip_*) entity=psweep_top ;; esac
  mapfile -t generics < <(sed -nE 's/^generic ([^ ]+) ([^ ]+)$/-g\1=\2/p' "$recording")
  "$ghdl" -r --std=93 --coverage --coverage-output="$work/$name.json" --workdir="$work/$entity" "${entity}_replay" \
    "${generics[@]}" -gG_FILE="$recording" --ieee-asserts=disable > "$work/$name.log" 2>&1 || true
  if ! grep -qE 'replay: [1-9][0-9]* steps, [1-9][0-9]* values compared, 0 differences' "$work/$name.log"; then
    tail -n 5 "$work/$name.log"
    printf 'coverage: the replay of %s failed\n' "$name"
    return 1
  fi
  printf 'coverage: lines: %s replayed (%d s)\n' "$name" $((SECONDS - begun))
}

# toggles: the same tests, on models that count.
count_toggles() {
  local work=$out/toggles
  rm -rf "$work/data"
  mkdir -p "$work/data"
  cmake -S . -B "$work/build" -G Ninja -DPSWEEP_COVERAGE=ON -DPSWEEP_FAST_OPTION=-O1 > "$work/configure.log" 2>&1 ||
    { tail -n 20 "$work/configure.log"; return 1; }
  local targets
  mapfile -t targets < <(ninja -C "$work/build" -t targets all | sed -nE 's/^(test_\w+): phony$/\1/p' | sort -u)
  mapfile -t programs < <(for t in "${targets[@]}"; do
    for folder in units engine chip; do
      if [ -e "tb/$folder/$t.cpp" ]; then echo "$folder/$t"; fi
    done
  done)
  if [ -n "${ONLY:-}" ]; then mapfile -t programs < <(printf '%s\n' "${programs[@]}" | grep -E "/($ONLY)\$"); fi
  [ ${#programs[@]} -gt 0 ] || { say "no tests"; return 1; }
  say "toggles: building ${#programs[@]} test programs"
  ninja -C "$work/build" -j "$jobs" "${programs[@]##*/}" > "$work/build.log" 2>&1 ||
    { tail -n 20 "$work/build.log"; return 1; }
  local program number=0 code
  for program in "${programs[@]}"; do
    number=$((number + 1))
    code=0
    PSWEEP_COVERAGE="$work/data/${program##*/}" "$work/build/tb/$program" > "$work/${program##*/}.log" 2>&1 || code=$?
    [ $code -eq 0 ] || { tail -n 20 "$work/${program##*/}.log"; say "$program failed"; return 1; }
    say "toggles: $program ($number of ${#programs[@]})"
  done
  perl scripts/coverage.pl toggles "$out" "$work"/data/*
}

failed=0
if wants lines; then count_lines || failed=1; fi
if wants toggles; then count_toggles || failed=1; fi
cat "$out"/lines.txt "$out"/toggles.txt 2> /dev/null > "$out/index.txt" || true
say "report: build/coverage/index.txt"
exit $failed
