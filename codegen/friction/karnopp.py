"""Karnopp's stick-slip: a band of velocities counts as standstill, where friction balances what is applied."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy

from codegen.friction.law import LawParameter, MemoryLaw, Values
from codegen.friction.rising_static import needed
from codegen.friction.stribeck import COULOMB, STATIC, VISCOUS


class Karnopp(MemoryLaw):
    """F = F_c sgn(u) + F_v u for |u| > D_v; within the band F is the applied force, limited to ±F_s."""

    name = "karnopp"
    source = "Karnopp 1985; Mentzelopoulou 1994, section 1.1.2.1"
    parameters = (
        COULOMB,
        STATIC,
        LawParameter("D_v", "{q}/s", True, "half width of the band that counts as standstill"),
        VISCOUS,
    )
    why_not = "within the band the force is that of the rest of the system, not a function of the slip"

    def response(self, time: Any, slip_velocity: Any, p: Mapping[str, float], applied_force: Any = None) -> Any:
        """The force over a history.

        Raises:
            BadInput: if the slip velocity enters the band and no applied force is given.
        """
        u = np.asarray(slip_velocity, dtype=float)
        force = p["F_c"] * np.sign(u) + p["F_v"] * u
        stuck = np.abs(u) <= p["D_v"]
        if not stuck.any():
            return force
        return np.where(stuck, np.clip(needed(applied_force, self.name), -p["F_s"], p["F_s"]), force)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        """Of sliding, outside the band."""
        return p["F_c"] + p["F_v"] * slip_speed

    def slope_bound(self, p: Values) -> sympy.Expr:
        return p["F_v"]
