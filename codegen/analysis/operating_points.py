"""Numerical evaluation of Ψ and the sampled matrix A at sampled operating points of the envelope."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.analysis.error_dynamics import ErrorDynamics, derive_error_dynamics
from codegen.analysis.polynomials import expand_products
from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.base.exact_numbers import powers_of_ten
from codegen.mechanics.casadi_form import at_points, function_of, symbol_values, to_casadi
from codegen.mechanics.solve import factorised
from codegen.mechanics.system import Matrix
from codegen.observers.coulomb import refuse_infinite_slope
from codegen.observers.equations import Observer
from codegen.spec.model import Spec, symbol
from codegen.spec.numerics import numerical

RANDOM_POINTS = 400
"""Random operating points within the envelope, in addition to its corners."""


@dataclass(frozen=True)
class OperatingPoints:
    """Sampled operating points at which Ψ and A are evaluated.

    Attributes:
        variables: the symbols on which Ψ or A depends, without gains and parameters.
        values: (points, variables): the centre, the corners, then random points.
        ranges: variable → (low, high).
        missing: variables for which the envelope gives no range.
    """

    variables: tuple[sympy.Symbol, ...]
    values: Array
    ranges: dict[sympy.Symbol, tuple[Any, Any]]
    missing: tuple[sympy.Symbol, ...]


def refuse_missing_ranges(spec: Spec, points: OperatingPoints) -> None:
    """Raise BadInput if Ψ depends on a variable without a range in the envelope: nothing can be proved then."""
    if not points.missing:
        return
    names = [s.name for s in points.missing]
    ranges = " and ".join(f"`{name}: [low, high]`" for name in names)
    expected = f"{ranges}, since Ψ depends on {'it' if len(names) == 1 else 'them'}"
    raise BadInput(spec.place("envelope"), f"no range for {', '.join(names)}", expected, code="SPEC026")


@dataclass(frozen=True, eq=False)
class EvaluatedDynamics:
    """Error dynamics of an observer, with their matrices at sampled points of the envelope.

    Attributes:
        continuous, sampled: Ψ and A in force errors, (distinct points, m, m). Points are distinct if they differ in a
            variable on which Ψ or A depends.
        index: for each of ``points`` the index of the distinct one.
    """

    dynamics: ErrorDynamics
    points: OperatingPoints
    continuous: Array
    sampled: Array
    index: NDArray[np.intp]


@numerical("the error dynamics over the envelope")
def dynamics_over_envelope(
    spec: Spec, observer: Observer, differential: ErrorDynamics | None = None
) -> EvaluatedDynamics:
    """The error dynamics of an observer, evaluated over the envelope; BadInput if they are not finite there.

    ``differential``: as of ``derive_error_dynamics``.
    """
    refuse_infinite_slope(spec)
    dynamics = rates_for_neighbours(derive_error_dynamics(observer, differential=differential), spec.envelope)
    points = operating_points(dynamics, spec)
    psi, step = dynamics.in_force(dynamics.jacobian), dynamics.in_force(dynamics.sampled)
    distinct, index = distinct_points(dynamics, points, psi, step)
    continuous, sampled = evaluate(dynamics, psi, distinct), evaluate(dynamics, step, distinct)
    finite = np.isfinite(continuous).all(axis=(1, 2)) & np.isfinite(sampled).all(axis=(1, 2))
    if not finite.all():
        at = ", ".join(f"{s} = {v:.4g}" for s, v in zip(points.variables, distinct.values[~finite][0], strict=True))
        found = f"the error dynamics are not finite at {at or 'every point'}"
        expected = "a force and gains whose slopes are finite in the whole envelope"
        raise BadInput(spec.place("envelope"), found, expected, code="SPEC033")
    return EvaluatedDynamics(dynamics, points, continuous, sampled, index)


def _variables(dynamics: ErrorDynamics, *matrices: Matrix) -> set[sympy.Symbol]:
    """The symbols on which matrices of the dynamics depend, without gains and parameters."""
    constants = set(dynamics.observer.values)
    free = {s for matrix in matrices for s in matrix.free_symbols} - constants
    for expression in dynamics.slopes.values():
        free |= expression.free_symbols - constants
    free -= {symbol("h"), *dynamics.inverse_mass, *dynamics.slopes}
    if dynamics.inverse_mass:
        free |= dynamics.observer.system.mass_matrix.free_symbols - constants
    return free


def distinct_points(
    dynamics: ErrorDynamics, points: OperatingPoints, *matrices: Matrix
) -> tuple[OperatingPoints, NDArray[np.intp]]:
    """The points that differ in a variable of the matrices, in order; for each of ``points`` its index among them."""
    used = _variables(dynamics, *matrices)
    columns = [k for k, s in enumerate(points.variables) if s in used]
    if len(columns) == len(points.variables):
        return points, np.arange(len(points.values))
    _, first, alike = np.unique(points.values[:, columns], axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return replace(points, values=points.values[first[order]]), np.argsort(order)[alike.ravel()]


def rates_for_neighbours(dynamics: ErrorDynamics, envelope: Mapping[str, Any]) -> ErrorDynamics:
    """The dynamics with v_next = v + h v_dot for the velocity at the next sample, if the envelope bounds v_dot.

    A friction state f_rail is treated alike, if the envelope bounds f_rail_dot. With v and v_next as independent
    variables, v_next − v would range over twice the envelope; so it is h v_dot, which is small.
    """
    h, bounded = symbol("h"), {}
    for neighbour, s in dynamics.next_velocity.items():
        if f"{s.name}_dot" in envelope:
            rate = h * symbol(f"{s.name}_dot")
            bounded[neighbour] = s - rate if dynamics.implicit else s + rate
    rest = {n: s for n, s in dynamics.next_velocity.items() if n not in bounded}
    sampled = Matrix(dynamics.sampled.xreplace(bounded).applyfunc(expand_products)) if bounded else dynamics.sampled
    return replace(dynamics, sampled=sampled, next_velocity=rest)


def operating_points(dynamics: ErrorDynamics, spec: Spec) -> OperatingPoints:
    """The centre, the corners and random points of the envelope in the variables of Ψ and A.

    A variable without a range in the envelope has −1…1, an angle −π…π.
    """
    variables = tuple(sorted(_variables(dynamics, dynamics.jacobian, dynamics.in_force(dynamics.sampled)), key=str))
    ranges: dict[sympy.Symbol, tuple[Any, Any]] = {}
    missing = []
    for s in variables:
        base = dynamics.next_velocity.get(s, s)
        if s in dynamics.observer.signs:
            ranges[s] = (sympy.Integer(-1), sympy.Integer(1))
        elif base.name in spec.envelope:
            ranges[s] = spec.envelope[base.name]
        elif base in dynamics.observer.truth_ranges:
            ranges[s] = dynamics.observer.truth_ranges[base]
        else:
            missing.append(s)
            unit = dict(zip(dynamics.observer.system.positions, dynamics.observer.system.position_units, strict=True))
            size = sympy.pi if unit.get(s) == "rad" else sympy.Integer(1)
            ranges[s] = (-size, size)
    bounds = np.array([[float(lo), float(hi)] for lo, hi in ranges.values()]).reshape(-1, 2)
    generator = np.random.default_rng(1)
    centre = bounds.mean(axis=1)[None, :]
    corners = _corners(bounds)
    spread = generator.uniform(bounds[:, 0], bounds[:, 1], (RANDOM_POINTS, len(bounds)))
    # Half of the points are concentrated near standstill, where friction changes fastest.
    spread[: RANDOM_POINTS // 2] *= powers_of_ten(-generator.uniform(0, 4, (RANDOM_POINTS // 2, 1)))
    spread = np.clip(spread, bounds[:, 0], bounds[:, 1])
    points = np.vstack([centre, corners, spread])
    points = _consistent(dynamics, variables, points, generator)
    return OperatingPoints(variables, points if variables else points[:1], ranges, tuple(missing))


def _consistent(
    dynamics: ErrorDynamics, variables: tuple[sympy.Symbol, ...], points: Array, generator: np.random.Generator
) -> Array:
    """The points made consistent: the sign of each slip is that of its velocities, and v_next is 0.6 to 1.4 times v."""
    column = {s: k for k, s in enumerate(variables)}
    share = generator.uniform(0.6, 1.4, len(points))
    for following, v in dynamics.next_velocity.items():
        if v in column:
            points[:, column[following]] = points[:, column[v]] * share
    slips = zip(dynamics.observer.signs, dynamics.observer.system.slip_velocity, strict=True)
    for s, slip in slips:
        if s not in column:
            continue
        slip = slip.subs(dynamics.observer.system.values)
        if slip.free_symbols <= set(column):
            value = at_points(function_of(slip, variables), points).ravel()
        else:
            value = points[:, column[s]]
        points[:, column[s]] = np.where(value < 0, -1.0, 1.0)
    return points


def _corners(bounds: Array) -> Array:
    """The corners of a box, (corners, variables); none for more than ten variables."""
    if len(bounds) == 0 or len(bounds) > 10:
        return np.empty((0, len(bounds)))
    return np.array(np.meshgrid(*bounds)).reshape(len(bounds), -1).T


def evaluate(
    dynamics: ErrorDynamics, matrix: Matrix, points: OperatingPoints, sample_time: float | None = None
) -> Array:
    """A matrix of the error dynamics at every point, (points, m, m), at the spec's gains and parameters."""
    h = float(dynamics.observer.sample_time if sample_time is None else sample_time)
    function = matrix_function(dynamics, matrix, points.variables)
    return at_points(function, np.column_stack([points.values, np.full(len(points.values), h)]))


def matrix_function(
    dynamics: ErrorDynamics, matrix: Matrix, variables: Sequence[sympy.Symbol], gains: Sequence[sympy.Symbol] = ()
) -> Any:
    """A matrix of the error dynamics as a CasADi function of one column: operating point, gains and sample time.

    ``variables`` and ``gains`` are the first entries of the column, h is the last. Other gains have the spec's values.
    """
    opened = (*variables, *gains, symbol("h"))
    column = casadi.SX.sym("p", len(opened))
    names = symbol_values(dynamics.observer.values, (opened, column))
    names |= {s: to_casadi(e, names) for s, e in dynamics.slopes.items()}
    if dynamics.inverse_mass:
        mass = to_casadi(dynamics.observer.system.mass_matrix, names)
        inverse = factorised(mass).solve_columns(casadi.SX.eye(mass.shape[0]))
        names |= {s: inverse[i, j] for s, (i, j) in dynamics.inverse_mass.items()}
    return casadi.Function("matrix", [column], [casadi.densify(to_casadi(matrix, names))])
