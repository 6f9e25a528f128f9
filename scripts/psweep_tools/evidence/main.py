# SPDX-License-Identifier: Apache-2.0
"""Evidence that says what it was measured on (docs/verification.md, "How evidence is kept").

  scripts/evidence.py status [--strict] [KIND ..]     what is there, what is stale and why; --strict: then exit code 1
  scripts/evidence.py run [--force] [KIND ..]         makes what is stale (make evidence), stamps it, writes pages
  scripts/evidence.py stamp [--force] [--at COMMIT] KIND ..
                                                      stamps what the latest run of a kind left in build/; --at: it was
                                                      made of the sources of that commit
  scripts/evidence.py blocks [--check]                writes the blocks of the pages from docs/evidence/*.json
  scripts/evidence.py full [FILE]                     the complete tables as one page: build/evidence/full.md
  scripts/evidence.py lint                            are all figures in blocks, are the blocks what they should be?
                                                      Stale ones are named, which is no failure

A KIND is a name of manifest.py, or the beginning of several (coverage). The tools take JOBS; mutants
takes MINUTES, after which it begins nothing new. Needs Python 3.11 and nothing else; the tools bring their own.
"""
import argparse
import pathlib
import subprocess
import sys

from . import figures, lists, manifest, pages, runner, sources


def _status(kinds: list[manifest.Kind], strict: bool) -> int:
    found = runner.all_status()
    stale = [kind.name for kind in kinds if found[kind.name].stale]
    for kind in kinds:
        print(f"{kind.name:17} {found[kind.name].text()}")
    print(f"{len(kinds) - len(stale)} as of now, {len(stale)} stale" + (f": {' '.join(stale)}" if stale else ""))
    return 1 if strict and stale else 0


def _blocks(check: bool) -> int:
    found = pages.check(runner.all_status(), not check)
    for line in found.wrong if check else found.written:
        print(line)
    if not check:
        # Once more: what is wrong now cannot be written.
        found = pages.check(runner.all_status(), False)
        for line in found.wrong:
            print(line)
    return 1 if found.wrong else 0


def _full(files: list[str]) -> int:
    out = pathlib.Path(files[0]) if files else sources.ROOT / "build" / "evidence" / "full.md"
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(pages.full(runner.all_status()))
    return 0


def _lint() -> int:
    status = runner.all_status()
    found = pages.check(status, False)
    wrong = found.wrong + figures.check()
    done = subprocess.run([sys.executable, "scripts/cost/report.py", "--pages", "--check"], cwd=sources.ROOT,
                          capture_output=True, text=True, check=False)
    if done.returncode:
        wrong.append(done.stderr.strip() or "scripts/cost/report.py --pages --check failed")
    for line in wrong:
        print(line)
    for line in found.dated:
        print(f"note: {line} does not say yet that its sources have changed: scripts/evidence.py blocks")
    for line in lists.gone():
        print(f"note: {line}")
    for name, one in status.items():
        if one.stale:
            print(f"note: {name}: {one.text()}")
    return 1 if wrong else 0


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="scripts/evidence.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("status", "run", "stamp", "blocks", "full", "lint"))
    parser.add_argument("kinds", nargs="*", metavar="KIND")
    parser.add_argument("--strict", action="store_true")
    parser.add_argument("--force", action="store_true")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--at", default="", metavar="COMMIT")
    options = parser.parse_args(arguments)
    try:
        if options.what == "full":
            return _full(options.kinds)
        kinds = manifest.chosen(options.kinds) if options.kinds else list(manifest.KINDS)
        if options.what == "status":
            return _status(kinds, options.strict)
        if options.what == "blocks":
            return _blocks(options.check)
        if options.what == "lint":
            return _lint()
        if options.what == "stamp":
            if not options.kinds:
                parser.error("stamp wants a KIND")
            return max(runner.stamp(kind, options.at, options.force) for kind in kinds)
        return 1 if runner.run(kinds, options.force) else 0
    except ValueError as error:
        print(f"evidence: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
