"""Friction cancellation, ū = gain · K(x) F̂, as further equations of an observer.

K is the solution of min r'W r, r = B ū − U F̂, by the factorisation B = C R of a ``Plan``.
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
CLOSED = 3
"""Rows up to which a constant solution is written in closed form over the parameters."""
PREFIX = "cancel"


@numerical("the cancelling input")
def with_cancellation(spec: Spec, observer: Observer) -> Observer:
    """The observer with the cancelling input ū as its last output; unchanged if the spec has no ``cancellation``.

    An estimate does not depend on the input of its own sample, so w = u + ū is no algebraic loop.

    Raises:
        BadInput: if the inputs cancel no friction, or K is unbounded somewhere in the envelope.
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
    steps = Steps(source)
    if found.constant and max(system.degrees_of_freedom, len(system.inputs)) <= CLOSED:
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
        y = _square(steps, C, force)
    else:
        y = _normal(steps, plan, weight, C, force)
    if R.is_Identity:
        return list(_with_unused_inputs(found, plan, sympy.Matrix(y)))
    gram = _symmetric(steps, "R", R * R.T)
    z = steps.solve("R", gram, steps.named(f"{PREFIX}_reached_force", [f"y{k + 1}" for k in range(rank)], y))
    named = steps.named(f"{PREFIX}_multipliers", [f"z{k + 1}" for k in range(rank)], z)
    return list(R.T * sympy.Matrix(named))


def _square(steps: Steps, C: Any, force: list[Any]) -> list[Any]:
    """C⁻¹ force as C'(C C')⁻¹ force: C C' is positive definite, so no pivot is zero."""
    z = steps.solve("S", _symmetric(steps, "S", C * C.T), force)
    named = steps.named(f"{PREFIX}_multipliers", [f"z{k + 1}" for k in range(C.rows)], z)
    return list(C.T * sympy.Matrix(named))


def _normal(steps: Steps, plan: Plan, weight: str, C: Any, force: list[Any]) -> list[Any]:
    """(C'W C + λ I)⁻¹ C'W force by the normal equations, W C by solving with M."""
    n, rank = C.shape
    weighed = C
    if weight != "identity":
        solved = [
            steps.accelerations(f"{PREFIX}_response_{j + 1}", [f"response{j + 1}_{i + 1}" for i in range(n)], C[:, j])
            for j in range(rank)
        ]
        weighed = sympy.Matrix([[solved[j][i] for j in range(rank)] for i in range(n)])
    gram = weighed.T * (weighed if weight == "acceleration" else C)
    if weight == "acceleration":
        force = steps.accelerations(f"{PREFIX}_friction_acceleration", [f"friction_{i + 1}" for i in range(n)], force)
    if plan.damping:
        gram = gram + symbol(DAMPING) * sympy.eye(rank)
    right = list(weighed.T * sympy.Matrix(force))
    named = steps.named(f"{PREFIX}_projected_force", [f"p{k + 1}" for k in range(rank)], right)
    return steps.solve("G", _symmetric(steps, "G", gram), named)


def _symmetric(steps: Steps, letter: str, matrix: Any) -> Any:
    """A symmetric matrix whose entries are named quantities."""
    places = [(i, j) for i in range(matrix.rows) for j in range(i + 1)]
    names = [f"{letter}{i + 1}_{j + 1}" for i, j in places]
    entries = steps.named(f"{PREFIX}_gram_matrix", names, [matrix[p] for p in places])
    result = sympy.zeros(*matrix.shape)
    for (i, j), entry in zip(places, entries, strict=True):
        result[i, j] = result[j, i] = entry
    return result


class Steps:
    """Ordered list of equations; each method adds some and returns the symbols of their results.

    Args:
        source: origin of the equations, for comments in the code.
    """

    def __init__(self, source: str) -> None:
        self._source = source
        self.equations: list[Equation] = []

    def named(self, title: str, names: list[str], values: list[Any]) -> list[Any]:
        """Add an equation for the values, named cancel_NAME; zeros and ones stay numbers."""
        kept = [k for k, value in enumerate(values) if value not in (0, 1)]
        symbols = [symbol(f"{PREFIX}_{names[k]}") for k in kept]
        if kept:
            column = Matrix([values[k] for k in kept])
            self.equations.append(Equation(title, Matrix(symbols), column, ("",) * len(kept), self._source))
        result = list(values)
        for k, s in zip(kept, symbols, strict=True):
            result[k] = s
        return result

    def accelerations(self, title: str, names: list[str], force: Any) -> list[Any]:
        """The a of M a = force, n by 1."""
        symbols = [symbol(f"{PREFIX}_{name}") for name in names]
        if all(e == 0 for e in force):
            return [sympy.S.Zero] * len(names)
        units = ("",) * len(names)
        self.equations.append(Equation(title, Matrix(symbols), Matrix(force), units, self._source, form="mass_solve"))
        return symbols

    def solve(self, letter: str, matrix: Any, right: list[Any]) -> list[Any]:
        """The y of G y = r for symmetric positive definite G: in closed form up to two rows, else by LDLᵀ.

        Args:
            letter: prefix of the names.
            matrix: G, k by k; zeros cost no operations.
            right: r, k entries.
        """
        k = matrix.rows
        if k == 1:
            return [right[0] / matrix[0, 0]]
        if k == 2 and matrix[0, 1] != 0:
            a, b, c = matrix[0, 0], matrix[0, 1], matrix[1, 1]
            over = self.named(f"{PREFIX}_determinant", [f"{letter}_one_over_det"], [1 / (a * c - b * b)])[0]
            return [over * (c * right[0] - b * right[1]), over * (a * right[1] - b * right[0])]
        return self._factored(letter, matrix, right)

    def _factored(self, letter: str, matrix: Any, right: list[Any]) -> list[Any]:
        """The y of G y = r by G = L D Lᵀ."""
        k = matrix.rows
        factor = sympy.eye(k)
        pivot: list[Any] = []
        for j in range(k):
            d = matrix[j, j] - sum(factor[j, p] ** 2 * pivot[p] for p in range(j))
            pivot += self.named(f"{PREFIX}_pivot", [f"{letter}_D{j + 1}"], [d])
            below = range(j + 1, k)
            entries = [
                (matrix[i, j] - sum(factor[i, p] * factor[j, p] * pivot[p] for p in range(j))) / pivot[j] for i in below
            ]
            names = [f"{letter}_L{i + 1}_{j + 1}" for i in below]
            for i, entry in zip(below, self.named(f"{PREFIX}_factors", names, entries), strict=True):
                factor[i, j] = entry
        y = list(right)
        for i in range(k):
            value = y[i] - sum(factor[i, p] * y[p] for p in range(i))
            y[i] = self.named(f"{PREFIX}_forward", [f"{letter}_y{i + 1}"], [value])[0]
        a = [y[i] / pivot[i] for i in range(k)]
        for i in reversed(range(k)):
            value = a[i] - sum(factor[p, i] * a[p] for p in range(i + 1, k))
            a[i] = self.named(f"{PREFIX}_backward", [f"{letter}_a{i + 1}"], [value])[0]
        return a
