"""Laws whose force needs the history of slip: rising static friction, lags, stick-slip and bristles."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy

from codegen.base.errors import BadInput
from codegen.friction.law import LawParameter, MemoryLaw, Values
from codegen.friction.zero_memory import COULOMB, STATIC, STRIBECK_VELOCITY, VISCOUS, Lorentzian

DWELL = LawParameter("F_s_inf", "{F}", False, "static level after a long rest")
CLOCK = "the static level needs the time since the slip stopped, a clock that jumps back to zero"


class RisingStatic(MemoryLaw):
    """F = F_c sgn(u) for u ≠ 0; at rest |F| ≤ F_s(t) with t the time since the slip stopped."""

    why_not = CLOCK

    @abstractmethod
    def static_level(self, dwell: Any, p: Mapping[str, float]) -> Any:
        """F_s after the time ``dwell`` at rest, in the contact's force unit; ``dwell`` in s, a number or an array."""

    def response(self, time: Any, slip_velocity: Any, p: Mapping[str, float], applied_force: Any = None) -> Any:
        """The force over a history; rest is u = 0 exactly, and the history begins as a rest begins.

        Raises:
            BadInput: if the contact rests and no applied force is given: at rest friction is what holds it.
        """
        dwell = time_at_rest(time, slip_velocity)
        resting = np.asarray(slip_velocity) == 0
        force = p["F_c"] * np.sign(slip_velocity)
        if resting.any():
            limit = self.static_level(dwell, p)
            force = np.where(resting, np.clip(needed(applied_force, self.name), -limit, limit), force)
        return force

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["F_c"]

    def slope_bound(self, p: Values) -> sympy.Expr:
        return sympy.Integer(0)


class Derjaguin(RisingStatic):
    """F = F_c sgn(u) for u ≠ 0; at rest |F| ≤ F_s(t) = F_c + (F_s∞ − F_c) t/(t + γ)."""

    name = "rising_static_derjaguin"
    source = "Derjaguin, Push and Tolstoi 1957 after Armstrong-Hélouvry 1991; Mentzelopoulou 1994, section 1.1.2.1"
    parameters = (COULOMB, DWELL, LawParameter("gamma", "s", True, "time at rest after which half the rise is there"))

    def static_level(self, dwell: Any, p: Mapping[str, float]) -> Any:
        return p["F_c"] + (p["F_s_inf"] - p["F_c"]) * dwell / (dwell + p["gamma"])


class Kato(RisingStatic):
    """F = F_c sgn(u) for u ≠ 0; at rest |F| ≤ F_s(t) = F_c + (F_s∞ − F_c) [1 − exp(−γ tⁿ)].

    Conformable contacts: γ from 0.04 to 0.64, n from 0.36 to 0.67; a nonconformable one: γ = 1.66, n = 0.65. With t in
    s, γ has the unit of s⁻ⁿ; a spec writes it as a bare number.
    """

    name = "rising_static_kato"
    source = "Kato, Yamaguchi and Matsubayashi 1972 and 1974; Mentzelopoulou 1994, section 1.1.2.1"
    parameters = (
        COULOMB,
        DWELL,
        LawParameter("gamma", "1", True, "rate of the rise, with t in s"),
        LawParameter("n", "1", True, "exponent of the time at rest"),
    )

    def static_level(self, dwell: Any, p: Mapping[str, float]) -> Any:
        return p["F_c"] + (p["F_s_inf"] - p["F_c"]) * -np.expm1(-p["gamma"] * np.asarray(dwell) ** p["n"])


def time_at_rest(time: Any, slip_velocity: Any) -> Any:
    """The time since the slip stopped, in s; zero while it slips."""
    time, moving = np.asarray(time, dtype=float), np.asarray(slip_velocity) != 0
    start = np.full(time.shape, time[0])
    before = ~moving[1:] & moving[:-1]
    start[1:][before] = time[1:][before]
    return np.where(moving, 0.0, time - np.maximum.accumulate(start))


def needed(applied_force: Any, law: str) -> Any:
    """The applied force as an array.

    Raises:
        BadInput: where there is none.
    """
    if applied_force is None:
        expected = "the force that tries to move the contact while it rests"
        raise BadInput(f"the law {law}", "no applied force", expected, code="SPEC020")
    return np.asarray(applied_force, dtype=float)


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


SEED = 1991


class Bristle(MemoryLaw):
    """F = Σ σ0 (x − b_k), k = 1 … N, x' = u; a bond b_k that is stretched to |x − b_k| = δ_s snaps and forms anew.

    It has a state space, the N bonds, but they jump at random: no differential equation that an observer could run.
    The source lets the new bond form at a random place; which distribution is open. Here it lies between the old bond
    and the body, uniformly, so that 2δ_s/3 is the mean stretch in sliding. The random numbers are the same each time.
    """

    name = "bristle"
    source = "Haessig and Friedland 1991; Mentzelopoulou 1994, section 1.1.2.1"
    parameters = (
        LawParameter("N", "1", False, "number of bristles (a whole number)", lowest=1, default=25),
        LawParameter("sigma_0", "{F}/{q}", True, "stiffness of a bristle"),
        LawParameter("delta_s", "{q}", True, "stretch at which a bond snaps"),
    )
    why_not = "its states, the places of N bonds, jump at random"

    def response(self, time: Any, slip_velocity: Any, p: Mapping[str, float], applied_force: Any = None) -> Any:
        """The force over a history that begins with bonds at random, unloaded on the mean.

        Raises:
            BadInput: if N is not a whole number.
        """
        if p["N"] != int(p["N"]):
            raise BadInput(f"the law {self.name}", f"N = {p['N']:g}", "a whole number of bristles", code="SPEC007")
        t, u = np.asarray(time, dtype=float), np.asarray(slip_velocity, dtype=float)
        random, limit = np.random.default_rng(SEED), p["delta_s"]
        stretch = limit * (2 * (np.arange(int(p["N"])) + 0.5) / int(p["N"]) - 1)
        travel = np.concatenate(([0.0], (u[1:] + u[:-1]) / 2 * np.diff(t)))
        force = np.empty_like(t)
        for k, step in enumerate(travel):
            stretch = stretch + step
            while (snapped := np.abs(stretch) >= limit).any():
                over = np.abs(stretch[snapped]) - limit
                stretch[snapped] = np.sign(stretch[snapped]) * (limit * random.random(over.size) + over)
            force[k] = p["sigma_0"] * stretch.sum()
        return force

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        """The mean over time; one bristle's stretch deviates from it by δ_s/√18, rms."""
        return sympy.Rational(2, 3) * p["N"] * p["sigma_0"] * p["delta_s"]

    def slope_bound(self, p: Values) -> sympy.Expr:
        return sympy.Integer(0)
