#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs a command in a Slurm cluster of this one machine: a controller, a node, a partition, no accounting. It lives in
# namespaces of its own (mounts, processes), with its files under /tmp, and is gone when the command has ended; the
# machine's own /etc/slurm, if any, is as it was.
#
#   scripts/dse/one_node.sh COMMAND [ARGUMENT ...]     e.g. scripts/dse/test_workflow.sh --slurm, or make dse SLURM=1
#
# Needs root, and Debian's packages: apt-get install slurm-wlm munge. JOBS: cores of the node (default: all).
# Exit code: the command's; 3 if there is no Slurm or it does not come up.
set -euo pipefail
say() { echo "one_node.sh: $*" >&2; }
case "${1:-}" in
  --inside) shift ;;
  -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
  '') echo "one_node.sh: no command; see --help" >&2; exit 2 ;;
  *)
    [ "$(id -u)" -eq 0 ] || { say "needs root"; exit 3; }
    for program in slurmctld slurmd sbatch squeue munged; do
      command -v "$program" > /dev/null || { say "no $program: apt-get install slurm-wlm munge"; exit 3; }
    done
    unshare --mount true 2> /dev/null || { say "this root may not make namespaces (a container?)"; exit 3; }
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
    code=0
    WORK=$work unshare --mount --pid --fork --kill-child --mount-proc "$0" --inside "$@" || code=$?
    exit $code
    ;;
esac

work=$WORK
unset WORK
chmod 755 "$work"
mkdir -p "$work/state" "$work/spool" "$work/etc" /etc/slurm
# Snakemake's plugin takes SLURM_CONF from its jobs.
mount --bind "$work/etc" /etc/slurm
host=$(hostname -s)
cores=${JOBS:-$(nproc)}
cat > /etc/slurm/slurm.conf << CONF
ClusterName=psweep
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=56817
SlurmdPort=56818
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$work/munge.socket
CredType=cred/munge
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
ReturnToService=2
MpiDefault=none
NodeName=$host NodeAddr=127.0.0.1 CPUs=$cores RealMemory=$(awk '/MemTotal/ {print int($2 / 1280)}' /proc/meminfo)
PartitionName=main Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
dd if=/dev/urandom of="$work/munge.key" bs=1 count=1024 status=none
chmod 600 "$work/munge.key"

up() { [ "$(sinfo --noheader --format %t 2> /dev/null)" = idle ]; }
munged --key-file "$work/munge.key" --socket "$work/munge.socket" --pid-file "$work/munged.pid" \
  --log-file "$work/munged.log" --seed-file "$work/munge.seed" || { say "munged does not start"; exit 3; }
slurmctld > /dev/null || { say "slurmctld does not start"; exit 3; }
slurmd > /dev/null || { say "slurmd does not start"; exit 3; }
for ((i = 0; i < 300; ++i)); do
  ! up || break
  sleep 0.1
done
up || { say "the node does not come up"; tail -n 5 "$work"/*.log >&2; exit 3; }
say "$(sinfo --version), a node of $cores cores"
"$@"
