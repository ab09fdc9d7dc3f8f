"""Parts of a system besides M, g and U λ, as functions of a fit's parameters: states that are not logged."""

from __future__ import annotations

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.diagnosis.law_states import all_law_terms
from codegen.diagnosis.shooting import Structure
from codegen.friction import DynamicLaw
from codegen.mechanics.numpy_form import numpy_function
from codegen.mechanics.system import System
from codegen.simulate.dynamic_contact import INSIDE

Array = NDArray[np.float64]

FAR = 1e300
"""Limit of a state without limits."""


def states(system: System) -> int:
    """Number of states of a free run besides positions and velocities."""
    laws = (c.law for c in system.contacts)
    return 2 * len(system.transmissions) + sum(len(law.states) for law in laws if isinstance(law, DynamicLaw))


class Structures:
    """Bristle stiffnesses, states of friction laws, and loads behind springs of a system."""

    def __init__(self, system: System, symbols: tuple[sympy.Symbol, ...]) -> None:
        """Args:
        symbols: whose values ``at`` is given, in order.
        """
        laws = [terms for _, terms in all_law_terms(system)]
        limits = [limit for terms in laws for limit in terms.limits]
        rest = [value for terms in laws for value in terms.rest]
        low = [-FAR if low is None else INSIDE * low for low, _ in limits]
        high = [FAR if high is None else INSIDE * high for _, high in limits]
        stiffness = [c.law.bristle_stiffness(c.law_parameters) for c in system.contacts]
        loads = [(t.load_fraction, t.stiffness, t.damping, t.gap) for t in system.transmissions]
        self._split = tuple(t.coordinate for t in system.transmissions)
        self._sizes = np.cumsum([len(stiffness), len(rest), len(rest), len(rest)])
        expressions = [*stiffness, *rest, *low, *high, *(e for load in loads for e in load)]
        self._numbers = numpy_function(expressions, symbols, system.values)

    def at(self, numbers: Array) -> Structure:
        values = np.array([float(v) for v in self._numbers(*numbers)])
        sigma, rest, low, high, coupling = np.split(values, self._sizes)
        return Structure(tuple(sigma), self._split, coupling.reshape(-1, 4), np.stack([low, high]), rest)
