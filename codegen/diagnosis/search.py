"""Output-error fits on one record: the refit of what is declared, and of it with effects."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.diagnosis.balance import slip_velocities
from codegen.diagnosis.credit import independent_share, level
from codegen.diagnosis.imposed import RigidTerms, is_separable, rigid_terms
from codegen.diagnosis.joint_shooter import JointShooter, Memory
from codegen.diagnosis.measure import Drive
from codegen.diagnosis.output_error import Shot, again, fit, state_slopes
from codegen.diagnosis.problem import Problem
from codegen.diagnosis.record import STILL
from codegen.diagnosis.shooting import STEPS_PER_PERIOD, Record, Shooter, terms_of
from codegen.diagnosis.signals import Motion
from codegen.diagnosis.trial import Part, Runner, Trial
from codegen.mechanics.system import System

Array = NDArray[np.float64]

DEEPEST = 50.0
"""The refit's error over the least noise that candidates are compared at."""
SECOND_LENGTH = 0.6
"""Of the segments of the second fit that the intervals know of."""
BOTH_WAYS = 0.05
ROUNDS = 10
"""Steps of a fit, at most."""


@dataclass(frozen=True, eq=False)
class Search:
    """Fits on one record.

    Attributes:
        system: as declared. moved: friction levels and parameters with a tolerance.
        shorter: the record in segments shorter by a factor.
        declared, price: of ``moved``: where it stands in the spec, and 1/variance by its tolerance, 0 for a level.
        rigid: of an arm whose joints are run one at a time; None where all coordinates run together.
        memory: of its joints' runs.
    """

    system: System
    motion: Motion
    record: Record
    moved: tuple[sympy.Symbol, ...]
    declared: Array
    price: Array
    shorter: Callable[[float], Record]
    rigid: RigidTerms | None = None
    memory: Memory = field(default_factory=Memory)

    @cached_property
    def substeps(self) -> int:
        return max(1, int(np.ceil(self.record.sample_time * STEPS_PER_PERIOD * self.motion.cutoff_hz)))

    @cached_property
    def turns(self) -> NDArray[np.bool_]:
        """(contacts,) whether the slip has, of the samples in motion, a share of ``BOTH_WAYS`` in either direction."""
        slip = slip_velocities(self.system, self.motion)[self.motion.usable]
        moving = np.where(np.abs(slip) > STILL * np.quantile(np.abs(slip), 0.95, axis=0), np.sign(slip), 0.0)
        rarer = np.minimum((moving > 0).sum(axis=0), (moving < 0).sum(axis=0))
        return np.asarray(rarer >= BOTH_WAYS * (moving != 0).sum(axis=0))

    @cached_property
    def drive(self) -> Drive:
        return Drive(self.system, self.motion)

    @cached_property
    def problem(self) -> Problem:
        """The declared system on the motion of the record."""
        return Problem(self.system, self.motion, {})

    @property
    def nothing(self) -> Trial:
        return Trial(self.system, (), self.moved)

    def refit(self) -> Shot:
        """The declared structure, refitted: first against the misfit, then against the noise."""
        trial = self.nothing
        runner = self.runners([trial])[0]
        zero = self.record.at_rest
        starts = state_slopes(runner, self.declared, zero)
        declared = fit(runner, self.declared, zero, starts, self.price, self.declared, 0)
        _, rough = self.softened(declared)
        return self.rebased(rough)

    def polished(self, shot: Shot) -> tuple[Shot, Shot]:
        """The fit against what it leaves, where that is above the noise, and the same on shorter segments.

        Noise of the input and what the model does not hold build up along a segment: what shorter ones say otherwise is
        an error that no covariance of one fit knows of.
        """
        found = self._against_its_misfit(shot)
        other = replace(self, record=self.shorter(SECOND_LENGTH))
        return found, other._against_its_misfit(other.elsewhere(found))

    def _against_its_misfit(self, shot: Shot) -> Shot:
        search = self
        for _ in range(2):
            search, shot = search.softened(shot, 1.0)
        return shot

    def softened(self, base: Shot, deepest: float = DEEPEST) -> tuple[Search, Shot]:
        """The search with the noise taken as no smaller than a share of what the base leaves, and the base in it.

        What is far above the noise is compared by logarithms; far below the misfit, that would credit a candidate for
        the few segments that it happens to hit.

        Args:
            deepest: the base's error over the least noise.
        """
        factor = max(1.0, level(base) / deepest)
        if factor == 1.0:
            return self, base
        record = replace(self.record, noise=factor * self.record.noise)
        search = replace(
            self, record=record, shorter=lambda share: replace(self.shorter(share), noise=factor * self.record.noise)
        )
        return search, search.rebased(base)

    def rebased(self, shot: Shot) -> Shot:
        """The fit again on this search's record, its prior weighed by what the shot leaves.

        Residuals that follow each other count as fewer than they are, so the likelihood is tempered by the share of
        them that is independent: the prior is divided by it. Near the noise that is all of them.
        """
        share = independent_share(shot)
        price = self.weighed(share, len(shot.theta))
        runner = replace(shot.runner, record=self.record)
        size, reach = self.sizes(runner.trial, shot.theta)
        starts = state_slopes(runner, shot.theta, shot.offsets)
        first = fit(runner, shot.theta, shot.offsets, starts, price, shot.centre, ROUNDS, (), size, reach, share)
        return again(first, ROUNDS, size, reach)

    def weighed(self, share: float, count: int) -> Array:
        """(count,) prior weights beside a likelihood of which such a share counts; effects' parameters have none."""
        return np.append(self.price / share, np.zeros(count - len(self.price)))

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
        centre = np.append(self.declared, np.zeros(len(theta) - len(moved)))
        return self.rebased(replace(shot, runner=self.runners([trial])[0], theta=theta, centre=centre))

    def elsewhere(self, shot: Shot) -> Shot:
        """The fit again on this search's record, which is of another log than the fit's own."""
        runner = replace(shot.runner, substeps=self.substeps)
        return self.rebased(replace(shot, runner=runner, offsets=self.record.at_rest))

    def fit_from(self, runner: Runner, theta: Array, base: Shot, rounds: int, raw: Sequence[Array]) -> Shot:
        """The fit of a trial with one part more than the base's, from ``theta``; the base's starts and slopes serve.

        Args:
            raw: slopes of the base's parameters.
        """
        free = len(theta) - len(base.theta)
        price, centre = np.append(base.price, np.zeros(free)), np.append(base.centre, np.zeros(free))
        size, reach = self.sizes(runner.trial, theta)
        starts = base.offsets, base.starts
        return fit(runner, theta, *starts, price, centre, rounds, raw, size, reach, base.tempering)

    def sizes(self, trial: Trial, theta: Array) -> tuple[Array, Array]:
        """(size, reach) of every parameter: a logarithm, a phase or a logit has the size 1."""
        size, reach = np.maximum(np.abs(theta), 1e-9), np.full(len(theta), np.inf)
        k = len(trial.moved)
        # A parameter of value zero is as large as its tolerance lets it be.
        size[:k] = np.maximum(size[:k], np.where(self.price > 0, 1 / np.sqrt(np.maximum(self.price, 1e-300)), 0.0))
        for part in trial.parts:
            for coordinate in part.coordinates:
                if coordinate.of_unit_size:
                    size[k] = 1.0
                reach[k] = coordinate.reach
                k += 1
        return size, reach

    def runners(self, trials: Sequence[Trial]) -> list[Runner]:
        """One library for all; trials whose terms are the same share their code."""
        if not trials:
            return []
        place: dict[tuple[Any, ...], int] = {}
        systems: list[System] = []
        free: list[tuple[sympy.Symbol, ...]] = []
        models: list[int] = []
        for trial in trials:
            key = (trial.free, terms_of(trial.changed))
            if key not in place:
                place[key] = len(systems)
                systems.append(trial.changed)
                free.append(trial.free)
            models.append(place[key])
        rigid = self.rigid
        loads = max(len(trial.changed.transmissions) for trial in trials)
        if rigid:
            shooter: Shooter | JointShooter = JointShooter(systems, free, rigid, self.memory, loads)
        else:
            shooter = Shooter(systems, free, loads)
        return [
            Runner(trial, shooter, model, self.record, self.substeps)
            for trial, model in zip(trials, models, strict=True)
        ]


def search_on(problem: Problem, shorter: Callable[[float], Record]) -> Search:
    """A search whose fits move the levels freely and the parameters with a tolerance within it."""
    system, levels, uncertain = problem.system, problem.levels, problem.uncertain
    moved = (*levels, *uncertain)
    declared = np.array([float(system.values[s]) for s in moved])
    held = [problem.deviation[s] ** -2.0 for s in uncertain]
    price = np.array([0.0] * len(levels) + held)
    if not is_separable(system):
        return Search(system, problem.motion, shorter(1.0), moved, declared, price, shorter)
    joints = tuple(range(system.degrees_of_freedom))

    def by_joint(share: float) -> Record:
        return replace(shorter(share), joints=joints)

    return Search(system, problem.motion, by_joint(1.0), moved, declared, price, by_joint, rigid_terms(system, moved))
