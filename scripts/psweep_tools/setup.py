# SPDX-License-Identifier: Apache-2.0
"""Installs the Debian packages of scripts/packages.txt that are missing, and nothing else.

When nothing is missing it returns at once, without network or root. Otherwise it needs root or sudo, and the network
unless apt has the packages in its cache. Exit code 1, and the missing names, when it cannot install them. SETUP=no in
the environment skips everything: for systems other than Debian, where CMake names what it does not find.

Some groups also have Python packages, by version (scripts/<group>/requirements.txt), in a virtual environment of their
own: made once from the Python Package Index, then no network is needed. <GROUP>_VENV names another place. pip takes
proxy, certificates (PIP_CERT) and index from the environment or its own configuration."""
from __future__ import annotations

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from . import work
from .paths import ROOT, SCRIPTS

# Python packages of a group: where they lie, megabytes.
VENVS = {"cost": ("build/cost/venv", 310), "dse": ("build/dse/venv", 250), "docs": ("build/docs-venv", 160),
         "python": ("build/lint/venv", 70)}


class Package:
    def __init__(self, line: str) -> None:
        self.group, self.name, self.program = line.split()[:3]

    def is_there(self, installed: set[str]) -> bool:
        """Installed, or its program is found."""
        return self.name in installed or (self.program != "-" and shutil.which(self.program) is not None)


def packages() -> list[Package]:
    lines = (SCRIPTS / "packages.txt").read_text().splitlines()
    return [Package(line) for line in lines if line.strip() and not line.startswith("#")]


def say(text: str) -> None:
    print(f"setup: {text}", flush=True)


def missing(wanted: list[Package]) -> list[str]:
    installed: set[str] = set()
    if shutil.which("dpkg-query"):
        done = subprocess.run(["dpkg-query", "-W", "-f", "${db:Status-Status} ${Package}\n", *(p.name for p in wanted)],
                              capture_output=True, text=True, check=False)
        installed = {line.split()[1] for line in done.stdout.splitlines() if line.startswith("installed ")}
    return list(dict.fromkeys(p.name for p in wanted if not p.is_there(installed)))


def known_to_apt(names: list[str]) -> set[str]:
    text = subprocess.run(["apt-cache", "policy", *names], capture_output=True, text=True, check=False).stdout
    return set(re.findall(r"^(\S+):\n(?:  .*\n)*?  Candidate: [^(]", text, re.M))


class Apt:
    def __init__(self, log: pathlib.Path) -> None:
        self.log = log
        self.command = ["env", "DEBIAN_FRONTEND=noninteractive"]
        if os.getuid() != 0:
            if shutil.which("sudo") is None:
                raise work.Failure("Neither root nor sudo to install them.")
            self.command = ["sudo", *(() if sys.stdin.isatty() else ("-n",)), *self.command]
        self.command += ["apt-get", "-q", "-o", "DPkg::Lock::Timeout=300"]

    def run(self, *arguments: str) -> bool:
        return work.run([*self.command, *arguments], log=self.log, check=False) == 0


def install(names: list[str], log: pathlib.Path) -> None:
    if shutil.which("apt-get") is None:
        raise work.Failure("This is no Debian (there is no apt-get): install their like, run make with SETUP=no.")
    apt, clock = Apt(log), work.Clock()
    # apt-get update ends with 0 even when it reaches nobody; what counts is whether the packages are known afterwards.
    if not apt.run("update"):
        say("the package lists could not be renewed, trying with the old ones")
    unknown = [name for name in names if name not in known_to_apt(names)]
    if unknown:
        raise work.Failure(f"{work.tail(log, 15)}\napt does not know (no network, or not Debian 12 or 13): "
                           + " ".join(unknown))
    # In two steps, to tell the network's time from the machine's.
    for options, done in ((("--download-only",), "downloaded"), ((), "installed")):
        if not apt.run("install", "-y", "--no-install-recommends", *options, *names):
            raise work.Failure(f"{work.tail(log, 15)}\nthe packages could not be {done}")
        say(f"{done} in {clock}")
        clock = work.Clock()


def venv_place(group: str) -> pathlib.Path:
    return ROOT / (os.environ.get(f"{group.upper()}_VENV") or VENVS[group][0])


def requirements(group: str) -> pathlib.Path:
    return SCRIPTS / group / "requirements.txt"


def _named(list_of_packages: pathlib.Path) -> list[str]:
    return [line for line in list_of_packages.read_text().splitlines() if line.strip() and not line.startswith("#")]


def venv_is_there(group: str) -> bool:
    """The list that was installed is kept beside the packages: it is complete only if pip came to its end."""
    place = venv_place(group)
    kept = place / "requirements.txt"
    return (place / "bin" / "python3").exists() and kept.is_file() and _named(kept) == _named(requirements(group))


def make_venv(group: str) -> None:
    place, wanted, clock = venv_place(group), requirements(group), work.Clock()
    say(f"making {place} (about {VENVS[group][1]} MB)")
    shutil.rmtree(place, ignore_errors=True)
    place.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        log = pathlib.Path(folder) / "log"
        if work.run(["python3", "-m", "venv", place], log=log, check=False):
            raise work.Failure(f"{work.tail(log, 5)}\npython3 cannot make a virtual environment; Debian: "
                               "apt-get install python3-venv")
        if work.run([place / "bin" / "python3", "-m", "pip", "install", "-q", "--disable-pip-version-check", "-r",
                     wanted], log=log, check=False):
            shutil.rmtree(place, ignore_errors=True)
            raise work.Failure(f"{work.tail(log, 5)}\npip could not install {wanted}. It needs the Python Package "
                               "Index once; behind a proxy or with a certificate of one's own, set https_proxy, "
                               "PIP_CERT or pip's configuration and run it again.")
    shutil.copy(wanted, place / "requirements.txt")
    say(f"made in {clock}")


def _packages(groups: list[str], check: bool) -> None:
    wanted = [package for package in packages() if package.group in groups]
    names = missing(wanted)
    if not names:
        return
    if check:
        raise work.Failure("missing: " + " ".join(names))
    say("missing: " + " ".join(names))
    with tempfile.TemporaryDirectory() as folder:
        try:
            install(names, pathlib.Path(folder) / "log")
            names = missing(wanted)
            if names:
                raise work.Failure("apt-get reported success, but packages are still missing")
        except work.Failure as failure:
            left = " ".join(missing(wanted))
            raise work.Failure(f"{failure}\nmissing: {left}\nAs root: apt-get install --no-install-recommends {left}") \
                from None


def main(arguments: list[str]) -> int:
    there = list(dict.fromkeys([p.group for p in packages()] + [g for g in VENVS if requirements(g).is_file()]))
    options = work.parser("scripts/setup.sh", __doc__)
    options.add_argument("groups", nargs="*", metavar="GROUP", help=f"default build; there are {', '.join(there)}")
    options.add_argument("--check", action="store_true", help="install nothing; exit code 1 if anything is missing")
    options.add_argument("--list", action="store_true", help="print the names of the packages")
    given = options.parse_args(arguments)
    groups = given.groups or ["build"]
    for group in groups:
        if group not in there:
            options.error(f"no group '{group}'")
    if given.list:
        print("\n".join(p.name for p in packages() if p.group in groups))
        return 0
    if os.environ.get("SETUP") != "no":
        _packages(groups, given.check)
    for group in groups:
        if group in VENVS and not venv_is_there(group):
            if given.check:
                raise work.Failure(f"{venv_place(group)} is missing or old: scripts/setup.sh {group}")
            make_venv(group)
    return 0
