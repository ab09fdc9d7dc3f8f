"""How the error moves under what the first-order matrix leaves out: noise, the curve of the motion, friction's change.

With ẽ the error that the estimates would have without noise in this sample, by explicit steps and exact numbers,

    ẽ[k+1] = Φ ẽ[k] + N n[k] + X d_x[k] + d_v[k] + a-terms + ΔF[k],    e[k] = ẽ[k] − D n[k],

n the position noise, d_x = x[k+1] − x[k] − h v[k], d_v = v[k+1] − v[k] − h a[k], ΔF the change of friction in a sample.
All hold for an observer that is affine in states and positions while no slip turns: constant M and U, g affine in x
and v, h(s) = s. For others there is no such response, and no bound.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import sympy

from codegen.mechanics.system import Matrix
from codegen.observers.equations import Observer
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import symbol

STEP = symbol("h")
SLOPES = {
    "by_position": "the slope of g in x",
    "by_velocity": "the slope of g in v",
    "by_input": "the slope of g in the inputs",
}
NEAR_ONE_POSITION = (
    "; a copy of the spec in which that force is linear, its slope at one position times the distance from it, "
    "has a bound: that of motion near this position"
)


@dataclass(frozen=True)
class Response:
    """Matrices of exact numbers, m the number of error components, n of coordinates.

    Attributes:
        step: Φ, m by m.
        noise: N, m by n; ``direct``: D, m by n.
        displacement: X, m by n.
        acceleration: what the true acceleration adds at e = 0, m by n (zero for explicit Euler).
        by_position, by_velocity, by_force: slopes of the model's acceleration in x, v and the friction on coordinates.
        by_input: in the inputs, n by inputs.
        by_state: |slope| of every error in every state, m by m.
    """

    step: Matrix
    noise: Matrix
    direct: Matrix
    displacement: Matrix
    acceleration: Matrix
    by_position: Matrix
    by_velocity: Matrix
    by_force: Matrix
    by_input: Matrix
    by_state: Matrix


def error_response(observer: Observer) -> Response | str:
    """The response in force errors; in words what stands against one: all that is not affine, or not explicit."""
    system, numbers = observer.system, {**observer.values, STEP: observer.sample_time}
    if observer.velocity == "measured":
        return "the observer measures velocity, and a bound is known for estimated velocity alone"
    if observer.integration == "implicit":
        return "the step is implicit, and a bound is known for euler and semi_implicit"
    if observer.kind in ("dfo", "gdfo"):
        return "the friction state of a DFO is no linear error"
    mass = system.mass_matrix.subs(numbers)
    if varying := _names(mass):
        return f"M depends on {varying}, and a bound is known for a constant M"
    if varying := _names(system.distribution.subs(numbers)):
        return f"the friction distribution U depends on {varying}, and a bound is known for a constant U"
    inverse = mass.inv()
    signs = dict(zip(_slips(observer), observer.signs, strict=True))
    a = sympy.Matrix([sympy.Dummy(f"a{k}", real=True) for k in range(mass.rows)])
    values: dict[Any, Any] = {}
    model = sympy.zeros(mass.rows, 1)
    estimates: list[Any] = []
    for equation in observer.equations:
        expression = equation.expression.subs(numbers)
        expression = expression.replace(Sgn, lambda u: signs.get(u, Sgn(u)))
        expression = expression.replace(Magnitude, lambda u: signs[u] * u if u in signs else Magnitude(u))
        expression = expression.xreplace(values)
        if equation.form == "mass_solve":
            model, expression = inverse * expression, a
        values.update(zip(equation.symbols, expression, strict=True))
        estimates += list(expression) if equation.state is not None else []
    known = dict(zip(a, model, strict=True))
    found, rates = sympy.Matrix(estimates), observer.rates.subs(numbers).xreplace(values)
    z, x, h = sympy.Matrix(observer.states), sympy.Matrix(system.positions), observer.sample_time
    stepped = rates.xreplace(known)

    turn = sympy.diag(
        *[1 if e.contact is None or not observer.level_errors else observer.signs[e.contact] for e in observer.errors]
    )
    from_state, from_position = found.jacobian(z), found.jacobian(x)
    n, m = mass.rows, len(estimates)
    direct_acceleration = sympy.zeros(m, n)
    direct_acceleration[:n, :] = h * sympy.eye(n)
    # The truth as a state: v̂ = v and ẽ = 0, so z = v − (the rest of the estimate); only slopes in a count here.
    matrices = {
        "step": turn * from_state * (sympy.eye(m) + h * stepped.jacobian(z)) * from_state.inv() * turn,
        "noise": -h * turn * from_state * stepped.jacobian(x),
        "direct": turn * from_position,
        "displacement": -turn * from_position,
        "acceleration": turn * (direct_acceleration - h * from_state * rates.jacobian(a)),
        "by_position": (model.jacobian(x) - model.jacobian(z) * from_state.inv() * from_position),
        "by_velocity": (model.jacobian(z) * from_state.inv())[:, :n],
        "by_force": -inverse,
        "by_state": from_state.subs(dict.fromkeys(observer.signs, 1)).applyfunc(abs),
        "by_input": model.jacobian(sympy.Matrix(system.inputs)) if system.inputs else sympy.zeros(n, 0),
    }
    tidy = {
        name: Matrix(matrix.applyfunc(lambda e: _signs_gone(e, observer.signs))) for name, matrix in matrices.items()
    }
    left = {name: e for name, matrix in tidy.items() for e in matrix if not e.is_Rational}
    if not left:
        return Response(**tidy)
    if observer.integration == "exponential":
        return "the step is exponential, and a bound is known for euler and semi_implicit"
    varies = [words for name, words in SLOPES.items() if name in left and left[name].free_symbols]
    if varies or any(e.free_symbols for e in left.values()):
        what = varies[0] if varies else "the slope of h"
        names = _names(left["by_position"].free_symbols & {*system.positions} if "by_position" in left else ())
        how = f" (it depends on {names}, as that of gravity on a tilting axis does)" if names else ""
        remedy = NEAR_ONE_POSITION if names else ""
        return f"{what} is no constant{how}, and a bound is known for g affine in x and v, and h(s) = s{remedy}"
    return "a number of the step is not rational"


def _names(expressions: Iterable[Any]) -> str:
    """The symbols in expressions, sorted; empty without any. A computed one has names in its text alone."""
    return ", ".join(sorted({s.name for e in expressions for s in e.free_symbols}))


def _slips(observer: Observer) -> tuple[Any, ...]:
    """The symbols of the estimated slips."""
    return next((tuple(e.symbols) for e in observer.equations if e.name == "slip_velocity"), observer.signs)


def _signs_gone(expression: Any, signs: tuple[sympy.Symbol, ...]) -> Any:
    """s² = 1. Where a sign is left all the same, there is no one response for both."""
    expanded = sympy.expand(expression)
    for s in signs:
        if expanded.has(s) and expanded.is_polynomial(s):
            expanded = sympy.rem(expanded, s**2 - 1, s)
    return expanded
