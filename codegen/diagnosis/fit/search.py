"""Output-error fits on one record: the refit of the declared model, and models with effects.

An arm is simulated joint by joint. Effects are then judged at the joint on which they act: evidence taken over all
joints would compare an effect at one joint with the unexplained forces of the others.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.diagnosis.fit.acceptance import independent_share, noise_ratio
from codegen.diagnosis.fit.force_rows import residual_slopes
from codegen.diagnosis.fit.identity_cache import identity_cache
from codegen.diagnosis.fit.joints import JointShooter, Memory, RigidTerms, is_separable, rigid_terms
from codegen.diagnosis.fit.measure import Drive, drive_force, inertia_along
from codegen.diagnosis.fit.output_error import (
    FINE_STEP,
    WITHIN,
    Fit,
    GaussNewton,
    Prior,
    polish,
    resolution,
    segment_cost,
    shooting_fit,
)
from codegen.diagnosis.fit.record import STILL, Record, substeps_of
from codegen.diagnosis.fit.residual import Problem, slip_velocities
from codegen.diagnosis.fit.shooting import Shooter, has_bristles, level_jumps, terms_of
from codegen.diagnosis.fit.signals import Motion
from codegen.diagnosis.fit.trial import Part, Runner, Trial
from codegen.effects.start import size_by_unit
from codegen.mechanics.system import System

LARGEST_RATIO = 50.0
"""Largest ratio of the refit's error to the noise with which candidates are compared."""
SECOND_LENGTH = 0.6
"""Factor on the segment length for the second fit, whose difference widens the intervals."""
BOTH_WAYS = 0.05
"""Least share of the samples in motion with slip in each direction, for a contact that reverses."""
ROUNDS = 10
"""Most steps of a fit."""
FREED = 5
"""Most repetitions of a fit whose limits are removed."""
COMPILED_APART = 8
"""Number of models from which on they are compiled as two libraries in parallel."""
SMALLEST = 1e-9
"""Least size of a parameter over its scale."""
PARTS = 200
"""Cached scales of effects at their places."""
FITS = 6
"""Cached fits, since successive tests of effects use the same fits."""


class ModelFits(ABC):
    """Fits of models with effects, in which these are replaced and removed: to free runs, or to the force residual."""

    @abstractmethod
    def begun_by(self, fit: Fit, trial: Trial, theta: Array) -> Fit:
        """The fit of another trial, from ``theta`` and what else a fit has found."""

    @identity_cache(FITS)
    def without(self, fit: Fit, index: int) -> Fit:
        """The fit with one of its effects removed."""
        return self.begun_by(fit, *fit.trial.without(fit.theta, index))

    def with_parts(
        self, fit: Fit, refitted_values: Array, parts: Sequence[Part], values: Sequence[Mapping[str, float]]
    ) -> Fit:
        """The fit with these effects in place of its own, from these starting values."""
        trial = replace(fit.trial, parts=tuple(parts))
        return self.begun_by(fit, trial, trial.theta(refitted_values, values))

    def replaced(self, fit: Fit, others: Mapping[int, tuple[Part, Mapping[str, float]]]) -> Fit:
        """The fit with other effects, and their starting values, in place of those of these indices."""
        refitted_values, values = fit.values
        pairs = [others.get(k, own) for k, own in enumerate(zip(fit.trial.parts, values, strict=True))]
        return self.with_parts(fit, refitted_values, [part for part, _ in pairs], [start for _, start in pairs])

    def with_first_effect(self, found: Fit, fit: Fit) -> Fit:
        """A fit with the last effect of another one, ``found``, in place of its first effect."""
        return self.replaced(fit, {0: (found.part, found.parameters)})

    def eliminated(self, fit: Fit, needless: Callable[[Fit], int | None]) -> Fit:
        """Backward elimination: the fit without the effects that ``needless`` names one after another, by index."""
        while (k := needless(fit)) is not None:
            fit = self.without(fit, k)
        return fit


@dataclass(frozen=True, eq=False)
class Search(ModelFits):
    """Output-error fits of trials on one record.

    Attributes:
        problem: the declared system on the motion of the record.
        shorter: the record with segments shorter by a factor.
        within: tolerances that a parameter may move.
        rigid: rigid-body terms of an arm whose joints are simulated one at a time.
        memory: cache of its joints' runs.
        compiled: by equations, the library that has them, and their index in it.
    """

    problem: Problem
    record: Record
    shorter: Callable[[float], Record]
    within: float = WITHIN
    rigid: RigidTerms | None = None
    memory: Memory = field(default_factory=Memory)
    compiled: dict[Hashable, tuple[Shooter | JointShooter, int]] = field(default_factory=dict)

    @property
    def system(self) -> System:
        return self.problem.system

    @property
    def motion(self) -> Motion:
        return self.problem.motion

    @property
    def refitted_symbols(self) -> tuple[sympy.Symbol, ...]:
        return self.problem.refitted_symbols

    @property
    def declared(self) -> Array:
        return self.problem.declared

    @property
    def prior_precision(self) -> Array:
        return self.problem.prior_precision

    @cached_property
    def substeps(self) -> int:
        return substeps_of(self.record.sample_time, self.motion.cutoff_hz)

    @cached_property
    def reverses(self) -> NDArray[np.bool_]:
        """(contacts,) whether each direction of slip has at least the share ``BOTH_WAYS`` of the samples in motion."""
        slip = slip_velocities(self.system, self.motion)[self.motion.usable]
        moving = np.where(np.abs(slip) > STILL * np.quantile(np.abs(slip), 0.95, axis=0), np.sign(slip), 0.0)
        rarer = np.minimum((moving > 0).sum(axis=0), (moving < 0).sum(axis=0))
        return np.asarray(rarer >= BOTH_WAYS * (moving != 0).sum(axis=0))

    @cached_property
    def drive(self) -> Drive:
        return Drive(self.system, self.motion)

    @property
    def declared_trial(self) -> Trial:
        return Trial(self.system, (), self.refitted_symbols)

    def refit(self) -> Fit:
        """The declared structure, refitted: first with the noise floor, then against the noise."""
        runner = self.runners([self.declared_trial])[0]
        prior = self.prior(self.declared_trial, self.declared)
        _, rough = self.with_noise_floor(shooting_fit(runner, self.declared, self.record.at_rest, prior, 0))
        return self.fitted_again(rough)

    def without_limits(self, fit: Fit) -> tuple[Search, Fit] | None:
        """The search with tolerances as Gaussian prior only, without limits, and the fit repeated in it.

        It is repeated until the misfit no longer decreases, at most ``FREED`` times: far from the limits one fit may
        stop before the minimum. The search without limits would then be refused as worse than effects that imitate
        what it finds, such as equal gains of all inputs for a payload.

        None if the fit did not end at a limit of a toleranced parameter, or if one would take an excluded sign.
        """
        count = len(self.refitted_symbols)
        if not fit.limited[:count].any():
            return None
        free = replace(self, within=np.inf)
        again = free.fitted_again(fit)
        for _ in range(FREED):
            further = free.fitted_again(again)
            before, after = (segment_cost(one.residual) for one in (again, further))
            if before - after < resolution(before):
                break
            again = further
        return None if has_turned(self, again.theta[:count]).any() else (free, again)

    def polished(self, fit: Fit) -> tuple[Fit, Fit]:
        """The fit with its own residual as noise level and slopes at its values, and the same on shorter segments."""
        found = self._with_its_slopes(self._against_its_misfit(self._nearest_to_declared(fit)))
        other = self.on_shorter(SECOND_LENGTH)
        return found, other._against_its_misfit(other.on_another_record(found))

    def on_shorter(self, share: float) -> Search:
        """The search on segments shorter by a factor."""
        return replace(self, record=self.shorter(share), shorter=lambda further: self.shorter(share * further))

    def _with_its_slopes(self, fit: Fit) -> Fit:
        """The fit with all slopes computed at its values.

        If an effect acts like a parameter, slopes computed at different values would make the two seem distinguishable.
        """
        prior = self.prior(fit.trial, fit.theta, fit.prior.tempering)
        fresh = shooting_fit(fit.runner, fit.theta, fit.offsets, prior, 0, fit.unprojected, FINE_STEP)
        return replace(fresh, limited=fit.limited)

    def _nearest_to_declared(self, fit: Fit) -> Fit:
        """The fit, or a fit from the declared values of toleranced parameters if that is better."""
        toleranced = np.flatnonzero(self.prior_precision > 0)
        if not len(toleranced) or not fit.trial.parts:
            return fit
        theta = fit.theta.copy()
        theta[toleranced] = self.declared[toleranced]
        here, there = self.fitted_again(fit), self.fitted_again(replace(fit, theta=theta))
        return there if there.cost < here.cost else here

    def _against_its_misfit(self, fit: Fit) -> Fit:
        search = self
        for _ in range(2):
            search, fit = search.with_noise_floor(fit, 1.0)
        return fit

    @identity_cache(FITS)
    def with_noise_floor(self, base: Fit, largest_ratio: float = LARGEST_RATIO) -> tuple[Search, Fit]:
        """The search with noise no smaller than the base's error over ``largest_ratio``, and the base fitted in it.

        Far above the noise, the logarithmic loss would accept a candidate that happens to fit a few segments. If an arm
        is simulated joint by joint, each joint has its own noise.
        """
        factor = np.maximum(1.0, _noise_ratios(base) / largest_ratio)
        if np.all(factor == 1.0):
            return self, base
        noise = factor * self.record.noise
        louder = replace(self.record, noise=noise)
        search = replace(self, record=louder, shorter=lambda share: replace(self.shorter(share), noise=noise))
        return search, search.fitted_again(base)

    @identity_cache(FITS)
    def fitted_again(self, fit: Fit) -> Fit:
        """The fit repeated on this record, with its prior precision divided by the share of independent residuals."""
        runner = replace(fit.runner, record=self.record)
        prior = self.prior(runner.trial, fit.theta, independent_share(fit))
        return polish(shooting_fit(runner, fit.theta, fit.offsets, prior, ROUNDS), ROUNDS)

    def begun_by(self, fit: Fit, trial: Trial, theta: Array) -> Fit:
        (runner,) = self.runners([trial])
        offsets = runner.offsets_of(fit.runner, fit.offsets)
        return self.fitted_again(replace(fit, runner=runner, theta=theta, offsets=offsets))

    def on_another_record(self, fit: Fit) -> Fit:
        """The fit repeated on this search's record, where the fit is from another log."""
        runner = replace(fit.runner, substeps=self.substeps)
        return self.fitted_again(replace(fit, runner=runner, offsets=self.record.at_rest))

    def on_its_record(self, fit: Fit) -> Fit:
        """The fit, repeated on this search's record if it is of other segments: harmonics have shorter ones."""
        return fit if len(fit.offsets) == len(self.record.at_rest) else self.on_another_record(fit)

    def fit_from(
        self,
        runner: Runner,
        theta: Array,
        base: Fit,
        rounds: int,
        raw: Sequence[Array] | None = None,
        final_slopes: bool = True,
    ) -> Fit:
        """The fit of a trial with one part more than the base's, from ``theta``, with the base's starts and slopes."""
        prior, known = self.prior(runner.trial, theta, base.prior.tempering), base.raw_slopes if raw is None else raw
        offsets = runner.offsets_of(base.runner, base.offsets)
        return GaussNewton(runner, base.starts, prior, theta, offsets, known=known).fit(rounds, final_slopes)

    def prior(self, trial: Trial, theta: Array, tempering: float = 1.0) -> Prior:
        """The prior of a trial's parameters, none for those of effects; a logarithm, phase or logit has the size 1."""
        count, zeros = len(trial.refitted_symbols), np.zeros(len(theta) - len(trial.refitted_symbols))
        scale = np.concatenate([self._scales, *(self.scales_of(part) for part in trial.parts)])
        size, reach = np.maximum(np.abs(theta), SMALLEST * scale), np.full(len(theta), np.inf)
        # The size of a parameter with value zero is its tolerance.
        known = self.prior_precision > 0
        deviation = np.full(len(theta), np.inf)
        deviation[:count][known] = self.prior_precision[known] ** -0.5
        size[:count][known] = np.maximum(size[:count], deviation[:count])[known]
        for k, coordinate in enumerate((c for part in trial.parts for c in part.coordinates), count):
            if coordinate.of_unit_size:
                size[k] = scale[k] = 1.0
            reach[k] = coordinate.reach
        precision, centre = np.zeros((len(theta), len(theta))), np.append(self.declared, zeros)
        precision[:count, :count] = self.problem.prior_information / tempering
        least = np.full(len(theta), -np.inf)
        least[:count] = np.where([s in self.problem.levels for s in self.refitted_symbols], 0.0, -np.inf)
        return Prior(precision, deviation, centre, size, reach, least, tempering, self.within, scale)

    @cached_property
    def _scales(self) -> Array:
        """(p,) scales of ``refitted_symbols``: the larger of declared value and tolerance.

        Where both are 0, the value at which the force of the parameter is as large as the drive force.
        """
        known = self.prior_precision > 0
        scales = np.abs(self.declared)
        scales[known] = np.maximum(scales[known], self.prior_precision[known] ** -0.5)
        for k in np.flatnonzero(scales == 0):
            slope = residual_slopes(self.system, self.motion, [self.refitted_symbols[k]])[self.motion.usable, :, 0]
            here = np.sqrt(np.mean(slope**2, axis=0))
            acting = here > 0
            scales[k] = np.min(self._forces[acting] / here[acting], initial=np.inf)
        return np.where(np.isfinite(scales), scales, 1.0)  # a value without any influence

    @identity_cache(PARTS)
    def scales_of(self, part: Part) -> Array:
        """Scales of the parameters of an effect, by their units (``size_by_unit``); of a curved coordinate unused."""
        motion, i = self.motion, part.effect.coordinate(self.system, part.place)
        command = motion.commands[:, part.place] if part.effect.sits_on == "input" else np.zeros(1)
        covered = (
            self._forces[i],
            _or_one(np.ptp(motion.positions[:, i]) / 2),
            _or_one(np.quantile(np.abs(motion.velocities[:, i]), 0.95)),
            _or_one(np.abs(command).max()),
        )
        return np.array([size_by_unit(p.unit, *map(float, covered)) for p in part.effect.parameters])

    @cached_property
    def _forces(self) -> Array:
        """(n,) RMS drive force; of a coordinate without drive that of its inertia."""
        motion, usable = self.motion, self.motion.usable
        forces = np.sqrt(np.mean(drive_force(self.system, motion)[usable] ** 2, axis=0))
        for i in np.flatnonzero(forces == 0):
            inertial = inertia_along(self.system, motion, int(i)) * motion.accelerations[:, i]
            forces[i] = _or_one(np.sqrt(np.mean(inertial[usable] ** 2)))
        return np.asarray(forces)

    def runners(self, trials: Sequence[Trial], at_once: bool = True) -> list[Runner]:
        """Free-run simulators of trials, in order; trials with the same equations share one compiled library.

        Args:
            at_once: whether the compiler starts now; otherwise it starts at the first run.
        """
        lacking: dict[int, dict[Hashable, Trial]] = {}
        keys = []
        for trial in trials:
            loads = len(trial.changed.transmissions)
            keys.append((self.rigid is None, loads, trial.free, terms_of(trial.changed), has_bristles(trial.changed)))
            if keys[-1] not in self.compiled:
                lacking.setdefault(loads, {}).setdefault(keys[-1], trial)
        jumps = any(level_jumps(trial.changed) for group in lacking.values() for trial in group.values())
        for loads, group in lacking.items():  # a library for each: loads make every run of a library slower by half
            parts = 2 if self.rigid is None and len(group) >= COMPILED_APART else 1
            for some in (dict(list(group.items())[k::parts]) for k in range(parts)):
                systems, free = [t.changed for t in some.values()], [t.free for t in some.values()]
                if self.rigid:
                    shooter: Shooter | JointShooter = JointShooter(
                        systems, free, self.rigid, self.memory, loads, jumps, at_once
                    )
                else:
                    shooter = Shooter(systems, free, loads, jumps=jumps, at_once=at_once)
                self.compiled.update({key: (shooter, model) for model, key in enumerate(some)})
        found = [self.compiled[key] for key in keys]
        return [Runner(trial, *place, self.record, self.substeps) for trial, place in zip(trials, found, strict=True)]


def _or_one(value: float) -> float:
    """A size; 1 for that of what does not occur."""
    return float(value) if value > 0 else 1.0


def tolerances_away(search: Search, values: Array) -> Array:
    """(p,) distance of values of ``refitted_symbols`` from the declared ones, in tolerances; 0 for a friction level."""
    return np.asarray(np.abs(values - search.declared) * np.sqrt(search.prior_precision))


def has_turned(search: Search, values: Array) -> NDArray[np.bool_]:
    """(p,) values whose sign differs from the declared one although zero is more than one tolerance away."""
    excluded = np.abs(search.declared) * np.sqrt(search.prior_precision) > 1
    return np.asarray(excluded & (values * search.declared < 0))


def _noise_ratios(fit: Fit) -> Array:
    """``noise_ratio`` of a fit, (); of an arm that is simulated joint by joint that of each joint, (n,)."""
    joints = fit.runner.record.joints
    if joints is None:
        return np.array(noise_ratio(fit))
    ratios = np.ones(len(fit.runner.record.noise))
    ratios[list(joints)] = [noise_ratio(fit.of_joint(joint)) for joint in joints]
    return ratios


def search_on(problem: Problem, shorter: Callable[[float], Record]) -> Search:
    """A search whose fits estimate friction levels freely and toleranced parameters with a prior.

    Of an arm that is simulated joint by joint, only joints that move are compared. One that always stands still has no
    residual under any model, so that a median over all joints would be far below the error of those that move.
    """
    system = problem.system
    joints = _moving(problem) if is_separable(system) else None
    rigid = rigid_terms(system, problem.refitted_symbols) if joints else None

    def records(share: float) -> Record:
        return replace(shorter(share), joints=joints)

    return Search(problem, records(1.0), records, rigid=rigid)


def _moving(problem: Problem) -> tuple[int, ...]:
    """Indices of the coordinates that do not always stand still; all of them if none moves."""
    moving = problem.used.any(axis=0)
    return tuple(map(int, np.flatnonzero(moving if moving.any() else ~moving)))


def joint_of(search: Search, part: Part) -> int | None:
    """Index of the joint on which an effect acts, the first of two; None of a machine that is simulated as a whole."""
    return part.effect.coordinate(search.system, part.place) if search.rigid else None


def where_they_differ(search: Search, one: Fit, other: Fit) -> tuple[Fit, Fit]:
    """Two fits on the joint on which their effects differ; as they are where that is not one joint alone."""
    joint = joint_of_difference(search, one, other)
    return (one, other) if joint is None else (one.of_joint(joint), other.of_joint(joint))


def joint_of_difference(search: Search, one: Fit, other: Fit) -> int | None:
    """The joint on which the effects of two fits differ; None where that is not one joint alone."""
    if search.rigid is None:
        return None
    effects = [{(p.kind, p.on, p.names): p for p in fit.trial.parts} for fit in (one, other)]
    differing = [p for own, known in (effects, effects[::-1]) for key, p in own.items() if key not in known]
    joints = {joint_of(search, p) for p in differing}
    is_one = len(joints) == 1 and not any(p.effect.sits_on == "two coordinates" for p in differing)
    return joints.pop() if is_one else None
