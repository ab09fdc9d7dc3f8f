"""Bodies under holonomic constraints → M_q, g_q and U_q: A.1.5, Lemma A.2."""

from __future__ import annotations

import sympy

from codegen.base.errors import BadInput
from codegen.mechanics.bodies import body_axes, body_distribution, body_masses, body_positions
from codegen.mechanics.compact import compact
from codegen.mechanics.sampling import numeric_matrix, rank, sampled_values
from codegen.mechanics.system import Matrix
from codegen.spec.model import Spec, symbol
from codegen.spec.motion import Constraints, position_name, rate_name

TOLERANCE = 1e-9


def constrained_motion(spec: Spec, form: Constraints) -> tuple[Matrix, Matrix, Matrix]:
    """M_q = T'M T (A.64), g_q = T'g_x − T'M (dT/dt) v plus the spec's ``force`` (A.66), U_q = T'U_x (A.65).

    T = ∂x/∂q (A.58), k by n; (dT/dt) v = (∂(T v)/∂q) v, the acceleration of the bodies at constant v (A.57).

    Raises:
        BadInput: for coordinates that do not move the bodies independently, and for equations ψ that contradict the
            positions or each other, or say the same twice.
    """
    q = Matrix([symbol(name) for name in spec.positions])
    v = Matrix([symbol(name) for name in spec.velocities])
    x, masses = body_positions(form.bodies), body_masses(form.bodies)
    T = Matrix(x.jacobian(q))
    _require_independent_coordinates(spec, T)
    _check_equations(spec, form, x)
    rate = T * v
    axes = body_axes(form.bodies)
    where = {symbol(position_name(*axis)): x[k] for k, axis in enumerate(axes)}
    where |= {symbol(rate_name(*axis)): rate[k] for k, axis in enumerate(axes)}
    on_bodies = Matrix([form.force.get(axis, sympy.S.Zero) for axis in axes]).subs(where)
    force = T.T * (on_bodies - masses * (rate.jacobian(q) * v))
    distribution = T.T * body_distribution(form.bodies, spec.contacts)
    return (
        compact(Matrix(T.T * masses * T)),
        Matrix(spec.force + compact(Matrix(force))),
        compact(Matrix(distribution)),
    )


def _require_independent_coordinates(spec: Spec, T: Matrix) -> None:
    """Each coordinate is a motion of its own: T_q has full column rank, or M_q would be singular."""
    points = sampled_values(spec)
    for k, name in enumerate(spec.positions):
        if rank(T[:, : k + 1], points) <= k:
            found = f"coordinate {name} " + (
                "adds no motion of the bodies to those of the coordinates before it"
                if any(T[:, k])
                else "moves no body"
            )
            raise BadInput(
                spec.place(f"coordinates.{name}"),
                found,
                "coordinates that move the bodies independently of each other",
                code="SPEC018",
            )


def _check_equations(spec: Spec, form: Constraints, x: Matrix) -> None:
    """ψ(x(q)) = 0 for every q, each ψ another condition, and k − λ = n motions left."""
    axes = [symbol(position_name(*axis)) for axis in body_axes(form.bodies)]
    where, points = dict(zip(axes, x, strict=True)), sampled_values(spec)
    gradients = Matrix(form.equations).jacobian(Matrix(axes)).subs(where) if form.equations else Matrix([])
    for k, equation in enumerate(form.equations):
        place = spec.place(f"constraints.equations[{k}]")
        dependent = rank(gradients[: k + 1, :], points) <= k
        value, at = _largest(compact(equation.subs(where)), points)
        if value > TOLERANCE:
            found = f"equation {k + 1} `{equation}` = {value:.4g} at {at}"
            others = "the equations before it and " if dependent else ""
            raise BadInput(
                place,
                f"contradictory: {found}",
                f"0, which follows from {others}the positions of the bodies",
                code="SPEC018",
            )
        if dependent:
            found = f"redundant: equation {k + 1} `{equation}` follows from those before it"
            raise BadInput(place, found, "equations that are independent", code="SPEC018")
    wanted = len(axes) - len(spec.positions)
    if form.equations and len(form.equations) != wanted:
        given, motions = len(form.equations), len(spec.positions)
        found = f"{given} of {wanted} equations for {len(axes)} positions and {motions} coordinates"
        expected = f"{wanted} equations (number of positions less number of coordinates), or none"
        raise BadInput(spec.place("constraints.equations"), found, expected, code="SPEC018")


def _largest(expression: sympy.Expr, points: list[dict[sympy.Symbol, sympy.Expr]]) -> tuple[float, str]:
    """The largest size of ψ over the points, and where."""
    if expression == 0:
        return 0.0, ""
    sizes = [abs(float(numeric_matrix(Matrix([expression]), point)[0, 0])) for point in points]
    k = max(range(len(points)), key=lambda index: sizes[index])
    names = [s for s in points[k] if s.name in str(expression) and s in expression.free_symbols]
    return sizes[k], ", ".join(f"{s} = {float(points[k][s]):.4g}" for s in names) or "every point"
