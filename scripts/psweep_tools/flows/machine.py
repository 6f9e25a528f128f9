# SPDX-License-Identifier: Apache-2.0
"""Types README's commands in a bare Debian: a debootstrap minimal root with a clone of HEAD in it. Says how long each
took and what it ended with, then repeats the build and the tests from scratch with the network cut off.

Environment: ROOTS (where roots are put, default /var/tmp/psweep-roots; the bare one is kept as a tar file there),
MIRROR (of Debian, default debootstrap's), OFFLINE=no (leave out the second part), KEEP=yes (leave the root behind).
Needs root, debootstrap and 4 GB. apt's settings (proxy and the like) and name servers are taken from this machine.
The commands are the first code block of README.md's section "Quick start", line by line.
Exit code 1 if a command failed."""
from __future__ import annotations

import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys

from .. import work
from ..paths import ROOT
from ..work import Failure

ENVIRONMENT = ("PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin", "HOME=/tmp", "TERM=dumb")


def commands(readme: str) -> list[str]:
    """Lines of the first code block of section 'Quick start'."""
    section = re.search(r"^## Quick start\b.*?$(.*?)(?=^## |\Z)", readme, re.M | re.S)
    block = re.search(r"^```\w*\n(.*?)^```", section[1], re.M | re.S) if section else None
    lines = [line for line in (block[1] if block else "").splitlines()
             if line.strip() and not line.strip().startswith("#")]
    if not lines:
        raise Failure("README.md has no code block in a section 'Quick start'")
    return lines


class Machine:
    def __init__(self, suite: str) -> None:
        self.suite = suite
        self.roots = pathlib.Path(os.environ.get("ROOTS") or "/var/tmp/psweep-roots")
        self.roots.mkdir(parents=True, exist_ok=True)
        self.root = self.roots / f"{suite}-{os.getpid()}"
        self.results: list[str] = []
        self.failed = False

    def say(self, text: str) -> None:
        print(f"fresh-machine: {self.suite}: {text}", flush=True)

    def __enter__(self) -> Machine:
        return self

    def __exit__(self, *_: object) -> None:
        for folder in ("dev", "proc"):
            if os.path.ismount(self.root / folder):
                work.run(["umount", self.root / folder], check=False)
        # Never through a mount that would not go.
        if os.environ.get("KEEP") != "yes" and f" {self.root}/" not in pathlib.Path("/proc/mounts").read_text():
            shutil.rmtree(self.root, ignore_errors=True)

    def unpack(self) -> None:
        bare = self.roots / f"{self.suite}.tar"
        if bare.exists():
            self.root.mkdir(parents=True)
            work.run(["tar", "-C", self.root, "-xpf", bare])
            return
        self.say("debootstrap")
        mirror = [os.environ["MIRROR"]] if os.environ.get("MIRROR") else []
        work.run(["debootstrap", "--variant=minbase", self.suite, self.root, *mirror],
                 log=self.roots / f"{self.suite}.tar.log")
        work.run(["tar", "-C", self.root, "-cf", f"{bare}.part", "."])
        pathlib.Path(f"{bare}.part").rename(bare)

    def prepare(self) -> None:
        shutil.copy("/etc/resolv.conf", self.root / "etc" / "resolv.conf")
        settings = work.output(["apt-config", "dump", "Acquire"]).splitlines(keepends=True)
        (self.root / "etc/apt/apt.conf.d/99host").write_text("".join(s for s in settings if not s.endswith('"";\n')))
        work.run(["mount", "-t", "proc", "proc", self.root / "proc"])
        work.run(["mount", "--bind", "/dev", self.root / "dev"])
        work.run(["git", "clone", "-q", "--no-hardlinks", ROOT, self.root / "psweep"])
        head = work.output(["git", "rev-parse", "--short", "HEAD"]).strip()
        there = subprocess.run(["chroot", str(self.root), "sh", "-c", "command -v make git g++ sudo python3"],
                               capture_output=True, text=True, check=False).stdout.split()
        version = (self.root / "etc/debian_version").read_text().strip()
        self.say(f"bare root with {head}, Debian {version}; of make, git, g++, sudo, python3 there are: "
                 f"{' '.join(there) or 'none'}")

    def inside(self, command: str, log: pathlib.Path | None, *wrap: str) -> int:
        """As a user would type it at the prompt, in the clone."""
        full = [*wrap, "env", "-i", *ENVIRONMENT, "chroot", str(self.root), "bash", "-c", 'cd /psweep && eval "$1"',
                "bash", command]
        with open(log or os.devnull, "wb") as out:
            return subprocess.run(full, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT,
                                  check=False).returncode

    def run(self, name: str, what: str, command: str, *wrap: str) -> None:
        self.say(what)
        log, clock = self.roots / f"{self.suite}-{name}.log", work.Clock()
        code = self.inside(command, log, *wrap)
        lines = log.read_text(errors="replace").splitlines()
        if code:
            print("\n".join(lines[-30:]))
            self.failed = True
        print("\n".join([*(line for line in lines if line.startswith("setup:")), *lines[-1:]]), flush=True)
        self.results.append(f"{str(clock).removesuffix(' s'):>5} s  exit {code}  {what}")

    def type(self) -> None:
        for number, command in enumerate(commands((ROOT / "README.md").read_text()), 1):
            self.run(str(number), command, command)
            if self.failed:
                return
        if os.environ.get("OFFLINE") == "no":
            return
        if self.inside('apt-get update 2>&1 | grep -q "^Err\\|^W: Failed"', None, "unshare", "-n"):
            self.say("the network could not be cut off")
            self.failed = True
        else:
            self.run("offline", "make clean sim, without network", "make clean && make sim", "unshare", "-n")


def main(arguments: list[str]) -> int:
    options = work.parser("scripts/fresh_machine.sh", __doc__)
    options.add_argument("suite", nargs="?", default="bookworm", choices=("bookworm", "trixie"))
    suite = options.parse_args(arguments).suite
    if os.getuid() != 0:
        raise Failure("needs root, for chroot and mount")
    work.need("debootstrap", how="apt-get install debootstrap")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(130))
    with Machine(suite) as machine:
        machine.unpack()
        machine.prepare()
        machine.type()
        machine.say("summary")
        print("\n".join(machine.results))
    return 1 if machine.failed else 0
