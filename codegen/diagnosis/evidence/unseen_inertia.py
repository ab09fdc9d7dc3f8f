"""Inertia parameters that a log hardly determines, as at constant speed or in one direction, and are not refitted."""

from __future__ import annotations

import numpy as np
import sympy

from codegen.diagnosis.fit.force_rows import force_rows, information, residual_sizes
from codegen.diagnosis.fit.linear import inverse
from codegen.diagnosis.fit.residual import Problem, slip_velocities
from codegen.diagnosis.fit.trial import in_unit
from codegen.logs import Finding

KNOWN = 0.1
"""Largest ratio of a refitted parameter's variance to its declared one; above it, free runs would be biased more."""


def unseen_inertias(problem: Problem) -> list[sympy.Symbol]:
    """The uncertain parameters that act through inertia alone and that the force residual hardly determines.

    At constant speed the noise of a logged input changes an inertia in free runs (errors in variables). So a parameter
    is undetermined if its variance by the force residual, H⁻¹, exceeds ``KNOWN`` times that of its tolerance: H = Σ s
    s'/σ² + ``Problem.prior_information``, with the slopes s and RMS residual σ over independent samples.
    """
    still = problem.system.equation_error.subs(dict.fromkeys(problem.system.accelerations, 0))
    inertias = [s for s in problem.uncertain if s not in still.free_symbols]
    if not inertias:
        return []
    prior, rows = problem.prior_information, force_rows(problem.system, problem, problem.moved)
    variance = np.diag(inverse(information(rows, residual_sizes(rows, prior), prior)))
    kept = dict(zip(problem.moved, variance * problem.prior_precision, strict=True))
    return [s for s in inertias if kept[s] > KNOWN]


def moves_one_way(problem: Problem) -> bool:
    """Whether some contact slips and none ever reverses."""
    slip = slip_velocities(problem.system, problem.motion)[problem.motion.usable]
    return slip.shape[1] > 0 and bool(np.all(np.all(slip > 0, axis=0) | np.all(slip < 0, axis=0)))


def not_refitted(problem: Problem, symbols: list[sympy.Symbol]) -> tuple[Finding, ...]:
    """The warning that these parameters keep their declared values."""
    if not symbols:
        return ()
    system = problem.system
    listed = " and ".join(f"{s.name} at {float(system.values[s]):.6g}{in_unit(system, s)}" for s in symbols)
    words = (
        f"The motion of this log hardly shows {' and '.join(s.name for s in symbols)}, which acts through inertia "
        f"alone. The diagnosis keeps {listed}. A log that accelerates both ways shows more."
    )
    return (Finding("warning", "unseen inertia", words),)
