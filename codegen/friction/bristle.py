"""Haessig and Friedland's bristles: bonds that stretch like springs and snap."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy

from codegen.base.errors import BadInput
from codegen.friction.law import LawParameter, MemoryLaw, Values

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
