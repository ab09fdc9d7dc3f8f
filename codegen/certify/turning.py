"""One function for both signs of every slip, so that a turn from one sample to the next leaves V as it is; or none.

A step has one sign throughout. That in which a slip turns is another, made with the old sign and read with the new:
it moves the level by 2 K_F |û| besides, with the velocity error in û, and no V is claimed to fall there.

In levels a turn of contact c changes A into J_c A J_c, J_c = diag(±1) with −1 at the errors of c. If V = e'Pe serves
all signs, so does the mean of P over all products of the J_c, which commutes with each: P has no entry between the
errors of two contacts, or of a contact and a velocity. Such a P proves the fall for the family in force errors and for
every sign at once. There is none where a Z >= 0 has Z <= the mean of Φ Z Φ' over the signs, since tr(PZ) would have to
fall and not fall; Z = diag(0, I) is one for explicit Euler, exactly.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.certify.enclosure import Cells
from codegen.certify.lyapunov import common_lyapunov
from codegen.checker import verify
from codegen.observers.equations import Observer

MOST_MATRICES = 32


def kept_by_turns(observer: Observer) -> NDArray[np.bool_]:
    """Where a P that commutes with every J_c may hold entries, m by m."""
    contacts = [e.contact for e in observer.errors]
    return np.array([[a == b for b in contacts] for a in contacts])


def turns(observer: Observer) -> bool:
    """Whether the error changes its sign at a reversal beside others that do not."""
    return observer.level_errors and not kept_by_turns(observer).all()


def through_turns(observer: Observer, cells: Cells) -> tuple[NDArray[np.float64], float] | None:
    """(P, α) as ``common_lyapunov``, P of the form that turns keep; None if none is found, or not looked for."""
    if len(cells.matrices) > MOST_MATRICES:
        return None
    h = 0.0 if observer.integration == "implicit" else float(observer.sample_time)
    return common_lyapunov(cells.matrices, h, kept_by_turns(observer))


def none_through_turns(observer: Observer, matrix: Any) -> bool:
    """Whether Z = diag(0, I) proves, in exact numbers, that no P serves all signs of explicit steps at one point.

    Args:
        matrix: A there, m by m, exact rationals.
    """
    if observer.integration == "implicit":
        return False
    kept, size = kept_by_turns(observer), range(matrix.rows)
    witness = sympy.diag(*[int(e.contact is not None) for e in observer.errors])
    step = sympy.eye(matrix.rows) + observer.sample_time * matrix
    moved = step * witness * step.T
    gap = [[moved[i, j] - witness[i, j] if kept[i, j] else sympy.Integer(0) for j in size] for i in size]
    common = sympy.ilcm(1, *[e.q for row in gap for e in row])
    try:
        verify.positive_pivots([[int(e * common) for e in row] for row in gap], 1, "")
    except verify.Refused:
        return False
    return True
