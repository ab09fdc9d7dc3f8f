"""How many steps a plant takes in a sample."""

from __future__ import annotations

from math import ceil

import casadi
import numpy as np
from numpy.typing import NDArray

from codegen.mechanics.casadi_form import symbol_values, to_casadi
from codegen.mechanics.system import System
from codegen.simulate.dynamic_contact import DynamicContacts

Array = NDArray[np.float64]
LONGEST_SUBSTEP = 1e-4
STEP_OF_PRESLIDING = 0.05
MOST_SUBSTEPS = 1000


def substeps_of(system: System, period: float, position: Array) -> int:
    """Substeps of a sample: at most ``LONGEST_SUBSTEP`` long and, where a law has states or a load is behind a spring,
    1/20 of what a radian of the oscillation takes, and of the time in which the spring's damping stops it. Position and
    velocity then agree with an exact integration to 1e-5 of their size.

    Args:
        period: s.
        position: (n,) where M and U are taken.
    """
    longest = LONGEST_SUBSTEP
    dynamic = DynamicContacts(system)
    if dynamic.contacts:
        names = symbol_values({**system.values, **dict(zip(system.positions, position, strict=True))})
        mass, U = (np.asarray(casadi.evalf(to_casadi(m, names))) for m in (system.mass_matrix, system.distribution))
        mobility = np.diag(U.T @ np.linalg.solve(mass, U))[list(dynamic.contacts)]
        rate = float(np.sqrt(np.max(mobility * np.maximum(dynamic.stiffness, 0))))
        longest = min(longest, STEP_OF_PRESLIDING / rate) if rate > 0 else longest
    for t in system.transmissions:
        inertia = system.mass_matrix[t.coordinate, t.coordinate] * t.load_fraction * (1 - t.load_fraction)
        stiffness, damping = (float((s / inertia).subs(system.values)) for s in (t.stiffness, t.damping))
        longest = min(longest, STEP_OF_PRESLIDING / max(stiffness**0.5, damping))
    return min(max(1, ceil(period / longest - 1e-9)), MOST_SUBSTEPS)
