#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Upsets of the whole chip: one bit of one register is changed while tiles run over the link (docs/robustness.md).

  scripts/flips_chip.py [--count N] [--seed N] [--jobs N]

    --count N   upsets, about (default 20000; every bit of every register at least once)
    --seed N    which clocks (default 1)
    --jobs N    processes (default: JOBS, or all cores)

Table and sites in build/flips_chip.txt. Exit code 1 if the chip hangs, or if nothing was changed.
"""
import argparse
import collections
import concurrent.futures
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "build/tb/upsets/chip_flips"
RESULT = ROOT / "build/flips_chip.txt"
VERDICTS = ("masked", "repeated", "session", "error", "silent", "hang")


def run(options):
    """Lines of all upsets, in no order, and the line about the run without one."""
    def part(k):
        done = subprocess.run([str(PROGRAM), "--lines", "--count", str(options.count), "--seed", str(options.seed),
                               "--part", f"{k}/{options.jobs}"],
                              stdout=subprocess.PIPE, stderr=None if k == 1 else subprocess.DEVNULL, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"{PROGRAM.name} --part {k}/{options.jobs} ended with {done.returncode}:\n"
                               + done.stdout[-2000:])
        return done.stdout.splitlines()

    lines, about = [], ""
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for text in pool.map(part, range(1, options.jobs + 1)):
            lines += [line.split("\t")[1:] for line in text if line.startswith("upset\t")]
            about = next((line for line in text if not line.startswith("upset\t")), about)
    return lines, about


class Count:
    def __init__(self):
        self.flips = self.resent = self.clocks = self.silence = 0
        self.verdict = collections.Counter()

    def add(self, verdict, resent, clocks, silence):
        self.flips += 1
        self.verdict[verdict] += 1
        self.resent += verdict == "masked" and resent > 0
        self.clocks = max(self.clocks, clocks)
        self.silence = max(self.silence, silence)


def tables(lines):
    groups = collections.defaultdict(Count)
    total = Count()
    sites = {v: collections.defaultdict(collections.Counter) for v in ("error", "silent", "hang")}
    again = {}
    for group, entity, name, site, bit, clock, verdict, resent, clocks, silence in lines:
        for count in (groups[group], total):
            count.add(verdict, int(resent), int(clocks), int(silence))
        if verdict in sites:
            where = f"{entity} {name}"
            sites[verdict][where][int(bit)] += 1
            again.setdefault((verdict, where), f"{site}:{bit}:{clock}")
    return groups, total, sites, again


def text_table(groups, total):
    rows = [f"{'upset in':<38} {'flips':>6} " + " ".join(f"{v:>8}" for v in VERDICTS) + f" {'resent':>7} {'clocks':>7} "
            f"{'silence':>7}"]
    for name, c in sorted(groups.items()) + [("all", total)]:
        rows.append(f"{name:<38} {c.flips:>6} " + " ".join(f"{c.verdict[v]:>8}" for v in VERDICTS)
                    + f" {c.resent:>7} {c.clocks:>7} {c.silence:>7}")
    return rows


def bits_text(bits):
    return ", ".join(f"{bit}" if times == 1 else f"{bit} ({times} times)" for bit, times in sorted(bits.items()))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=20000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=int(os.environ.get("JOBS") or os.cpu_count() or 1))
    options = parser.parse_args()
    try:
        lines, about = run(options)
    except RuntimeError as problem:
        sys.exit(f"flips_chip.py: {problem}")
    groups, total, sites, again = tables(lines)
    report = [about] + text_table(groups, total)
    for verdict, places in sites.items():
        for where, bits in sorted(places.items()):
            report.append(f"{verdict}: {where}: {bits_text(bits)}; again: build/tb/upsets/chip_flips --only "
                          f"{again[verdict, where]}")
    RESULT.write_text("\n".join(report) + "\n")
    print("\n".join(report))
    good = total.flips > 0 and total.verdict["hang"] == 0
    print("flips_chip:", "nothing hangs" if good else "FAILED")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
