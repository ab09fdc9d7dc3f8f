"""Linear response of the estimation error to disturbances, in exact numbers: noise, acceleration, changes of friction.

With n the measurement noise of the positions, a the acceleration, ΔF the change of friction in a sample,

    d_x = x[k+1] − x[k] − h v[k]   (− h v[k+1] for a semi-implicit observer, whose equations use the new velocity),
    d_v = v[k+1] − v[k] − h a[k],

an explicit step of the observer has the error

    ẽ[k+1] = Φ ẽ[k] + N n[k] + X d_x[k] + V d_v[k] + A a[k] + ΔF[k],    e[k] = ẽ[k] − D n[k].

D is the direct feedthrough of the noise to the estimates; ẽ is the error without it. The equations hold while no slip
reverses, for an observer that is affine in states and positions: M and U constant, g affine in v, h(s) = s. For others
there is no such response, and no bound. Terms of g that are not affine in x, such as gravity on a tilting axis or
cogging, are computed by the observer at the measured position; their difference to the true position adds to d_v.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import sympy

from codegen.analysis.error_dynamics import drop_squares
from codegen.mechanics.sparse import each, jacobian, scaled
from codegen.mechanics.system import Matrix
from codegen.observers.equations import Observer
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import symbol

STEP = symbol("h")
"""Symbol of the sample time."""
SLOPES = {"by_position": "the stiffness dg/dx", "by_velocity": "the damping dg/dv", "by_input": "the input gain dg/dw"}
"""Matrix of ``Response`` → its name in reasons."""


@dataclass(frozen=True)
class Response:
    """The matrices of the linear response, in exact numbers; m error components (force errors), n coordinates.

    Attributes:
        step: Φ, m by m.
        noise: N, m by n.
        direct: D, m by n.
        displacement: X, m by n.
        velocity: V, m by n.
        acceleration: A, m by n; zero for Euler and semi-implicit steps, but in a semi-implicit tracker for its gain K_1
            on the position: its state moves by the old velocity and x by the new one, which leaves −h² K_1 a.
        by_position, by_velocity, by_force: ∂v̂'/∂x, ∂v̂'/∂v and ∂v̂'/∂F of the model's acceleration v̂', n by n.
        by_input: ∂v̂'/∂w, n by inputs.
        estimate_by_state: |∂estimate/∂z|, m by m.
        by_nonaffine: ∂v̂'/∂(part), n by number of parts.
        nonaffine: the parts: forces that are not affine in positions or inputs, and not contained in the slopes above.
    """

    step: Matrix
    noise: Matrix
    direct: Matrix
    displacement: Matrix
    velocity: Matrix
    acceleration: Matrix
    by_position: Matrix
    by_velocity: Matrix
    by_force: Matrix
    by_input: Matrix
    estimate_by_state: Matrix
    by_nonaffine: Matrix
    nonaffine: tuple[Any, ...] = ()

    @property
    def inputs(self) -> dict[str, Matrix]:
        """Disturbance → its input matrix: N, X, V, A, and unit columns for changes of friction and rounding errors."""
        unit = sympy.eye(self.step.rows)
        motion = {cause: getattr(self, cause) for cause in ("noise", "displacement", "velocity", "acceleration")}
        return motion | {"friction": unit[:, self.noise.cols :], "rounding": unit}


def error_response(observer: Observer) -> Response | str:
    """The linear response of the force errors to disturbances; or why there is none, such as an implicit step."""
    system, h, numbers = observer.system, observer.sample_time, _numbers(observer)
    if reason := _unsupported(observer):
        return reason
    inverse = system.mass_matrix.xreplace(numbers).inv()
    n, m = inverse.rows, len(observer.errors)
    a = sympy.Matrix([sympy.Dummy(f"a{k}", real=True) for k in range(n)])
    nonaffine = NonAffine(observer)
    values, acceleration, estimates = _substituted(observer, inverse, a, nonaffine)
    rates = observer.rates.xreplace(numbers).xreplace(values)
    if nonaffine.parts and (observer.domain is not None or rates.free_symbols & nonaffine.parts.keys()):
        return (
            "the force is not linear in position; with a domain, or where the observer integrates it, no bound is known"
        )

    z, x = sympy.Matrix(observer.states), sympy.Matrix(system.positions)
    step_rates = rates.xreplace(dict(zip(a, acceleration, strict=True)))
    estimate_by_state, direct = jacobian(estimates, z), jacobian(estimates, x)
    state_by_estimate, acceleration_by_state = estimate_by_state.inv(), jacobian(acceleration, z)
    of_velocity = sympy.eye(m)[:, :n]
    if observer.integration == "semi_implicit":
        # d_x is relative to v[k+1]: x[k+1] − x[k] − h v[k] = d_x + h (h a[k] + d_v[k]).
        of_velocity = of_velocity - h * direct
    # The slopes of v̂' are taken at e = 0 in x and v, with the states z = z(estimates = truth, x).
    matrices = {
        "step": estimate_by_state * (sympy.eye(m) + h * jacobian(step_rates, z)) * state_by_estimate,
        "noise": -h * estimate_by_state * jacobian(step_rates, x),
        "direct": direct,
        "displacement": -direct,
        "velocity": of_velocity,
        "acceleration": h * of_velocity - h * estimate_by_state * jacobian(rates, a),
        "by_position": jacobian(acceleration, x) - acceleration_by_state * state_by_estimate * direct,
        "by_velocity": (acceleration_by_state * state_by_estimate)[:, :n],
        "by_force": -inverse,
        "estimate_by_state": estimate_by_state.subs(dict.fromkeys(observer.signs, 1)).applyfunc(abs),
        "by_input": jacobian(acceleration, system.inputs) if system.inputs else sympy.zeros(n, 0),
        "by_nonaffine": jacobian(acceleration, [*nonaffine.parts]) if nonaffine.parts else sympy.zeros(n, 0),
    }
    signs = [
        1 if e.contact is None or not observer.level_errors else observer.signs[e.contact] for e in observer.errors
    ]
    for name in ("step", "noise", "direct", "displacement", "velocity", "acceleration"):
        matrices[name] = scaled(signs, matrices[name], signs if name == "step" else [1] * n)
    # A sign that remains makes the response depend on the direction of slip; ``_not_constant`` reports it.
    exact = {
        name: each(matrix, lambda e: drop_squares(sympy.expand(e), observer.signs)) for name, matrix in matrices.items()
    }
    reason = _not_constant(observer, exact)
    return reason or Response(**exact, nonaffine=tuple(nonaffine.parts.values()))


def _numbers(observer: Observer) -> dict[sympy.Symbol, Any]:
    """Parameter, gain or sample time → its exact value."""
    return {**observer.values, STEP: observer.sample_time}


def _unsupported(observer: Observer) -> str:
    """Why an observer of this kind has no response; empty if it may have one."""
    if observer.velocity == "measured":
        return "the observer measures velocity, and the bound covers estimated velocity only"
    if observer.integration == "implicit":
        return "the step is implicit, and the bound covers euler and semi_implicit"
    if any(e.of == "state" for e in observer.errors):
        return "the error of a DFO's friction state is not linear, and the bound is a sum of linear responses"
    if not observer.exact:
        return "e = 0 is no equilibrium of the observer's error, and the bound is a sum of responses about it"
    if varying := _names(observer.system.mass_matrix.xreplace(_numbers(observer))):
        return f"the mass matrix depends on {varying}, and the bound covers a constant one"
    if varying := _names(observer.system.distribution.xreplace(_numbers(observer))):
        return f"the friction distribution depends on {varying}, and the bound covers a constant one"
    return ""


def _substituted(
    observer: Observer, inverse_mass: Matrix, a: Matrix, nonaffine: NonAffine
) -> tuple[dict[Any, Any], Matrix, Matrix]:
    """(symbol of an equation → its expression in states and measurements, the model's acceleration, the estimates).

    ``a``: symbols that replace the model's acceleration where equations use it. ``nonaffine`` collects parts of forces.
    """
    numbers = _numbers(observer)
    slips = next((tuple(e.symbols) for e in observer.equations if e.name == "slip_velocity"), observer.signs)
    signs = dict(zip(slips, observer.signs, strict=True))

    values: dict[Any, Any] = {}
    acceleration: Any = sympy.zeros(len(a), 1)
    estimates: list[Any] = []
    for equation in observer.equations:
        expression = equation.expression.xreplace(numbers)
        expression = expression.replace(Sgn, lambda u: signs.get(u, Sgn(u)))
        expression = expression.replace(Magnitude, lambda u: signs[u] * u if u in signs else Magnitude(u))
        expression = nonaffine.replaced_in(expression, equation.form == "mass_solve").xreplace(values)
        if equation.form == "mass_solve":
            acceleration, expression = inverse_mass * expression, a
        values.update(zip(equation.symbols, expression, strict=True))
        estimates += list(expression) if equation.state is not None else []
    return values, acceleration, sympy.Matrix(estimates)


def _not_constant(observer: Observer, matrices: Mapping[str, Matrix]) -> str:
    """The reason why the response is not constant: a matrix with an entry that is no rational number; else ""."""
    varying = {name: e for name, matrix in matrices.items() for e in matrix if not e.is_Rational}
    if not varying:
        return ""
    if observer.integration == "exponential":
        return "the step is exponential, and the bound covers euler and semi_implicit"
    free = {x for e in varying.values() for x in e.free_symbols}
    if free and free <= {*observer.signs}:
        return "K_F couples contacts, so that each direction of slip has another error matrix, and the bound covers one"
    slopes = [words for name, words in SLOPES.items() if name in varying and varying[name].free_symbols]
    if slopes or free:
        what = slopes[0] if slopes else "the slope of the gain function h"
        reason = f"{what} is not constant, and the bound covers a constant one"
        contacts = observer.system.contacts
        forces = [c.known_force.replace(Sgn, lambda u: 1).replace(Magnitude, lambda u: u) for c in contacts]
        curved = ", ".join(c.name for c, f in zip(contacts, forces, strict=True) if f.diff(c.slip, 2) != 0)
        if curved and what == SLOPES["by_velocity"]:
            reason += (
                f"; the effects on {curved} are curved over the slip speed: a curve that is the contact's law "
                "(`stiction laws` lists them with their curves) has a bound, since it is then estimated; where the "
                "curve is steep this bound is large"
            )
        return reason
    return "the matrix of a sample contains an irrational number, and the bound is computed in rational ones"


class NonAffine:
    """Terms of an observer's forces that depend on no state and are not affine in positions or inputs.

    If any of them depends on a position, all terms of g with a position count as one part, affine ones too: the claim
    (``forces: measured``) then states one force at the measured positions.

    Attributes:
        parts: symbol → the part that it replaces.
    """

    def __init__(self, observer: Observer) -> None:
        self._positions = {*observer.system.positions}
        self._measured = self._positions | {*observer.system.inputs}
        self._known = self._measured | {*observer.signs}
        self.parts: dict[sympy.Dummy, Any] = {}
        numbers = _numbers(observer)
        entries = [e for equation in observer.equations for e in equation.expression.xreplace(numbers)]
        self._all_with_position = any(
            term.free_symbols & self._positions for e in entries for term in self._terms(e, False)
        )

    def replaced_in(self, expression: Matrix, is_force: bool) -> Matrix:
        """The expressions, each with its non-affine part replaced by one symbol, which is added to ``parts``."""
        return Matrix(expression.applyfunc(lambda e: self._replaced(e, is_force and self._all_with_position)))

    def _replaced(self, expression: Any, all_with_position: bool) -> Any:
        """One expression with its non-affine part replaced."""
        terms = self._terms(expression, all_with_position)
        if not terms:
            return expression
        part = sympy.Dummy("nonaffine", real=True)
        self.parts[part] = sum(terms)
        return sympy.expand(expression) - self.parts[part] + part

    def _terms(self, expression: Any, all_with_position: bool) -> list[Any]:
        """The terms without states that are not affine or, with ``all_with_position``, that contain a position."""
        terms = [e for e in sympy.Add.make_args(sympy.expand(expression)) if e.free_symbols <= self._known]
        return [e for e in terms if not self._is_affine(e) or (all_with_position and e.free_symbols & self._positions)]

    def _is_affine(self, term: Any) -> bool:
        """Whether a term is a constant, or a constant times one position or input."""
        _, rest = term.as_independent(*self._measured, as_Add=False)
        return bool(rest.is_Symbol or not rest.free_symbols)


def _names(expressions: Iterable[Any]) -> str:
    """The symbols in expressions, sorted, as text; empty without any."""
    return ", ".join(sorted({s.name for e in expressions for s in e.free_symbols}))
