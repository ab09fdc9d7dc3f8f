"""Armstrong's seven-parameter law: presliding, Coulomb, viscous and Stribeck friction, lag, rising static friction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy

from codegen.friction.hess_soom_lag import LAG, lagged
from codegen.friction.law import LawParameter, MemoryLaw, Values
from codegen.friction.lorentzian import Lorentzian
from codegen.friction.rising_static import CLOCK
from codegen.friction.stribeck import COULOMB, STRIBECK_VELOCITY

_STEADY = Lorentzian()


class SevenParameter(MemoryLaw):
    """Stuck: F = k_t x. Sliding: F = [F_c + F_v |u| + F_s(γ, t2)/(1 + (u(t − τ_L)/v_s)²)] sgn(u).

    F_s(γ, t2) = F_s,a + (F_s∞ − F_s,a) t2/(t2 + γ) with t2 the time stuck and F_s,a the Stribeck friction when the last
    sliding ended. It is what F_s adds to the Coulomb level, so that sliding starts at |F| = F_c + F_s(γ, t2).

    The source leaves two things open. Here the spring of a contact that sticks holds the force with which sliding
    ends at u = 0, and a history begins stuck without load, after a long rest.
    """

    name = "seven_parameter"
    source = "Armstrong-Hélouvry 1993; Armstrong-Hélouvry, Dupont and Canudas de Wit 1994; Mentzelopoulou 1994, 1.1.2.1"
    parameters = (
        LawParameter("k_t", "{F}/{q}", True, "tangential stiffness while stuck"),
        COULOMB,
        LawParameter("F_v", "{F}*s/{q}", False, "viscous slope"),
        LawParameter("F_s_inf", "{F}", False, "Stribeck friction (above the Coulomb level) after a long rest"),
        STRIBECK_VELOCITY,
        LAG,
        LawParameter("gamma", "s", True, "time stuck after which half the rise is there"),
    )
    why_not = f"{CLOCK}; and the Stribeck part lags by a delay"

    def response(self, time: Any, slip_velocity: Any, p: Mapping[str, float], applied_force: Any = None) -> Any:
        t, u = np.asarray(time, dtype=float), np.asarray(slip_velocity, dtype=float)
        share = 1 / (1 + (lagged(t, u, p["tau_L"]) / p["v_s"]) ** 2)
        force = np.zeros_like(t)
        direction, stuck_since, left = 0.0, -np.inf, p["F_s_inf"]  # direction 0: stuck
        stribeck = left
        for k in range(len(t)):
            before, travel = (force[k - 1], (u[k] + u[k - 1]) / 2 * (t[k] - t[k - 1])) if k else (0.0, 0.0)
            if direction and u[k] * direction <= 0:
                stuck_since, left = t[k], stribeck * share[k]
                before, travel, direction = (p["F_c"] + left) * direction, 0.0, 0.0
            if not direction:
                force[k] = before + p["k_t"] * travel
                stribeck = p["F_s_inf"] - (p["F_s_inf"] - left) * p["gamma"] / (t[k] - stuck_since + p["gamma"])
                if abs(force[k]) <= p["F_c"] + stribeck or u[k] * force[k] <= 0:
                    continue
                direction = float(np.sign(u[k]))
            force[k] = (p["F_c"] + p["F_v"] * abs(u[k]) + stribeck * share[k]) * direction
        return force

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        """Of sliding that began after a long rest: the Stribeck part keeps the size it had then."""
        return _STEADY.level(slip_speed, {**p, "F_s": p["F_c"] + p["F_s_inf"]})

    def slope_bound(self, p: Values) -> sympy.Expr:
        return _STEADY.slope_bound({**p, "F_s": p["F_c"] + p["F_s_inf"]})
