"""Fits of models to the force residual by nonlinear least squares, and free runs with the effects of such a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.acting_joint import joint_of_difference
from codegen.diagnosis.fit.credit import SIGNED
from codegen.diagnosis.fit.force_rows import residual_slopes
from codegen.diagnosis.fit.output_error import Fit, damped_step, polish, segment_cost, segment_weights, shooting_fit
from codegen.diagnosis.fit.recent import recent
from codegen.diagnosis.fit.residual import (
    BODIES,
    Problem,
    ResidualAlong,
    drive_gain,
    drive_left,
    drive_symbols,
    inverse_dynamics_residual,
    moves_measurement,
)
from codegen.diagnosis.fit.search import ROUNDS, Search
from codegen.diagnosis.fit.starting_values import STEP
from codegen.diagnosis.fit.trial import Trial, model_of
from codegen.diagnosis.selection.candidate_fits import CandidateFits, every_part
from codegen.diagnosis.selection.ranking import CLOSE
from codegen.diagnosis.verdict.adoption import adopt_values

LEVEL = 10.0
"""RMS to which the residual of the model without effects is scaled: far above 1, where the loss of a block is
logarithmic, so that each block counts by the ratio of its residuals."""
FIXED = 1e-9
"""Prior deviation, in sizes of a parameter, of the values of effects that are fixed in free runs."""
STEPS, DAMPED = 5, 4
"""Most Gauss–Newton steps, and most attempts at one step with increasing damping."""


@dataclass(frozen=True, eq=False)
class ForceFits:
    """Fits of models to the low-passed force residual, with the log in ``SIGNED`` blocks in place of segments.

    Attributes:
        search: gives the prior of parameters with a tolerance. problem: the declared system on the log's motion.
        base: the refit by free runs, which gives the start states.
    """

    search: Search
    problem: Problem
    base: Fit
    _along: dict[Trial, ResidualAlong] = field(default_factory=dict)

    @cached_property
    def _rows(self) -> list[NDArray[np.int_]]:
        """Samples used, for each coordinate: away from standstill, two in each period of the cutoff."""
        motion = self.problem.motion
        every = max(1, round(1 / (2 * motion.cutoff_hz * motion.sample_time)))
        return [np.flatnonzero(used)[::every] for used in self.problem.used.T]

    @cached_property
    def _sizes(self) -> list[float]:
        """Scale of the residual, for each coordinate: that of the model without effects becomes ``LEVEL``."""
        residual = self._forces(self.search.declared_trial, self.adopted)
        sizes = [
            float(np.sqrt(np.mean(r[k] ** 2))) if len(k) else 1.0 for r, k in zip(residual.T, self._rows, strict=True)
        ]
        return [max(size, 1e-300) / LEVEL for size in sizes]

    @cached_property
    def candidates(self) -> CandidateFits:
        """All candidates: every effect at every place, with the range of its variable that the log covers."""
        return CandidateFits(self.search, self.base, tuple(every_part(self.search, ())), lambda share: None)

    @cached_property
    def adopted(self) -> Array:
        """(p,) adopted values of levels and toleranced parameters, by free runs and force residual."""
        values = adopt_values(self.search, self.base, self.problem, self.search.system)
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

    def _forces(self, trial: Trial, theta: Array) -> Array:
        """The residual divided by the drive gain of the values, since a weaker drive makes every force smaller.

        It is linear in the parameters of an arm's links. So the arm's bodies are evaluated at their declared values.
        """
        motion, at, added = self.problem.motion, theta, np.zeros(1)
        if self.by_links and not trial.changed.transmissions and not trial.changed.sensor_errors:
            places, at = list(self.by_links), theta.copy()
            at[places] = self.search.declared[places]
            added = self._change_by_links(*map(float, (theta - at)[places]))
        if moves_measurement(trial):
            forces = inverse_dynamics_residual(model_of(trial, at), motion)
        else:
            along = self._along.get(trial) or self._along.setdefault(trial, ResidualAlong(trial, motion))
            forces = motion.low_pass(along.at(at))
        model = model_of(trial, theta)
        forces = (forces + added) / drive_left(model, motion)
        return forces / drive_gain(model, self.problem.system, motion) if self._moves_drive else forces

    @cached_property
    def _moves_drive(self) -> bool:
        """Whether a refitted parameter scales the drive force."""
        return not drive_symbols(self.problem.system).isdisjoint(self.search.moved)

    def _residual(self, trial: Trial, theta: Array) -> Array:
        """Scaled residuals of each block, (SIGNED, K); shorter blocks are padded with zeros."""
        return self._scaled(self._forces(trial, theta))

    def _scaled(self, forces: Array) -> Array:
        """Forces (N, n) at the used samples, each coordinate in units of its scale, in blocks (SIGNED, K)."""
        return self._in_blocks(
            [values[rows] / size for values, rows, size in zip(forces.T, self._rows, self._sizes, strict=True)]
        )

    def _in_blocks(self, columns: Sequence[Array]) -> Array:
        """A column of the used samples of each coordinate, in blocks (SIGNED, K)."""
        count = len(self.problem.motion.time)
        blocks: list[list[Array]] = [[] for _ in range(SIGNED)]
        for values, rows in zip(columns, self._rows, strict=True):
            edges = np.searchsorted(rows, np.linspace(0, count, SIGNED + 1)[1:-1])
            for block, part in zip(blocks, np.split(values, edges), strict=True):
                block.append(part)
        joined = [np.concatenate(block) for block in blocks]
        longest = max(map(len, joined))
        return np.array([np.pad(block, (0, longest - len(block))) for block in joined])

    def where_they_differ(self, one: Fit, other: Fit) -> tuple[Fit, Fit]:
        """Two fits to the force, restricted to the joint on which their effects differ.

        Unchanged if they differ on more than one joint, or for a machine that is simulated as a whole.
        """
        joint = joint_of_difference(self.search, one, other)
        if joint is None:
            return one, other
        here = self._in_blocks([np.full(len(rows), i == joint, dtype=float) for i, rows in enumerate(self._rows)])
        first, second = (replace(f, residual=f.residual * here, slopes=f.slopes * here) for f in (one, other))
        return first, second

    def fit(self, trial: Trial, theta: Array) -> Fit:
        """The fit from these values, by damped Gauss–Newton steps."""
        runner = self.search.runners([trial], at_once=False)[0]
        prior = self.search.prior(trial, theta)
        first, damping = theta, 1e-6
        now = self._residual(trial, theta)
        slopes = self._slopes(trial, theta, now, prior.size)
        for _ in range(STEPS):
            weighted = slopes * segment_weights(now)[:, None]
            matrix = np.einsum("ask,bsk->ab", weighted, slopes) + np.diag(prior.precision)
            right = np.einsum("ask,sk->a", weighted, now) - prior.precision * (theta - prior.centre)
            cost = segment_cost(now) + prior.cost(theta)
            for _ in range(DAMPED):
                step = damped_step(matrix, right, damping, prior.held(theta, right))
                moved = prior.clip(np.clip(theta + step, first - prior.reach, first + prior.reach))
                then = self._residual(trial, moved)
                new = segment_cost(then) + prior.cost(moved)  # NaN where it is not finite
                if new < cost:
                    break
                damping = max(damping, 1e-4) * 10
            else:
                break
            theta, now, damping = moved, then, max(damping / 10, 1e-6)
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
        symbols = () if rigid is None else rigid.parameters
        return {self.search.moved.index(s): self._slopes_by_links[:, :, k] for k, s in enumerate(symbols)}

    @cached_property
    def _slopes_by_links(self) -> Array:
        """(N, n, P) slopes of the low-passed residual by the parameters of an arm's links."""
        assert self.search.rigid is not None
        return residual_slopes(self.search.system, self.problem.motion, self.search.rigid.parameters)

    @recent(BODIES)
    def _change_by_links(self, *change: float) -> Array:
        """(N, n) change of the low-passed residual by a change of those parameters; slopes by all others keep it."""
        return np.asarray(self._slopes_by_links @ np.array(change))

    @recent(BODIES)
    def _scaled_by_links(self, *left: float) -> dict[int, Array]:
        """``by_links`` of the predicted force in blocks, for a ``drive_left``, which few effects change."""
        return {k: self._scaled(-slope / np.array(left)) for k, slope in self.by_links.items()}

    def _slopes(self, trial: Trial, theta: Array, now: Array, size: Array, before: Array | None = None) -> Array:
        """Derivatives of the predicted force by each parameter, (p, SIGNED, K).

        Forces are linear in the refitted levels and parameters, so their derivatives are taken from ``before``, unless
        the residual is divided by a drive gain that depends on them.
        """
        slopes = [] if before is None or self._moves_drive else list(before[: len(trial.moved)])
        by_links: dict[int, Array] = {}
        if not slopes and not self._moves_drive and not trial.changed.sensor_errors:
            by_links = self._scaled_by_links(*map(float, drive_left(model_of(trial, theta), self.problem.motion)))
        for k in range(len(slopes), len(theta)):
            if k in by_links:
                slopes.append(by_links[k])
                continue
            step, moved = STEP * float(size[k]), theta.copy()
            moved[k] += step
            slopes.append((now - self._residual(trial, moved)) / step)
        return np.array(slopes)

    def without(self, fit: Fit, index: int) -> Fit:
        """The fit with one of its effects removed."""
        return self.fit(*fit.trial.without(fit.theta, index))

    def run(self, fit: Fit, joint: int | None = None) -> Fit:
        """Free runs with fixed effects of a fit, and fitted levels, toleranced values and start states.

        A level or a mass by the force residual may be far off for free runs, whatever the effects.

        Args:
            joint: the simulated joint of an arm that is simulated joint by joint; all by default.
        """
        record = self.search.record if joint is None else replace(self.search.record, joints=(joint,))
        runner = replace(fit.runner, record=record)
        prior, effects = self.search.prior(fit.trial, fit.theta), slice(len(fit.trial.moved), None)
        precision, centre = prior.precision.copy(), prior.centre.copy()
        precision[effects], centre[effects] = (FIXED * prior.size[effects]) ** -2.0, fit.theta[effects]
        held = replace(prior, precision=precision, centre=centre)
        rough = shooting_fit(runner, fit.theta, record.at_rest, held, ROUNDS, final_slopes=False)
        return replace(polish(rough, ROUNDS), prior=prior)
