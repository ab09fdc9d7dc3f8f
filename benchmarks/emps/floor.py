"""How small the error over a whole test record can be: fits that know it, and what a small force does to a free run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.emps.choice import LENGTHS_S, Candidate
from benchmarks.emps.models import Model, finite, score
from benchmarks.emps.records import FREE_SAMPLES, Measured

Array = NDArray[np.float64]

FORCE_N = 0.1
GAIN = "gtau"


@dataclass(frozen=True)
class Floor:
    """Errors of one structure, in mm over the whole test record.

    Attributes:
        known: fitted to the test record itself. both: one set of values fitted to both records together.
        values: (name, fitted to the training record, to the test record).
    """

    words: str
    known: float
    both: float
    values: tuple[tuple[str, float, float], ...]


def floor(model: Model, chosen: Candidate, training: Measured, test: Measured) -> Floor:
    """The same structure, allowed to know the test record.

    Args:
        chosen: the fit to the training record, from which the others start.
    """
    start = np.array(chosen.theta)
    known = model.fitted(start, test, [(0, len(test))], None)
    both = model.fitted_to([(training, [(0, len(training))]), (test, [(0, len(test))])], start, None)
    own, other = (model.flat(theta) for theta in (start, known))
    values = tuple((name, own[name], other[name]) for name in own)
    return Floor(model.words, whole(model, known, test), whole(model, both, test), values)


def whole(model: Model, theta: Array, data: Measured) -> float:
    """RMSE of one free run over a record."""
    return score(model.predicted(theta, data.free_run()), data.measured)


def drift_mm(model: Model, theta: Array, data: Measured, force_n: float = FORCE_N) -> float:
    """RMS by which a constant force, as an error of the offset, moves the free run over a record."""
    place = [s.name for s in model.trial.refitted_symbols].index("offset")
    moved = theta.copy()
    moved[place] += force_n
    record = data.free_run()
    change = finite(1e3 * (model.predicted(moved, record) - model.predicted(theta, record)))[FREE_SAMPLES:]
    return float(np.sqrt(np.mean(change**2)))


def left_out_mm(model: Model, chosen: Candidate, test: Measured) -> tuple[float, ...]:
    """RMSE on the test record of the fits that miss one block of the training record each."""
    return tuple(whole(model, np.array(theta), test) for theta in chosen.left_out)


def whole_length(found: list[Candidate], kinds: tuple[str, ...]) -> Candidate:
    """The candidate of a structure that is fitted to one run over the whole record."""
    return next(c for c in found if c.kinds == kinds and c.seconds == LENGTHS_S[-1])
