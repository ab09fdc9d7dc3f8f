"""Why a gain set is not stable: the failing condition or eigenvalue, its value and operating point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import sympy

from codegen.analysis.analysis import largest_euler_steps
from codegen.analysis.feasibility.family import Family, Settings
from codegen.analysis.feasibility.region import LIMIT
from codegen.analysis.polynomials import jury, routh_hurwitz

HIGHEST_ORDER = 4


@dataclass(frozen=True)
class FailedCondition:
    """A condition that is not positive; ``name`` as printed by `stiction derive`."""

    name: str
    value: float


@dataclass(frozen=True)
class Failure:
    """The worst failure of one gain set.

    Attributes:
        which: "continuous" where Ψ itself is unstable, so that no sample time helps; else "sampled".
        gains: gain symbol → number.
        point: operating point; empty where Ψ does not depend on it.
        eigenvalue: of Ψ in 1/s, or z of the sampled error.
        conditions: those of Routh–Hurwitz ("continuous") or Jury that fail there; () above the fourth order.
        largest_sample_time: of explicit Euler at these gains over all points, s; 0 where Ψ is unstable.
    """

    which: str
    gains: Mapping[str, float]
    point: Mapping[str, float]
    eigenvalue: complex
    conditions: tuple[FailedCondition, ...]
    largest_sample_time: float


def explain_failure(family: Family, settings: Settings) -> Failure | None:
    """The failure of one gain set over all operating points; None where it is stable."""
    every = family.every
    for which in ("continuous", "sampled"):
        measures = family.measures(which, settings, every)[0]
        at = int(every[measures.argmax()])
        if measures.max() < LIMIT[which]:
            continue
        matrix = family.matrices(which, settings, [at])[0, 0]
        eigenvalue, conditions = complex(np.inf, 0), tuple[FailedCondition, ...]()
        if np.isfinite(matrix).all():
            eigenvalue = family.worst_eigenvalue(which, settings, at)
            conditions = _failed(which, [float(c) for c in np.poly(matrix).real], float(settings.sample_time[0]))
        return Failure(
            which=which,
            gains={s.name: float(v) for s, v in zip(family.symbols, settings.gains[0], strict=True)},
            point={s.name: float(family.points.values[at, k]) for k, s in enumerate(family.points.variables)},
            eigenvalue=eigenvalue,
            conditions=conditions,
            largest_sample_time=0.0 if which == "continuous" else largest_sample_time(family, settings),
        )
    return None


def largest_sample_time(family: Family, settings: Settings) -> float:
    """Stability limit of explicit Euler for one gain set: h < −2 Re λ/|λ|² at every λ and point, where A = Ψ; s."""
    matrices = family.matrices("continuous", settings, family.every)[0]
    return float(largest_euler_steps(np.linalg.eigvals(matrices)).min())


def _failed(which: str, coefficients: list[float], h: float) -> tuple[FailedCondition, ...]:
    if len(coefficients) - 1 > HIGHEST_ORDER:
        return ()
    numbers = [sympy.Float(c) for c in coefficients]
    conditions = routh_hurwitz(numbers) if which == "continuous" else jury(numbers, sympy.Float(h))
    valued = [FailedCondition(name, float(value)) for name, value in conditions]
    return tuple(c for c in valued if c.value <= 0)
