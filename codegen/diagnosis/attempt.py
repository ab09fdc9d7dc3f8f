"""Every effect at every place beside what was found: screened on few segments, and the best fitted on all."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis.coverage import survey
from codegen.diagnosis.models import with_values
from codegen.diagnosis.output_error import Shot, again, fit, raw_slopes, state_slopes
from codegen.diagnosis.screen import settled, starting_points
from codegen.diagnosis.search import ROUNDS, Search
from codegen.diagnosis.trial import ROUGH, Part, Trial, part_of
from codegen.effects import CATALOGUE
from codegen.effects.declare import places_of
from codegen.effects.register import is_own

Array = NDArray[np.float64]

SCREENED_SAMPLES = 9000
LEAST_SCREENED = 60
"""Segments: candidates are first tried on every so many of them, then the best on all."""
NEAR, SHORTEST = 30.0, 0.2
"""In noise: where the refit's error is larger, candidates are first tried on shorter segments, on which a free run
stays near the measured motion (error grows with the square of time)."""
FIRST_ROUNDS = 4
FITTED = 6
POLISHES, MOVING = 4, 0.01
"""Fresh slopes of the segments' starts for each of those, at most so often, while the cost falls by such a share."""
WORKERS = max(1, min(2, os.cpu_count() or 1))

Progress = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class Found:
    """A candidate with its fit; the part on trial is the last one."""

    trial: Trial
    shot: Shot

    @property
    def part(self) -> Part:
        return self.trial.parts[-1]

    @property
    def parameters(self) -> dict[str, float]:
        return self.trial.split(self.shot.theta)[1][-1]


def every_part(search: Search, taken: Sequence[Part]) -> list[Part]:
    """Effects at their places, less those taken; richer forms of a kind are not tried on their own."""
    system = search.system
    known = {(p.kind, p.on) for p in taken}
    joined = ("compliance", "backlash")
    if any(p.kind in joined for p in taken):
        known |= {(kind, x.name) for kind in joined for x in system.positions}
    parts = [
        part_of(effect, k, system)
        for effect in CATALOGUE.values()
        if not effect.refines
        for k in range(len(places_of(effect, system)))
        if effect.applies(system, k)
    ]
    return [p for p in parts if (p.kind, p.on) not in known]


def attempt(search: Search, base: Shot, parts: Sequence[Part], tell: Progress) -> list[Found]:
    """Each part added to the base's trial and fitted; best first."""
    tried = Attempt(search, base, tuple(parts), tell)
    with ThreadPoolExecutor(WORKERS) as pool:
        smooth = [k for k, part in enumerate(parts) if part.kind not in ROUGH]
        screened = [s for s in pool.map(tried.screened, smooth) if s]
        costs = sorted(shot.cost for _, shot in screened)
        tried.worth = min([tried.worth, *costs[FITTED - 1 : FITTED]])
        rough = [k for k in range(len(parts)) if k not in smooth]
        screened = sorted([*screened, *(s for s in pool.map(tried.screened, rough) if s)], key=lambda s: s[1].cost)
        kept = [s for rank, s in enumerate(screened) if rank < FITTED or is_own(parts[s[0]].kind)]
        found = list(pool.map(tried.fitted, kept))
    return sorted(found, key=lambda f: f.shot.cost)


@dataclass(eq=False)
class Attempt:
    """Parts tried beside one base.

    Attributes:
        couplings: by coordinate, the compliance that was fitted there.
        worth: cost by which a part with a rough loss must start for its search to be worth it.
    """

    search: Search
    base: Shot
    parts: tuple[Part, ...]
    tell: Progress
    couplings: dict[int, dict[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.trials = [self.base.runner.trial.with_part(part) for part in self.parts]
        self.runners = self.search.runners(self.trials)
        self.raw = raw_slopes(self.base)
        self.few = _screening(self.search, self.base)
        self.few_raw = raw_slopes(self.few)
        self.levels = [float(v) for v in self.base.runner.trial.split(self.base.theta)[0]]
        self.worth = self.few.cost
        names = [s.name for s in self.search.moved]
        refit = with_values(self.search.system, dict(zip(names, self.levels, strict=True)))
        self.survey = survey(refit, self.search.motion)

    def screened(self, k: int) -> tuple[int, Shot] | None:
        """Part ``k`` fitted on few segments from its best starts; None where none is worth it."""
        part, runner = self.parts[k], replace(self.runners[k], record=self.few.runner.record)
        noise = self.search.record.noise
        covered = self.survey.covered(part, self.levels, noise, self.couplings.get(part.place))
        most = 3 if len(part.names) > 2 else 2
        starts = starting_points(runner, self.few, self.few_raw, covered, most)
        if part.kind in ROUGH:
            near = [theta for cost, theta in starts if cost < self.worth]
            starts = [settled(runner, self.few, self.few_raw, theta) for theta in near]
        fits = [self.search.fit_from(runner, theta, self.few, FIRST_ROUNDS, self.few_raw) for _, theta in starts]
        self.tell((k + 1) / (len(self.parts) + FITTED))
        if not fits:
            return None
        best = min(fits, key=lambda shot: shot.cost)
        if part.kind == "compliance":
            self.couplings[part.place] = self.trials[k].split(best.theta)[1][-1]
        return k, best

    def fitted(self, screened: tuple[int, Shot]) -> Found:
        """The part on all segments, with fresh slopes of their starts while that helps."""
        k, start = screened
        shot, before = self.search.fit_from(self.runners[k], start.theta, self.base, ROUNDS, self.raw), np.inf
        for _ in range(POLISHES):
            if shot.cost > (1 - MOVING) * before:
                break
            before = shot.cost
            shot = again(shot, ROUNDS, *self.search.sizes(self.trials[k], shot.theta))
        return Found(self.trials[k], shot)


def _screening(search: Search, base: Shot) -> Shot:
    """The base on fewer and, where it is far from the data, shorter segments."""
    level = float(np.sqrt(np.median(base.by_segment) / base.residual.shape[1]))
    record = search.shorter(float(np.clip(np.sqrt(NEAR / max(level, NEAR)), SHORTEST, 1.0)))
    segments = len(record.start)
    every = max(1, min(segments * record.length // SCREENED_SAMPLES, segments // LEAST_SCREENED))
    few = replace(record, start=np.ascontiguousarray(record.start[::every]))
    runner = replace(base.runner, record=few)
    zero = np.zeros((len(few.start), base.offsets.shape[1]))
    size, reach = search.sizes(runner.trial, base.theta)
    starts = state_slopes(runner, base.theta, zero)
    return fit(runner, base.theta, zero, starts, base.price, base.centre, FIRST_ROUNDS, (), size, reach)
