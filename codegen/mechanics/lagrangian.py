"""E(x, v) and V(x) → M and g by Lagrange's equations."""

from __future__ import annotations

from codegen.base.errors import BadInput
from codegen.mechanics.compact import compact
from codegen.mechanics.system import Matrix
from codegen.spec.model import Spec, symbol
from codegen.spec.motion import Lagrangian


def lagrangian_motion(spec: Spec, form: Lagrangian) -> tuple[Matrix, Matrix]:
    """M, n by n, and g, n by 1, of d/dt (∂E/∂v)' − (∂E/∂x)' + (∂V/∂x)' = Φ (A.50), Φ the spec's ``force``.

    With p = (∂E/∂v)', M = ∂p/∂v and g = Φ + (∂E/∂x)' − (∂V/∂x)' − (∂p/∂x) v. Terms of E that are linear in v
    (gyroscopic) or free of it (centrifugal) are admitted.

    Raises:
        BadInput: where E is not of the second degree in the velocities, or a coordinate has no kinetic energy.
    """
    x = Matrix([symbol(name) for name in spec.positions])
    v = Matrix([symbol(name) for name in spec.velocities])
    momentum = Matrix([form.kinetic.diff(rate) for rate in v])
    mass = compact(Matrix(momentum.jacobian(v)))
    place = spec.place("lagrangian.kinetic")
    if mass.has(*v):
        expected = "an energy of the second degree in the velocities"
        raise BadInput(
            place, f"a kinetic energy whose second derivative holds {_first(mass, v)}", expected, code="SPEC018"
        )
    for name, row in zip(spec.velocities, range(mass.rows), strict=True):
        if not any(mass.row(row)):
            raise BadInput(
                place, f"no kinetic energy in {name}", f"a term with {name}**2 for its inertia", code="SPEC018"
            )
    conservative = Matrix([(form.kinetic - form.potential).diff(position) for position in x])
    return mass, Matrix(spec.force + compact(conservative - momentum.jacobian(x) * v))


def _first(mass: Matrix, v: Matrix) -> str:
    return next(str(rate) for rate in v if mass.has(rate))
