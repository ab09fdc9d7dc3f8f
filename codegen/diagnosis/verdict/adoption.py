"""Adoption of refitted parameter values, by cross-validation on blocks of the training log.

Free-run simulations alone are biased on a real machine: an unmodelled force acts like noise on the input and increases
the inertia estimate. So the values are estimated from three tempered likelihoods (free runs, force residual, both),
with the tolerances as Gaussian prior. Each estimate is repeated without each block of the log, and its errors on that
block by force residual and by free run are compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from codegen.base.arrays import Array, Flags
from codegen.diagnosis.evidence.estimate import CONFIDENCE, estimate
from codegen.diagnosis.fit.credit import independent_share
from codegen.diagnosis.fit.force_rows import ForceRows, independent_samples, relative_force_rows, residual_sizes
from codegen.diagnosis.fit.linear import rms, solved
from codegen.diagnosis.fit.output_error import (
    BLOCKS,
    Fit,
    mean_residuals,
    segment_losses,
    segment_weights,
    shooting_fit,
)
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.trial import in_unit
from codegen.diagnosis.results import Fact, ParameterError
from codegen.mechanics.system import System

LINEARISED = 4
"""Repeated linearisations of the force residual about its own estimate."""
SAME = 0.01
"""Relative change of an error that is ignored."""
DOUBTFUL = 2.0
"""Deviation in tolerances above which a value alone must improve both criteria by more than ``SAME``."""
AWAY = 3.0
"""Deviation in tolerances above which a value is reported as a parameter error; 0.3 % of a Gaussian lies beyond."""
ALIKE = 0.25
"""Least increase of another parameter's deviation, if a parameter is fixed, at which it counts as a substitute, over
the parameter's deviation."""
AGAIN, SETTLED = 5, 0.1
"""Most fits about values beyond a limit, and the change in standard errors at which they have settled."""
HALF_WIDTH = float(norm.ppf(0.5 + CONFIDENCE / 2))


@dataclass(frozen=True, eq=False)
class Information:
    """Quadratic log-likelihood ½ θ'Mθ − m'θ of the refitted values, by block: (BLOCKS, p, p) and (BLOCKS, p)."""

    matrix: Array
    vector: Array

    def __add__(self, other: Information) -> Information:
        return Information(self.matrix + other.matrix, self.vector + other.vector)


@dataclass(frozen=True)
class Score:
    """Cross-validated errors: each block with the values that were estimated without it.

    (BLOCKS,) squared force residual over the declared model's, and loss of free runs, of ``count`` residuals.
    """

    force: Array
    run: Array
    count: int

    def over(self, other: Score) -> tuple[float, float]:
        """(force error, free-run error) relative to another model's."""
        force = float(np.sqrt(self.force.sum() / max(other.force.sum(), 1e-300)))
        return force, float(np.exp((self.run.sum() - other.run.sum()) / self.count))


@dataclass(frozen=True, eq=False)
class MapEstimate:
    """Maximum a posteriori estimate (p,) from one likelihood, its standard errors, and which values are estimated."""

    values: Array
    deviation: Array
    moves: Flags
    source: Information
    score: Score


@dataclass(frozen=True, eq=False)
class Refit:
    """The adopted values of a refit.

    Attributes:
        deviation: (p,) standard errors of the values.
        levels: (p,) the best values if only levels are refitted.
        errors: parameters that differ from their declared values by more than their tolerance explains.
        notes: changes by free runs alone that are not adopted.
    """

    names: tuple[str, ...]
    declared: Array
    values: Array
    deviation: Array
    levels: Array
    errors: tuple[ParameterError, ...]
    notes: tuple[Fact, ...]

    def mapping(self, values: Array | None = None) -> dict[str, float]:
        return dict(zip(self.names, map(float, self.values if values is None else values), strict=True))


def adopt_values(search: Search, fit: Fit, problem: Problem, system: System) -> Refit:
    """Choose the values of levels and toleranced parameters for a fit; ``system`` has its effects, which are fixed."""
    return CrossValidation(search, fit, problem, system).adopted()


def settled_values(search: Search, fit: Fit, problem: Problem, system: System) -> Refit:
    """The values of ``adopt_values``, estimated again at themselves if one exceeds a limit of the fit.

    A motion is not linear in a mass over such a distance, and the residual of a wrong mass gave the tolerances too much
    weight.
    """
    adopted = adopt_values(search, fit, problem, system)
    away = np.abs(adopted.values - adopted.declared) * np.sqrt(search.prior_precision)
    if not (away > search.within).any() or not fit.limited[: len(search.moved)].any():
        return adopted
    free = replace(search, within=np.inf)
    for _ in range(AGAIN):
        theta = np.append(adopted.values, fit.theta[len(adopted.values) :])
        prior = free.prior(fit.trial, theta, fit.prior.tempering)
        fit = free.fitted_again(shooting_fit(fit.runner, theta, fit.offsets, prior, 0))
        before, adopted = adopted, adopt_values(free, fit, problem, system)
        if np.all(np.abs(adopted.values - before.values) <= SETTLED * adopted.deviation):
            break
    return adopted


@dataclass(frozen=True, eq=False)
class CrossValidation:
    """Estimates of the refitted values, compared by cross-validated force and free-run errors, for one set of effects.

    Attributes:
        fit: its effects are fixed.
        system: declared values with those effects.
    """

    search: Search
    fit: Fit
    problem: Problem
    system: System

    def adopted(self) -> Refit:
        """The best values: first of levels, then of all, without unjustified changes."""
        shown_levels = self.is_level & self.is_shown
        levels = self.best([self.unmoved, *(self.map_estimate(s, shown_levels) for s in self.sources)])
        chosen = levels
        if not self.is_level.all():
            chosen = self.best([levels, *(self.map_estimate(s, self.is_shown) for s in self.sources)])
        justified, errors = self.justified(chosen)
        if justified is not chosen:  # the remaining changes may be no improvement
            chosen = self.best([levels, justified])
            errors = errors if chosen is justified else ()
        names, notes = tuple(s.name for s in self.search.moved), tuple(self.refused(chosen))
        return Refit(names, self.search.declared, chosen.values, chosen.deviation, levels.values, errors, notes)

    @property
    def count(self) -> int:
        return len(self.search.moved)

    @property
    def is_level(self) -> Flags:
        return np.asarray(self.search.prior_precision == 0)

    @cached_property
    def is_shown(self) -> Flags:
        """(p,) values in the force balance of a coordinate that moves; all if none moves.

        Free runs of a joint that stands still stick with any friction level above its load.
        """
        error = self.search.system.equation_error
        rows = [row for row, used in zip(error, self.problem.used.T, strict=True) if used.any()]
        return np.array([not rows or any(row.has(s) for row in rows) for s in self.search.moved], dtype=bool)

    @cached_property
    def here(self) -> Fit:
        """The fit on the search's record, evaluated without a step, with the noise floor of the comparison."""
        soft = self.search.with_noise_floor(self.fit)[0]
        runner = replace(self.fit.runner, record=soft.record)
        theta, offsets = self.fit.theta, self.fit.offsets
        prior = replace(self.fit.prior, size=np.maximum(np.abs(theta), 1e-3), within=self.search.within)
        return shooting_fit(runner, theta, offsets, prior, 0)

    @cached_property
    def sources(self) -> list[Information]:
        return [self._by_run, self._by_force, self._by_run + self._by_force]

    @cached_property
    def unmoved(self) -> MapEstimate:
        nothing = Information(np.zeros((BLOCKS, self.count, self.count)), np.zeros((BLOCKS, self.count)))
        return self.map_estimate(nothing, np.zeros(self.count, dtype=bool))

    def map_estimate(self, source: Information, moves: Flags) -> MapEstimate:
        """The MAP estimate by one likelihood with only the values ``moves`` free, and its cross-validated score."""
        values = self._solved(source.matrix.sum(axis=0), source.vector.sum(axis=0), moves)
        without = [
            self._solved(np.delete(source.matrix, k, 0).sum(axis=0), np.delete(source.vector, k, 0).sum(axis=0), moves)
            for k in range(BLOCKS)
        ]
        deviation = self._deviation(source, moves, self.search.prior_precision)
        return MapEstimate(values, deviation, moves, source, self._score(values, without))

    def _deviation(self, source: Information, moves: Flags, prior_precision: Array) -> Array:
        """(p,) standard errors of the values that move."""
        deviation = np.zeros(self.count)
        matrix = (source.matrix.sum(axis=0) + np.diag(prior_precision))[np.ix_(moves, moves)]
        if moves.any():
            deviation[moves] = np.sqrt(np.maximum(np.diag(np.linalg.pinv(matrix, hermitian=True)), 0.0))
        return deviation

    def best(self, estimates: Sequence[MapEstimate]) -> MapEstimate:
        """The estimate with the least product of both errors, among those no worse than the first in either error."""
        fair = [w for w in estimates if all(r <= 1 + SAME for r in w.score.over(estimates[0].score))]
        best = estimates[0]
        for chosen in fair:
            best = chosen if np.prod(chosen.score.over(best.score)) < 1 - SAME else best
        return best

    def distance(self, chosen: MapEstimate) -> Array:
        """(p,) deviation from the declared values in tolerances; zero for friction levels."""
        return np.asarray(np.abs(chosen.values - self.search.declared) * np.sqrt(self.search.prior_precision))

    def justified(self, chosen: MapEstimate) -> tuple[MapEstimate, tuple[ParameterError, ...]]:
        """The estimate without deviations beyond ``DOUBTFUL`` that do not improve both criteria; parameter errors.

        Nor with a sign that a tolerance of less than the declared value excludes, as of an inertia below zero.
        """
        while True:
            far, errors = self.distance(chosen), []
            turned = self._has_turned(chosen)
            for k in (int(k) for k in np.lexsort((far, ~turned)) if far[k] > DOUBTFUL or turned[k]):
                group, fixed = self._with_declared(chosen, k)
                if turned[k] or not all(r < 1 - SAME for r in chosen.score.over(fixed.score)):
                    chosen = fixed
                    break
                if far[k] > AWAY:
                    errors.append(self._error(chosen, fixed, k, [j for j in group if j != k]))
            else:
                return chosen, tuple(errors)

    def _has_turned(self, chosen: MapEstimate) -> Flags:
        """(p,) values with another sign than declared where the tolerance does not reach to zero."""
        declared = self.search.declared
        excluded = np.abs(declared) * np.sqrt(self.search.prior_precision) > 1
        return np.asarray(excluded & (chosen.values * declared < 0))

    def _with_declared(self, chosen: MapEstimate, k: int) -> tuple[list[int], MapEstimate]:
        """The estimate with parameter ``k`` and those that would change in its place as declared; their indices."""
        far, moves = self.distance(chosen), chosen.moves.copy()
        moves[k] = False
        alone = self.map_estimate(chosen.source, moves)
        others = self.distance(alone) > far + ALIKE * far[k]
        if not others.any():
            return [k], alone
        moves &= ~others
        return [k, *(int(j) for j in np.flatnonzero(others))], self.map_estimate(chosen.source, moves)

    def refused(self, adopted: MapEstimate) -> list[Fact]:
        """Facts on deviations beyond ``DOUBTFUL`` by free runs alone that are not adopted."""
        kept = self.distance(adopted)
        alone = self.map_estimate(self._by_run, np.ones(self.count, dtype=bool))
        far, turned, facts = self.distance(alone), self._has_turned(alone), []
        for k in np.flatnonzero((far > DOUBTFUL) & (kept <= DOUBTFUL)):
            s, taken = self.search.moved[k], f"{adopted.values[k]:.4g}"
            declared, unit = f"{self.search.declared[k]:.4g}", in_unit(self.search.system, s)
            why = "but not both errors fall with that"
            if turned[k]:
                why = "with the other sign, which the tolerance excludes: check the polarity, or the other values"
            facts.append(
                Fact(
                    "spec.yaml",
                    f"{s.name} {'stays at' if taken == declared else 'becomes'} {taken}{unit}. Simulation alone would "
                    f"make it {alone.values[k]:.4g}{unit} ({far[k]:.2g} tolerances from {declared}), {why}",
                    "Both errors: residual force and simulation error on held-out parts of the training log.",
                )
            )
        return facts

    def _error(self, chosen: MapEstimate, fixed: MapEstimate, k: int, others: Sequence[int]) -> ParameterError:
        force, run = chosen.score.over(fixed.score)
        symbol, declared = self.search.moved[k], float(self.search.declared[k])
        return ParameterError(
            name=symbol.name,
            unit=str(self.search.system.units.get(symbol, "1")),
            declared=declared,
            tolerance=float(self.search.prior_precision[k] ** -0.5 / abs(declared)) if declared else float("nan"),
            estimate=float(chosen.values[k]),
            interval=self._interval(chosen, k),
            away=float(self.distance(chosen)[k]),
            alike=tuple(self.search.moved[j].name for j in others),
            force=force,
            free_run=run,
            blocks_by_force=int((chosen.score.force < fixed.score.force).sum()),
            blocks_by_free_run=int((chosen.score.run < fixed.score.run).sum()),
            blocks=BLOCKS,
        )

    def _interval(self, chosen: MapEstimate, k: int) -> tuple[float, float]:
        """95 % interval of a wrong value: the hull of those with and without its tolerance as prior.

        Neither is narrower than by the sandwich covariance of the fit, which is also valid with model errors.
        """
        without = self.search.prior_precision.copy()
        without[k] = 0.0
        matrix, vector = chosen.source.matrix.sum(axis=0), chosen.source.vector.sum(axis=0)
        free = self._solved(matrix, vector, chosen.moves, without)
        wide = self._deviation(chosen.source, chosen.moves, without)
        least = self._sandwich[k]
        ends = [
            float(values[k]) + sign * max(HALF_WIDTH * float(deviation[k]), least)
            for values, deviation in ((chosen.values, chosen.deviation), (free, wide))
            for sign in (-1, 1)
        ]
        return min(ends), max(ends)

    @cached_property
    def _sandwich(self) -> list[float]:
        """Half the interval of each value by the sandwich covariance of the fit."""
        found = estimate(self.here).moved
        return [0.5 * (found[s.name][1][1] - found[s.name][1][0]) for s in self.search.moved]

    def _solved(self, matrix: Array, vector: Array, moves: Flags, prior: Array | None = None) -> Array:
        """(p,) values of the least quadratic loss with a prior, by default that of the tolerances."""
        values = self.search.declared.copy()
        if moves.any():
            prior_precision = (self.search.prior_precision if prior is None else prior)[moves]
            inner = matrix[np.ix_(moves, moves)] + np.diag(prior_precision)
            fixed = matrix[np.ix_(moves, ~moves)] @ values[~moves]
            right = vector[moves] - fixed + prior_precision * self.search.declared[moves]
            values[moves] = solved(inner, right)
        return values

    def _score(self, values: Array, without: Sequence[Array]) -> Score:
        force = np.zeros(BLOCKS)
        for block, one in enumerate(without):
            change = one - self.search.declared
            for rows, size, places in zip(self._rows, self._sizes, self._blocks, strict=True):
                residual = rows.about(change).residual[places == block]
                force[block] += float((residual**2).sum()) / size**2
        theta = np.concatenate([values, self.here.theta[self.count :]])
        runner = self.here.runner
        left = self.here.starts.project(mean_residuals(runner, runner.run(theta, self.here.offsets)))
        run = np.zeros(BLOCKS)
        for block, segments in enumerate(np.array_split(np.arange(len(left)), BLOCKS)):
            moved = np.tensordot(without[block] - values, self.here.slopes[: self.count, segments], axes=1)
            run[block] = float(segment_losses(left[segments] - moved).sum())
        return Score(force, run, left.size)

    @cached_property
    def _rows(self) -> list[ForceRows]:
        return relative_force_rows(self.system, self.problem, self.search.moved)

    @cached_property
    def _sizes(self) -> Array:
        """RMS force residual of the declared model on each coordinate."""
        return np.array([max(rms(r.residual), 1e-300) for r in self._rows])

    @cached_property
    def _blocks(self) -> list[NDArray[np.int_]]:
        """Number of the block of segments of each row."""
        record, rows = self.here.runner.record, np.arange(len(self.here.residual))
        each = len(record.joints or (0,))  # rows of a segment: one a joint, where joints are run one at a time
        starts = [record.start[block[0] // each] for block in np.array_split(rows, BLOCKS)]
        return [np.maximum(np.searchsorted(starts, r.sample, side="right") - 1, 0) for r in self._rows]

    @cached_property
    def _by_run(self) -> Information:
        fit, p = self.here, self.count
        slopes, share = fit.slopes[:p], independent_share(fit)
        weighted = slopes * segment_weights(fit.residual)[:, None]
        matrix = share * np.einsum("ask,bsk->sab", weighted, slopes, optimize=True)
        vector = share * np.einsum("ask,sk->sa", weighted, fit.residual) + matrix @ fit.theta[:p]
        return Information(*(np.stack([b.sum(axis=0) for b in np.array_split(a, BLOCKS)]) for a in (matrix, vector)))

    @cached_property
    def _by_force(self) -> Information:
        """Information of the force residual; if it is divided by a drive gain, linearised about its own estimate."""
        declared, every = self.search.declared, np.ones(self.count, dtype=bool)
        found = self._information(self._rows, declared)
        for _ in range(LINEARISED if any(rows.gain.any() for rows in self._rows) else 0):
            values = self._solved(found.matrix.sum(axis=0), found.vector.sum(axis=0), every)
            found = self._information([rows.about(values - declared) for rows in self._rows], values)
        return found

    def _information(self, about: Sequence[ForceRows], values: Array) -> Information:
        """Information of rows that are linearised about ``values``."""
        p = self.count
        matrix, vector = np.zeros((BLOCKS, p, p)), np.zeros((BLOCKS, p))
        free = np.ones(p, dtype=bool)
        left = residual_sizes(self._rows, self.search.prior_precision, free, np.zeros(p))
        for rows, size, places in zip(about, left, self._blocks, strict=True):
            weight = independent_samples(rows.residual) / len(rows.residual) / size**2
            for block in range(BLOCKS):
                slopes, residual = rows.slopes[places == block], rows.residual[places == block]
                matrix[block] += weight * slopes.T @ slopes
                vector[block] += weight * slopes.T @ (slopes @ values - residual)
        return Information(matrix, vector)
