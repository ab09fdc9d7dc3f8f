"""Adoption of refitted parameter values, by cross-validation on blocks of the training log.

Free-run simulations alone are biased on a real machine: an unmodelled force acts like noise on the input and increases
the inertia estimate. So the values are estimated from three likelihoods (free runs, force residual, both), with the
tolerances as Gaussian prior, in which the parameters of an arm's links are correlated. Neighbouring residuals are
correlated, so each log-likelihood is multiplied by the share of independent ones (a tempered likelihood); else the data
would outweigh the prior. Each estimate is repeated without each block of the log, and its errors on that block by force
residual and by free run are compared.
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
from codegen.diagnosis.fit.acceptance import independent_share
from codegen.diagnosis.fit.force_rows import (
    LEAST_GAIN,
    ForceRows,
    independent_samples,
    relative_force_rows,
    residual_sizes,
)
from codegen.diagnosis.fit.linear import rms, solved
from codegen.diagnosis.fit.output_error import (
    BLOCKS,
    LEAST_PART,
    Fit,
    mean_residuals,
    segment_losses,
    segment_weights,
    shooting_fit,
)
from codegen.diagnosis.fit.search import Search, has_turned, tolerances_away
from codegen.diagnosis.fit.trial import in_unit
from codegen.diagnosis.results import Fact, ParameterError
from codegen.mechanics.system import System

CRITERIA = ("simulation alone", "residual force alone", "both errors together")
"""What the values are estimated from."""
LINEARISED = 4
"""How often the force residual is linearised again, each time about the last estimate."""
SAME = 0.01
"""Relative change of an error that is ignored."""
DOUBTFUL = 2.0
"""Deviation in tolerances above which a value alone must improve both criteria by more than ``SAME``."""
AWAY = 3.0
"""Deviation in tolerances above which a value is reported as a parameter error; 0.3 % of a Gaussian lies beyond."""
ALIKE = 0.25
"""A parameter is a substitute of another if, with that fixed, it moves by this share of its deviation."""
HALF_WIDTH = float(norm.ppf(0.5 + CONFIDENCE / 2))
"""Half the width of a confidence interval in standard errors."""


@dataclass(frozen=True, eq=False)
class Information:
    """Negative log-likelihood ½ θ'Mθ − m'θ of the refitted values, one a block: M (BLOCKS, p, p), m (BLOCKS, p)."""

    matrix: Array
    vector: Array

    def __add__(self, other: Information) -> Information:
        return Information(self.matrix + other.matrix, self.vector + other.vector)

    @property
    def total(self) -> tuple[Array, Array]:
        """(M, m) of all blocks together."""
        return self.matrix.sum(axis=0), self.vector.sum(axis=0)

    def without(self, block: int) -> tuple[Array, Array]:
        """(M, m) of all blocks but one."""
        return np.delete(self.matrix, block, 0).sum(axis=0), np.delete(self.vector, block, 0).sum(axis=0)


@dataclass(frozen=True)
class Score:
    """Cross-validated errors: those of each block with the values that were estimated without it.

    Attributes:
        force: (BLOCKS,) squared force residual, relative to the declared model's.
        run: (BLOCKS,) loss of the free runs.
    """

    force: Array
    run: Array
    count: int

    def over(self, other: Score) -> tuple[float, float]:
        """(force error, free-run error) over those of another model; below 1 this one is better."""
        force = float(np.sqrt(self.force.sum() / max(other.force.sum(), 1e-300)))
        return force, float(np.exp((self.run.sum() - other.run.sum()) / self.count))


@dataclass(frozen=True, eq=False)
class MapEstimate:
    """Maximum a posteriori (MAP) estimate of the refitted values from one likelihood.

    Attributes:
        deviation: (p,) standard errors; 0 for values that are not estimated.
        moves: (p,) which values are estimated; the others are as declared.
    """

    values: Array
    deviation: Array
    moves: Flags
    source: Information
    score: Score


@dataclass(frozen=True, eq=False)
class Refit:
    """The adopted values of a refit.

    Attributes:
        names: of the p values: friction levels, and parameters that have a tolerance.
        levels: (p,) the best values if only levels are refitted.
        errors: parameters that differ from their declared values by more than their tolerance explains.
        notes: facts on changes that free runs alone would make and that are not adopted.
        others: (p,) each, with its criterion, what the other criteria estimate, the best first; none is worse than
            ``declared`` by either.
    """

    names: tuple[str, ...]
    declared: Array
    values: Array
    deviation: Array
    levels: Array
    errors: tuple[ParameterError, ...]
    notes: tuple[Fact, ...]
    others: tuple[tuple[str, Array], ...] = ()

    def mapping(self, values: Array | None = None) -> dict[str, float]:
        """Name → value, of the adopted values or of others (p,)."""
        return dict(zip(self.names, map(float, self.values if values is None else values), strict=True))


def adopt_values(search: Search, fit: Fit, system: System) -> Refit:
    """Choose the values of levels and toleranced parameters for a fit of free runs, with its effects fixed.

    ``system``: the declared one with these effects.
    """
    return CrossValidation(search, fit, system).adopted()


@dataclass(frozen=True, eq=False)
class CrossValidation:
    """Estimates of the refitted values, compared by cross-validated errors; arguments as of ``adopt_values``."""

    search: Search
    fit: Fit
    system: System

    def adopted(self) -> Refit:
        """The best values: first of the levels alone, then of all, without unjustified changes."""
        free_levels = self.is_level & self.is_excited
        levels = self.best([self.as_declared, *(self.map_estimate(s, free_levels) for s in self._sources)])
        chosen = levels
        if not self.is_level.all():
            chosen = self.best([levels, *self._of_all])
        justified, errors = self.justified(chosen)
        if justified is not chosen:  # the remaining changes may be no improvement
            chosen = self.best([levels, justified])
            errors = errors if chosen is justified else ()
        names, notes = tuple(s.name for s in self.search.refitted_symbols), tuple(self.refused(chosen))
        others = self.others(chosen) if not self.is_level.all() else ()
        return Refit(names, self.search.declared, chosen.values, chosen.deviation, levels.values, errors, notes, others)

    @cached_property
    def _sources(self) -> list[Information]:
        """The likelihoods of the ``CRITERIA``."""
        return [self._by_run, self._by_force, self._by_both]

    @cached_property
    def _of_all(self) -> list[MapEstimate]:
        """The estimate of all values by each likelihood."""
        return [self.map_estimate(s, self.is_excited) for s in self._sources]

    def others(self, chosen: MapEstimate) -> tuple[tuple[str, Array], ...]:
        """The estimates of all values that were not chosen and are no worse than the declared ones, the best first.

        Far from the noise the criteria may want quite different values, all within the tolerances, and held-out data
        may refuse those of the one and not of the other. None of these contains a parameter error.
        """
        found = []
        for criterion, one in zip(CRITERIA, self._of_all, strict=True):
            one, errors = self.justified(one)
            apart = np.any(np.abs(one.values - chosen.values) > SAME * np.abs(chosen.values))
            ratios = one.score.over(self.as_declared.score)
            if apart and not errors and max(ratios) <= 1 + SAME:
                found.append((float(np.prod(ratios)), criterion, one.values))
        return tuple((criterion, values) for _, criterion, values in sorted(found, key=lambda one: one[0]))

    @property
    def count(self) -> int:
        """p, the number of refitted values."""
        return len(self.search.refitted_symbols)

    @property
    def is_level(self) -> Flags:
        """(p,) friction levels, which have no tolerance."""
        return np.asarray(self.search.prior_precision == 0)

    @cached_property
    def is_excited(self) -> Flags:
        """(p,) values that occur in the force balance of a coordinate that moves; all if none moves.

        The other values cannot be estimated: a joint at rest stays at rest with any friction level above its load.
        A declared level below it is kept too, although the joint slips with it. Parameters of links follow one another
        by their tolerances.
        """
        error = self.search.system.equation_error
        rows = [row for row, used in zip(error, self.search.problem.used.T, strict=True) if used.any()]
        seen = np.array([not rows or any(row.has(s) for row in rows) for s in self.search.refitted_symbols], dtype=bool)
        return np.asarray(
            seen | np.array([s in self.search.problem.changes for s in self.search.refitted_symbols], dtype=bool)
        )

    @cached_property
    def evaluated(self) -> Fit:
        """The fit evaluated at its own parameters, in units of the noise floor with which models are compared."""
        soft = self.search.with_noise_floor(self.fit)[0]
        runner = replace(self.fit.runner, record=soft.record)
        theta, offsets = self.fit.theta, self.fit.offsets
        least = LEAST_PART * np.asarray(self.fit.prior.scale)
        prior = replace(self.fit.prior, size=np.maximum(np.abs(theta), least), within=self.search.within)
        return shooting_fit(runner, theta, offsets, prior, 0)

    @cached_property
    def as_declared(self) -> MapEstimate:
        """The declared values and their score."""
        nothing = Information(np.zeros((BLOCKS, self.count, self.count)), np.zeros((BLOCKS, self.count)))
        return self.map_estimate(nothing, np.zeros(self.count, dtype=bool))

    def map_estimate(self, source: Information, moves: Flags) -> MapEstimate:
        """The MAP estimate by one likelihood with only the values ``moves`` free, and its cross-validated score."""
        values = self._solved(*source.total, moves)
        without = [self._solved(*source.without(block), moves) for block in range(BLOCKS)]
        deviation = self._deviation(source, moves, self.search.problem.prior_information)
        return MapEstimate(values, deviation, moves, source, self._score(values, without))

    def _deviation(self, source: Information, moves: Flags, prior: Array) -> Array:
        """(p,) standard errors of the values that are estimated, 0 for the others: √diag (M + prior)⁻¹."""
        deviation = np.zeros(self.count)
        matrix = (source.total[0] + prior)[np.ix_(moves, moves)]
        if moves.any():
            deviation[moves] = np.sqrt(np.maximum(np.diag(np.linalg.pinv(matrix, hermitian=True)), 0.0))
        return deviation

    def best(self, estimates: Sequence[MapEstimate]) -> MapEstimate:
        """The estimate with the least product of both errors, among those no worse than the first."""
        first = best = estimates[0]
        for one in estimates:
            no_worse = all(ratio <= 1 + SAME for ratio in one.score.over(first.score))
            if no_worse and np.prod(one.score.over(best.score)) < 1 - SAME:
                best = one
        return best

    def distance(self, chosen: MapEstimate) -> Array:
        """(p,) deviation from the declared values in tolerances; zero for friction levels."""
        return tolerances_away(self.search, chosen.values)

    def justified(self, chosen: MapEstimate) -> tuple[MapEstimate, tuple[ParameterError, ...]]:
        """The estimate with its unjustified values as declared, and the parameter errors among those that remain.

        A value is unjustified if it is more than ``DOUBTFUL`` tolerances away and does not improve both criteria, or if
        it has a sign that its tolerance excludes, such as an inertia below zero.
        """
        while True:
            far, errors = self.distance(chosen), []
            turned = has_turned(self.search, chosen.values)
            for k in (int(k) for k in np.lexsort((far, ~turned)) if far[k] > DOUBTFUL or turned[k]):
                group, fixed = self._with_declared(chosen, k)
                if turned[k] or not all(r < 1 - SAME for r in chosen.score.over(fixed.score)):
                    chosen = fixed
                    break
                if far[k] > AWAY:
                    errors.append(self._error(chosen, fixed, k, [j for j in group if j != k]))
            else:
                return chosen, tuple(errors)

    def _with_declared(self, chosen: MapEstimate, k: int) -> tuple[list[int], MapEstimate]:
        """The estimate with value ``k`` and its substitutes fixed as declared, and the indices of these values.

        Substitutes are values that would change in place of value ``k`` (``ALIKE``).
        """
        far, moves = self.distance(chosen), chosen.moves.copy()
        moves[k] = False
        k_fixed = self.map_estimate(chosen.source, moves)
        substitutes = self.distance(k_fixed) > far + ALIKE * far[k]
        if not substitutes.any():
            return [k], k_fixed
        moves &= ~substitutes
        return [k, *(int(j) for j in np.flatnonzero(substitutes))], self.map_estimate(chosen.source, moves)

    def refused(self, adopted: MapEstimate) -> list[Fact]:
        """Facts on values that free runs alone would move by more than ``DOUBTFUL`` tolerances, and that stay."""
        kept = self.distance(adopted)
        alone = self.map_estimate(self._by_run, np.ones(self.count, dtype=bool))
        far, turned, facts = self.distance(alone), has_turned(self.search, alone.values), []
        for k in np.flatnonzero((far > DOUBTFUL) & (kept <= DOUBTFUL)):
            s, taken = self.search.refitted_symbols[k], f"{adopted.values[k]:.4g}"
            declared, unit = f"{self.search.declared[k]:.4g}", in_unit(self.search.system, s)
            why = "but not both errors fall with that"
            if turned[k] and abs(alone.values[k]) <= HALF_WIDTH * alone.deviation[k]:
                why = "zero within its 95 % interval, which the tolerance excludes"
            elif turned[k]:
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
        """The report on value ``k``, from the estimate and that of ``_with_declared``; ``others``: its substitutes."""
        force, run = chosen.score.over(fixed.score)
        symbol, declared = self.search.refitted_symbols[k], float(self.search.declared[k])
        return ParameterError(
            name=symbol.name,
            unit=str(self.search.system.units.get(symbol, "1")),
            declared=declared,
            tolerance=float(self.search.prior_precision[k] ** -0.5 / abs(declared)) if declared else float("nan"),
            estimate=float(chosen.values[k]),
            interval=self._interval(chosen, k),
            away=float(self.distance(chosen)[k]),
            alike=tuple(self.search.refitted_symbols[j].name for j in others),
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
        without = self.search.problem.prior_information_without(k)
        free = self._solved(*chosen.source.total, chosen.moves, without)
        free_deviation = self._deviation(chosen.source, chosen.moves, without)
        values = np.array([chosen.values[k], free[k]])
        half_widths = np.maximum(HALF_WIDTH * np.array([chosen.deviation[k], free_deviation[k]]), self._sandwich[k])
        return float((values - half_widths).min()), float((values + half_widths).max())

    @cached_property
    def _sandwich(self) -> list[float]:
        """Half the interval of each value by the sandwich covariance of the fit."""
        found = estimate(self.evaluated).refitted
        return [0.5 * (found[s.name][1][1] - found[s.name][1][0]) for s in self.search.refitted_symbols]

    def _solved(self, matrix: Array, vector: Array, moves: Flags, prior: Array | None = None) -> Array:
        """(p,) minimum of ½ θ'Mθ − m'θ + ½ d'P d, d = θ − declared, those not in ``moves`` as declared."""
        values = self.search.declared.copy()
        if moves.any():
            inner_prior = (self.search.problem.prior_information if prior is None else prior)[np.ix_(moves, moves)]
            inner = matrix[np.ix_(moves, moves)] + inner_prior
            fixed = matrix[np.ix_(moves, ~moves)] @ values[~moves]
            right = vector[moves] - fixed + inner_prior @ self.search.declared[moves]
            values[moves] = solved(inner, right)
        return values

    def _score(self, values: Array, without: Sequence[Array]) -> Score:
        """The cross-validated errors of ``values``, (p,), by those estimated ``without`` each block."""
        force = np.zeros(BLOCKS)
        for block, estimated in enumerate(without):
            change = estimated - self.search.declared
            for rows, size, places in zip(self._rows, self._sizes, self._blocks, strict=True):
                residual = rows.about(change).residual[places == block]
                force[block] += float((residual**2).sum()) / size**2
        theta = np.concatenate([values, self.evaluated.theta[self.count :]])
        runner = self.evaluated.runner
        left = self.evaluated.starts.project(mean_residuals(runner, runner.run(theta, self.evaluated.offsets)))
        run = np.zeros(BLOCKS)
        for block, segments in enumerate(np.array_split(np.arange(len(left)), BLOCKS)):
            correction = np.tensordot(without[block] - values, self.evaluated.slopes[: self.count, segments], axes=1)
            run[block] = float(segment_losses(left[segments] - correction).sum())
        return Score(force, run, left.size)

    @cached_property
    def _rows(self) -> list[ForceRows]:
        """The force residual of each coordinate at the declared values, and its slopes by the p values.

        Linearised about the values of the fit: the force of a bristle is not linear in its level. About the declared
        level, 11 % too large, the error was smallest where all forces and inertias were 18 % too large, which is the
        same motion, and values 4 to 5 tolerances away were reported.
        """
        symbols = self.search.refitted_symbols
        about = dict(zip(symbols, map(float, self.evaluated.theta), strict=False))
        return relative_force_rows(self.system, self.search.problem, symbols, about)

    @cached_property
    def _sizes(self) -> Array:
        """RMS force residual of the declared model on each coordinate."""
        return np.array([max(rms(r.residual), 1e-300) for r in self._rows])

    @cached_property
    def _blocks(self) -> list[NDArray[np.int_]]:
        """For each coordinate the block of the log in which each row of ``_rows`` is."""
        record, rows = self.evaluated.runner.record, np.arange(len(self.evaluated.residual))
        joints = len(record.joints or (0,))  # a segment has a row for each joint that is simulated alone
        starts = [record.every * record.start[block[0] // joints] for block in np.array_split(rows, BLOCKS)]
        return [np.maximum(np.searchsorted(starts, r.sample, side="right") - 1, 0) for r in self._rows]

    @cached_property
    def _by_run(self) -> Information:
        """Information of the free runs, tempered by their share of independent residuals."""
        return self._run_information(self.evaluated.theta[: self.count])

    def _run_information(self, values: Array) -> Information:
        """Information of the free runs, linearised in a drive gain about ``values``, as the rows of the force are.

        The residual of the fit's values θ is r − S Δ/(1 + γΔ), Δ the change from θ: a common factor on all values is
        the same motion.
        """
        fit, p = self.evaluated, self.count
        change, gain = values - fit.theta[:p], self._drive_gain / self._gain_of(fit.theta[:p])
        left, step = max(1 + float(gain @ change), LEAST_GAIN), np.tensordot(change, fit.slopes[:p], axes=1)
        slopes = fit.slopes[:p] / left - gain[:, None, None] * step / left**2
        residual, share = fit.residual - step / left, independent_share(fit)
        weighted = slopes * segment_weights(fit.residual)[:, None]
        matrix = share * np.einsum("ask,bsk->sab", weighted, slopes, optimize=True)
        vector = share * np.einsum("ask,sk->sa", weighted, residual) + matrix @ values
        return Information(*(np.stack([b.sum(axis=0) for b in np.array_split(a, BLOCKS)]) for a in (matrix, vector)))

    @cached_property
    def _drive_gain(self) -> Array:
        """(p,) slopes γ of the drive gain at the declared values, the mean of all coordinates."""
        return np.asarray(np.mean([rows.gain for rows in self._rows], axis=0)) if self._rows else np.zeros(self.count)

    def _gain_of(self, values: Array) -> float:
        """The linearised drive gain, 1 at the declared values."""
        return max(1 + float(self._drive_gain @ (values - self.search.declared)), LEAST_GAIN)

    @cached_property
    def _by_both(self) -> Information:
        """Information of both criteria, linearised again in a drive gain about their common estimate.

        No motion shows the scale of all forces. Linearised about two different estimates, each criterion has a residual
        in the null direction of the other, which falls with the scale: values were 4 % smaller than the tolerances say.
        """
        declared, found = self.search.declared, self._by_run + self._by_force
        for _ in range(LINEARISED if self._drive_gain.any() else 0):
            values = self._solved(*found.total, np.ones(self.count, dtype=bool))
            found = self._run_information(values)
            found += self._information([rows.about(values - declared) for rows in self._rows], values)
        return found

    @cached_property
    def _by_force(self) -> Information:
        """Information of the force residual, linearised again in a drive gain about its own estimate."""
        declared, every = self.search.declared, np.ones(self.count, dtype=bool)
        found = self._information(self._rows, declared)
        for _ in range(LINEARISED if any(rows.gain.any() for rows in self._rows) else 0):
            values = self._solved(*found.total, every)
            found = self._information([rows.about(values - declared) for rows in self._rows], values)
        return found

    def _information(self, about: Sequence[ForceRows], values: Array) -> Information:
        """Information of rows that are linearised about ``values``, weighted by the number of independent samples."""
        p = self.count
        matrix, vector = np.zeros((BLOCKS, p, p)), np.zeros((BLOCKS, p))
        left = residual_sizes(self._rows, self.search.problem.prior_information)
        for rows, size, places in zip(about, left, self._blocks, strict=True):
            weight = independent_samples(rows.residual) / len(rows.residual) / size**2
            for block in range(BLOCKS):
                slopes, residual = rows.slopes[places == block], rows.residual[places == block]
                matrix[block] += weight * slopes.T @ slopes
                vector[block] += weight * slopes.T @ (slopes @ values - residual)
        return Information(matrix, vector)
