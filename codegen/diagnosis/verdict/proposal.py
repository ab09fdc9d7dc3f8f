"""Proposal of a sparse sum of terms for an unknown residual, by PySINDy; it is never written into a spec."""

import warnings
from collections.abc import Callable
from importlib.util import find_spec

import numpy as np

from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.diagnosis.fit.residual import Problem, inverse_dynamics_residual
from codegen.diagnosis.results import ProposedTerms
from codegen.mechanics.system import System

THRESHOLDS = (0.8, 0.5, 0.3, 0.2, 0.1, 0.05)
"""Thresholds of STLSQ over the RMS residual, below which terms are removed."""
INNER = 0.7
"""Share of the training rows to which each threshold is fitted; the rest chooses the threshold."""
WORTH = 0.02
"""Share of the residual that each further term must explain."""
LEAST_ROWS = 50
"""Least number of samples for a proposal."""
Terms = dict[str, Callable[[Array], Array]]
OVER_POSITION: Terms = {"{}": lambda q: q, "{}**2": lambda q: q**2, "{}**3": lambda q: q**3}
OVER_ANGLE: Terms = {"sin({})": np.sin, "cos({})": np.cos}
OVER_VELOCITY: Terms = {
    "{}": lambda q: q,
    "abs({})": np.abs,
    "sgn({})": np.sign,
    "{}*abs({})": lambda q: q * np.abs(q),
    "{}**3": lambda q: q**3,
}


def refuse_without_pysindy() -> None:
    """Raise BadInput if PySINDy is not installed, before any work is done."""
    if find_spec("pysindy") is None:
        raise BadInput(
            "--propose", "PySINDy is not installed", "`pip install 'stiction[sindy]'`, or no --propose", code="TOOL003"
        )


def propose_terms(system: System, train: Problem, test: Problem, window: slice) -> tuple[ProposedTerms, ...]:
    """Sparse regression of each coordinate's force residual of the refit on x, v, |v|, sgn v and the like.

    Columns and residual are low-passed alike. The end of the training rows chooses the threshold; the explained share
    is of the held-out residual, in ``window`` of ``test``, which chose nothing.

    Raises:
        BadInput: if PySINDy is not installed.
    """
    refuse_without_pysindy()
    names, columns = _library(system, train)
    others = _library(system, test)[1]
    residual, held_out = (inverse_dynamics_residual(system, p.motion) for p in (train, test))
    inside = np.zeros(len(test.motion.time), dtype=bool)
    inside[window] = True
    found = []
    for i, x in enumerate(system.positions):
        rows, seen = train.used[:, i], test.used[:, i] & inside
        weights = _sparse(columns[rows], residual[rows, i])
        share = _share(others[seen] @ weights, held_out[seen, i]) if seen.sum() >= LEAST_ROWS else float("nan")
        terms = {name: float(w) for name, w in zip(names, weights, strict=True) if w != 0}
        found.append(ProposedTerms(x.name, system.force_unit(i), terms, share))
    return tuple(found)


def _library(system: System, problem: Problem) -> tuple[list[str], Array]:
    """Names and low-passed columns (N, K), over all coordinates."""
    motion = problem.motion
    names, columns = ["1"], [np.ones(len(motion.time))]
    for i, (x, v) in enumerate(zip(system.positions, system.velocities, strict=True)):
        over_x = OVER_POSITION | (OVER_ANGLE if system.position_units[i] == "rad" else {})
        for terms, values, symbol in ((over_x, motion.positions, x), (OVER_VELOCITY, motion.velocities, v)):
            names += [pattern.replace("{}", symbol.name) for pattern in terms]
            columns += [function(values[:, i]) for function in terms.values()]
    return names, motion.low_pass(np.column_stack(columns))


def _sparse(columns: Array, residual: Array) -> Array:
    """(K,) weights by sequentially thresholded least squares, with the largest threshold that explains nearly most."""
    none = np.zeros(columns.shape[1])
    if len(columns) < LEAST_ROWS:
        return none
    cut = round(INNER * len(columns))
    best, most = none, 0.0
    for threshold in THRESHOLDS:
        weights = _fitted(columns[:cut], residual[:cut], threshold)
        share = _share(columns[cut:] @ weights, residual[cut:])
        if share > most + WORTH * max(1, int(np.count_nonzero(weights)) - int(np.count_nonzero(best))):
            best, most = weights, share
    return best


def _fitted(columns: Array, residual: Array, threshold: float) -> Array:
    """(K,) weights by STLSQ with this threshold."""
    import pysindy

    size, height = np.sqrt((columns**2).mean(axis=0)), float(np.sqrt((residual**2).mean()))
    scale = np.where(size > 0, size, 1.0)
    solver = pysindy.STLSQ(threshold=threshold, alpha=1e-6)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a threshold may drop every term
        solver.fit(columns / scale, residual[:, None] / (height or 1.0))
    return np.asarray(solver.coef_[0] * height / scale)


def _share(explained: Array, residual: Array) -> float:
    """Share of the squared residual that is removed; negative if the residual increases."""
    power = float((residual**2).sum())
    return 1 - float(((residual - explained) ** 2).sum()) / power if power > 0 else 0.0
