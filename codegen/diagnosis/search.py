"""Every effect at every place fitted by output error, most promising first; one round adds at most one effect."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.diagnosis.coverage import survey
from codegen.diagnosis.credit import level
from codegen.diagnosis.models import with_values
from codegen.diagnosis.output_error import Shot, again, fit, raw_slopes, state_slopes
from codegen.diagnosis.problem import Problem
from codegen.diagnosis.screen import starting_points
from codegen.diagnosis.shooting import STEPS_PER_PERIOD, Record, Shooter
from codegen.diagnosis.signals import Motion
from codegen.diagnosis.trial import Part, Runner, Trial, declared_chain, part_of
from codegen.effects import CATALOGUE
from codegen.effects.declare import places_of
from codegen.effects.register import is_own
from codegen.mechanics.system import System

Array = NDArray[np.float64]

SCREENED_SAMPLES = 9000
LEAST_SCREENED = 60
"""Segments: candidates are first tried on every so many of them, then the best on all."""
DEEPEST = 50.0
"""The refit's error over the least noise that candidates are compared at."""
NEAR, SHORTEST = 30.0, 0.2
"""In noise: where the refit's error is larger, candidates are first tried on shorter segments, on which a free run
stays near the measured motion (error grows with the square of time)."""
FIRST_ROUNDS, ROUNDS = 4, 10
FITTED, POLISHED = 6, 4
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


@dataclass(frozen=True, eq=False)
class Search:
    """Fits on one record.

    Attributes:
        system: as declared. moved: friction levels and parameters with a tolerance.
        shorter: the record in segments shorter by a factor.
        declared, price: of ``moved``: where it stands in the spec, and 1/variance by its tolerance, 0 for a level.
    """

    system: System
    motion: Motion
    record: Record
    moved: tuple[sympy.Symbol, ...]
    declared: Array
    price: Array
    shorter: Callable[[float], Record]

    @cached_property
    def substeps(self) -> int:
        return max(1, int(np.ceil(self.record.sample_time * STEPS_PER_PERIOD * self.motion.cutoff_hz)))

    @property
    def nothing(self) -> Trial:
        return Trial(self.system, (), self.moved)

    def refit(self) -> Shot:
        """The declared structure, refitted: first against the misfit, then against the noise."""
        trial = self.nothing
        runner = self._runners([trial])[0]
        zero = np.zeros((len(self.record.start), 2 * self.record.measured.shape[1]))
        starts = state_slopes(runner, self.declared, zero)
        declared = fit(runner, self.declared, zero, starts, self.price, self.declared, 0)
        _, rough = self.softened(declared)
        return self.rebased(rough)

    def softened(self, base: Shot) -> tuple[Search, Shot]:
        """The search with the noise taken as no smaller than a share of what the base leaves, and the base in it.

        What is far above the noise is compared by logarithms; far below the misfit, that would credit a candidate for
        the few segments that it happens to hit.
        """
        factor = max(1.0, level(base) / DEEPEST)
        if factor == 1.0:
            return self, base
        record = replace(self.record, noise=factor * self.record.noise)
        search = replace(
            self, record=record, shorter=lambda share: replace(self.shorter(share), noise=factor * self.record.noise)
        )
        return search, search.rebased(base)

    def rebased(self, shot: Shot) -> Shot:
        """The fit again on this search's record."""
        runner = replace(shot.runner, record=self.record)
        size, reach = self._sizes(runner.trial, shot.theta)
        starts = state_slopes(runner, shot.theta, shot.offsets)
        first = fit(runner, shot.theta, shot.offsets, starts, shot.price, shot.centre, ROUNDS, (), size, reach)
        return again(first, ROUNDS, size, reach)

    def without(self, shot: Shot, index: int) -> Shot:
        """The fit with one of its effects left out."""
        trial = shot.runner.trial
        moved, found = trial.split(shot.theta)
        rest = [k for k in range(len(trial.parts)) if k != index]
        return self.exchanged(shot, moved, [trial.parts[k] for k in rest], [found[k] for k in rest])

    def exchanged(self, shot: Shot, moved: Array, parts: Sequence[Part], values: Sequence[Mapping[str, float]]) -> Shot:
        """The fit with these effects in place of its own, from these values."""
        trial = replace(shot.runner.trial, parts=tuple(parts))
        theta = trial.theta(moved, values)
        free = np.zeros(len(theta) - len(moved))
        start = replace(
            shot,
            runner=self._runners([trial])[0],
            theta=theta,
            price=np.append(self.price, free),
            centre=np.append(self.declared, free),
        )
        return self.rebased(start)

    def elsewhere(self, shot: Shot) -> Shot:
        """The fit again on this search's record, which is of another log than the fit's own."""
        runner = replace(shot.runner, substeps=self.substeps)
        offsets = np.zeros((len(self.record.start), shot.offsets.shape[1]))
        return self.rebased(replace(shot, runner=runner, offsets=offsets))

    def every_part(self, taken: Sequence[Part]) -> list[Part]:
        """Effects at their places, less those taken; richer forms of a kind are not tried on their own."""
        system = self.system
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

    def attempt(self, base: Shot, parts: Sequence[Part], tell: Progress) -> list[Found]:
        """Each part added to the base's trial and fitted; best first."""
        trials = [base.runner.trial.with_part(part) for part in parts]
        runners = self._runners(trials)
        raw = raw_slopes(base)
        moved, _ = base.runner.trial.split(base.theta)
        refit = with_values(self.system, {s.name: float(v) for s, v in zip(self.moved, moved, strict=True)})
        sizes = survey(refit, self.motion)
        few_base = self._screening(base)
        few, few_raw = few_base.runner.record, raw_slopes(few_base)
        levels = [float(v) for v in moved]

        couplings: dict[int, dict[str, float]] = {}

        def first(k: int) -> tuple[int, Shot] | None:
            runner = replace(runners[k], record=few)
            covered = sizes.covered(parts[k], levels, self.record.noise, couplings.get(parts[k].place))
            best = None
            most = 3 if len(parts[k].names) > 2 else 2
            for _, theta in starting_points(runner, few_base, few_raw, covered, most):
                shot = self._fit(runner, theta, few_base, FIRST_ROUNDS, few_raw)
                best = shot if best is None or shot.cost < best.cost else best
            tell((k + 1) / (len(parts) + FITTED))
            if best is not None and parts[k].kind == "compliance":
                couplings[parts[k].place] = trials[k].split(best.theta)[1][-1]
            return None if best is None else (k, best)

        def second(entry: tuple[int, Shot]) -> Found:
            k, shot = entry
            return Found(trials[k], self._fit(runners[k], shot.theta, base, ROUNDS, raw))

        def third(found: Found) -> Found:
            size, reach = self._sizes(found.trial, found.shot.theta)
            return Found(found.trial, again(found.shot, ROUNDS, size, reach))

        with ThreadPoolExecutor(WORKERS) as pool:
            later = [k for k, part in enumerate(parts) if part.kind == "backlash"]
            sooner = [k for k in range(len(parts)) if k not in later]
            tried = [t for group in (sooner, later) for t in pool.map(first, group) if t]
            tried.sort(key=lambda t: t[1].cost)
            kept = [t for rank, t in enumerate(tried) if rank < FITTED or is_own(parts[t[0]].kind)]
            found = sorted(pool.map(second, kept), key=lambda f: f.shot.cost)
            best = sorted(pool.map(third, found[:POLISHED]), key=lambda f: f.shot.cost)
        return [*best, *found[POLISHED:]]

    def _screening(self, base: Shot) -> Shot:
        """The base on fewer and, where it is far from the data, shorter segments."""
        level = float(np.sqrt(np.median(base.by_segment) / base.residual.shape[1]))
        record = self.shorter(float(np.clip(np.sqrt(NEAR / max(level, NEAR)), SHORTEST, 1.0)))
        segments = len(record.start)
        every = max(1, min(segments * record.length // SCREENED_SAMPLES, segments // LEAST_SCREENED))
        few = replace(record, start=np.ascontiguousarray(record.start[::every]))
        runner = replace(base.runner, record=few)
        zero = np.zeros((len(few.start), base.offsets.shape[1]))
        size, reach = self._sizes(runner.trial, base.theta)
        starts = state_slopes(runner, base.theta, zero)
        return fit(runner, base.theta, zero, starts, base.price, base.centre, FIRST_ROUNDS, (), size, reach)

    def _fit(self, runner: Runner, theta: Array, base: Shot, rounds: int, raw: Sequence[Array]) -> Shot:
        free = len(theta) - len(base.theta)
        price, centre = np.append(base.price, np.zeros(free)), np.append(base.centre, np.zeros(free))
        size, reach = self._sizes(runner.trial, theta)
        return fit(runner, theta, base.offsets, base.starts, price, centre, rounds, raw, size, reach)

    def _sizes(self, trial: Trial, theta: Array) -> tuple[Array, Array]:
        """(size, reach) of every parameter: a logarithm, a phase or a logit has the size 1."""
        size, reach = np.maximum(np.abs(theta), 1e-9), np.full(len(theta), np.inf)
        k = len(trial.moved)
        for part in trial.parts:
            for j, name in enumerate(part.names):
                if name in part.positive or name in ("phase", "load_fraction"):
                    size[k + j] = 1.0
            reach[k : k + len(part.names)] = part.reach
            k += len(part.names)
        return size, reach

    def _runners(self, trials: Sequence[Trial]) -> list[Runner]:
        """One library for all; trials whose system is the same share its code."""
        place: dict[tuple[tuple[str, str], ...], int] = {}
        systems: list[System] = []
        free: list[tuple[sympy.Symbol, ...]] = []
        models: list[int] = []
        for trial in trials:
            key = tuple((p.kind, p.on) for p in trial.parts if p.symbols)
            if key not in place:
                place[key] = len(systems)
                systems.append(trial.changed)
                free.append(trial.free)
            models.append(place[key])
        shooter = Shooter(systems, free)
        chains = {w.name: declared_chain(a, self.system.values) for w, a in self.system.actuators.items()}
        return [
            Runner(trial, shooter, model, self.record, self.substeps, chains)
            for trial, model in zip(trials, models, strict=True)
        ]


def search_on(problem: Problem, shorter: Callable[[float], Record]) -> Search:
    """A search whose fits move the levels freely and the parameters with a tolerance within it."""
    system, levels, uncertain = problem.system, problem.levels, problem.uncertain
    moved = (*levels, *uncertain)
    declared = np.array([float(system.values[s]) for s in moved])
    held = [1 / (problem.tolerance[s] * abs(float(system.values[s])) or 1e-12) ** 2 for s in uncertain]
    price = np.array([0.0] * len(levels) + held)
    return Search(system, problem.motion, shorter(1.0), moved, declared, price, shorter)
