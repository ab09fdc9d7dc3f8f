"""Approximation of a friction law in steady sliding by the terms of a simulator, with the error in force.

Terms: a level, powers of the speed s, and a Stribeck rise r exp(−(s/v_s)²). A law that is a sum of terms of the target
is exported exactly. Any other is fitted by non-negative least squares over the speeds of the envelope, so that the
exported friction is dissipative.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy
from scipy.optimize import nnls

from codegen.base.arrays import Array
from codegen.export.mechanism import HIGHEST, SPEED
from codegen.mechanics.casadi_form import at_points, function_of

WIDTHS = 120
"""Number of Stribeck velocities that are tried."""


@dataclass(frozen=True)
class Terms:
    """level + Σ damping_j s^(j+1) + rise exp(−(s/stribeck)²) over the speed s > 0; ``stribeck`` is 0 without a rise."""

    level: float
    damping: tuple[float, ...]
    rise: float = 0.0
    stribeck: float = 0.0

    def damped(self, speed: Any) -> Any:
        """The part of the damping alone."""
        return sum(d * speed ** (j + 1) for j, d in enumerate(self.damping))

    def at(self, speed: Array) -> Array:
        """The force at speeds (N,)."""
        force: Array = self.level + self.damped(speed) + 0 * speed
        return force + self.rise * np.exp(-((speed / self.stribeck) ** 2)) if self.rise else force


@dataclass(frozen=True)
class FrictionFit:
    """Fitted terms, with their largest and RMS force error over the speeds of the envelope."""

    terms: Terms
    exact: bool
    worst: float
    rms: float

    def force_errors(self, unit: str) -> tuple[float | None, float | None, str]:
        """(worst, rms, unit) of a ``Remark``: the force errors, or none if the fit is exact."""
        return (None, None, "") if self.exact else (self.worst, self.rms, unit)


def fit_friction(level: sympy.Expr, speeds: Array, powers: int, stribeck: bool) -> FrictionFit:
    """The terms nearest to a friction level.

    Args:
        level: over SPEED, in force.
        speeds: at which it is fitted.
        powers: highest power of the speed that the target has; 1 for viscous friction. A fit uses the first power only,
            since higher ones would grow quickly beyond the envelope.
        stribeck: whether the target has the Stribeck rise.
    """
    found = _exact(level, powers, stribeck)
    if found is not None:
        return FrictionFit(found, True, 0.0, 0.0)
    values = np.asarray(at_points(function_of(level, [SPEED]), speeds[:, None]).ravel(), dtype=float)
    best: tuple[float, Terms] | None = None
    widths = np.geomspace(speeds[-1] / 1000, speeds[-1] * 2, WIDTHS) if stribeck else [0.0]
    for width in widths:
        columns = [np.ones_like(speeds), speeds]
        if width:
            columns.append(np.exp(-((speeds / width) ** 2)))
        scale = np.array([np.linalg.norm(c) for c in columns])
        weights, distance = nnls(np.column_stack(columns) / scale, values)
        weights = weights / scale
        damping = (float(weights[1]), *(0.0,) * (HIGHEST - 1))
        terms = Terms(float(weights[0]), damping, *((float(weights[-1]), float(width)) if width else ()))
        if best is None or distance < best[0]:
            best = distance, terms
    assert best is not None
    error = best[1].at(speeds) - values
    return FrictionFit(best[1], False, float(np.abs(error).max()), float(np.sqrt(np.mean(error**2))))


def _exact(level: sympy.Expr, powers: int, stribeck: bool) -> Terms | None:
    """The terms of a law, if the target has all of them; else None."""
    constant, rise, width = 0.0, 0.0, 0.0
    damping = [0.0] * HIGHEST
    for term in sympy.Add.make_args(sympy.expand(level)):
        factor, shape = term.as_independent(SPEED)
        value = float(factor)
        power = next((j for j in range(1, powers + 1) if shape == SPEED**j), None)
        if shape == 1:
            constant += value
        elif power is not None:
            damping[power - 1] += value
        elif stribeck and rise == 0 and value > 0 and isinstance(shape, sympy.exp):
            slope = sympy.expand(shape.args[0]).coeff(SPEED, 2)
            if sympy.expand(shape.args[0] - slope * SPEED**2) != 0 or not float(slope) < 0:
                return None
            rise, width = value, float((-slope) ** sympy.Rational(-1, 2))
        else:
            return None
    return Terms(constant, tuple(damping), rise, width) if constant >= 0 else None
