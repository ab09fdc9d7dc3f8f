"""Friction cancellation: the input ū = gain · K(x) F̂ that opposes the estimated friction, as equations of an observer.

F̂ (p by 1) are the estimated contact forces, U F̂ the force that they exert on the coordinates, and B (coordinates by
inputs) maps inputs to forces. K F̂ is the ū of weighted least squares, min r'W r with the residual force
r = B ū − U F̂; of several minima the smallest ū, or, by Appendix B of the thesis, one that uses selected inputs only.
It is computed from the rank factorisation B = C R of a ``Plan``, since B need have neither full row nor full column
rank.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import sympy

from codegen.cancellation.plan import Plan, make_plan
from codegen.cancellation.reach import Reach, reach
from codegen.mechanics.system import Matrix, System
from codegen.observers.equations import Equation, Observer
from codegen.spec.model import CancellationChoice, Spec, symbol
from codegen.spec.numerics import numerical

GAIN, DAMPING = "cancellation_gain", "cancellation_damping"
"""Names in the generated code of the factor of K, and of the λ of damped least squares."""
LARGEST_CLOSED = 3
"""Most coordinates and inputs with which a constant K is written in closed form over the parameters."""
PREFIX = "cancel"
"""First part of the names of ū and of the intermediate values in the generated code."""


@numerical("the cancelling input")
def with_cancellation(spec: Spec, observer: Observer) -> Observer:
    """The observer with the cancelling input ū as its last output; unchanged if the spec has no ``cancellation``.

    An estimate does not depend on the input of its own sample, so w = u + ū is no algebraic loop. Raises BadInput if
    the inputs cancel no friction, or K is unbounded somewhere in the envelope.
    """
    choice = spec.cancellation
    if choice is None:
        return observer
    found = reach(spec, observer.system, choice.weight)
    plan = make_plan(spec, choice, found)
    gains = {symbol(GAIN): choice.gain} | ({symbol(DAMPING): plan.damping} if plan.damping else {})
    return replace(
        observer,
        equations=(*observer.equations, *cancelling_equations(observer, choice, found, plan)),
        gains={**observer.gains, **gains},
        gain_units={**observer.gain_units, **dict.fromkeys(gains, "1")},
    )


def cancelling_outputs(system: System) -> tuple[str, ...]:
    """Names of the elements of ū in the generated code, in the order of the inputs."""
    return tuple(f"u_{PREFIX}_{w.name}" for w in system.inputs)


def cancelling_equations(
    observer: Observer, choice: CancellationChoice, found: Reach, plan: Plan
) -> tuple[Equation, ...]:
    """The equations of ū; the last one is ū itself."""
    system = observer.system
    source = "Appendix B" if plan.pivots is not None else "least r' W r, r = B u - U F"
    directions, forces = _estimates(observer, plan)
    steps = Steps(source, system.mass_matrix)
    if found.constant and max(system.degrees_of_freedom, len(system.inputs)) <= LARGEST_CLOSED:
        gains = _closed_gains(found, plan, choice.weight, directions)
        inputs = list(gains * forces)
    else:
        inputs = _solved(steps, found, plan, choice.weight, list(directions * forces))
    scaled = Matrix([symbol(GAIN) * sympy.sympify(u) for u in inputs])
    symbols = Matrix([symbol(name) for name in cancelling_outputs(system)])
    last = Equation("cancelling_input", symbols, scaled, system.input_units, source, output=True)
    return (*steps.equations, last)


def _estimates(observer: Observer, plan: Plan) -> tuple[Any, Any]:
    """Directions (n by p) and estimates (p by 1); their product is the force to be cancelled, such as U F̂."""
    by_name = {e.name: e.symbols for e in observer.equations}
    n = observer.system.degrees_of_freedom
    contact = by_name.get("contact_friction")
    if contact is None:
        return sympy.eye(n), sympy.Matrix(by_name["friction_force"])
    U = sympy.Matrix(observer.system.distribution)
    chosen = list(plan.contacts)
    return U[:, chosen], sympy.Matrix([contact[k] for k in chosen])


def _closed_gains(found: Reach, plan: Plan, weight: str, directions: Any) -> Any:
    """K in closed form over the parameters, in lowest terms; inputs by estimates."""
    M, C, R = (sympy.Matrix(m) for m in (found.system.mass_matrix, plan.columns, plan.mixing))
    W = {"identity": sympy.eye(M.rows), "mass_inverse": M.inv()}.get(weight, M.inv() ** 2)
    gram = C.T * W * C + (symbol(DAMPING) * sympy.eye(C.cols) if plan.damping else sympy.zeros(C.cols))
    inner = gram.inv() * C.T * W if C.rows > C.cols or plan.damping else C.inv()
    gains = (R.T * (R * R.T).inv() * inner * directions).applyfunc(lambda e: sympy.factor(sympy.cancel(e)))
    return _with_unused_inputs(found, plan, gains)


def _with_unused_inputs(found: Reach, plan: Plan, rows: Any) -> Any:
    """A matrix with a row for each input, from one with a row for each used input; the others are zero (App. B, 4)."""
    if plan.pivots is None:
        return rows
    full = sympy.zeros(len(found.system.inputs), rows.cols)
    for k, j in enumerate(plan.pivots):
        full[j, :] = rows[k, :]
    return full


def _solved(steps: Steps, found: Reach, plan: Plan, weight: str, force: list[Any]) -> list[Any]:
    """ū by elimination: G y = C'W force with G = C'W C, then the smallest ū with R ū = y, ū = R'(R R')⁻¹ y."""
    C, R = sympy.Matrix(plan.columns), sympy.Matrix(plan.mixing)
    n, rank = C.shape
    if C.is_Identity and not plan.damping:
        y = force
    elif n == rank and not plan.damping:
        # C⁻¹ force as C'(C C')⁻¹ force: C C' is positive definite, so no pivot is zero
        y = list(C.T * sympy.Matrix(steps.solve("weights", C * C.T, force)))
    else:
        y = _normal(steps, plan, weight, C, force)
    if R.is_Identity:
        return list(_with_unused_inputs(found, plan, sympy.Matrix(y)))
    return list(R.T * sympy.Matrix(steps.solve("multipliers", R * R.T, y)))


def _normal(steps: Steps, plan: Plan, weight: str, C: Any, force: list[Any]) -> list[Any]:
    """(C'W C + λ I)⁻¹ C'W force by the normal equations, W C by solving with M."""
    n, rank = C.shape
    weighed = C
    if weight != "identity":
        solved = [steps.accelerations(f"response_{j + 1}", C[:, j]) for j in range(rank)]
        weighed = sympy.Matrix([[solved[j][i] for j in range(rank)] for i in range(n)])
    gram = weighed.T * (weighed if weight == "acceleration" else C)
    if weight == "acceleration":
        force = steps.accelerations("friction_acceleration", force)
    if plan.damping:
        gram = gram + symbol(DAMPING) * sympy.eye(rank)
    return steps.solve("forces", gram, weighed.T * sympy.Matrix(force))


class Steps:
    """Ordered list of equations A y = r; each method adds one and returns the symbols of y, cancel_NAME_1, …."""

    def __init__(self, source: str, mass: Matrix) -> None:
        self._source, self._mass = source, mass
        self.equations: list[Equation] = []

    def accelerations(self, name: str, force: Any) -> list[Any]:
        """The a of M a = force, n by 1; without an equation where the force is zero."""
        return self.solve(name, self._mass, force) if any(force) else list(force)

    def solve(self, name: str, matrix: Any, right: Any) -> list[Any]:
        """The y of A y = r, k by 1, for a symmetric positive definite A."""
        title = f"{PREFIX}_{name}"
        symbols = [symbol(f"{title}_{i + 1}") for i in range(matrix.rows)]
        units = ("",) * len(symbols)
        equation = Equation(title, Matrix(symbols), Matrix(right), units, self._source, "solve", matrix=Matrix(matrix))
        self.equations.append(equation)
        return symbols
