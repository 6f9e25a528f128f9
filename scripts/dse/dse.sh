#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Explores the design space by Snakemake: resources, clocks, accuracy as CSV, plots and a page (docs/dse.md).
# Goes on where another run stopped; measures only what depends on what changed.
#
#   scripts/dse/dse.sh [--grid FILE] [--out DIR] [--programs DIR] [--rtl DIR] [--slurm] [-- SNAKEMAKE OPTIONS]
#     --grid      grid (default scripts/dse/default.yaml; scripts/dse/large.yaml takes hours)
#     --out       results (default build/dse); the page is index.html in it
#     --programs  build folder with psweep, shape_table, psweep_accuracy (default build)
#     --rtl       another folder with VHDL and its files.f (default rtl)
#     --slurm     as jobs of a Slurm cluster, by the profile scripts/dse/slurm; jobs of a killed run are cancelled first
#
# Environment, which jobs of a cluster have, too: JOBS (default: all cores; with --slurm jobs in the queue, default
# 64), COST_VENV, COST_CACHE (scripts/cost/measure.py), DSE_VENV (Snakemake's Python: scripts/setup.sh dse makes it).
# Exit code 1 if a point failed: its log is shown, the other points that do not need it are made.
set -euo pipefail
start=$PWD
cd "$(dirname "$0")/../.."
root=$PWD
grid=$root/scripts/dse/default.yaml
out=$root/build/dse
slurm=
settings=()
for name in COST_VENV COST_CACHE DSE_VENV; do
  # Jobs run in the folder of the results.
  if [ -n "${!name:-}" ]; then export "$name=$(cd "$start" && realpath -ms "${!name}")"; fi
done
while [ $# -gt 0 ]; do
  case $1 in
    --grid) grid=$(cd "$start" && realpath "$2"); shift ;;
    --out) out=$(cd "$start" && realpath -m "$2"); shift ;;
    --programs) settings+=("programs=$(cd "$start" && realpath "$2")"); shift ;;
    --rtl) settings+=("rtl=$(cd "$start" && realpath "$2")"); shift ;;
    --slurm) slurm=yes ;;
    --) shift; break ;;
    -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
    *) echo "dse.sh: unknown option '$1'" >&2; exit 2 ;;
  esac
  shift
done
snakemake=${DSE_VENV:-$root/build/dse/venv}/bin/snakemake
[ -x "$snakemake" ] || { echo "dse.sh: no $snakemake: run scripts/setup.sh dse" >&2; exit 1; }
mkdir -p "$out"
if [ ${#settings[@]} -gt 0 ]; then settings=(--config "${settings[@]}"); fi
# Snakemake's own lock outlives a run that was killed; this one does not. Half a file is made again.
exec 9> "$out/.dse.lock"
flock -n 9 || { echo "dse.sh: another run is at work in $out" >&2; exit 1; }
if [ -n "$slurm" ]; then
  # Jobs carry the folder in their name. Those of a run that was killed would write the files of this one.
  name=psweep-$(cksum <<< "$out" | cut -d' ' -f1)
  how=(--profile "$root/scripts/dse/slurm" --slurm-jobname-prefix "$name")
  if [ -n "${JOBS:-}" ]; then how+=(--jobs "$JOBS"); fi
  queue() { squeue --noheader --user "$(id -un)" --format '%i %j' | sed -n "s/ ${name}_.*//p"; }
  mapfile -t left < <(queue)
  if [ ${#left[@]} -gt 0 ]; then
    echo "dse.sh: cancelling ${#left[@]} jobs of a run that was killed" >&2
    scancel "${left[@]}"
    while [ -n "$(queue)" ]; do sleep 1; done
  fi
else
  how=(--cores "${JOBS:-$(nproc)}")
fi
exec "$snakemake" --snakefile scripts/dse/Snakefile --directory "$out" --configfile "$grid" "${how[@]}" \
  "${settings[@]}" --rerun-incomplete --keep-going --rerun-triggers mtime params --nolock "$@"
