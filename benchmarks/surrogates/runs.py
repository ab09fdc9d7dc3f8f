"""Diagnoses of surrogates, kept one file a log; a run that was stopped goes on, and more surrogates add to it."""

from __future__ import annotations

import json
import os
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from benchmarks.practice.cases import TIERS, cases
from benchmarks.rates import rate
from benchmarks.real.spiked import real_sets
from benchmarks.surrogates.surrogate import WAYS, Way, surrogate
from codegen.base.files import write_atomically
from codegen.diagnosis.diagnose import Models, diagnose_log
from codegen.diagnosis.fit.acceptance import LEAST_NET
from codegen.diagnosis.fit.trial import with_values
from codegen.diagnosis.results import Diagnosis
from codegen.effects.declare import system_of
from codegen.logs import Log, excerpt, read_log
from codegen.mechanics import System
from codegen.spec import Spec, read_spec

Read = Callable[[], tuple[Spec, Log, Log | None]]


@dataclass(frozen=True)
class Source:
    """A log with its model, read on demand; ``group``: a tier of the practice logs, or a real set."""

    group: str
    name: str
    read: Read


@dataclass(frozen=True)
class Trial:
    """The diagnosis of one surrogate.

    Attributes:
        p: the least of the candidates of the first round, each over all candidates of the round; 1 without any.
        p_material: the least of those that are at least ``LEAST_NET`` of the drive force; others are never accepted.
        named: kinds of a verdict `effect`.
        cpu_s: of this diagnosis.
    """

    way: Way
    verdict: str
    p: float
    p_material: float
    named: tuple[str, ...]
    cpu_s: float


@dataclass(frozen=True)
class Trials:
    """The diagnoses of all surrogates of one log; ``plain``: verdict on the log as it is."""

    group: str
    name: str
    plain: str
    trials: tuple[Trial, ...]


ADAPTER: TypeAdapter[Trials] = TypeAdapter(Trials)


def sources(groups: Sequence[str] = (), only: Sequence[str] = ()) -> list[Source]:
    """Every log that is here, or those of these groups and names."""
    real = [Source(name, name, one.read) for name, one in real_sets().items() if one.is_here and not one.steady]
    found = [*_practice(), *real]
    return [s for s in found if (not groups or s.group in groups) and (not only or s.name in only)]


def trials_of(source: Source, file: Path, count: int, again: bool) -> Trials:
    """So many surrogates of a log, by all ways in turn."""
    done = ADAPTER.validate_json(file.read_bytes()) if file.exists() and not again else None
    if done is not None and len(done.trials) >= count:
        return done
    spec, log, test = source.read()
    system = system_of(spec)
    log, test = excerpt(log)[0], None if test is None else excerpt(test)[0]
    plain, models = diagnose_log(spec, system, log, test)
    found = done or Trials(source.group, source.name, plain.verdict, ())
    for k in range(len(found.trials), count if plain.verdict != "unfit" else 0):
        trial = _trial(spec, system, log, test, models, source.name, k)
        found = Trials(found.group, found.name, found.plain, (*found.trials, trial))
        write_atomically(file, json.dumps(asdict(found), indent=1, ensure_ascii=False) + "\n")
    return found


def least_p(diagnosis: Diagnosis, size: float = 0.0) -> float:
    """The least p of all fitted candidates with at least this share of the drive force."""
    return min((c.p for c in diagnosis.candidates if np.isfinite(c.p) and (not size or c.size >= size)), default=1.0)


def _trial(spec: Spec, system: System, log: Log, test: Log | None, models: Models, name: str, k: int) -> Trial:
    random, way = np.random.default_rng([zlib.crc32(name.encode()), k]), WAYS[k % len(WAYS)]
    cutoff = models.train.motion.cutoff_hz
    before = os.times()
    refitted_values = {s.name: float(models.augmented.values[s]) for s in models.train.refitted_symbols}
    machine = with_values(system, refitted_values)  # as fitted together with the effects, nearest to the true ones
    made = surrogate(log, machine, way, random, cutoff, models.augmented)
    held_out = None if test is None else surrogate(test, machine, way, random, cutoff, models.augmented)
    said = diagnose_log(spec, system, made, held_out)[0]
    after = os.times()
    cpu = sum(after[:4]) - sum(before[:4])
    return Trial(
        way, said.verdict, least_p(said), least_p(said, LEAST_NET), tuple(e.kind for e in said.effects), round(cpu, 2)
    )


def _practice() -> Iterator[Source]:
    for tier in TIERS:
        for case in cases([tier]):

            def read(folder: Path = case.folder) -> tuple[Spec, Log, Log | None]:
                spec = read_spec(folder / "spec.yaml")
                return spec, read_log(folder / "train.csv", spec), read_log(folder / "test.csv", spec)

            yield Source(tier, case.title, read)


def table(found: Sequence[Trials], alpha: float) -> list[dict[str, Any]]:
    """A row a group and way: how often an effect was accepted, and p is at most α; with the cost."""
    rows = []
    for group in dict.fromkeys(one.group for one in found):
        for way in WAYS:
            logs = [(one.name, t) for one in found for t in one.trials if (one.group, t.way) == (group, way)]
            own = [t for _, t in logs]
            if own:
                row = {
                    "group": group,
                    "way": way,
                    "logs": len({name for name, _ in logs}),
                    "accepted": rate(t.verdict == "effect" for t in own),
                    "at_alpha": rate(t.p <= alpha for t in own),
                    "material": rate(t.p_material <= alpha for t in own),
                    "verdicts": sorted(Counter(t.verdict for t in own).items()),
                    "cpu": float(np.median([t.cpu_s for t in own])),
                }
                rows.append(row)
    return rows
