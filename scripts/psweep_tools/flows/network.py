# SPDX-License-Identifier: Apache-2.0
"""The simulated chip behind the kernel's own network stack (make sim-net): in a network namespace of its own, on a TAP
device, psweep-sim is pinged (so the kernel's ARP works first), described, and sweeps a rendered pair in tiles through
`psweep depth --engine udp://ADDRESS`; the files equal those of `--engine fixed` byte for byte. Then with an MTU that
is too small, after a host that was killed, and on a bad wire. Nothing outside the namespace is touched, and it goes
with this program, however that ends.

Needs /dev/net/tun and the right to make namespaces: root, or user namespaces and a /dev/net/tun open to users.
Without them it prints 'SKIPPED: <reason>', tests the chip over the in-process link instead, and ends with 0 if that
is good. Exit code 1 if anything differs or does not answer."""
from __future__ import annotations

import argparse
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

from .. import pairs, work
from ..paths import SCRIPTS
from ..work import Failure

DEVICE, HOST, CHIP = "psweep0", "10.5.0.1", "10.5.0.2"
INSIDE = "PSWEEP_IN_NAMESPACE"
DISSECTOR = pathlib.Path("sw/wireshark/psweep.lua")
WRONG = ("_ws.malformed || ip.checksum.status == 0 || udp.checksum.status == 0 || icmp.checksum.status == 0")
BAD_WIRE = ("--loss", "0.01", "--duplicate", "0.01", "--reorder", "0.01", "--corrupt", "0.01", "--corrupt-fcs", "0.01")


class Skip(Exception):
    """Why there can be no namespace with a TAP device."""


def way_in() -> list[str]:
    """The command that makes the namespace."""
    for tool in ("unshare", "ip", "ping"):
        if shutil.which(tool) is None:
            raise Skip(f"{tool} is not installed")
    if not pathlib.Path("/dev/net/tun").exists():
        raise Skip("there is no /dev/net/tun (modprobe tun)")
    enter = ["unshare", "-n"] if os.getuid() == 0 else ["unshare", "-Urn"]
    if subprocess.run([*enter, "true"], capture_output=True, check=False).returncode:
        raise Skip(f"no right to make a network namespace ({' '.join(enter)})")
    done = subprocess.run([*enter, "ip", "tuntap", "add", "dev", DEVICE, "mode", "tap"], capture_output=True, text=True,
                          check=False)
    if done.returncode:
        raise Skip(f"no TAP device in a network namespace: {done.stderr.strip()}")
    return enter


class Chip:
    """The running simulation."""

    def __init__(self, command: list[str], log: pathlib.Path, *more: str) -> None:
        self.log = log
        with open(log, "wb") as out:
            self.process = subprocess.Popen([*command, *more], stdout=out, stderr=subprocess.STDOUT)
        # It prints its address when it is there.
        for _ in range(100):
            if "Ctrl-C" in log.read_text(errors="replace"):
                return
            if self.process.poll() is not None:
                break
            time.sleep(0.1)
        self.process.kill()
        raise Failure(f"the chip did not start:\n{log.read_text(errors='replace')}")

    def __enter__(self) -> Chip:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        """Its exit code counts if nothing else has failed."""
        self.process.terminate()
        code = self.process.wait()
        print(self.log.read_text(errors="replace"), end="", flush=True)
        if code and kind is None:
            raise Failure(f"the chip ended with {code}")


class Session:
    def __init__(self, given: argparse.Namespace) -> None:
        self.given, self.out = given, given.out
        self.psweep, self.sim = pairs.program(given.psweep), pairs.program(given.sim)
        self.size = given.size or (64 if given.small else 96)
        self.chip = [str(self.sim), "--config", given.config, "--tap", DEVICE, "--seed", str(given.seed)]
        self.udp = ["--engine", f"udp://{CHIP}"]

    def depth_command(self, to: str, *more: str) -> list[str]:
        scene = self.out / "scene"
        return [str(part) for part in (
            self.psweep, "depth", scene / "left.png", scene / "right.png", "--calib", scene / "calib.yaml", "--planes",
            self.given.planes, "--window", self.given.window, "-o", self.out / to, *more)]

    def equal(self, name: str) -> None:
        if not pairs.same_output(self.out / "fixed", self.out / name):
            raise Failure("chip and model differ")

    def interface(self) -> None:
        work.run(["ip", "link", "set", "lo", "up"])
        work.run(["ip", "tuntap", "add", "dev", DEVICE, "mode", "tap"])
        # Without it the kernel looks for IPv6 neighbours, and the chip counts its packets.
        try:
            pathlib.Path(f"/proc/sys/net/ipv6/conf/{DEVICE}/disable_ipv6").write_text("1")
        except OSError:
            pass
        work.run(["ip", "addr", "add", f"{HOST}/24", "dev", DEVICE])
        work.run(["ip", "link", "set", DEVICE, "up"])

    def scene(self) -> None:
        print("== scene, and its map by the bit-true model", flush=True)
        for name in ("scene", "fixed", "chip", "chip_faults", "chip_next", "chip_lost"):
            shutil.rmtree(self.out / name, ignore_errors=True)
        work.run([self.psweep, "render", "--kind", "rocky", "--seed", str(self.given.seed), "--size", str(self.size),
                  "-o", self.out / "scene"])
        work.run(self.depth_command("fixed", "--engine", "fixed"))

    def clean_wire(self) -> None:
        print(f"== chip '{self.given.config}' at {CHIP}", flush=True)
        with Chip(self.chip, self.out / "chip.log", "--pcap", str(self.out / "wire.pcap")):
            for number in (0, 1, 18, 56, 100, 1000, 1471, 1472):
                text = work.output(["ping", "-n", "-c", "1", "-W", "20", "-s", str(number), CHIP])
                print("\n".join(line for line in text.splitlines() if "bytes from" in line), flush=True)
            work.run(["ip", "neigh", "show", "dev", DEVICE])
            (self.out / "info.txt").write_text(work.output([self.psweep, "info", f"udp://{CHIP}"]))
            work.run(self.depth_command("chip", *self.udp))
        self.equal("chip")

    def read_wire(self, *more: str) -> list[str]:
        dissector = ["-X", f"lua_script:{DISSECTOR}"] if DISSECTOR.exists() else []
        # XDG_CONFIG_HOME: without the preferences and plugins of whoever runs this.
        return work.output(["tshark", "-r", self.out / "wire.pcap", *dissector, "-o", "ip.check_checksum:TRUE", "-o",
                            "udp.check_checksum:TRUE", *more],
                           environment={"XDG_CONFIG_HOME": str(self.out)}).splitlines()

    def look_at_wire(self) -> None:
        if shutil.which("tshark") is None:
            print(f"== tshark is not installed: {self.out}/wire.pcap is not looked at")
            return
        frames, bad = self.read_wire(), self.read_wire("-Y", WRONG)
        print(f"== tshark: {len(frames)} frames, {len(bad)} of them malformed or with a wrong checksum", flush=True)
        if len(frames) < 20 or bad:
            raise Failure("\n".join(bad[:10]) or "too few frames")

    def small_mtu(self) -> None:
        work.run(["ip", "link", "set", "dev", DEVICE, "mtu", "1400"])
        log = self.out / "mtu.log"
        if work.run(self.depth_command("chip_mtu", *self.udp), log=log, check=False) == 0:
            raise Failure("a chip behind an MTU of 1400 gave a map")
        wanted = f"interface {DEVICE} has an MTU of 1400"
        if wanted not in log.read_text():
            raise Failure(log.read_text())
        print("\n".join(line for line in log.read_text().splitlines() if wanted in line), flush=True)
        work.run(["ip", "link", "set", "dev", DEVICE, "mtu", "1500"])

    def killed_host(self) -> None:
        host = subprocess.Popen(self.depth_command("chip_lost", "-q", *self.udp))
        for _ in range(100):
            if '"session": true' in work.output([self.psweep, "info", "--json", f"udp://{CHIP}"]):
                break
        host.send_signal(signal.SIGKILL)
        host.wait()
        work.run(self.depth_command("chip_next", *self.udp))

    def run(self) -> None:
        self.interface()
        self.scene()
        self.clean_wire()
        self.look_at_wire()
        print("== an interface whose MTU is too small, and a host that is killed", flush=True)
        with Chip(self.chip, self.out / "chip_killed.log", "--session-wall", "2"):
            self.small_mtu()
            self.killed_host()
        if "sessions ended for 2 s of silence: 1" not in (self.out / "chip_killed.log").read_text():
            raise Failure("the session of the host that was killed did not end")
        self.equal("chip_next")
        print("== again, with 1 % of the frames lost, doubled, reordered, corrupted", flush=True)
        with Chip(self.chip, self.out / "chip_faults.log", *BAD_WIRE):
            work.run(self.depth_command("chip_faults", *self.udp))
        self.equal("chip_faults")
        print(f"sim-net: chip and model agree in every file; recorded wire: {self.out}/wire.pcap")


def main(arguments: list[str]) -> int:
    options = work.parser("scripts/sim_net.sh", __doc__)
    options.add_argument("--psweep", default="build/psweep", metavar="FILE")
    options.add_argument("--sim", default="build/psweep-sim", metavar="FILE")
    options.add_argument("--out", type=pathlib.Path, default=pathlib.Path("build/sim-net"), metavar="DIR")
    options.add_argument("--config", default="tiny", metavar="NAME", help="the chip (default: tiny)")
    options.add_argument("--planes", type=int, default=12, help="that it serves (default: 12)")
    options.add_argument("--window", type=int, default=5, help="that it serves (default: 5)")
    options.add_argument("--size", type=int, metavar="N", help="side of the images (default: 96; with --small: 64)")
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--small", action="store_true")
    given = options.parse_args(arguments)
    given.out.mkdir(parents=True, exist_ok=True)
    session = Session(given)
    if not os.environ.get(INSIDE):
        try:
            enter = way_in()
        except Skip as reason:
            print(f"SKIPPED: {reason}\n== the chip over the in-process link instead", flush=True)
            return work.run([session.sim, "--config", given.config], check=False)
        os.environ[INSIDE] = "1"
        os.execvp(enter[0], [*enter, sys.executable, "-B", str(SCRIPTS / "tools.py"), "sim-net", *arguments])
    # A signal must not leave the chip behind.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    session.run()
    return 0
