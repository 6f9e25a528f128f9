# SPDX-License-Identifier: Apache-2.0
"""The run: hands mutants to the jobs, keeps what came out, goes on where it was interrupted.

Two rounds. In the first all mutants meet the cheap tests: that of their entity, and one small engine or chip under
random tiles or frames. What survives these goes through the tests of the whole engine or chip in the second, in which a
mutant costs minutes. Results are kept line by line in results.jsonl, with the hash of what each test depends on: a
mutant whose entity and tests are unchanged is not run again."""
import hashlib
import json
import pathlib
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ..evidence import sources
from .chains import Chains, Test
from .faults import Mutant
from .workshop import BrokenTest, Job, Stopped

MOST_INVALID = 25  # in a row, then a file has no more places
KILLED, NO_END, INVALID, SURVIVED, WAITING = "killed", "no end", "invalid", "survived", "waiting"


@dataclass
class Result:
    """What is known of a mutant."""
    verdict: str = ""  # one of the above, '' if unknown
    by: str = "-"  # the test that found it
    whole: bool = False  # that is one of the whole engine or chip
    passed: dict[str, str] = field(default_factory=dict)  # tests that noticed nothing, and what they depended on
    depends: str = ""  # of the test that found it, or could not be built
    seconds: float = 0

    def known(self, chain: tuple[Test, ...], chains: Chains) -> "Result":
        """What of it still holds."""
        if self.verdict in (KILLED, NO_END):
            test = next((t for t in chain if t.name == self.by), None)
            if test is not None and chains.depends(test) == self.depends:
                return self
        if self.verdict == INVALID and chain and chains.depends(chain[0]) == self.depends:
            return self
        by_name = {test.name: test for test in chain}
        passed = {name: depends for name, depends in self.passed.items()
                  if name in by_name and chains.depends(by_name[name]) == depends}
        verdict = "" if not passed else WAITING
        if all(test.name in passed for test in chain):
            verdict = SURVIVED
        elif any(not test.thorough and test.name not in passed for test in chain):
            verdict = ""
        return Result(verdict, passed=passed, seconds=self.seconds)


@dataclass
class Entity:
    name: str
    text: list[str]
    ordered: list[Mutant]
    quota: int
    at: int = 0  # the next one of the draw
    valid: int = 0
    in_work: int = 0
    invalid_in_a_row: int = 0

    def wants(self) -> bool:
        return (self.at < len(self.ordered) and self.valid + self.in_work < self.quota
                and self.invalid_in_a_row < MOST_INVALID)


class Campaign:
    def __init__(self, folder: pathlib.Path, chains: Chains, entities: list[Entity], jobs: list[Job],
                 keep_logs: bool, say: Callable[[str], None]) -> None:
        self.folder, self.chains, self.entities, self.jobs = folder, chains, entities, jobs
        self.keep_logs, self._say = keep_logs, say
        self.results: dict[str, Result] = {}  # by key of the mutant
        self.met: dict[str, list[Mutant]] = {e.name: [] for e in entities}  # those of the draw that were tried
        self._file = folder / "results.jsonl"
        self._kept = self._load()
        self._baseline_file = folder / "baseline.json"
        self._baseline: dict[str, list[Any]] = {}
        if self._baseline_file.is_file():
            self._baseline = json.loads(self._baseline_file.read_text())
        self._change = threading.Condition()
        self._tests: dict[str, threading.Lock] = {}
        self.until = float("inf")
        self.begun = time.monotonic()
        self.problems: list[str] = []
        self.fresh = 0  # tried in this run

    # ---- what is kept

    def _load(self) -> dict[str, Result]:
        kept: dict[str, Result] = {}
        if self._file.is_file():
            for line in self._file.read_text().splitlines():
                try:
                    entry = json.loads(line)
                    key = entry.pop("key")
                    kept[key] = Result(**entry)
                except (ValueError, KeyError, TypeError):
                    pass  # a line that was cut short
        return kept

    def key(self, m: Mutant, entity: Entity) -> str:
        """Changes with the text of the entity, comments apart."""
        text = sources.essence(f"{m.entity}.vhd", "\n".join(entity.text).encode("latin-1"))
        return hashlib.sha256(text + f"|{m.key}".encode("latin-1")).hexdigest()[:20]

    def _keep(self, key: str, result: Result) -> None:
        self._kept[key] = result
        with open(self._file, "a", encoding="ascii") as out:
            out.write(json.dumps({"key": key, **vars(result)}) + "\n")

    def recall(self) -> None:
        """Takes what is known of the draw, without running anything."""
        for entity in self.entities:
            while entity.wants():
                m = entity.ordered[entity.at]
                result = self._known(m, entity)
                if not result.verdict and not result.passed:
                    break
                self._take(m, entity, result)

    def _known(self, m: Mutant, entity: Entity) -> Result:
        return self._kept.get(self.key(m, entity), Result()).known(self.chains.of[m.entity], self.chains)

    def _take(self, m: Mutant, entity: Entity, result: Result) -> None:
        entity.at += 1
        self._count(m, entity, result)

    def _count(self, m: Mutant, entity: Entity, result: Result) -> None:
        self.results[m.key] = result
        self.met[entity.name].append(m)
        if result.verdict == INVALID:
            entity.invalid_in_a_row += 1
        else:
            entity.valid += 1
            entity.invalid_in_a_row = 0

    # ---- one mutant

    def baseline(self, test: Test, job: Job) -> float:
        """Seconds of a test on the circuit as it is; it has to pass there, or to fail would mean nothing."""
        with self._change:
            lock = self._tests.setdefault(test.name, threading.Lock())
        with lock:
            depends = self.chains.depends(test)
            known = self._baseline.get(test.name)
            if known and known[0] == depends:
                return float(known[1])
            log = job.at / f"baseline.{test.name.replace(' ', '_')}.txt"
            log.unlink(missing_ok=True)
            if not job.make(test, log, 3600):
                raise BrokenTest(f"{test.name} cannot be built: {log}")
            code, seconds = job.try_(test, log, 1800)
            text = log.read_text(errors="replace")
            if code != 0 or not ("All tests passed (" in text and "All tests passed (0" not in text
                                 or "100% tests passed, 0 tests failed out of" in text):
                raise BrokenTest(f"{test.name} fails on the circuit as it is: {log}")
            with self._change:
                self._baseline[test.name] = [depends, round(seconds, 2)]
                self._baseline_file.write_text(json.dumps(self._baseline, indent=0) + "\n")
            self._say(f"the circuit as it is passes {test.name} ({seconds:.0f} s)")
            return seconds

    def _try(self, m: Mutant, entity: Entity, job: Job, result: Result, thorough: bool) -> Result:
        original = "\n".join(entity.text)
        lines = list(entity.text)
        lines[m.line] = m.after
        begun = time.monotonic()
        log = job.at / f"log.{m.id}.txt"
        log.write_text(m.shown() + "\n")
        out = Result(WAITING, passed=dict(result.passed), seconds=result.seconds)
        try:
            for test in self.chains.of[m.entity]:
                if test.name in out.passed or test.thorough and not thorough:
                    continue
                if test.thorough and time.monotonic() >= self.until:
                    break
                seconds = self.baseline(test, job)
                job.put(m.entity, "\n".join(lines))
                verdict = None
                if not job.make(test, log, 600):
                    verdict = INVALID
                else:
                    limit = 60 + 4 * seconds if test.thorough else 20 + 3 * seconds
                    code, _ = job.try_(test, log, limit)
                    if code is None:
                        verdict = NO_END
                    elif code in (126, 127):
                        raise BrokenTest(f"{test.name} cannot be run: {log}")
                    elif code != 0:
                        verdict = KILLED
                job.put(m.entity, original)
                if verdict is not None:
                    out.verdict, out.by, out.whole = verdict, test.name, test.whole
                    out.depends = self.chains.depends(test)
                    if verdict == INVALID and out.passed:
                        # Other generics: it could be built before, so what follows cannot be said.
                        out.verdict, out.by = KILLED, test.name
                    break
                out.passed[test.name] = self.chains.depends(test)
            else:
                if thorough:
                    out.verdict = SURVIVED
        except Stopped:
            if out.passed != result.passed:
                with self._change:
                    self._keep(self.key(m, entity), out)
            raise
        finally:
            job.put(m.entity, original)
        out.seconds = round(out.seconds + time.monotonic() - begun, 1)
        if out.verdict not in (SURVIVED, WAITING) and not self.keep_logs:
            log.unlink(missing_ok=True)
        return out

    def _told(self, m: Mutant, result: Result) -> None:
        self.fresh += 1
        left = self.left()
        share = (time.monotonic() - self.begun) / self.fresh * sum(left)
        by = f" by {result.by}" if result.by != "-" else ""
        self._say(f"[{left[0]} + {left[1]} to do, about {share / 60:.0f} min] {m.id}: {m.shown()}: "
                  f"{result.verdict}{by} ({result.seconds:.0f} s)")

    def left(self) -> tuple[int, int]:
        """Mutants that have not met the cheap tests, and those that wait for the others."""
        first = sum(max(0, e.quota - e.valid) for e in self.entities if e.at < len(e.ordered))
        return first, sum(r.verdict == WAITING for r in self.results.values())

    # ---- the rounds

    def _next(self, current: Entity | None) -> Entity | None:
        """The entity to go on with: that of the latest build, else one that nobody is at, else any."""
        if current is not None and current.wants():
            return current
        waiting = [e for e in self.entities if e.wants()]
        return next((e for e in waiting if e.in_work == 0), waiting[0] if waiting else None)

    def _first_round(self, job: Job) -> None:
        entity: Entity | None = None
        while time.monotonic() < self.until:
            with self._change:
                entity = self._next(entity)
                if entity is None:
                    if not any(e.in_work for e in self.entities):
                        return
                    self._change.wait(1)
                    continue
                m = entity.ordered[entity.at]
                known = self._known(m, entity)
                if known.verdict:
                    self._take(m, entity, known)
                    continue
                entity.at += 1
                entity.in_work += 1
            try:
                result = self._try(m, entity, job, known, False)
            finally:
                with self._change:
                    entity.in_work -= 1
                    self._change.notify_all()
            with self._change:
                self._count(m, entity, result)
                self._keep(self.key(m, entity), result)
                self._told(m, result)

    def _second_round(self, queue: list[tuple[Mutant, Entity]], job: Job) -> None:
        while time.monotonic() < self.until:
            with self._change:
                if not queue:
                    return
                m, entity = queue.pop(0)
            result = self._try(m, entity, job, self.results[m.key], True)
            with self._change:
                self.results[m.key] = result
                self._keep(self.key(m, entity), result)
                self._told(m, result)

    def _all_jobs(self, work: Callable[[Job], None]) -> bool:
        """True if no job broke off."""
        broken: list[BaseException] = []

        def guarded(job: Job) -> None:
            try:
                work(job)
            except Stopped:
                broken.append(Stopped())
            except BaseException as error:  # pylint: disable=broad-except
                broken.append(error)
                self.problems.append(str(error))
                Job.stop()
        threads = [threading.Thread(target=guarded, args=(job,), daemon=True) for job in self.jobs]
        for thread in threads:
            thread.start()
        for thread in threads:
            while thread.is_alive():
                thread.join(0.5)
        return not broken

    def run(self, spared: set[str]) -> None:
        """Both rounds. `spared`: keys of mutants whose survival is explained, which come last in the second one."""
        if not self._all_jobs(self._first_round):
            return
        by_name = {e.name: e for e in self.entities}
        queue = [(m, by_name[name]) for name, found in self.met.items() for m in found
                 if self.results[m.key].verdict == WAITING]
        queue.sort(key=lambda pair: pair[0].key in spared)
        self._all_jobs(lambda job: self._second_round(queue, job))
