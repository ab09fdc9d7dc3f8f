"""The characteristic polynomial block by block, with Routh–Hurwitz and Jury conditions of each block's own order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np
import sympy

from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import Matrix
from codegen.stability.conditions import WRITABLE, Condition, positive_parameters, reduce_conditions
from codegen.stability.error_dynamics import ErrorDynamics
from codegen.stability.modes import independent_blocks
from codegen.stability.polynomials import characteristic_polynomial, jury, routh_hurwitz

SYMBOLIC_ORDER = 4


@dataclass(frozen=True)
class Factor:
    """One block of Ψ in force errors that no other block acts back on.

    Attributes:
        errors: its components of e.
        polynomial: coefficients of its |sI − Ψ_block|, highest first; None above the fourth order.
        routh, jury: conditions > 0 on the block, necessary and sufficient; () above order 4; jury () if implicit.
    """

    errors: tuple[sympy.Symbol, ...]
    polynomial: tuple[Any, ...] | None
    routh: tuple[Condition, ...]
    jury: tuple[Condition, ...]


def factor_conditions(dynamics: ErrorDynamics, continuous: Any, sampled: Any, h: float) -> tuple[Factor, ...]:
    """Every block's polynomial and conditions: written out in the gains where short, else in the coefficients c.

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
    written = reduce_conditions(_written(raw, c, of_psi), positive)
    known = positive | {period} | {e for _, e in written}
    stepped = reduce_conditions(_written(later, c, of_step), known)
    at = np.ix_(range(len(continuous)), block, block)
    prefix = f"{errors[-1]}: " if several else ""
    return Factor(
        errors,
        tuple(of_psi),
        _valued(written, raw, c, continuous[at], h, prefix),
        () if dynamics.implicit else _valued(stepped, later, c, sampled[at], h, prefix),
    )


def _written(raw: Sequence[tuple[str, Any]], c: Sequence[Any], coefficients: Sequence[Any]) -> list[tuple[str, Any]]:
    """Coefficients put in where that can be read: all at low order, else where that stays short."""
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
    coefficients = np.array([np.poly(m)[1:] for m in matrices]).T
    values = np.asarray(function.map(coefficients.shape[1])(coefficients)).reshape(len(raw), -1).min(axis=1)
    smallest = dict(zip([name for name, _ in raw], values, strict=True))
    return tuple(Condition(prefix + name, e, float(smallest[name])) for name, e in written)
