"""Laws whose force depends on the history of slip: rising static friction, lags, stick–slip and bristles."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy

from codegen.base.errors import BadInput
from codegen.friction.law import LawParameter, MemoryLaw, Values
from codegen.friction.zero_memory import COULOMB, STATIC, STRIBECK_VELOCITY, VISCOUS, Lorentzian, StaticViscous

STATIC_AFTER_REST = LawParameter("F_s_inf", "{F}", False, "static level after a long rest")
NEEDS_CLOCK = "the static level needs the time since the slip stopped, a clock that jumps back to zero"


class RisingStatic(MemoryLaw):
    """F = F_c sgn(u) for u ≠ 0; at rest |F| ≤ F_s(t) with t the time since the slip stopped."""

    why_not = NEEDS_CLOCK
    instead = "static_viscous or karnopp, whose static level does not rise"

    @abstractmethod
    def static_level(self, dwell: Any, p: Mapping[str, float]) -> Any:
        """F_s(t) in the contact's force unit; ``dwell`` is the time t at rest in s, a number or an array."""

    def response(self, time: Any, slip_velocity: Any, p: Mapping[str, float], applied_force: Any = None) -> Any:
        """The force over a history; the contact rests where u = 0 exactly.

        Raises BadInput if the contact rests and no applied force is given: friction at rest equals the applied force,
        up to the static level.
        """
        dwell = time_at_rest(time, slip_velocity)
        resting = np.asarray(slip_velocity) == 0
        force = p["F_c"] * np.sign(slip_velocity)
        if resting.any():
            limit = self.static_level(dwell, p)
            force = np.where(resting, np.clip(required(applied_force, self.name), -limit, limit), force)
        return force

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["F_c"]


class Derjaguin(RisingStatic):
    """F = F_c sgn(u) for u ≠ 0; at rest |F| ≤ F_s(t) = F_c + (F_s∞ − F_c) t/(t + γ)."""

    name = "rising_static_derjaguin"
    source = "Derjaguin, Push and Tolstoi 1957 after Armstrong-Hélouvry 1991; Mentzelopoulou 1994, section 1.1.2.1"
    parameters = (
        COULOMB,
        STATIC_AFTER_REST,
        LawParameter("gamma", "s", True, "time at rest after which half the rise is there"),
    )

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
        STATIC_AFTER_REST,
        LawParameter("gamma", "1", True, "rate of the rise, with t in s"),
        LawParameter("n", "1", True, "exponent of the time at rest"),
    )

    def static_level(self, dwell: Any, p: Mapping[str, float]) -> Any:
        share_of_rise = -np.expm1(-p["gamma"] * np.asarray(dwell) ** p["n"])
        return p["F_c"] + (p["F_s_inf"] - p["F_c"]) * share_of_rise


def time_at_rest(time: Any, slip_velocity: Any) -> Any:
    """(N,) time since the slip stopped, in s; zero while the contact slips."""
    time, moving = np.asarray(time, dtype=float), np.asarray(slip_velocity) != 0
    stops = ~moving[1:] & moving[:-1]
    stopped_at = np.full(time.shape, time[0])
    stopped_at[1:][stops] = time[1:][stops]
    # Time increases, so the running maximum is the last stop so far.
    return np.where(moving, 0.0, time - np.maximum.accumulate(stopped_at))


def required(applied_force: Any, law: str) -> Any:
    """The applied force as an array.

    ``law``: its name, for the message. Raises BadInput where no applied force is given.
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
    instead = "lorentzian, which is its steady sliding"

    def response(self, time: Any, slip_velocity: Any, p: Mapping[str, float], applied_force: Any = None) -> Any:
        """The force over a history; before it, the slip velocity was that of the first sample."""
        u = np.asarray(slip_velocity, dtype=float)
        rise = (p["F_s"] - p["F_c"]) / (1 + (lagged(time, u, p["tau_L"]) / p["v_s"]) ** 2)
        return (p["F_c"] + p["F_v"] * np.abs(u) + rise) * np.sign(u)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return _STEADY.level(slip_speed, p)

    def slope_bound(self, p: Values) -> sympy.Expr:
        """The bound of the Lorentzian law, which this one is in steady sliding: u(t − τ_L) = u."""
        return _STEADY.slope_bound(p)


def lagged(time: Any, slip_velocity: Any, lag: float) -> Any:
    """(N,) u(t − lag), linear between the samples of the history and constant before it."""
    time = np.asarray(time, dtype=float)
    return np.interp(time - lag, time, slip_velocity)


class SevenParameter(MemoryLaw):
    """Stuck: F = k_t x. Sliding: F = [F_c + F_v |u| + F_s(γ, t2)/(1 + (u(t − τ_L)/v_s)²)] sgn(u).

    x is the deflection of the stuck contact. F_s(γ, t2) = F_s,a + (F_s∞ − F_s,a) t2/(t2 + γ) is the static friction
    above the Coulomb level, with t2 the time stuck and F_s,a the Stribeck friction at the end of the last sliding. A
    contact breaks away at |F| = F_c + F_s(γ, t2).

    The source leaves two things open. Here the spring of a contact that sticks starts with the force at which sliding
    ends, (F_c + F_s,a) sgn(u), and a history begins stuck without load, after a long rest.
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
    why_not = f"{NEEDS_CLOCK}; and the Stribeck part lags by a delay"
    instead = "lugre, which has presliding and Stribeck friction, or lorentzian, which is its steady sliding"

    def response(self, time: Any, slip_velocity: Any, p: Mapping[str, float], applied_force: Any = None) -> Any:
        """The force over a history: a state machine, stuck or sliding, from sample to sample."""
        t, u = np.asarray(time, dtype=float), np.asarray(slip_velocity, dtype=float)
        share_at_speed = 1 / (1 + (lagged(t, u, p["tau_L"]) / p["v_s"]) ** 2)
        force = np.zeros_like(t)
        direction = 0.0  # sign of the slip while sliding, 0 while stuck
        stuck_since = -np.inf
        stribeck_at_stop = p["F_s_inf"]  # F_s,a
        stribeck = stribeck_at_stop  # F_s(γ, t2); constant while sliding
        for k in range(len(t)):
            before = force[k - 1] if k else 0.0
            travel = (u[k] + u[k - 1]) / 2 * (t[k] - t[k - 1]) if k else 0.0
            stops_or_reverses = direction and u[k] * direction <= 0
            if stops_or_reverses:
                stuck_since, stribeck_at_stop = t[k], stribeck * share_at_speed[k]
                before, travel, direction = (p["F_c"] + stribeck_at_stop) * direction, 0.0, 0.0
            if not direction:
                force[k] = before + p["k_t"] * travel
                # F_s(γ, t2) with t2/(t2 + γ) = 1 − γ/(t2 + γ), which is also right for t2 = ∞, the rest at the start.
                missing = (p["F_s_inf"] - stribeck_at_stop) * p["gamma"] / (t[k] - stuck_since + p["gamma"])
                stribeck = p["F_s_inf"] - missing
                # Beyond the static level the contact breaks away, but not while the slip relaxes the spring.
                if abs(force[k]) <= p["F_c"] + stribeck or u[k] * force[k] <= 0:
                    continue
                direction = float(np.sign(u[k]))
            force[k] = (p["F_c"] + p["F_v"] * abs(u[k]) + stribeck * share_at_speed[k]) * direction
        return force

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        """The level in sliding that began after a long rest, F_s(γ, t2) = F_s∞, which stays constant while sliding."""
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
    simulable = True  # by ``plant_level``

    def response(self, time: Any, slip_velocity: Any, p: Mapping[str, float], applied_force: Any = None) -> Any:
        """The force over a history.

        Raises BadInput if the slip velocity enters the band and no applied force is given.
        """
        u = np.asarray(slip_velocity, dtype=float)
        force = p["F_c"] * np.sign(u) + p["F_v"] * u
        stuck = np.abs(u) <= p["D_v"]
        if not stuck.any():
            return force
        return np.where(stuck, np.clip(required(applied_force, self.name), -p["F_s"], p["F_s"]), force)

    def plant_level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        """Static, Coulomb and viscous friction: the law with a band of zero width."""
        return StaticViscous().level(slip_speed, p)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        """The level in sliding, outside the band."""
        return p["F_c"] + p["F_v"] * slip_speed

    def slope_bound(self, p: Values) -> sympy.Expr:
        return p["F_v"]


SEED = 1991
"""Seed of the random numbers of ``Bristle``."""


class Bristle(MemoryLaw):
    """F = Σ σ0 (x − b_k), k = 1 … N, x' = u; a bond b_k breaks at |x − b_k| = δ_s and is replaced by a new one.

    The states, the positions of the N bonds, jump at random, so there is no differential equation that an observer
    could integrate. The source puts a new bond at a random position and leaves the distribution open. Here it is
    uniform between the old bond and the body, which gives a mean deflection of 2δ_s/3 in sliding. The random numbers
    are the same each time.
    """

    name = "bristle"
    source = "Haessig and Friedland 1991; Mentzelopoulou 1994, section 1.1.2.1"
    parameters = (
        LawParameter("N", "1", False, "number of bristles (a whole number)", lowest=1, default=25),
        LawParameter("sigma_0", "{F}/{q}", True, "stiffness of a bristle"),
        LawParameter("delta_s", "{q}", True, "stretch at which a bond snaps"),
    )
    why_not = "its states, the places of N bonds, jump at random"
    instead = "lugre, dahl or reset_integrator, whose state is a mean deflection"

    def response(self, time: Any, slip_velocity: Any, p: Mapping[str, float], applied_force: Any = None) -> Any:
        """The force over a history; at its start the bonds are spread evenly over ±δ_s, and the force is zero.

        Raises BadInput if N is not a whole number.
        """
        if p["N"] != int(p["N"]):
            raise BadInput(f"the law {self.name}", f"N = {p['N']:g}", "a whole number of bristles", code="SPEC007")
        t, u = np.asarray(time, dtype=float), np.asarray(slip_velocity, dtype=float)
        random, limit = np.random.default_rng(SEED), p["delta_s"]
        stretch = limit * (2 * (np.arange(int(p["N"])) + 0.5) / int(p["N"]) - 1)  # x − b_k
        travel = np.concatenate(([0.0], (u[1:] + u[:-1]) / 2 * np.diff(t)))
        force = np.empty_like(t)
        for k, step in enumerate(travel):
            stretch = stretch + step
            # A new bond forms when the old one breaks, is stretched during the rest of the step, and may break too.
            while (snapped := np.abs(stretch) >= limit).any():
                rest_of_step = np.abs(stretch[snapped]) - limit
                new_stretch = limit * random.random(rest_of_step.size) + rest_of_step
                stretch[snapped] = np.sign(stretch[snapped]) * new_stretch
            force[k] = p["sigma_0"] * stretch.sum()
        return force

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        """The mean force over time; the deflection of one bristle has a standard deviation of δ_s/√18."""
        return sympy.Rational(2, 3) * p["N"] * p["sigma_0"] * p["delta_s"]
