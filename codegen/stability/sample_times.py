"""The largest sample time that can be certified at a spec's gains, for every way to step its observer."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import sympy

from codegen.mechanics.system import System
from codegen.observers import build_observer
from codegen.observers.integration import INTEGRATIONS
from codegen.spec.model import Spec
from codegen.stability.analysis import Analysis, analyse
from codegen.stability.certify import Certificate, beyond_checker, certify
from codegen.stability.family import NotEnclosable, build_family
from codegen.stability.lyapunov import common_lyapunov

ANY = 1e3
SHORTEST = 1e-9
STEPS = 14
MARGIN = 0.995


def largest_sample_times(spec: Spec, system: System) -> dict[str, float]:
    """Integration → the largest sample time in s that was certified, within 1 %; inf where 1000 s still is.

    An integration is left out that does not apply (velocity measured, K_v not diagonal), or whose error matrix varies
    over the envelope, and 0 says that none was found. What is handed out has passed the checker.
    """
    assert spec.observer is not None
    varies = not system.mass_matrix.free_symbols <= set(system.values) or spec.observer.kind in ("dfo", "gdfo")
    found: dict[str, float] = {}
    if varies or beyond_checker(build_observer(spec, system)):
        return found
    for integration in INTEGRATIONS:
        if spec.observer.velocity == "measured" and integration in ("semi_implicit", "exponential"):
            continue
        if integration == "exponential" and _full(spec.observer.gains.get("K_v")):
            continue
        chosen = replace(spec, observer=replace(spec.observer, integration=integration, domain=None))
        largest = _largest(chosen, system, analyse(chosen, build_observer(chosen, system)))
        if largest is not None:
            found[integration] = largest
    return found


def _full(gain: object) -> bool:
    return isinstance(gain, list) and any(isinstance(row, list) for row in gain)


def _largest(spec: Spec, system: System, analysis: Analysis) -> float | None:
    try:
        family = build_family(analysis.dynamics, analysis.points.ranges)
    except (NotEnclosable, TypeError):
        return None
    if any(e.free_symbols for e in family.parameters.values()):
        return None
    if _stands(analysis, ANY):
        return math.inf if _certified(spec, system, ANY) else None
    high = ANY
    while not _stands(analysis, high):
        high /= 4
        if high < SHORTEST:
            return 0.0
    low, high = high, 4 * high
    for _ in range(STEPS):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if _stands(analysis, middle) else (low, middle)
    for share in (MARGIN, MARGIN**2, 0.9):
        h = float(f"{low * share:.3g}")
        if _certified(spec, system, h):
            return h
    return 0.0


def _stands(analysis: Analysis, h: float) -> bool:
    """Whether floating point finds a Lyapunov matrix at this sample time."""
    dynamics = analysis.dynamics
    exact = sympy.Rational(Fraction(f"{h:.12g}"))
    at = replace(dynamics, observer=replace(dynamics.observer, sample_time=exact))
    family = build_family(at, analysis.points.ranges)
    matrix = family.matrix.subs(family.parameters)
    a = np.array(matrix.evalf(30).tolist(), dtype=float)
    return common_lyapunov([a], 0.0 if dynamics.implicit else h) is not None


def _certified(spec: Spec, system: System, h: float) -> bool:
    assert spec.observer is not None
    exact = sympy.Rational(Fraction(f"{h:.12g}"))
    shifted = replace(spec, observer=replace(spec.observer, sample_time=exact))
    return isinstance(
        certify(shifted, analyse(shifted, build_observer(shifted, system)), {}, "certify", further=False), Certificate
    )
