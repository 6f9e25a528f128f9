# SPDX-License-Identifier: Apache-2.0
"""Tests the tests: puts one small fault at a time into a copy of the RTL (an operator, a constant, a condition, an
assignment), and the tests of `make sim` have to notice it. docs/mutants.md says how and with what result.

  scripts/mutants.sh [options] [ENTITY ...]      default: all entities of rtl/files.f, the chip's parts first
    --count N    N mutants an entity (default: one for each 50 lines; at least ten of a file of more than 200 lines,
                 two of a smaller one)
    --seed N     draws others (default 1)
    --minutes N  begins nothing new after that time; the next run goes on
    --only ID    that mutant alone (ENTITY.NUMBER, as in the list), drawn or not
    --list       shows what would be tested and by which tests, tests nothing
    --report     only the table of what is known
    --strict     no mercy for those in the list of equivalents: for tests of this script
    --out DIR    where to work (default: build/mutants)

Works in build/mutants, one copy of the tree and its builds per job; the checkout is not touched. The entity's own
test comes first, then one small engine or chip, then the tests of the whole; the first that fails ends it. A mutant
that cannot be built is 'invalid' and another is drawn. A mutant that survives has to be in
scripts/mutants_equivalent.txt, with a reason. Results are kept in build/mutants/results.jsonl: an interrupted run
goes on, and a mutant whose entity and tests are unchanged is not run again. Environment: JOBS (default: all cores),
VERBOSE=1 (keeps all logs).
Exit code 1 if a mutant survived that is not in that list, if one in the list was killed, if an entry of the list fits
no mutant, if the run is not finished, or if nothing was tested."""
import argparse
import json
import os
import pathlib
import re
import sys
import time
from typing import Any

from . import campaign as c
from . import faults, workshop
from .chains import Chains
from ..vhdl import Rtl

ROOT = pathlib.Path(__file__).resolve().parents[3]
LIST = ROOT / "scripts" / "mutants_equivalent.txt"


def say(text: str) -> None:
    print(f"mutants: {text}", flush=True)


def options_of(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="scripts/mutants.sh", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("entities", nargs="*")
    parser.add_argument("--count", type=int)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float)
    parser.add_argument("--only", default="")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--report", action="store_true")
    parser.add_argument("--strict", action="store_true")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "build" / "mutants")
    options = parser.parse_args(arguments)
    if options.count is not None and options.count < 1:
        parser.error("--count wants a number from 1 on")
    return options


def drawn(tree: pathlib.Path, chains: Chains, options: argparse.Namespace) -> list[c.Entity]:
    """The entities wanted, in the order of their work: the chip's first, of each kind the long ones first."""
    wanted = options.entities or chains.order
    only = re.fullmatch(r"(\w+)\.(\d+)", options.only)
    if options.only:
        if not only:
            raise ValueError("--only wants ENTITY.NUMBER")
        wanted = [only[1]]
    found, rtl = [], Rtl(tree / "rtl")
    for name in wanted:
        if name not in chains.of:
            raise ValueError(f"no entity {name} in rtl/files.f")
        text = rtl.text(name).split("\n")
        ordered = faults.drawn_order(faults.candidates(name, text, options.seed))
        if not ordered:
            raise ValueError(f"rtl/{rtl.name(name)}: no place for a fault")
        quota = min(options.count or faults.quota(len(text) - 1), len(ordered))
        if only:
            ordered, quota = [m for m in ordered if m.id == options.only], 1
            if not ordered:
                raise ValueError(f"no mutant {options.only}")
        found.append(c.Entity(name, text, ordered, quota))
    return sorted(found, key=lambda e: (e.name not in chains.of_chip, -e.quota))


def report(run: c.Campaign, equivalents: dict[str, faults.Equivalent], seed: int, strict: bool) -> dict[str, Any]:
    """What came out, for the page and for the exit code."""
    table: dict[str, dict[str, int]] = {}
    survivors, explained, problems = [], [], list(run.problems)
    order = [name for name in run.chains.order if name in run.met]
    by_name = {e.name: e for e in run.entities}
    for name in order:
        entity = by_name[name]
        row = dict.fromkeys(("drawn", "tested", "own", "whole", "no_end", "equivalent", "survived", "waiting",
                             "invalid"), 0)
        row["drawn"] = entity.quota
        for m in run.met[name]:
            r = run.results[m.key]
            listed = equivalents.get(m.key)
            if r.verdict == c.INVALID:
                row["invalid"] += 1
                continue
            row["tested"] += 1
            if r.verdict in (c.KILLED, c.NO_END):
                row["no_end" if r.verdict == c.NO_END else "whole" if r.whole else "own"] += 1
                if listed:
                    problems.append(f"{listed.where}: not equivalent, {r.by} killed it: {m.shown()}")
            elif listed and not strict:
                row["equivalent"] += 1
                explained.append({"id": m.id, "text": m.shown(), "reason": " ".join(listed.reason)})
            elif r.verdict == c.SURVIVED:
                row["survived"] += 1
                survivors.append({"id": m.id, "text": m.shown()})
                problems.append(f"survived and is not in {LIST.name}: {m.id}: {m.shown()}")
            else:
                row["waiting"] += 1
        # Fewer than drawn: all places of a small entity have been tried, or what is left cannot be built.
        if entity.at >= len(entity.ordered) or entity.invalid_in_a_row >= c.MOST_INVALID:
            row["drawn"] = row["tested"]
        table[name] = row
    total = {key: sum(row[key] for row in table.values()) for key in next(iter(table.values()))} if table else {}
    missing = total.get("drawn", 0) - total.get("tested", 0)
    if total.get("waiting", 0) or missing:
        problems.append(f"not finished: {missing} have met no test, {total['waiting']} wait for those of the whole "
                        "engine or chip; run it again, it goes on")
    if not total.get("tested"):
        problems.append("nothing was tested")
    return {"seed": seed, "complete": not missing and not total.get("waiting", 0), "entities": table, "all": total,
            "survivors": survivors, "equivalents": explained, "problems": problems}


def show(result: dict[str, Any]) -> None:
    columns = ("drawn", "tested", "own", "whole", "no_end", "equivalent", "survived", "waiting", "invalid")
    print(f"\n{'entity':20} " + " ".join(f"{name:>10}" for name in columns))
    for name, row in [*result["entities"].items(), ("all", result["all"])]:
        print(f"{name:20} " + " ".join(f"{row[column]:>10}" for column in columns))
    for problem in result["problems"]:
        say(problem)
    total = result["all"]
    say(f"{total['tested']} tested, {total['own'] + total['whole'] + total['no_end']} killed, {total['equivalent']} "
        f"equivalent, {total['survived']} survived, {total['waiting']} not through all tests, {total['invalid']} could "
        "not be built")


def main(arguments: list[str]) -> int:
    options = options_of(arguments)
    try:
        jobs = [] if options.list or options.report else [
            workshop.Job(options.out / str(n + 1)) for n in range(int(os.environ.get("JOBS") or os.cpu_count() or 1))]
        tree = ROOT
        if jobs:
            for job in jobs:
                # The first copy is what the others are copies of: somebody may go on editing.
                names = workshop.synchronise(ROOT if job is jobs[0] else jobs[0].tree, job.tree)
            tree = jobs[0].tree
        else:
            names = [str(p.relative_to(ROOT)) for f in workshop.FOLDERS for p in
                     ([ROOT / f] if (ROOT / f).is_file() else (ROOT / f).rglob("*"))
                     if p.is_file() and not workshop._LEFT_OUT.search(str(p.relative_to(ROOT)))]
        chains = Chains(names, lambda name: (tree / name).read_bytes().decode("latin-1"))
        entities = drawn(tree, chains, options)
        equivalents = faults.equivalents(LIST)
        wrong = [f"{entry.where}: fits no line of the RTL" for key, entry in equivalents.items()
                 if not _fits(key, tree, options.seed)]
    except ValueError as error:
        print(f"mutants: {error}", file=sys.stderr)
        return 2
    if options.list:
        for e in entities:
            print(f"{e.name}: {e.quota} of {len(e.ordered)}; {', '.join(t.name for t in chains.of[e.name])}")
            for m in e.ordered[:e.quota]:
                print(f"  {m.id:24} {m.shown()}")
        print(f"{sum(e.quota for e in entities)} of {sum(len(e.ordered) for e in entities)} "
              "(those that cannot be built are replaced)")
        return 0
    options.out.mkdir(parents=True, exist_ok=True)
    run = c.Campaign(options.out, chains, entities, jobs, bool(os.environ.get("VERBOSE")), say)
    interrupted = False
    if options.report:
        run.recall()
    else:
        if options.minutes:
            run.until = time.monotonic() + 60 * options.minutes
        try:
            run.run(set(equivalents))
        except KeyboardInterrupt:
            interrupted = True
            workshop.Job.stop()
    result = report(run, equivalents, options.seed, options.strict)
    result["problems"] += wrong
    show(result)
    whole = not options.entities and not options.only and options.count is None and options.seed == 1
    if whole or options.report:
        out = ROOT / "build" / "evidence"
        out.mkdir(parents=True, exist_ok=True)
        (out / "mutants.json").write_text(json.dumps(result, indent=1) + "\n")
    if interrupted:
        return 130
    return 1 if result["problems"] else 0


def _fits(key: str, tree: pathlib.Path, seed: int) -> bool:
    """Is there such a mutant?"""
    rtl, entity = Rtl(tree / "rtl"), key.split("|")[0]
    if entity not in rtl.files:
        return False
    return any(m.key == key for m in faults.candidates(entity, rtl.text(entity).split("\n"), seed))
