"""Static friction that rises with the time at rest, after Derjaguin and after Kato."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy

from codegen.base.errors import BadInput
from codegen.friction.law import LawParameter, MemoryLaw, Values
from codegen.friction.stribeck import COULOMB

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
        raise BadInput(
            f"the law {law}",
            "no applied force",
            "the force that tries to move the contact while it rests",
            code="SPEC020",
        )
    return np.asarray(applied_force, dtype=float)
