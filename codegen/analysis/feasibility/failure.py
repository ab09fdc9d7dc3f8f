"""Cause of instability of a gain set: the worst eigenvalue, its operating point, and the conditions that fail there."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import sympy

from codegen.analysis.analysis import largest_euler_steps
from codegen.analysis.conditions import SYMBOLIC_ORDER, Condition
from codegen.analysis.feasibility.gain_dynamics import GainDynamics, Settings
from codegen.analysis.feasibility.region import LIMIT
from codegen.analysis.polynomials import jury, routh_hurwitz


@dataclass(frozen=True)
class Failure:
    """The instability of one gain set, at the operating point where it is worst.

    Attributes:
        which: "continuous" if Ψ is unstable, for any sample time; else "sampled".
        gains: gain symbol → value.
        point: variable → value at the operating point; empty if Ψ is constant.
        eigenvalue: of Ψ in 1/s, or z of the sampled error.
        conditions: those of Routh–Hurwitz ("continuous") or Jury ("sampled") that fail there; () above order 4.
        largest_sample_time: stability limit of explicit Euler over all points, s; 0 if Ψ is unstable.
    """

    which: str
    gains: Mapping[str, float]
    point: Mapping[str, float]
    eigenvalue: complex
    conditions: tuple[Condition, ...]
    largest_sample_time: float


def explain_failure(dynamics: GainDynamics, settings: Settings) -> Failure | None:
    """The instability of one gain set over all operating points; None if it is stable."""
    every = dynamics.every
    for which in ("continuous", "sampled"):
        measures = dynamics.measures(which, settings, every)[0]
        at = int(every[measures.argmax()])
        if measures.max() < LIMIT[which]:
            continue
        matrix = dynamics.matrices(which, settings, [at])[0, 0]
        eigenvalue, conditions = complex(np.inf, 0), tuple[Condition, ...]()
        if np.isfinite(matrix).all():
            eigenvalue = dynamics.worst_eigenvalue(which, settings, at)
            conditions = _failed(which, [float(c) for c in np.poly(matrix).real], float(settings.sample_time[0]))
        return Failure(
            which=which,
            gains={s.name: float(v) for s, v in zip(dynamics.symbols, settings.gains[0], strict=True)},
            point={s.name: float(dynamics.points.values[at, k]) for k, s in enumerate(dynamics.points.variables)},
            eigenvalue=eigenvalue,
            conditions=conditions,
            largest_sample_time=0.0 if which == "continuous" else largest_sample_time(dynamics, settings),
        )
    return None


def largest_sample_time(dynamics: GainDynamics, settings: Settings) -> float:
    """Stability limit of explicit Euler (A = Ψ) for one gain set, min −2 Re λ/|λ|² over eigenvalues and points, s."""
    matrices = dynamics.matrices("continuous", settings, dynamics.every)[0]
    return float(largest_euler_steps(np.linalg.eigvals(matrices)).min())


def _failed(which: str, coefficients: list[float], h: float) -> tuple[Condition, ...]:
    """The conditions on a polynomial, coefficients highest first, that do not hold; () above order 4."""
    if len(coefficients) - 1 > SYMBOLIC_ORDER:
        return ()
    numbers = [sympy.Float(c) for c in coefficients]
    conditions = routh_hurwitz(numbers) if which == "continuous" else jury(numbers, sympy.Float(h))
    valued = [Condition(label, value, float(value)) for label, value in conditions]
    return tuple(c for c in valued if not c.holds)
