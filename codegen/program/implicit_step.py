"""Backward Euler, z[k] = z[k−1] + h f(z[k], x[k], w[k−1]), solved by Newton's method, as blocks.

If f is linear in z, one Newton step solves it exactly; otherwise two are made. The unknowns are the states z and the
acceleration a, with M a = g − F̂ as further equations, so that M(x) is not inverted. Initial guess: the velocity
estimate that follows for a = 0, and the previous values of the other states. The signs of slip are fixed at those of
the initial guess, so that the equations stay the same in both steps. The step is made at the beginning of a sample,
when x[k] is known.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import casadi
import sympy

from codegen.mechanics.casadi_form import to_casadi
from codegen.observers.equations import Observer
from codegen.program.mass_solve import MassSolve
from codegen.program.model import Block, Field
from codegen.spec.functions import Sgn

SOURCE = "z[k] = z[k-1] + h f(z[k])"


def implicit_blocks(
    observer: Observer, names: Mapping[sympy.Symbol, Any], states: Sequence[Field], period: Any, taken: set[str]
) -> list[Block]:
    """The blocks of the step; the last of them is the states at this sample.

    Args:
        names: symbol → SX of every parameter, measurement and input; the inputs are those held since the last sample.
        states: z[k−1].
        period: SX of the sample time.
        taken: names in use; those of the blocks are added.
    """
    before = casadi.vertcat(*[f.symbol for f in states])
    z = casadi.SX.sym("z", len(states))
    a = casadi.SX.sym("a", observer.system.degrees_of_freedom)
    unknown = casadi.vertcat(z, a)
    signs = {s: casadi.SX.sym("sign") for s in _signs(observer)}
    rates, balance, _ = _rates(observer, names, z, a, signs)
    residual = casadi.vertcat(z - before - period * rates, balance)
    slope = casadi.jacobian(residual, unknown)

    first = MassSolve(taken, SOURCE)
    at = casadi.vertcat(_start(observer, first, residual, unknown, before), casadi.SX.zeros(a.shape[0]))
    signed = casadi.substitute(_rates(observer, names, z, a, {})[2], unknown, at)

    def newton(solve: MassSolve, at: Any) -> Any:
        """The unknowns after a Newton step from ``at``."""
        here = casadi.substitute([slope, residual], [unknown, casadi.vertcat(*signs.values())], [at, signed])
        return at + solve.eliminate(casadi.sparsify(here[0]), -here[1])

    units, elements = tuple(f.unit for f in states), tuple(f"{f.name}_now" for f in states)
    after = newton(first, at)
    if _linear(slope, unknown):
        return [*first.blocks, Block("state_now", elements, after[: len(states)], units, f"{SOURCE}, one Newton step")]
    reached = [*(f"{f.name}_newton" for f in states), *(f"{v.name}_dot_newton" for v in observer.system.velocities)]
    rate_units = tuple(f"{unit}/s^2" for unit in observer.system.position_units)
    once = Block("state_now", tuple(reached), after, (*units, *rate_units), f"{SOURCE}, first Newton step")
    second = MassSolve(taken, SOURCE)
    twice = newton(second, once.symbols)[: len(states)]
    now = Block("state_now", elements, twice, units, f"{SOURCE}, second Newton step")
    return [*first.blocks, once, *second.blocks, now]


def solved_by_one_step(observer: Observer) -> bool:
    """Whether one Newton step solves the implicit step: for given signs of slip, f is linear in z."""
    expressions = [*(e.expression for e in observer.equations), observer.rates, observer.system.mass_matrix]
    names = {s: casadi.SX.sym(s.name) for s in set().union(*(e.free_symbols for e in expressions))}
    z = casadi.SX.sym("z", len(observer.states))
    a = casadi.SX.sym("a", observer.system.degrees_of_freedom)
    signs = {s: casadi.SX.sym("sign") for s in _signs(observer)}
    rates, balance, _ = _rates(observer, names, z, a, signs)
    unknown = casadi.vertcat(z, a)
    return _linear(casadi.jacobian(casadi.vertcat(rates, balance), unknown), unknown)


def _signs(observer: Observer) -> list[Any]:
    """The sgn(·) expressions in the observer's equations."""
    expressions = [*(e.expression for e in observer.equations), observer.rates]
    return sorted(set().union(*(e.atoms(Sgn) for e in expressions)), key=str)


def _rates(
    observer: Observer, names: Mapping[sympy.Symbol, Any], z: Any, a: Any, signs: Mapping[Any, Any]
) -> tuple[Any, Any, Any]:
    """SX of dz/dt, of M a − (g − F̂), and of the signs of slip, over z and a.

    ``signs``: sgn(·) expression → the SX symbol that replaces it; empty to keep the expressions.
    """
    values = dict(names) | dict(zip(observer.states, casadi.vertsplit(z), strict=True))
    held = {s: sympy.Dummy() for s in signs}
    values.update({held[s]: symbol for s, symbol in signs.items()})
    balance = casadi.SX(0, 1)
    for equation in observer.equations:
        if equation.form == "solve":
            break  # no state depends on what follows
        expression = to_casadi(equation.expression.xreplace(held), values)
        if equation.form == "mass_solve":
            balance = to_casadi(observer.system.mass_matrix, values) @ a - expression
            expression = a
        values.update(zip(equation.symbols, casadi.vertsplit(expression), strict=True))
    own = to_casadi(sympy.Matrix(_signs(observer)), values) if _signs(observer) else casadi.SX(0, 1)
    return to_casadi(observer.rates.xreplace(held), values), balance, own


def _linear(slope: Any, unknown: Any) -> bool:
    """Whether a Jacobian does not depend on the unknowns; CasADi differentiates the sign of a magnitude to zero."""
    return bool(casadi.sparsify(casadi.jacobian(casadi.vec(slope), unknown)).nnz() == 0)


def _start(observer: Observer, solve: MassSolve, residual: Any, unknown: Any, before: Any) -> Any:
    """The initial guess: z_v[k] for a = 0, from a linear equation, and z[k−1] for the other states."""
    if observer.velocity == "measured":
        return before
    n = observer.system.degrees_of_freedom
    at = casadi.vertcat(before, casadi.SX.zeros(n))
    slope, miss = casadi.substitute([casadi.jacobian(residual[:n], unknown[:n]), residual[:n]], [unknown], [at])
    change = solve.eliminate(casadi.sparsify(slope), -miss)
    elements = [f"z_start_{k + 1}" for k in range(n)]
    start = solve.named("start", elements, [before[k] + change[k] for k in range(n)])
    return casadi.vertcat(*start, before[n:])
