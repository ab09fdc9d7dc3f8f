"""Fits of models to the force residual by nonlinear least squares, and free runs with the effects of such a fit."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.adoption import adopt_values
from codegen.diagnosis.fit.acceptance import SIGN_BLOCKS
from codegen.diagnosis.fit.drive import DriveLeft, drive_gain, drive_left, drive_symbols, rubs_by_load
from codegen.diagnosis.fit.force_rows import residual_slopes
from codegen.diagnosis.fit.identity_cache import identity_cache
from codegen.diagnosis.fit.output_error import Fit, damped_step, polish, segment_cost, segment_weights, shooting_fit
from codegen.diagnosis.fit.residual import ResidualAlong, inverse_dynamics_residual, moves_sensors, unfiltered_residual
from codegen.diagnosis.fit.search import ROUNDS, ModelFits, Search, joint_of_difference
from codegen.diagnosis.fit.shooting import hidden_states
from codegen.diagnosis.fit.signals import Motion
from codegen.diagnosis.fit.starting_values import STEP
from codegen.diagnosis.fit.trial import Part, Trial, model_of
from codegen.diagnosis.selection.candidate_fits import CandidateFits, every_part
from codegen.diagnosis.selection.comparison import CLOSE
from codegen.mechanics.system import Matrix, System

LEVEL = 10.0
"""RMS to which the residual of the model without effects is scaled: far above 1, where the loss of a block is
logarithmic, so that each block counts by the ratio of its residuals."""
FIXED = 1e-9
"""Prior deviation, in sizes of a parameter, of the values of effects that are fixed in free runs."""
RUNS = 4
"""Cached free runs: the confirmation of effects runs the same fits as their selection."""
STEPS, DAMPED = 5, 4
"""Most Gauss–Newton steps, and most attempts at one step with increasing damping."""


class DriveGain:
    """``drive_gain`` of a trial's models over a system, once for all values on which the drive force depends.

    A fit takes slopes by many other parameters, with which it does not change.
    """

    def __init__(self, trial: Trial, other: System, motion: Motion) -> None:
        self._trial, self._other, self._motion = trial, other, motion
        acting, first = drive_symbols(trial.changed), len(trial.refitted_symbols)
        places = [k for k, s in enumerate(trial.refitted_symbols) if s in acting]
        for part in trial.parts:  # the values of a part are computed from its coordinates together
            own = range(first, first + len(part.names))
            places += own if acting.intersection(part.symbols) else []
            first = own.stop
        self._places = list(range(first)) if moves_sensors(trial) else places
        self._known: dict[bytes, Array] = {}

    def at(self, theta: Array) -> Array:
        """(n,) the gain with the values of ``theta``."""
        key = theta[self._places].tobytes()
        if key not in self._known:
            self._known[key] = drive_gain(model_of(self._trial, theta), self._other, self._motion)
        return self._known[key]


@dataclass(frozen=True, eq=False)
class ForceFits(ModelFits):
    """Fits of models to the low-passed force residual, with the log in ``SIGN_BLOCKS`` blocks in place of segments.

    Attributes:
        search: gives the log's motion, and the prior of parameters with a tolerance.
        base: the refit by free runs, which gives the start states.
    """

    search: Search
    base: Fit
    _along: dict[Trial, ResidualAlong] = field(default_factory=dict)
    _left: dict[Trial, DriveLeft] = field(default_factory=dict)
    _drives: dict[Trial, DriveGain] = field(default_factory=dict)

    @cached_property
    def _rows(self) -> list[NDArray[np.int_]]:
        """Samples used, for each coordinate: away from standstill, two in each period of the cutoff."""
        motion = self.search.motion
        every = max(1, round(1 / (2 * motion.cutoff_hz * motion.sample_time)))
        return [np.flatnonzero(used)[::every] for used in self.search.problem.used.T]

    @cached_property
    def _sizes(self) -> list[float]:
        """Scale of the residual, for each coordinate: that of the model without effects becomes ``LEVEL``."""
        trial, theta = self.search.declared_trial, self.adopted
        residual = inverse_dynamics_residual(model_of(trial, theta), self.search.motion) / self._gain(trial, theta)
        sizes = [
            float(np.sqrt(np.mean(r[k] ** 2))) if len(k) else 1.0 for r, k in zip(residual.T, self._rows, strict=True)
        ]
        return [max(size, 1e-300) / LEVEL for size in sizes]

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """Every effect at every place: the hypotheses among which the candidates are."""
        return tuple(every_part(self.search, ()))

    @cached_property
    def candidates(self) -> CandidateFits:
        """The candidates, with the range of the variable of each that the log covers.

        Every effect at every place, but those on joints with less than ``LEAST_EXCESS`` of the worst joint's misfit.
        """
        return CandidateFits(self.search, self.base, self.parts)

    @cached_property
    def adopted(self) -> Array:
        """(p,) adopted values of levels and toleranced parameters, by free runs and force residual."""
        values = adopt_values(self.search, self.base, self.search.system)
        return np.array(values.values, dtype=float)

    @cached_property
    def plain(self) -> Fit:
        """The fit of the model without effects."""
        return self.fit(self.search.declared_trial, self.adopted)

    def nearly_alike(self, one: Fit, best: Fit) -> bool:
        """Whether two fits differ little in both the remaining and the removed squared residual.

        A long log shows any difference between two slightly wrong models. Then it does not show which effect acts, but
        which one also imitates part of what neither describes.
        """
        plain, less, most = (float(fit.by_segment.sum()) for fit in (self.plain, one, best))
        return less <= CLOSE * most and plain - most <= CLOSE * (plain - less)

    def _residual(self, trial: Trial, theta: Array) -> Array:
        """Scaled residuals of each block, (SIGN_BLOCKS, K), over the drive gain."""
        return next(self._residuals(trial, [theta]))

    def _residuals(self, trial: Trial, thetas: Sequence[Array]) -> Iterator[Array]:
        """``_residual`` with several values, which take less time together if states are not logged."""
        motion, found = self.search.motion, [theta.copy() for theta in thetas]
        linear = not trial.changed.transmissions and not trial.changed.sensor_errors
        places = list(self.by_links) if linear else []
        for at in found:
            at[places] = self.search.declared[places]
        if moves_sensors(trial):
            unfiltered: Iterator[Array] = (unfiltered_residual(model_of(trial, at), motion) for at in found)
        else:
            along = self._along.get(trial) or self._along.setdefault(trial, ResidualAlong(trial, motion))
            unfiltered = along.several(found)
        for theta, at, forces in zip(thetas, found, unfiltered, strict=True):
            # The slopes by an arm's links are of the residual without these factors.
            relative = None if places or moves_sensors(trial) else self._left_of(trial).relative(theta)
            scaled = self._scaled(motion.low_pass(forces if relative is None else forces / relative))
            if places:
                scaled = scaled + np.tensordot((theta - at)[places], self._scaled_by_links, axes=1)
            yield scaled * self._by_coordinate(1 / self._gain(trial, theta))

    def _gain(self, trial: Trial, theta: Array) -> Array:
        """(n,) share of the drive force that is left with these values, times the drive gain."""
        motion = self.search.motion
        moved = moves_sensors(trial)
        left = drive_left(model_of(trial, theta), motion) if moved else self._left_of(trial).at(theta)
        if not self._moves_drive:
            return left
        drive = self._drives.get(trial) or self._drives.setdefault(trial, DriveGain(trial, self.search.system, motion))
        return left * drive.at(theta)

    def _left_of(self, trial: Trial) -> DriveLeft:
        return self._left.get(trial) or self._left.setdefault(trial, DriveLeft(trial, self.search.motion))

    @cached_property
    def _moves_drive(self) -> bool:
        """Whether a refitted parameter scales the drive force."""
        return not drive_symbols(self.search.system).isdisjoint(self.search.refitted_symbols)

    def _scaled(self, forces: Array) -> Array:
        """Forces (N, n) at the used samples, each coordinate in units of its scale, in blocks (SIGN_BLOCKS, K)."""
        return self._in_blocks(
            [values[rows] / size for values, rows, size in zip(forces.T, self._rows, self._sizes, strict=True)]
        )

    def _in_blocks(self, columns: Sequence[Array]) -> Array:
        """A column of the used samples of each coordinate, in blocks (SIGN_BLOCKS, K), padded with zeros."""
        return np.append(np.concatenate(columns), 0.0)[self._places]

    @cached_property
    def _places(self) -> NDArray[np.int_]:
        """(SIGN_BLOCKS, K) indices of each block's values in the joined columns; past their end where padded."""
        edges = np.linspace(0, len(self.search.motion.time), SIGN_BLOCKS + 1)[1:-1]
        block = np.concatenate([np.searchsorted(edges, rows, side="right") for rows in self._rows])
        parts = [np.flatnonzero(block == k) for k in range(SIGN_BLOCKS)]
        longest = max(map(len, parts))
        return np.array([np.pad(p, (0, longest - len(p)), constant_values=len(block)) for p in parts])

    def _by_coordinate(self, values: NDArray[Any]) -> Array:
        """One value of each coordinate, (n,), at its used samples in blocks (SIGN_BLOCKS, K)."""
        return self._in_blocks([np.full(len(r), v, dtype=float) for r, v in zip(self._rows, values, strict=True)])

    def where_they_differ(self, one: Fit, other: Fit) -> tuple[Fit, Fit]:
        """Two fits to the force, restricted to the joint on which their effects differ.

        Unchanged if they differ on more than one joint, or for a machine that is simulated as a whole.
        """
        joint = joint_of_difference(self.search, one, other)
        if joint is None:
            return one, other
        here = self._by_coordinate(np.arange(len(self._rows)) == joint)
        first, second = (replace(f, residual=f.residual * here, slopes=f.slopes * here) for f in (one, other))
        return first, second

    def fit(self, trial: Trial, theta: Array) -> Fit:
        """The fit from these values, by damped Gauss–Newton steps."""
        runner = self.search.runners([trial], at_once=False)[0]
        prior = self.search.prior(trial, theta)
        first, damping, gain = theta, 1e-6, self._gain(trial, theta)
        now = self._residual(trial, theta)
        slopes = self._slopes(trial, theta, now, prior.size)
        for _ in range(STEPS):
            weighted = slopes * segment_weights(now)[:, None]
            matrix = np.einsum("ask,bsk->ab", weighted, slopes) + prior.precision
            right = np.einsum("ask,sk->a", weighted, now) - prior.slope(theta)
            cost = segment_cost(now) + prior.cost(theta)
            for _ in range(DAMPED):
                step = damped_step(matrix, right, damping, prior.blocked(theta, right))
                moved = prior.clip(np.clip(theta + step, first - prior.reach, first + prior.reach))
                then = self._residual(trial, moved)
                new = segment_cost(then) + prior.cost(moved)  # NaN where it is not finite
                if new < cost:
                    break
                damping = max(damping, 1e-4) * 10
            else:
                break
            theta, now, damping = moved, then, max(damping / 10, 1e-6)
            was, gain = gain, self._gain(trial, theta)
            slopes = slopes * self._by_coordinate(was / gain) if np.any(was != gain) else slopes
            slopes = self._slopes(trial, theta, now, prior.size, slopes)
            if cost - new < 1e-2 + 1e-4 * cost:
                break
        at = self.base.offsets, now, now, slopes, self.base.starts
        return Fit(runner, theta, *at, prior, prior.limited(theta, theta), of_forces=True)

    @cached_property
    def by_links(self) -> dict[int, Array]:
        """Index of a value that is a parameter of an arm's links → (N, n) slope of the low-passed residual.

        The residual is linear in these, and effects change nothing of it. An arm of seven joints has 43, each of which
        would otherwise take a residual of the whole arm in every fit.
        """
        rigid = self.search.rigid
        if rigid is None or not rigid.parameters:
            return {}
        slopes = residual_slopes(self.search.system, self.search.motion, rigid.parameters)
        return {self.search.refitted_symbols.index(s): slopes[:, :, k] for k, s in enumerate(rigid.parameters)}

    @cached_property
    def _scaled_by_links(self) -> Array:
        """(P, SIGN_BLOCKS, K) slopes of the scaled residual by the parameters of an arm's links."""
        return np.array([self._scaled(slope) for slope in self.by_links.values()])

    @cached_property
    def _scaled_by_others(self) -> dict[int, Array]:
        """As ``_scaled_by_links``, by the other values in which the declared forces are linear."""
        system, symbols = self.search.system, self.search.refitted_symbols
        error = Matrix(system.equation_error)
        others = [k for k, s in enumerate(symbols) if k not in self.by_links and error.has(s)]
        linear = [k for k in others if error.diff(symbols[k]).free_symbols.isdisjoint({*symbols, *system.inputs})]
        if not linear or hidden_states(system):
            return {}
        found = residual_slopes(system, self.search.motion, [symbols[k] for k in linear])
        return {k: self._scaled(found[:, :, j]) for j, k in enumerate(linear)}

    def _known(self, trial: Trial) -> dict[int, Array]:
        """Index of a value → (SIGN_BLOCKS, K) slope of the scaled residual by it, if the effects do not change it."""
        if trial.changed.sensor_errors:
            return {}
        known = dict(zip(self.by_links, self._scaled_by_links, strict=True))
        if hidden_states(trial.changed) or self._left_of(trial).follows_load:
            return known
        pairs = zip(trial.changed.equation_error, self.search.system.equation_error, strict=True)
        added = [sympy.expand_mul(one - other) for one, other in pairs if one != other]
        changed = set().union(*(force.free_symbols for force in added))
        return known | {
            k: s for k, s in self._scaled_by_others.items() if self.search.refitted_symbols[k] not in changed
        }

    def _slopes(self, trial: Trial, theta: Array, now: Array, size: Array, before: Array | None = None) -> Array:
        """Derivatives of the predicted force by each parameter, (p, SIGN_BLOCKS, K).

        Forces are linear in the refitted levels and parameters, so their derivatives are taken from ``before``, which
        is over the present ``_gain``, unless that depends on them.
        """
        fixed = before is not None and not self._moves_drive and not rubs_by_load(trial.changed)
        slopes = dict(enumerate(before[: len(trial.refitted_symbols)])) if before is not None and fixed else {}
        steps, moved = STEP * size, theta + np.diag(STEP * size)
        if not slopes:  # those known are by values on which the gain does not depend
            over = self._by_coordinate(1 / self._gain(trial, theta))
            slopes = {k: -slope * over for k, slope in self._known(trial).items()}
        lacking = [k for k in range(len(theta)) if k not in slopes]
        for k, other in zip(lacking, self._residuals(trial, list(moved[lacking])), strict=True):
            slopes[k] = (now - other) / steps[k]
        return np.array([slopes[k] for k in range(len(theta))])

    def begun_by(self, fit: Fit, trial: Trial, theta: Array) -> Fit:
        return self.fit(trial, theta)

    @identity_cache(RUNS)
    def run(self, fit: Fit, joint: int | None = None) -> Fit:
        """Free runs with fixed effects of a fit, and fitted levels, toleranced values and start states.

        A level or a mass by the force residual may be far off for free runs, whatever the effects.

        Args:
            joint: the simulated joint of an arm that is simulated joint by joint; all by default.
        """
        record = self.search.record if joint is None else replace(self.search.record, joints=(joint,))
        runner = replace(fit.runner, record=record)
        prior, effects = self.search.prior(fit.trial, fit.theta), slice(len(fit.trial.refitted_symbols), None)
        fixed, centre = np.zeros(len(fit.theta)), prior.centre.copy()
        fixed[effects], centre[effects] = (FIXED * prior.size[effects]) ** -2.0, fit.theta[effects]
        held = replace(prior, precision=prior.precision + np.diag(fixed), centre=centre)
        rough = shooting_fit(runner, fit.theta, record.at_rest, held, ROUNDS, final_slopes=False)
        return replace(polish(rough, ROUNDS), prior=prior)
