"""The observers of the thesis (errata applied) as NumPy, estimate by estimate, written without the project's own.

GCFO (4.10)-(4.15), (4.27)-(4.28); GTO (4.16)-(4.17), (4.33); MGTO (5.14)-(5.15); velocity observer (4.25)-(4.26).
Everything takes complex numbers, so that a complex step differentiates it to the last digit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.observers.by_hand import ByHand, magnitude

STEP = 1e-30
DIFFERENCE = 1e-3


@dataclass(frozen=True)
class Point:
    """An operating point and the friction there: levels (GCFO), forces (GTO) or contact forces (MGTO)."""

    x: Any
    v: Any
    w: Any
    friction: Any


@dataclass(frozen=True)
class Reference:
    """An observer with numeric gains: ``first`` is K_F or K_1, ``second`` is K_2."""

    hand: ByHand
    kind: str
    estimated: bool
    first: Any
    second: Any
    velocity: Any
    exponent: float = 1.0
    effects: bool = False

    @property
    def levels(self) -> bool:
        return self.kind in ("cfo", "gcfo")

    def acceleration(self, x: Any, v: Any, w: Any, friction: Any) -> Any:
        """M⁻¹[g − F] with the friction as the observer's kind counts it."""
        u, slip = self.hand.distribution(x), self.hand.distribution(x).T @ v
        contact = self.hand.known_friction(slip, self.effects)
        if self.levels:
            force = u @ (np.sign(np.real(slip)) * friction + contact)
        elif self.kind == "mgto":
            force = u @ (friction + contact)
        else:
            force = friction + u @ contact
        return np.linalg.solve(self.hand.mass(x), self.hand.total_force(x, v, w, self.effects) - force)

    def estimates(self, x: Any, v: Any, state: Any) -> tuple[Any, Any]:
        """(v̂, â or F̂) from the states, at measured x and, where it is measured, v."""
        n = len(x)
        v_hat = state[:n] + self.velocity @ x if self.estimated else v
        z = state[n:] if self.estimated else state
        if self.levels:
            return v_hat, z - self.first @ magnitude(self.hand.distribution(x).T @ v_hat) ** self.exponent
        return v_hat, z + self.first @ x + self.second @ v_hat

    def states(self, x: Any, v_hat: Any, friction: Any) -> Any:
        """The states that give these estimates."""
        if self.levels:
            z = friction + self.first @ magnitude(self.hand.distribution(x).T @ v_hat) ** self.exponent
        else:
            z = friction - self.first @ x - self.second @ v_hat
        return np.concatenate([v_hat - self.velocity @ x, z]) if self.estimated else z

    def rates(self, x: Any, v: Any, w: Any, state: Any) -> Any:
        """dz/dt."""
        v_hat, friction = self.estimates(x, v, state)
        a = self.acceleration(x, v_hat, w, friction)
        if self.levels:
            u = self.hand.distribution(x)
            slip = u.T @ v_hat
            slope = self.exponent * magnitude(slip) ** (self.exponent - 1) * np.sign(np.real(slip))
            z_rate = self.first @ (slope * (u.T @ a + self.turning(x, v_hat).T @ v_hat))
        else:
            z_rate = -self.first @ v_hat - self.second @ a
        return np.concatenate([-self.velocity @ v_hat + a, z_rate]) if self.estimated else z_rate

    def turning(self, x: Any, v: Any) -> Any:
        """dU/dt along v by a five-point difference, which takes complex v too; the thesis leaves it out of (4.12)."""
        at = [self.hand.distribution(x + k * DIFFERENCE * v) for k in (-2, -1, 1, 2)]
        return (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * DIFFERENCE)

    def perturbed(self, e: Any, p: Point) -> Any:
        """The states at the point when the estimation error is e."""
        n = len(p.x) if self.estimated else 0
        return self.states(p.x, p.v - e[:n] if n else p.v + 0 * e[0], p.friction - e[n:])

    def error(self, x: Any, v: Any, friction: Any, state: Any) -> Any:
        v_hat, estimate = self.estimates(x, v, state)
        return np.concatenate([v - v_hat, friction - estimate]) if self.estimated else friction - estimate

    def error_rate(self, e: Any, p: Point) -> Any:
        """de/dt of the continuous observer on the true plant: the estimates' chain rule, written out."""
        state = self.perturbed(e, p)
        rates = self.rates(p.x, p.v, p.w, state)
        v_hat, _ = self.estimates(p.x, p.v, state)
        a = self.acceleration(p.x, p.v, p.w, p.friction)
        n = len(p.x) if self.estimated else 0
        v_hat_rate = rates[:n] + self.velocity @ p.v if self.estimated else a
        if self.levels:
            u, turning = self.hand.distribution(p.x), np.imag(self.hand.distribution(p.x + 1j * STEP * p.v)) / STEP
            slip = u.T @ v_hat
            slope = self.exponent * magnitude(slip) ** (self.exponent - 1) * np.sign(np.real(slip))
            estimate_rate = rates[n:] - self.first @ (slope * (u.T @ v_hat_rate + turning.T @ v_hat))
        else:
            estimate_rate = rates[n:] + self.first @ p.v + self.second @ v_hat_rate
        return np.concatenate([a - v_hat_rate, -estimate_rate]) if self.estimated else -estimate_rate

    def next_error(self, e: Any, p: Point, h: float) -> Any:
        """e[k+1] of explicit Euler observer equations on a plant that moves by explicit Euler too."""
        state = self.perturbed(e, p)
        following = state + h * self.rates(p.x, p.v, p.w, state)
        a = self.acceleration(p.x, p.v, p.w, p.friction)
        return self.error(p.x + h * p.v, p.v + h * a, p.friction, following)

    def jacobian(self, function: Any, size: int) -> Any:
        """∂function/∂e at e = 0 by complex steps."""
        return np.array([np.imag(function(1j * STEP * row)) / STEP for row in np.eye(size)]).T
