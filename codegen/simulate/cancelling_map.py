"""C(x) of ū = C(x) F̂: the input that leaves the least of a force on the coordinates."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray

from codegen.errors import BadInput
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.input_matrix import NonlinearInput
from codegen.mechanics.system import System
from codegen.spec.model import Spec

Array = NDArray[np.float64]


def least_squares_map(spec: Spec, system: System) -> Callable[[Array], Array]:
    """C = (B' M⁻¹ B)⁺ B' M⁻¹ (inputs by coordinates) as a function of the positions: the remainder r = F̂ − B ū costs
    r' M⁻¹ r, and among equals the smallest ū is taken.

    Raises:
        BadInput: where an input does not enter linearly, or B depends on velocities.
    """
    B = system.input_matrix
    place = spec.place("simulation.cancel")
    if isinstance(B, NonlinearInput):
        raise BadInput(place, B.reason, "inputs that enter linearly, whose effect can be reversed")
    if B.has(*system.velocities):
        raise BadInput(place, "inputs whose effect depends on velocities", "an input matrix over positions")
    x = casadi.SX.sym("x", system.degrees_of_freedom)
    names: dict[Any, Any] = {s: casadi.SX(float(value)) for s, value in system.values.items()}
    names |= {s: x[i] for i, s in enumerate(system.positions)}
    parts = [casadi.densify(to_casadi(matrix, names)) for matrix in (B, system.mass_matrix)]
    matrices = casadi.Function("matrices", [x], parts)

    def at(positions: Array) -> Array:
        onto, mass = (part.full() for part in matrices(positions))
        eased = np.linalg.solve(mass, onto).T
        return np.asarray(np.linalg.pinv(eased @ onto, hermitian=True) @ eased, dtype=float)

    if B.has(*system.positions) or system.mass_matrix.has(*system.positions):
        return at
    constant = at(np.zeros(system.degrees_of_freedom))
    return lambda positions: constant
