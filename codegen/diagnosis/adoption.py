"""Which values a refit adopts: those that predict held-out blocks of the training log better by both witnesses.

The free runs alone are a biased judge on a real machine: a force that no model holds acts like noise on the input,
and inertia grows until it no longer moves anything. So levels and parameters are fitted by free runs, by the force
residual and by both together, each likelihood tempered by its independent samples and pulled by the tolerances; every
such fit is made without each block in turn and judged there by both witnesses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from codegen.diagnosis.credit import BLOCKS, independent_share
from codegen.diagnosis.estimate import CONFIDENCE
from codegen.diagnosis.force_fit import ForceRows, force_rows, independent_samples, scales
from codegen.diagnosis.output_error import Shot, fit, means, segment_losses, segment_weights, state_slopes
from codegen.diagnosis.problem import Problem
from codegen.diagnosis.results import ParameterError
from codegen.diagnosis.search import Search
from codegen.mechanics.system import System

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

SAME = 0.01
"""Relative change of an error that counts as none."""
DOUBTFUL = 2.0
"""Tolerances from which on a value needs evidence of its own."""
AWAY = 3.0
"""Tolerances from which on it is named as a parameter error: of a Gaussian tolerance 0.3 % lie there."""
ALIKE = 0.25
"""Of the way that one parameter is held back, what another that acts alike goes further."""
HALF_WIDTH = float(norm.ppf(0.5 + CONFIDENCE / 2))


@dataclass(frozen=True, eq=False)
class Information:
    """A likelihood of the moved values, quadratic, by block: ½ θ'Mθ − m'θ.

    Attributes:
        matrix: (BLOCKS, p, p). vector: (BLOCKS, p).
    """

    matrix: Array
    vector: Array

    def __add__(self, other: Information) -> Information:
        return Information(self.matrix + other.matrix, self.vector + other.vector)


@dataclass(frozen=True)
class Score:
    """Errors on blocks that the values were not fitted to.

    Attributes:
        force: (BLOCKS,) squared force residual, each coordinate in units of what the declared model leaves.
        run: (BLOCKS,) loss of free runs. count: of residuals in the free runs.
    """

    force: Array
    run: Array
    count: int

    def over(self, other: Score) -> tuple[float, float]:
        """Errors by force and in free run over those of another model."""
        force = float(np.sqrt(self.force.sum() / max(other.force.sum(), 1e-300)))
        return force, float(np.exp((self.run.sum() - other.run.sum()) / self.count))


@dataclass(frozen=True, eq=False)
class Way:
    """One way to fill in the moved values.

    Attributes:
        values: (p,). deviation: (p,) standard errors. moves: (p,) which of them are fitted; the rest is as declared.
        source: the likelihood that it is the best of, beside the prior.
    """

    values: Array
    deviation: Array
    moves: Flags
    source: Information
    score: Score


@dataclass(frozen=True, eq=False)
class Refit:
    """What a refit says.

    Attributes:
        names: of the moved values; ``declared``, ``values``: (p,) and ``deviation``: (p,) standard errors.
        levels: (p,) the best values with every tolerance parameter as declared.
        errors: parameters that lie away from what was declared, with their evidence.
        notes: what the free runs alone ask for and is not adopted, in words.
    """

    names: tuple[str, ...]
    declared: Array
    values: Array
    deviation: Array
    levels: Array
    errors: tuple[ParameterError, ...]
    notes: tuple[str, ...]

    def mapping(self, values: Array | None = None) -> dict[str, float]:
        return dict(zip(self.names, map(float, self.values if values is None else values), strict=True))


def settle(search: Search, shot: Shot, problem: Problem, system: System) -> Refit:
    """The values to adopt beside the effects of a fit, which stay as they are.

    Args:
        shot: fit on the search's record.
        system: declared values with the effects of the fit in it.
    """
    judge = Judge(search, shot, problem, system)
    levels = judge.best([judge.unmoved, *(judge.way(s, judge.is_level) for s in judge.sources)])
    way = levels
    if not judge.is_level.all():
        every = np.ones(judge.count, dtype=bool)
        way = judge.best([levels, *(judge.way(s, every) for s in judge.sources)])
    justified, errors = judge.justified(way)
    if justified is not way:  # what is left of its moves need not be worth it
        way = judge.best([levels, justified])
        errors = errors if way is justified else ()
    names = tuple(s.name for s in search.moved)
    notes = tuple(judge.refused(judge.distance(way)))
    return Refit(names, search.declared, way.values, way.deviation, levels.values, errors, notes)


@dataclass(frozen=True, eq=False)
class Judge:
    """Both witnesses on one record, for one set of effects.

    Attributes:
        shot: fit whose effects stay. system: declared values with those effects.
    """

    search: Search
    shot: Shot
    problem: Problem
    system: System

    @property
    def count(self) -> int:
        return len(self.search.moved)

    @property
    def is_level(self) -> Flags:
        return np.asarray(self.search.price == 0)

    @cached_property
    def here(self) -> Shot:
        """The fit on the search's record, as it is, against a noise near which differences count."""
        soft = self.search.softened(self.shot)[0]
        runner = replace(self.shot.runner, record=soft.record)
        theta, offsets = self.shot.theta, self.shot.offsets
        starts = state_slopes(runner, theta, offsets)
        prior = self.shot.price, self.shot.centre
        return fit(runner, theta, offsets, starts, *prior, 0, tempering=self.shot.tempering)

    @cached_property
    def sources(self) -> list[Information]:
        return [self._by_run, self._by_force, self._by_run + self._by_force]

    @cached_property
    def unmoved(self) -> Way:
        nothing = Information(np.zeros((BLOCKS, self.count, self.count)), np.zeros((BLOCKS, self.count)))
        return self.way(nothing, np.zeros(self.count, dtype=bool))

    def way(self, source: Information, moves: Flags) -> Way:
        """The best values of a likelihood beside the prior, where only some may move; and without each block."""
        values = self._solved(source.matrix.sum(axis=0), source.vector.sum(axis=0), moves)
        without = [
            self._solved(np.delete(source.matrix, k, 0).sum(axis=0), np.delete(source.vector, k, 0).sum(axis=0), moves)
            for k in range(BLOCKS)
        ]
        deviation = np.zeros(self.count)
        matrix = (source.matrix.sum(axis=0) + np.diag(self.search.price))[np.ix_(moves, moves)]
        if moves.any():
            deviation[moves] = np.sqrt(np.maximum(np.diag(np.linalg.pinv(matrix, hermitian=True)), 0.0))
        return Way(values, deviation, moves, source, self._score(values, without))

    def best(self, ways: Sequence[Way]) -> Way:
        """The best of those that are worse than the first by neither witness."""
        fair = [w for w in ways if all(r <= 1 + SAME for r in w.score.over(ways[0].score))]
        best = ways[0]
        for way in fair:
            best = way if self.better(way, best) else best
        return best

    def better(self, way: Way, other: Way) -> bool:
        force, run = way.score.over(other.score)
        return force * run < 1 - SAME

    def distance(self, way: Way) -> Array:
        """(p,) tolerances from what is declared; zero for levels."""
        return np.asarray(np.abs(way.values - self.search.declared) * np.sqrt(self.search.price))

    def justified(self, way: Way) -> tuple[Way, tuple[ParameterError, ...]]:
        """Without those moves beyond ``DOUBTFUL`` that do not predict better by both witnesses; and what stays away."""
        while True:
            far, errors = self.distance(way), []
            for k in (int(k) for k in np.argsort(far) if far[k] > DOUBTFUL):
                group, held = self._held(way, k)
                if not all(r < 1 for r in way.score.over(held.score)):
                    way = held
                    break
                if far[k] > AWAY:
                    errors.append(self._error(way, held, k, [j for j in group if j != k]))
            else:
                return way, tuple(errors)

    def _held(self, way: Way, k: int) -> tuple[list[int], Way]:
        """The fit with a parameter as declared, and with it those others that would go its way in its place."""
        far, moves = self.distance(way), way.moves.copy()
        moves[k] = False
        alone = self.way(way.source, moves)
        others = self.distance(alone) > far + ALIKE * far[k]
        if not others.any():
            return [k], alone
        moves &= ~others
        return [k, *(int(j) for j in np.flatnonzero(others))], self.way(way.source, moves)

    def refused(self, kept: Array) -> list[str]:
        """Moves beyond ``DOUBTFUL`` that the free runs alone ask for and that the refit does not make.

        Args:
            kept: (p,) tolerances that each value moves.
        """
        alone = self.way(self._by_run, np.ones(self.count, dtype=bool))
        far, words = self.distance(alone), []
        for k in np.flatnonzero((far > DOUBTFUL) & (kept <= DOUBTFUL)):
            s, value = self.search.moved[k], alone.values[k]
            unit = self.search.system.units.get(s, "1")
            in_unit = f" {unit}" if unit != "1" else ""
            words.append(
                f"free runs alone would move {s.name} from {self.search.declared[k]:.4g} to {value:.4g}{in_unit} "
                f"({far[k]:.2g} tolerances); on held-out blocks of the training log that is not better by both force "
                "residual and free run, so it is not adopted"
            )
        return words

    def _error(self, way: Way, held: Way, k: int, others: Sequence[int]) -> ParameterError:
        force, run = way.score.over(held.score)
        symbol, declared = self.search.moved[k], float(self.search.declared[k])
        value, half = float(way.values[k]), HALF_WIDTH * float(way.deviation[k])
        return ParameterError(
            name=symbol.name,
            unit=str(self.search.system.units.get(symbol, "1")),
            declared=declared,
            tolerance=float(self.search.price[k] ** -0.5 / abs(declared)) if declared else float("nan"),
            estimate=value,
            interval=(value - half, value + half),
            away=float(self.distance(way)[k]),
            alike=tuple(self.search.moved[j].name for j in others),
            force=force,
            free_run=run,
            blocks_by_force=int((way.score.force < held.score.force).sum()),
            blocks_by_free_run=int((way.score.run < held.score.run).sum()),
            blocks=BLOCKS,
        )

    def _solved(self, matrix: Array, vector: Array, moves: Flags) -> Array:
        values = self.search.declared.copy()
        if moves.any():
            price = self.search.price[moves]
            inner = matrix[np.ix_(moves, moves)] + np.diag(price)
            fixed = matrix[np.ix_(moves, ~moves)] @ values[~moves]
            right = vector[moves] - fixed + price * self.search.declared[moves]
            size = np.sqrt(np.maximum(np.diag(inner), 1e-300))
            values[moves] = np.linalg.lstsq(inner / np.outer(size, size), right / size, rcond=1e-10)[0] / size
        return values

    def _score(self, values: Array, without: Sequence[Array]) -> Score:
        force = np.zeros(BLOCKS)
        for block, one in enumerate(without):
            change = one - self.search.declared
            for rows, size, places in zip(self._rows, self._sizes, self._blocks, strict=True):
                here = places == block
                force[block] += float(((rows.residual[here] + rows.slopes[here] @ change) ** 2).sum()) / size**2
        theta = np.concatenate([values, self.here.theta[self.count :]])
        runner = self.here.runner
        left = self.here.starts.project(means(runner, runner.run(theta, self.here.offsets)))
        run = np.zeros(BLOCKS)
        for block, segments in enumerate(np.array_split(np.arange(len(left)), BLOCKS)):
            moved = np.tensordot(without[block] - values, self.here.slopes[: self.count, segments], axes=1)
            run[block] = float(segment_losses(left[segments] - moved).sum())
        return Score(force, run, left.size)

    @cached_property
    def _rows(self) -> list[ForceRows]:
        return force_rows(self.system, self.problem, self.search.moved)

    @cached_property
    def _sizes(self) -> Array:
        """What the declared model leaves on each coordinate."""
        return np.array([max(float(np.sqrt(np.mean(r.residual**2))), 1e-300) for r in self._rows])

    @cached_property
    def _blocks(self) -> list[NDArray[np.int_]]:
        """Of each row, the block of segments that it lies in."""
        starts = [
            self.here.runner.record.start[s[0]] for s in np.array_split(np.arange(len(self.here.residual)), BLOCKS)
        ]
        return [np.maximum(np.searchsorted(starts, r.sample, side="right") - 1, 0) for r in self._rows]

    @cached_property
    def _by_run(self) -> Information:
        shot, p = self.here, self.count
        slopes, share = shot.slopes[:p], independent_share(shot)
        weighted = slopes * segment_weights(shot.residual)[:, None]
        matrix = share * np.einsum("ask,bsk->sab", weighted, slopes, optimize=True)
        vector = share * np.einsum("ask,sk->sa", weighted, shot.residual) + matrix @ shot.theta[:p]
        blocks = np.array_split(np.arange(len(matrix)), BLOCKS)
        return Information(
            np.stack([matrix[b].sum(axis=0) for b in blocks]), np.stack([vector[b].sum(axis=0) for b in blocks])
        )

    @cached_property
    def _by_force(self) -> Information:
        p, declared = self.count, self.search.declared
        matrix, vector = np.zeros((BLOCKS, p, p)), np.zeros((BLOCKS, p))
        free = np.ones(p, dtype=bool)
        left = scales(self._rows, self.search.price, free, np.zeros(p))
        for rows, size, places in zip(self._rows, left, self._blocks, strict=True):
            weight = independent_samples(rows.residual) / len(rows.residual) / size**2
            for block in range(BLOCKS):
                slopes, residual = rows.slopes[places == block], rows.residual[places == block]
                matrix[block] += weight * slopes.T @ slopes
                vector[block] += weight * slopes.T @ (slopes @ declared - residual)
        return Information(matrix, vector)
