"""Backward Euler as blocks: z[k] = z[k−1] + h f(z[k], x[k], w[k−1]) by one Newton step, exact where f is linear in z.

The unknowns are the states and the acceleration a; M a = g − F̂ is one more row, so that M(x) is not inverted. Newton
starts from the velocity estimate for a = 0 and the previous other states, with the slip signs of that start. The step
is made at the beginning of a sample, when x[k] is known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import casadi
import sympy

from codegen.mechanics.casadi_form import to_casadi
from codegen.observers.equations import Observer
from codegen.program.mass_solve import MassSolve
from codegen.program.model import Block, Field

SOURCE = "z[k] = z[k-1] + h f(z[k]), one Newton step"


def implicit_blocks(
    observer: Observer, names: Mapping[sympy.Symbol, Any], states: Sequence[Field], period: Any, taken: set[str]
) -> list[Block]:
    """The blocks of the step; the last of them are the states at this sample.

    Args:
        names: symbol → SX of every parameter, measurement and input; the inputs are those held since the last sample.
        states: after the last sample.
        period: SX of the sample time, s.
        taken: names in use; extended.
    """
    before = casadi.vertcat(*[f.symbol for f in states])
    z = casadi.SX.sym("z", len(states))
    a = casadi.SX.sym("a", observer.system.degrees_of_freedom)
    rates, balance = _rates(observer, names, z, a)
    residual = casadi.vertcat(z - before - period * rates, balance)
    unknown = casadi.vertcat(z, a)

    solve = MassSolve(taken, SOURCE)
    start = _start(observer, solve, residual, unknown, before)
    at = casadi.vertcat(start, casadi.SX.zeros(a.shape[0]))
    slope, miss = casadi.substitute([casadi.jacobian(residual, unknown), residual], [unknown], [at])
    change = solve.eliminate(casadi.sparsify(slope), -miss)
    elements, units = tuple(f"{f.name}_now" for f in states), tuple(f.unit for f in states)
    return [*solve.blocks, Block("state_now", elements, start + change[: len(states)], units, SOURCE)]


def _rates(observer: Observer, names: Mapping[sympy.Symbol, Any], z: Any, a: Any) -> tuple[Any, Any]:
    """dz/dt and M a − (g − F̂) as functions of z and a."""
    values = dict(names) | dict(zip(observer.states, casadi.vertsplit(z), strict=True))
    balance = casadi.SX(0, 1)
    for equation in observer.equations:
        expression = to_casadi(equation.expression, values)
        if equation.form == "mass_solve":
            balance = to_casadi(observer.system.mass_matrix, values) @ a - expression
            expression = a
        values.update(zip(equation.symbols, casadi.vertsplit(expression), strict=True))
    return to_casadi(observer.rates, values), balance


def _start(observer: Observer, solve: MassSolve, residual: Any, unknown: Any, before: Any) -> Any:
    """Newton's start: z_v[k] for a = 0, which is linear, and the other states as before."""
    if observer.velocity == "measured":
        return before
    n = observer.system.degrees_of_freedom
    at = casadi.vertcat(before, casadi.SX.zeros(n))
    slope, miss = casadi.substitute([casadi.jacobian(residual[:n], unknown[:n]), residual[:n]], [unknown], [at])
    change = solve.eliminate(casadi.sparsify(slope), -miss)
    elements = [f"z_start_{k + 1}" for k in range(n)]
    start = solve.named("start", elements, [before[k] + change[k] for k in range(n)])
    return casadi.vertcat(*start, before[n:])
