"""M(x), g(x, v, w) and U(x) of a spec: as written, or from bodies, constraints, energies or a robot file."""

from collections.abc import Sequence

import casadi
import numpy as np
import sympy

from codegen.base.errors import BadInput
from codegen.mechanics.base_parameters import LinkParameter, base_values, masses_of, regrouped
from codegen.mechanics.compact import compact
from codegen.mechanics.computed import computed_matrix
from codegen.mechanics.kinematic_chain import bias_force, mass_matrix, points_of
from codegen.mechanics.sampling import at_samples, rank, sampled_values
from codegen.mechanics.sparse import diagonal, jacobian, sparse
from codegen.mechanics.system import Matrix
from codegen.spec.model import Contact, Spec, symbol
from codegen.spec.motion import Body, Constraints, KinematicTree, Lagrangian, Topology, position_name, rate_name

TOLERANCE = 1e-9
"""Largest magnitude at sampled points of an expression that must be zero."""


def equation_of_motion(spec: Spec, free: Sequence[LinkParameter] = ()) -> tuple[Matrix, Matrix, Matrix]:
    """M(x), n by n; g(x, v, w), n by 1; U(x), n by contacts: as written in the spec, or derived from its other form.

    ``free``: base parameters of the robot file that stay symbols; the others are numbers. Raises BadInput where the
    form does not determine the matrices, or the spec's ``distribution`` contradicts it.
    """
    force = Matrix(spec.force)
    match spec.form:
        case Topology():
            mass, derived = _topology(spec, spec.form)
            return mass, force, _distribution(spec, derived)
        case Constraints():
            mass, force, derived = _constraints(spec, spec.form)
            return mass, force, _distribution(spec, derived)
        case Lagrangian():
            mass, force = _lagrangian(spec, spec.form)
        case KinematicTree():
            mass, force = _kinematic_tree(spec, spec.form, free)
        case _:
            mass = Matrix(spec.mass_matrix)
    return mass, force, Matrix(spec.distribution)


def form_key(spec: Spec) -> str:
    """Name of the spec's section from which the mass matrix is taken, for messages."""
    if isinstance(spec.form, KinematicTree):
        return "urdf"
    return "mass_matrix" if spec.form is None else type(spec.form).__name__.lower()


def _distribution(spec: Spec, derived: Matrix) -> Matrix:
    """The U derived from the bodies, with the signs of the spec's ``distribution`` where it gives one.

    The sign of a column is a convention: it reverses both slip velocity and friction force, so U S(v) a is unchanged.
    """
    if spec.distribution is None:
        return derived
    given = Matrix(spec.distribution)
    for k, contact in enumerate(spec.contacts):
        column = given[:, k]
        if contact.sliding is not None and not any(_equal(spec, column, sign * derived[:, k]) for sign in (1, -1)):
            found = f"U inconsistent with {form_key(spec)}: column {k + 1} [{_words(column)}] of contact {contact.name}"
            between = " and ".join(contact.sliding.bodies)
            expected = f"[{_words(derived[:, k])}], the slip between {between}, or its negative"
            raise BadInput(spec.place("friction.distribution"), found, expected, code="SPEC028")
    return given


def _equal(spec: Spec, a: Matrix, b: Matrix) -> bool:
    """Whether two columns are equal, symbolically or at sampled points of the envelope."""
    difference = compact(Matrix(a - b))
    if difference == sympy.zeros(difference.rows, 1):
        return True
    return bool((np.abs(at_samples(difference, sampled_values(spec))) <= TOLERANCE).all())


def _words(column: Matrix) -> str:
    """The entries of a column as text for a message."""
    return ", ".join(str(entry) for entry in column)


# Bodies: positions and masses in one vector, and the contacts between them by Lemma A.1.


def _axes(bodies: Sequence[Body]) -> list[tuple[str, str]]:
    """(body, direction) of each row of x̄, M̄ and Ū."""
    return [(body.name, direction) for body in bodies for direction in body.positions]


def _positions(bodies: Sequence[Body]) -> Matrix:
    """Positions of the bodies x̄, k by 1, as in (A.41) but ordered by body instead of by direction."""
    return Matrix([position for body in bodies for position in body.positions.values()])


def _masses(bodies: Sequence[Body]) -> Matrix:
    """M̄, k by k, the diagonal matrix of the bodies' masses and moments of inertia: (A.5), (A.43)."""
    return diagonal(b.inertia if direction == "angle" else b.mass for b in bodies for direction in b.positions)


def _body_distribution(bodies: Sequence[Body], contacts: Sequence[Contact]) -> Matrix:
    """Ū, k by contacts, of Lemma A.1; it has columns only for contacts that exist (A.36).

    A contact of bodies i and j slides by u = v_i − v_j, against the ground by u = v_i: its column has +1 at i and −1
    at j, times the contact's share of each direction. A contact without bodies has a column of zeros.
    """
    row = {axis: i for i, axis in enumerate(_axes(bodies))}
    entries: dict[tuple[int, int], sympy.Expr] = {}
    for k, contact in enumerate(contacts):
        if contact.sliding is None:
            continue
        first, second = contact.sliding.bodies
        for direction, share in contact.sliding.along.items():
            for body, sign in ((first, 1), (second, -1)):
                if (body, direction) in row:  # the ground does not move
                    at = row[body, direction], k
                    entries[at] = entries.get(at, sympy.S.Zero) + sign * share
    return sparse(len(row), len(contacts), entries)


# Topology: bodies without constraints.


def _topology(spec: Spec, form: Topology) -> tuple[Matrix, Matrix]:
    """M, n by n, and U, n by contacts, of a ``topology`` section, in the order of the coordinates."""
    back = jacobian(list(_positions(form.bodies)), [symbol(name) for name in spec.positions])
    mass = compact(Matrix(back.T * _masses(form.bodies) * back))
    return mass, compact(Matrix(back.T * _body_distribution(form.bodies, spec.contacts)))


# Constraints: bodies under holonomic constraints, A.1.5.


def _constraints(spec: Spec, form: Constraints) -> tuple[Matrix, Matrix, Matrix]:
    """M, g and U in independent coordinates q of bodies with holonomic constraints, whose positions are x(q).

    M_q = T'M T (A.64), g_q = T'g_x − T'M (dT/dt) v plus the spec's ``force`` (A.66), U_q = T'U_x (A.65).
    T = ∂x/∂q (A.58), k by n; (dT/dt) v = (∂(T v)/∂q) v, the acceleration of the bodies at constant v (A.57).
    """
    q = Matrix([symbol(name) for name in spec.positions])
    v = Matrix([symbol(name) for name in spec.velocities])
    x, masses = _positions(form.bodies), _masses(form.bodies)
    T = Matrix(x.jacobian(q))
    _require_independent_coordinates(spec, T)
    _check_equations(spec, form, x)
    rate = T * v
    axes = _axes(form.bodies)
    where = {symbol(position_name(*axis)): x[k] for k, axis in enumerate(axes)}
    where |= {symbol(rate_name(*axis)): rate[k] for k, axis in enumerate(axes)}
    on_bodies = Matrix([form.force.get(axis, sympy.S.Zero) for axis in axes]).subs(where)
    force = T.T * (on_bodies - masses * (rate.jacobian(q) * v))
    distribution = T.T * _body_distribution(form.bodies, spec.contacts)
    mass, total = compact(Matrix(T.T * masses * T)), Matrix(spec.force + compact(Matrix(force)))
    return mass, total, compact(Matrix(distribution))


def _require_independent_coordinates(spec: Spec, T: Matrix) -> None:
    """Raise BadInput unless T has full column rank: else M_q would be singular."""
    points = sampled_values(spec)
    for k, name in enumerate(spec.positions):
        if rank(T[:, : k + 1], points) <= k:
            adds = "adds no motion of the bodies to those of the coordinates before it"
            found = f"coordinate {name} {adds if any(T[:, k]) else 'moves no body'}"
            expected = "coordinates that move the bodies independently of each other"
            raise BadInput(spec.place(f"coordinates.{name}"), found, expected, code="SPEC018")


def _check_equations(spec: Spec, form: Constraints, x: Matrix) -> None:
    """Check the constraint equations: ψ(x(q)) = 0 for every q, independent ψ, and k − λ = n remaining motions.

    k is the number of body positions, λ that of equations and n that of coordinates.
    """
    axes = [symbol(position_name(*axis)) for axis in _axes(form.bodies)]
    where, points = dict(zip(axes, x, strict=True)), sampled_values(spec)
    gradients = Matrix(form.equations).jacobian(Matrix(axes)).subs(where) if form.equations else Matrix([])
    for k, equation in enumerate(form.equations):
        place = spec.place(f"constraints.equations[{k}]")
        dependent = rank(gradients[: k + 1, :], points) <= k
        value, at = _largest(compact(equation.subs(where)), points)
        if value > TOLERANCE:
            found = f"equation {k + 1} `{equation}` = {value:.4g} at {at}"
            others = "the equations before it and " if dependent else ""
            expected = f"0, which follows from {others}the positions of the bodies"
            raise BadInput(place, f"contradictory: {found}", expected, code="SPEC018")
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
    """The largest |ψ| over the points, and the point in words."""
    if expression == 0:
        return 0.0, ""
    sizes = np.abs(at_samples(Matrix([expression]), points)).ravel()
    k = int(np.argmax(sizes))
    names = [s for s in points[k] if s in expression.free_symbols]
    return float(sizes[k]), ", ".join(f"{s} = {float(points[k][s]):.4g}" for s in names) or "every point"


# Energies and robot files.


def _lagrangian(spec: Spec, form: Lagrangian) -> tuple[Matrix, Matrix]:
    """M, n by n, and g, n by 1, by Lagrange's equations d/dt (∂E/∂v)' − (∂E/∂x)' + (∂V/∂x)' = Φ (A.50).

    E is the kinetic energy, V the potential energy, and Φ the spec's ``force``. With p = (∂E/∂v)', M = ∂p/∂v and
    g = Φ + (∂E/∂x)' − (∂V/∂x)' − (∂p/∂x) v. E may have terms linear in v (gyroscopic) and without v (centrifugal).
    """
    x = Matrix([symbol(name) for name in spec.positions])
    v = Matrix([symbol(name) for name in spec.velocities])
    momentum = Matrix([form.kinetic.diff(rate) for rate in v])
    mass = compact(Matrix(momentum.jacobian(v)))
    place = spec.place("lagrangian.kinetic")
    if mass.has(*v):
        found = f"a kinetic energy whose second derivative holds {next(rate for rate in v if mass.has(rate))}"
        raise BadInput(place, found, "an energy of the second degree in the velocities", code="SPEC018")
    for name, row in zip(spec.velocities, range(mass.rows), strict=True):
        if not any(mass.row(row)):
            raise BadInput(
                place, f"no kinetic energy in {name}", f"a term with {name}**2 for its inertia", code="SPEC018"
            )
    conservative = Matrix([(form.kinetic - form.potential).diff(position) for position in x])
    return mass, Matrix(spec.force + compact(conservative - momentum.jacobian(x) * v))


def _kinematic_tree(spec: Spec, tree: KinematicTree, free: Sequence[LinkParameter]) -> tuple[Matrix, Matrix]:
    """M(x), n by n, and g = force − h(x, v), n by 1, of a robot file.

    The force is the spec's ``force``, by default the joints' inputs, and h the bias force. The ``free`` base parameters
    stay symbols; the others are numbers, from the spec or else from the robot file.
    """
    positions = {symbol(name): casadi.SX.sym(name) for name in spec.positions}
    velocities = {symbol(name): casadi.SX.sym(name) for name in spec.velocities}
    open_ones = {symbol(p.name): casadi.SX.sym(p.name) for p in free}
    x, v = (casadi.vertcat(*names.values()) for names in (positions, velocities))
    whole, tree = tree, regrouped(tree)
    if free or whole.base_parameters:
        values = {name: casadi.SX(float(value)) for name, value in base_values(spec, whole).items()}
        masses = masses_of(tree, values | {s.name: value for s, value in open_ones.items()})
    else:
        masses = [points_of(body) for body in tree.bodies]
    wide = len(tree.bodies) > 9
    mass = computed_matrix(
        lambda i, j: f"M{i + 1}_{j + 1}" if wide else f"M{i + 1}{j + 1}",
        mass_matrix(tree, x, masses),
        positions | open_ones,
        symmetric=True,
    )
    bias = computed_matrix(lambda i, _: f"h{i + 1}", bias_force(tree, x, v, masses), positions | velocities | open_ones)
    return mass, Matrix(Matrix(spec.force) - bias)
