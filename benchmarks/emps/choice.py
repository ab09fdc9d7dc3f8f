"""A model by the training record alone: cross-validated free runs over its blocks, and three rules that use them.

A candidate is a structure and the length of the runs that it is fitted to. Each block of the training record is
predicted in one free run by the candidate fitted to the other blocks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.emps.models import Model, score
from benchmarks.emps.records import Measured, blocks, without

Array = NDArray[np.float64]

BLOCKS = 4
LENGTHS_S: tuple[float | None, ...] = (0.5, 2.0, 6.2, None)
"""Of the runs of a fit, each started from the fit before it; None is as long as the stretch."""


@dataclass(frozen=True)
class Candidate:
    """A structure fitted to runs of one length.

    Attributes:
        seconds: None for the whole stretch. errors: mm, of each block, predicted from the others.
        theta: fitted to the whole training record. left_out: the same without each block in turn.
    """

    kinds: tuple[str, ...]
    seconds: float | None
    errors: tuple[float, ...]
    theta: tuple[float, ...]
    left_out: tuple[tuple[float, ...], ...]

    @property
    def error(self) -> float:
        """RMS over all blocks."""
        return float(np.sqrt(np.mean(np.square(self.errors))))


def candidates(model: Model, data: Measured, lengths: Sequence[float | None] = LENGTHS_S) -> list[Candidate]:
    """The candidates of one structure, one for each length of the runs."""
    parts = blocks(BLOCKS, len(data))
    fits = [_fits(model, data, without(part, len(data)), lengths) for part in parts]
    whole = _fits(model, data, [(0, len(data))], lengths)
    found = []
    for k, seconds in enumerate(lengths):
        errors = []
        for (start, stop), own in zip(parts, fits, strict=True):
            predicted = model.predicted(own[k], data.free_run(start, stop))
            errors.append(score(predicted, data.measured[start:stop]))
        others = tuple(tuple(map(float, own[k])) for own in fits)
        found.append(Candidate(model.kinds, seconds, tuple(errors), tuple(map(float, whole[k])), others))
    return found


def _fits(
    model: Model, data: Measured, stretches: Sequence[tuple[int, int]], lengths: Sequence[float | None]
) -> list[Array]:
    theta, found = model.start, []
    for seconds in lengths:
        theta = model.fitted(theta, data, stretches, seconds)
        found.append(theta)
    return found


def least(found: Sequence[Candidate]) -> Candidate:
    """The least error over the blocks."""
    return min(found, key=lambda c: c.error)


def as_good(found: Sequence[Candidate]) -> list[Candidate]:
    """All whose error is within one standard error, over the blocks, of the least."""
    best = least(found)
    squares = np.square(best.errors)
    bound = float(squares.mean() + squares.std(ddof=1) / np.sqrt(len(squares)))
    return [c for c in found if c.error**2 <= bound]


Rule = Callable[[Sequence[Candidate]], list[Candidate]]


def rules(verdict: Sequence[str]) -> Mapping[str, Rule]:
    """In words → the candidates whose mean prediction it takes.

    Args:
        verdict: the effects that the diagnosis names on the training record.
    """
    return {
        "least error over the blocks": lambda found: [least(found)],
        "mean of all within one standard error of it": as_good,
        "what the diagnosis names, length by the blocks": lambda found: [
            least([c for c in found if set(c.kinds) == set(verdict)])
        ],
    }


def mean_prediction(chosen: Sequence[Candidate], models: Mapping[tuple[str, ...], Model], data: Measured) -> Array:
    """(N,) m, the mean of the free runs of these candidates over a whole record."""
    record = data.free_run()
    return np.asarray(np.mean([models[c.kinds].predicted(np.array(c.theta), record) for c in chosen], axis=0))
