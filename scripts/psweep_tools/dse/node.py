# SPDX-License-Identifier: Apache-2.0
"""Runs a command in a Slurm cluster of this one machine: a controller, a node, a partition, no accounting. It lives in
namespaces of its own (mounts, processes), with its files under /tmp, and is gone when the command has ended; the
machine's own /etc/slurm, if any, is as it was.

  scripts/dse/one_node.sh COMMAND [ARGUMENT ...]     e.g. scripts/dse/test_workflow.sh --slurm, or make dse SLURM=1

Needs root, and Debian's packages: apt-get install slurm-wlm munge. JOBS: cores of the node (default: all).
Exit code: the command's; 3 if there is no Slurm or it does not come up."""
from __future__ import annotations

import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time

from .. import work
from ..paths import SCRIPTS

CONFIGURATION = """ClusterName=psweep
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort=56817
SlurmdPort=56818
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={work}/munge.socket
CredType=cred/munge
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
StateSaveLocation={work}/state
SlurmdSpoolDir={work}/spool
SlurmctldPidFile={work}/slurmctld.pid
SlurmdPidFile={work}/slurmd.pid
SlurmctldLogFile={work}/slurmctld.log
SlurmdLogFile={work}/slurmd.log
ReturnToService=2
MpiDefault=none
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory={memory}
PartitionName=main Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


class NoCluster(Exception):
    """Why there is none."""


def start(folder: pathlib.Path) -> None:
    folder.chmod(0o755)
    for name in ("state", "spool", "etc"):
        (folder / name).mkdir()
    pathlib.Path("/etc/slurm").mkdir(exist_ok=True)
    # Snakemake's plugin takes SLURM_CONF from its jobs.
    work.run(["mount", "--bind", folder / "etc", "/etc/slurm"])
    total = re.search(r"MemTotal:\s*(\d+)", pathlib.Path("/proc/meminfo").read_text())
    pathlib.Path("/etc/slurm/slurm.conf").write_text(CONFIGURATION.format(
        host=socket.gethostname().split(".")[0], work=folder, cores=work.jobs(),
        memory=int(total[1]) // 1280 if total else 1024))
    key = folder / "munge.key"
    key.write_bytes(os.urandom(1024))
    key.chmod(0o600)
    for program, *options in (("munged", "--key-file", key, "--socket", folder / "munge.socket", "--pid-file",
                               folder / "munged.pid", "--log-file", folder / "munged.log", "--seed-file",
                               folder / "munge.seed"), ("slurmctld",), ("slurmd",)):
        if work.run([str(program), *map(str, options)], check=False):
            raise NoCluster(f"{program} does not start")
    for _ in range(300):
        state = subprocess.run(["sinfo", "--noheader", "--format", "%t"], capture_output=True, text=True, check=False)
        if state.stdout.strip() == "idle":
            return
        time.sleep(0.1)
    raise NoCluster("\n".join(["the node does not come up", *(work.tail(log, 5) for log in folder.glob("*.log"))]))


def outside(arguments: list[str]) -> int:
    if os.getuid() != 0:
        raise NoCluster("needs root")
    for program in ("slurmctld", "slurmd", "sbatch", "squeue", "munged"):
        if shutil.which(program) is None:
            raise NoCluster(f"no {program}: apt-get install slurm-wlm munge")
    if subprocess.run(["unshare", "--mount", "true"], capture_output=True, check=False).returncode:
        raise NoCluster("this root may not make namespaces (a container?)")
    with tempfile.TemporaryDirectory() as folder:
        return subprocess.run(["unshare", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc", sys.executable,
                               "-B", str(SCRIPTS / "tools.py"), "dse-node", "--inside", folder, *arguments],
                              check=False).returncode


def main(arguments: list[str]) -> int:
    if not arguments or arguments[0] in ("-h", "--help"):
        print(__doc__, file=sys.stdout if arguments else sys.stderr)
        return 0 if arguments else 2
    try:
        if arguments[0] != "--inside":
            return outside(arguments)
        start(pathlib.Path(arguments[1]))
    except NoCluster as reason:
        print(f"one_node.sh: {reason}", file=sys.stderr)
        return 3
    version = work.output(["sinfo", "--version"]).strip()
    print(f"one_node.sh: {version}, a node of {work.jobs()} cores", file=sys.stderr, flush=True)
    return subprocess.run(arguments[2:], check=False).returncode
