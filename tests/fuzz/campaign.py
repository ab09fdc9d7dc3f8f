"""Many damaged files, one after the other: ``python -m tests.fuzz.campaign --seconds 3600``.

A worker process runs the cases of one family and writes a line before and after each, so that this one knows the case
that ended it or that it hangs in, notes that as a failure, and goes on behind it with another worker. What fails is
kept as files that say the family, the seed and what went wrong.
"""

from __future__ import annotations

import argparse
import gc
import json
import multiprocessing
import os
import resource
import select
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from multiprocessing.connection import Connection
from pathlib import Path

import typer.main

from .case import Case, run
from .verdict import Verdict

ROOT = Path(__file__).parents[2]
MEMORY = 1_500_000_000
"""Bytes of address space that a case may take beyond what the worker has when it begins."""
HANG = 900.0
"""Seconds of silence after which a worker is ended; every call has its own limit of processor time long before."""
EACH = 1000
"""Cases after which a campaign that keeps what fails says how far it is."""
WARM = multiprocessing.get_context("forkserver")
"""Makes processes by fork from one that has imported what all workers need, and has run nothing else."""
WARM.set_forkserver_preload([f"tests.fuzz.{name}_cases" for name in ("broken", "corpus", "library", "robot", "spec")])
SHARES = {"spec": 0.5, "log": 0.25, "library": 0.1, "robot": 0.1, "proof": 0.05}


def families() -> Mapping[str, Callable[[int], Case]]:
    """Name → the case of a seed."""
    from . import broken_cases, corpus_cases, library_cases, log_cases, proof_cases, robot_cases, spec_cases

    return {
        "spec": spec_cases.spec,
        "log": log_cases.log,
        "library": library_cases.library_log,
        "robot": robot_cases.robot,
        "proof": proof_cases.proof,
        "corpus": corpus_cases.corpus,
        "broken": broken_cases.broken,
    }


@dataclass(frozen=True)
class Told:
    """A case of the campaign."""

    family: str
    seed: int
    stage: str
    verdict: Verdict


@dataclass
class Campaign:
    """What became of the cases of one family.

    Attributes:
        counts: (stage, kind of verdict) → cases.
        failures: those that failed.
    """

    family: str
    counts: Counter[tuple[str, str]] = field(default_factory=Counter)
    failures: list[Told] = field(default_factory=list)

    @property
    def cases(self) -> int:
        return sum(self.counts.values())

    def far(self) -> str:
        """How many cases ended in which stage."""
        stages = Counter[str]()
        for (stage, _), n in self.counts.items():
            stages[stage] += n
        return ", ".join(f"{stage} {n}" for stage, n in stages.most_common())

    def of(self, kind: str) -> int:
        return sum(n for (_, known), n in self.counts.items() if known == kind)


# ---- the worker -----------------------------------------------------------------------------------------------------


def work(family: str, seeds: Iterable[int]) -> None:
    """Run the cases here; what they print on the process's own channels is a failure too."""
    make = families()[family]
    typer.main.get_command = cache(typer.main.get_command)  # it makes the tree of verbs anew for each call
    channel = os.fdopen(os.dup(1), "w")
    with tempfile.TemporaryDirectory(prefix="stiction-fuzz-") as name, (Path(name) / "screen").open("wb+") as screen:
        for number in (1, 2):
            os.dup2(screen.fileno(), number)
        run(make(0), Path(name) / "case")  # imports
        gc.freeze()
        gc.set_threshold(50_000, 20, 100)
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY,) * 2)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        for seed in seeds:
            print(json.dumps({"seed": seed}), file=channel, flush=True)
            screen.truncate(0)
            stage, verdict = run(make(seed), Path(name) / "case")
            written = Path(screen.name).read_bytes().lstrip(b"\0") if not verdict.failed else b""
            if written:
                words = written.decode("utf-8", "replace")
                verdict = Verdict("screen", words[:300], f"written past Python: {words[:40]!r}")
            told = {"seed": seed, "stage": stage, "kind": verdict.kind, "words": verdict.words, "spot": verdict.spot}
            print(json.dumps(told), file=channel, flush=True)


def _worker(family: str, seeds: Iterable[int], told: Connection) -> None:
    """``work`` in a process of its own, whose standard output is the channel."""
    os.chdir(ROOT)
    os.dup2(told.fileno(), 1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    told.close()
    work(family, seeds)


# ---- the process that watches ------------------------------------------------------------------------------------


def campaign(
    family: str, first: int, count: int | None = None, seconds: float | None = None, keep: Path | None = None
) -> Campaign:
    """Run so many cases, or so long.

    Args:
        keep: folder for the files of the cases that fail.
    """
    found, end = Campaign(family), None if seconds is None else time.monotonic() + seconds
    for told in _told(family, first, count, end):
        found.counts[told.stage, told.verdict.kind] += 1
        if found.cases % EACH == 0 and keep is not None:
            print(f"{family}: {found.cases} cases up to seed {told.seed}, {len(found.failures)} failures", flush=True)
        if told.verdict.failed:
            found.failures.append(told)
            if keep is not None:
                kept(told, keep)
    return found


def kept(told: Told, folder: Path) -> None:
    """Write the files of a case, and what went wrong with it."""
    spot = "".join(c if c.isalnum() else "_" for c in told.verdict.spot)[:80]
    target = folder / told.family / f"{told.verdict.kind}-{spot}" / str(told.seed)
    target.mkdir(parents=True, exist_ok=True)
    for name, content in families()[told.family](told.seed).files.items():
        (target / name).write_bytes(content)
    words = [f"{told.family} {told.seed}", told.stage, told.verdict.kind, told.verdict.spot, told.verdict.words]
    (target / "what.txt").write_text("\n".join(words) + "\n", encoding="utf-8", errors="backslashreplace")


def _told(family: str, first: int, count: int | None, end: float | None) -> Iterator[Told]:
    seed, last = first, None if count is None else first + count
    while (last is None or seed < last) and (end is None or time.monotonic() < end):
        channel, told = WARM.Pipe(duplex=False)
        worker = WARM.Process(target=_worker, args=(family, range(seed, sys.maxsize if last is None else last), told))
        worker.start()
        told.close()
        with channel:
            running = None
            try:
                for line in _lines(channel.fileno(), end):
                    raw = json.loads(line)
                    running = raw["seed"] if "kind" not in raw else None
                    if running is None:
                        verdict = Verdict(raw["kind"], raw["words"], raw["spot"])
                        yield Told(family, raw["seed"], raw["stage"], verdict)
                        seed = raw["seed"] + 1
                worker.join()
                kind = ("crash", f"the process ended with {worker.exitcode}")
            except TimeoutError:
                kind = ("hang", f"nothing for {HANG:g} s")
            except _Over:
                return
            finally:
                worker.kill()
                worker.join()
        if running is None and kind[0] == "crash" and (last is None or seed < last):
            raise RuntimeError(f"the worker of {family} ended before a case began: {kind[1]}")
        if running is not None:
            yield Told(family, running, "unknown", Verdict(kind[0], kind[1], kind[1]))
            seed = running + 1


class _Over(Exception):
    """The time is up."""


def _lines(channel: int, end: float | None) -> Iterator[bytes]:
    waiting, told = b"", time.monotonic()
    while True:
        ready, _, _ = select.select([channel], [], [], 1.0)
        if ready:
            some = os.read(channel, 1 << 16)
            if not some:
                return
            *lines, waiting = (waiting + some).split(b"\n")
            told = time.monotonic()
            yield from lines
        if end is not None and time.monotonic() > end:
            raise _Over
        if time.monotonic() - told > HANG:
            raise TimeoutError


def table(found: Iterable[Campaign]) -> str:
    """What became of the cases, and the faults that were seen, each with the seeds that show it."""
    found = list(found)
    lines = [f"{'family':8}{'cases':>10}{'results':>10}{'errors':>10}{'failures':>10}  ended in"]
    for one in found:
        numbers = (one.cases, one.of("result"), one.of("error"), len(one.failures))
        lines.append(f"{one.family:8}" + "".join(f"{n:>10}" for n in numbers) + f"  {one.far()}")
    for one in found:
        spots: dict[tuple[str, str], list[Told]] = {}
        for told in one.failures:
            spots.setdefault((told.verdict.kind, told.verdict.spot), []).append(told)
        for (kind, spot), those in sorted(spots.items(), key=lambda item: -len(item[1])):
            seeds = ", ".join(str(t.seed) for t in those[:4])
            lines.append(f"{len(those):>6} {one.family} {kind}: {spot} (stage {those[0].stage}; seeds {seeds})")
            lines.append(f"       {those[0].verdict.words[:150]}")
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(prog="make fuzz", description="Run many damaged files through the tool.")
    parser.add_argument("--seconds", type=float, default=3600, help="how long, all families together")
    parser.add_argument("--seed", type=int, default=0, help="the first seed of each family")
    parser.add_argument("--count", type=int, help="so many cases of each family, however long it takes")
    parser.add_argument("--family", choices=SHARES, action="append", help="this one alone; may be repeated")
    parser.add_argument("--keep", type=Path, default=Path("fuzz-failures"), help="folder for what fails")
    given = parser.parse_args()
    chosen = given.family or list(SHARES)
    whole = sum(SHARES[name] for name in chosen)
    found = []
    for name in chosen:
        seconds = None if given.count else given.seconds * SHARES[name] / whole
        found.append(campaign(name, given.seed, given.count, seconds, given.keep))
        print(table(found[-1:]), flush=True)
    print(table(found))
    failures = sum(len(one.failures) for one in found)
    print(f"failures are in {given.keep}/" if failures else "no failure")
    return int(failures > 0)


if __name__ == "__main__":
    sys.exit(main())
