"""Hess and Soom's Stribeck friction that follows the slip velocity after a pure time lag."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy

from codegen.friction.law import LawParameter, MemoryLaw, Values
from codegen.friction.lorentzian import Lorentzian
from codegen.friction.stribeck import COULOMB, STATIC, STRIBECK_VELOCITY, VISCOUS

LAG = LawParameter("tau_L", "s", False, "lag of the Stribeck friction behind the slip velocity")
_STEADY = Lorentzian()


class HessSoomLag(MemoryLaw):
    """F = [F_c + F_v |u| + (F_s − F_c)/(1 + (u(t − τ_L)/v_s)²)] sgn(u)."""

    name = "hess_soom_lag"
    source = "Hess and Soom 1990; Mentzelopoulou 1994, section 1.1.2.1"
    parameters = (COULOMB, STATIC, STRIBECK_VELOCITY, LAG, VISCOUS)
    why_not = "the force needs the slip velocity of τ_L ago: a delay, not a finite number of states"

    def response(self, time: Any, slip_velocity: Any, p: Mapping[str, float], applied_force: Any = None) -> Any:
        """The force over a history; before it began, the slip velocity was what it is at its first time."""
        u = np.asarray(slip_velocity, dtype=float)
        rise = (p["F_s"] - p["F_c"]) / (1 + (lagged(time, u, p["tau_L"]) / p["v_s"]) ** 2)
        return (p["F_c"] + p["F_v"] * np.abs(u) + rise) * np.sign(u)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return _STEADY.level(slip_speed, p)

    def slope_bound(self, p: Values) -> sympy.Expr:
        """Of steady sliding."""
        return _STEADY.slope_bound(p)


def lagged(time: Any, slip_velocity: Any, lag: float) -> Any:
    """u(t − lag), linear between the times of the history and constant before it."""
    time = np.asarray(time, dtype=float)
    return np.interp(time - lag, time, slip_velocity)
