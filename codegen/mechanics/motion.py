"""M(x), g(x, v, w) and U(x) of a spec, whichever way it states them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy

from codegen.base.errors import BadInput
from codegen.mechanics.chain_motion import chain_motion
from codegen.mechanics.compact import compact
from codegen.mechanics.constraints import constrained_motion
from codegen.mechanics.lagrangian import lagrangian_motion
from codegen.mechanics.link_parameters import LinkParameter
from codegen.mechanics.sampling import numeric_matrix, sampled_values
from codegen.mechanics.system import Matrix
from codegen.mechanics.topology import topology_motion
from codegen.spec.kinematics import KinematicTree
from codegen.spec.model import Spec
from codegen.spec.motion import Constraints, Lagrangian, Topology

TOLERANCE = 1e-9


@dataclass(frozen=True)
class Motion:
    """M(x), n by n; g(x, v, w), n by 1; U(x), n by contacts."""

    mass_matrix: Matrix
    force: Matrix
    distribution: Matrix


def equation_of_motion(spec: Spec, free: Sequence[LinkParameter] = ()) -> Motion:
    """The matrices as written, or derived from the spec's topology, constraints, Lagrangian or robot file.

    Args:
        free: base parameters of the robot file that stay symbols.

    Raises:
        BadInput: for a form from which they do not follow, or a distribution that contradicts it.
    """
    force = Matrix(spec.force)
    match spec.form:
        case Topology():
            mass, derived = topology_motion(spec, spec.form)
            return Motion(mass, force, _distribution(spec, derived))
        case Constraints():
            mass, force, derived = constrained_motion(spec, spec.form)
            return Motion(mass, force, _distribution(spec, derived))
        case Lagrangian():
            mass, force = lagrangian_motion(spec, spec.form)
            return Motion(mass, force, Matrix(spec.distribution))
        case KinematicTree():
            mass, force = chain_motion(spec, spec.form, free)
            return Motion(mass, force, Matrix(spec.distribution))
        case _:
            return Motion(Matrix(spec.mass_matrix), force, Matrix(spec.distribution))


def form_key(spec: Spec) -> str:
    """The section that holds the mass matrix."""
    if isinstance(spec.form, KinematicTree):
        return "urdf"
    return "mass_matrix" if spec.form is None else type(spec.form).__name__.lower()


def _distribution(spec: Spec, derived: Matrix) -> Matrix:
    """U of the bodies; where the spec gives U too, its columns may differ in sign, and then its signs hold.

    The sign of a column is free: it turns the slip velocity and the friction force together, and U S(v) a stays.
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
    difference = compact(Matrix(a - b))
    if difference == sympy.zeros(difference.rows, 1):
        return True
    sizes = [abs(numeric_matrix(difference, point)).max() for point in sampled_values(spec)]
    return all(size <= TOLERANCE for size in sizes)


def _words(column: Matrix) -> str:
    return ", ".join(str(entry) for entry in column)
