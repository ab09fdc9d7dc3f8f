"""Characteristic polynomial by diagonal block, with Routh–Hurwitz and Jury conditions for each block."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.analysis.conditions import WRITABLE, Condition, positive_parameters, reduce_conditions
from codegen.analysis.error_dynamics import ErrorDynamics
from codegen.analysis.modes import independent_blocks
from codegen.analysis.polynomials import characteristic_polynomial, jury, routh_hurwitz
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import Matrix

Array = NDArray[np.float64]
SYMBOLIC_ORDER = 4


@dataclass(frozen=True)
class Factor:
    """One diagonal block of Ψ in force errors.

    Attributes:
        errors: its components of e.
        polynomial: coefficients of its |sI − Ψ_block|, highest first; None above the fourth order.
        routh, jury: conditions > 0 on the block, each list necessary and sufficient: ``routh`` for Ψ, ``jury`` for the
            step; () above order 4; jury () if implicit.
    """

    errors: tuple[sympy.Symbol, ...]
    polynomial: tuple[Any, ...] | None
    routh: tuple[Condition, ...]
    jury: tuple[Condition, ...]


def factor_conditions(dynamics: ErrorDynamics, continuous: Any, sampled: Any, h: float) -> tuple[Factor, ...]:
    """Polynomial and conditions of every block: in the gains where short, else in the coefficients c.

    Args:
        continuous, sampled: Ψ and A in force errors at the operating points, points by m by m.
        h: the sample time, s.
    """
    psi, step = dynamics.in_force(dynamics.jacobian), dynamics.in_force(dynamics.sampled)
    blocks = independent_blocks(psi, step)
    return tuple(_factor(dynamics, psi, step, block, continuous, sampled, h, len(blocks) > 1) for block in blocks)


def _factor(
    dynamics: ErrorDynamics,
    psi: Matrix,
    step: Matrix,
    block: list[int],
    continuous: Any,
    sampled: Any,
    h: float,
    several: bool,
) -> Factor:
    errors = tuple(dynamics.errors[i] for i in block)
    order = len(block)
    if order > SYMBOLIC_ORDER:
        return Factor(errors, None, (), ())
    c = [sympy.Integer(1), *[sympy.Symbol(f"c{k}", real=True) for k in range(order - 1, -1, -1)]]
    period = sympy.Symbol("h", real=True)
    raw, later = routh_hurwitz(c), jury(c, period)
    of_psi = characteristic_polynomial(psi[block, block])
    of_step = characteristic_polynomial(step[block, block])
    positive = positive_parameters(dynamics.observer.system.values)
    written = written_conditions(raw, c, of_psi, positive)
    stepped = written_conditions(later, c, of_step, positive | {period})
    at = np.ix_(range(len(continuous)), block, block)
    prefix = f"{errors[-1]}: " if several else ""
    return Factor(
        errors,
        tuple(of_psi),
        _valued(written, raw, c, continuous[at], h, prefix),
        () if dynamics.implicit else _valued(stepped, later, c, sampled[at], h, prefix),
    )


def written_conditions(
    raw: Sequence[tuple[str, Any]], c: Sequence[Any], coefficients: Sequence[Any], positive: set[sympy.Symbol]
) -> list[tuple[str, Any]]:
    """Printed conditions, which are together equivalent to those of ``raw``.

    A factor is dropped only where it is positive by its meaning or by a condition of the same list. So the Jury
    conditions do not rely on those of Routh–Hurwitz.

    Args:
        raw: (name, expression > 0), over ``c``.
        c: symbols of the coefficients, highest first; the first is 1.
        coefficients: their values.
        positive: symbols with a positive value.
    """
    return list(_reduced(tuple(_written(raw, c, coefficients)), frozenset(positive)))


@lru_cache(maxsize=256)
def _reduced(written: tuple[tuple[str, Any], ...], positive: frozenset[sympy.Symbol]) -> tuple[tuple[str, Any], ...]:
    """``reduce_conditions``, kept: they are over symbols, and so alike for all values of the gains and parameters."""
    return tuple(reduce_conditions(written, positive))


def _written(raw: Sequence[tuple[str, Any]], c: Sequence[Any], coefficients: Sequence[Any]) -> list[tuple[str, Any]]:
    """Insert the coefficients: all at low order, else only where the result is short."""
    values = dict(zip(c[1:], coefficients[1:], strict=True))
    result = []
    for name, e in raw:
        value = e.subs(values)
        short = len(c) <= 3 or e in values or int(sympy.count_ops(value)) <= WRITABLE
        result.append((name, value if short else e))
    return result


def _valued(
    written: Sequence[tuple[str, Any]],
    raw: Sequence[tuple[str, Any]],
    c: Sequence[Any],
    matrices: Any,
    h: float,
    prefix: str,
) -> tuple[Condition, ...]:
    """Each condition with its smallest value over the points, from the coefficients of the numeric matrices."""
    symbols = casadi.SX.sym("c", len(c) - 1)
    names = {s: symbols[k] for k, s in enumerate(c[1:])} | {sympy.Symbol("h", real=True): casadi.SX(h)}
    column = Matrix([e for _, e in raw])
    function = casadi.Function("conditions", [symbols], [casadi.densify(to_casadi(column, names))])
    coefficients = _coefficients(np.asarray(matrices))
    values = np.asarray(function.map(coefficients.shape[1])(coefficients)).reshape(len(raw), -1).min(axis=1)
    smallest = dict(zip([name for name, _ in raw], values, strict=True))
    return tuple(Condition(prefix + name, e, float(smallest[name])) for name, e in written)


def _coefficients(matrices: Array) -> Array:
    """Coefficients of |sI − A| after the first, order by points, computed exactly and rounded to doubles.

    Faddeev–LeVerrier in integers: in doubles its cancellation would lose a slow rate in the presence of a fast one.

    Args:
        matrices: A, points by order by order, finite; the order is at most ``SYMBOLIC_ORDER``.

    Raises:
        OverflowError: where a coefficient is beyond the doubles.
    """
    ratios = [value.as_integer_ratio() for value in matrices.ravel().tolist()]
    scale = max((below for _, below in ratios), default=1)  # each is a power of two
    numbers = [above * (scale // below) for above, below in ratios]
    whole: NDArray[np.object_] = np.array(numbers, dtype=object).reshape(matrices.shape)
    order, unit = matrices.shape[1], np.eye(matrices.shape[1], dtype=int).astype(object)
    found, product = [], np.broadcast_to(unit, matrices.shape)
    for k in range(1, order + 1):
        current = sum(whole[:, :, j, None] * product[:, None, j, :] for j in range(order))
        coefficient = -sum(current[:, j, j] for j in range(order)) // k  # exact division
        found.append([c / scale**k for c in coefficient])
        product = current + coefficient[:, None, None] * unit
    return np.array(found)
