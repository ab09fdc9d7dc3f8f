"""Bodies without constraints → M and U: A.1.1 to A.1.4, and a change of coordinates (A.37)."""

from __future__ import annotations

import sympy

from codegen.base.errors import BadInput
from codegen.mechanics.bodies import body_distribution, body_masses, body_positions
from codegen.mechanics.compact import compact
from codegen.mechanics.sparse import jacobian
from codegen.mechanics.system import Matrix
from codegen.spec.model import Spec, symbol
from codegen.spec.motion import Topology

LARGEST_SYMBOLIC = 4


def topology_motion(spec: Spec, form: Topology) -> tuple[Matrix, Matrix]:
    """M, n by n, and U, n by contacts.

    With x̄ the positions of the bodies and x = T x̄: M = T⁻ᵀ M̄ T⁻¹ and U = T⁻ᵀ Ū. For the unitary T of (A.37)
    these are T M̄ T' and T Ū; a lever or a gear is a T that is not.

    Raises:
        BadInput: for a T that has no inverse.
    """
    positions = body_positions(form.bodies)
    if form.transform is None:
        back = jacobian(list(positions), [symbol(name) for name in spec.positions])
    else:
        back = _inverse(spec, Matrix(form.transform))
    mass = compact(Matrix(back.T * body_masses(form.bodies) * back))
    return mass, compact(Matrix(back.T * body_distribution(form.bodies, spec.contacts)))


def _inverse(spec: Spec, T: Matrix) -> Matrix:
    """T⁻¹: T' where T is unitary, else exactly."""
    if compact(Matrix(T * T.T)) == sympy.eye(T.rows):
        return Matrix(T.T)
    place, expected = spec.place("topology.transform"), "an invertible transform"
    if T.free_symbols and T.rows > LARGEST_SYMBOLIC:
        found = f"{T.rows} rows with parameters, not unitary"
        raise BadInput(place, found, f"numbers, a unitary matrix, or up to {LARGEST_SYMBOLIC} rows", code="SPEC015")
    determinant = compact(T.det(method="berkowitz"))
    values = {symbol(p.name): p.value for p in spec.parameters}
    if determinant.subs(values).evalf() == 0:
        raise BadInput(place, "a transform of determinant 0", expected, code="SPEC018")
    return Matrix(T.adjugate() / determinant)
