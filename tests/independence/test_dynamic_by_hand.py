"""DFO and GDFO a fourth time: (7.10)–(7.12) with dU/dt and the laws written by hand in NumPy, by complex steps.

Nothing here comes from the project but the machine's numbers (tests.observers.by_hand) and the Ψ that is tested.
Complex steps differentiate to rounding: a relative 1e-9 of the largest entry.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from observers.cases import seeded

from codegen.analysis.error_dynamics import derive_error_dynamics
from codegen.mechanics import build_system
from codegen.observers import Observer, build_observer
from codegen.spec import Spec, parse_spec
from tests.machines import ONE_MASS, TWO_MASS
from tests.observers.by_hand import BY_HAND, ByHand, magnitude

from .derived import Derived
from .true_plant import Point, TruePlant
from .variants import ROD, H

STEP = 1e-30
ROD_BY_HAND = ByHand(
    mass=BY_HAND["cart"].mass,
    force=BY_HAND["cart"].force,
    distribution=lambda x: np.array([[1, 0.4 * np.cos(x[0])], [0, 1]]),
    known=lambda u: 0 * u,
    drag=lambda v: 0 * v,
    inputs=1,
)
# dU/dt along v, by hand
TURNING: dict[str, Callable[[Any, Any], Any]] = {
    "rod": lambda x, v: np.array([[0, -0.4 * np.sin(x[0]) * v[0]], [0, 0]]),
}
CONTACTS = {"one_mass": ["rail"], "two_mass": ["between", "ground"], "rod": ["pivot", "rod"]}
MACHINES = {
    "one_mass": (ONE_MASS, BY_HAND["one_mass"]),
    "two_mass": (TWO_MASS, BY_HAND["two_mass"]),
    "rod": (ROD, ROD_BY_HAND),
}


def sign(u: Any) -> Any:
    return np.sign(np.real(u))


def _stribeck(u: Any) -> Any:
    return 2 + (3 - 2) * np.exp(-((u / 0.4) ** 2))


def _lugre(u: Any, f: Any) -> Any:
    return u - 150 * magnitude(u) * f / _stribeck(u)


def _dead_zone(f: Any) -> Any:
    """φ⁻¹ of (6.33): slope D2 = 0.01 within the level, D1 = 20 beyond."""
    return np.where(np.abs(np.real(f)) < 1, 0.01 * f, sign(f) * 0.01 + 20 * (f - sign(f)))


# law → (entry of a spec, ξ(u, f), force at level 1 φ(u, f), the span of f)
LAWS: dict[str, tuple[str, Callable[[Any, Any], Any], Callable[[Any, Any], Any], float]] = {
    "dahl": ("law: dahl, a: 3, c: 30", lambda u, f: 30 * u * (1 - f * sign(u)), lambda u, f: f, 0.95),
    "dahl_squared": (
        "law: dahl, a: 3, c: 30, i: 2",
        lambda u, f: 30 * u * (1 - f * sign(u)) * magnitude(1 - f * sign(u)),
        lambda u, f: f,
        0.95,
    ),
    "reset_integrator": (
        "law: reset_integrator, a: 3, c: 30, D1: 20, D2: 0.01",
        lambda u, f: 30 * (u - _dead_zone(f)),
        lambda u, f: f,
        1.5,
    ),
    "walrath": ("law: walrath, T: 3, tau: 0.05", lambda u, f: (sign(u) - f) / 0.05, lambda u, f: f, 0.95),
    "lugre": (
        "law: lugre, sigma_0: 150, sigma_1: 4, sigma_2: 0.7, F_c: 2, F_s: 3, v_s: 0.4",
        _lugre,
        lambda u, f: 150 * f + 4 * _lugre(u, f) + 0.7 * u,
        0.02,
    ),
}


class ByHand:
    """An observer (7.10)–(7.12), behind (4.25)–(4.26) where the velocity is estimated, and its plant."""

    def __init__(self, machine: str, law: str, estimated: bool, random: np.random.Generator) -> None:
        _, self.rate, self.unit, self.span = LAWS[law]
        self.machine, self.hand, self.estimated = machine, MACHINES[machine][1], estimated
        n = len(self.hand.mass(np.zeros(2)))
        self.n = n
        self.k_v, self.k_a, self.k_f1, self.k_f2 = (np.round(random.uniform(-9, 9, (n, n)), 3) for _ in range(4))

    def acceleration(self, x: Any, v: Any, w: Any, f: Any, a: Any) -> Any:
        u = self.hand.distribution(x)
        return np.linalg.solve(self.hand.mass(x), self.hand.force(x, v, w) - u @ (a * self.unit(u.T @ v, f)))

    def error_rate(self, e: Any, p: Point) -> Any:
        """de/dt at an error e = (e_v, e_f, e_a), estimates' rates by the chain rule written out."""
        n, u = self.n, self.hand.distribution(p.x)
        turning = TURNING.get(self.machine, lambda x, v: np.zeros((n, n)))
        f, a = p.truth[:n], p.truth[n:]
        v_hat = p.v - e[:n] if self.estimated else p.v
        f_hat, a_hat = f - e[-2 * n : -n], a - e[-n:]
        slip = u.T @ v_hat
        true_a = self.acceleration(p.x, p.v, p.w, f, a)
        a_model = self.acceleration(p.x, v_hat, p.w, f_hat, a_hat)
        v_rate = -self.k_v @ v_hat + a_model + self.k_v @ p.v if self.estimated else true_a
        xi = self.rate(slip, f_hat)
        z_f = -self.k_f1 @ v_hat - self.k_f2 @ a_model + xi
        f_rate = z_f + self.k_f1 @ p.v + self.k_f2 @ v_rate
        slip_model = u.T @ a_model + turning(p.x, v_hat).T @ v_hat
        z_a = -self.k_a @ (slip * xi + f_hat * slip_model)
        slip_rate = u.T @ v_rate + turning(p.x, p.v).T @ v_hat
        a_rate = z_a + self.k_a @ (f_rate * slip + f_hat * slip_rate)
        errors = [self.rate(u.T @ p.v, f) - f_rate, -a_rate]
        return np.concatenate([true_a - v_rate, *errors] if self.estimated else errors)

    def psi(self, p: Point) -> Any:
        m = (3 if self.estimated else 2) * self.n
        return np.array([np.imag(self.error_rate(1j * STEP * axis, p)) / STEP for axis in np.eye(m)]).T

    def spec(self, law: str) -> Spec:
        rows = {"K_a": self.k_a, "K_f1": self.k_f1, "K_f2": self.k_f2} | ({"K_v": self.k_v} if self.estimated else {})
        gains = ", ".join(f"{name}: {matrix.tolist()}" for name, matrix in rows.items())
        velocity = "estimated" if self.estimated else "measured"
        text = re.sub(r"law: coulomb, a: [0-9.]+", LAWS[law][0], MACHINES[self.machine][0])
        text += f"observer: {{kind: gdfo, velocity: {velocity}, gains: {{{gains}}}, sample_time: {H}}}\n"
        text += "envelope: {" + ", ".join(f"a_{name}: [1, 5]" for name in CONTACTS[self.machine]) + "}\n"
        return parse_spec(text, Path(f"{self.machine}.yaml"))

    def point(self, random: np.random.Generator, slip: Any = None) -> Point:
        """A random point; with ``slip`` given, one at which the contacts slip that fast."""
        n = self.n
        x, v = random.uniform(-1, 1, n), random.uniform(-2, 2, n)
        if slip is not None:
            x = np.zeros(n)  # K_v x would drown so small a slip
            v = np.linalg.solve(self.hand.distribution(x).T, slip)
        states = random.uniform(-self.span, self.span, n)
        return Point(x, v, random.uniform(-5, 5, self.hand.inputs), np.concatenate([states, random.uniform(1, 5, n)]))


def close(found: Any, right: Any) -> None:
    np.testing.assert_allclose(found, right, rtol=0, atol=1e-9 * np.abs(right).max())


def is_fast(machine: str, law: str, velocity: str) -> bool:
    return machine == "one_mass" or (velocity == "measured" and law == {"two_mass": "lugre", "rod": "dahl"}[machine])


CASES = [
    pytest.param(*case, marks=[] if is_fast(*case) else [pytest.mark.slow])
    for case in itertools.product(MACHINES, LAWS, ("measured", "estimated"))
]


@pytest.mark.parametrize(("machine", "law", "velocity"), CASES)
def test_psi_of_a_gdfo_is_that_of_the_equations_by_hand(machine: str, law: str, velocity: str) -> None:
    """SymPy's Ψ and CasADi's, at random points and at slips of 1e-9 of either sign."""
    random = seeded("by hand", machine, law, velocity)
    hand = ByHand(machine, law, velocity == "estimated", random)
    spec = hand.spec(law)
    observer: Observer = build_observer(spec, build_system(spec))
    derived, plant = Derived(spec, derive_error_dynamics(observer)), TruePlant(spec, observer)
    slips = [None] * 4 + [s * np.array([1e-9, -2e-9])[: hand.n] for s in (1, -1)]
    for slip in slips:
        p = hand.point(random, slip)
        right = hand.psi(p)
        close(derived.matrices(p, plant, H)[0], right)
        close(plant.matrices(p, H)[0], right)


def test_the_distribution_turns_as_written() -> None:
    """The hand-written dU/dt is the derivative of the hand-written U."""
    x, v = np.array([0.4, -0.2]), np.array([1.3, 0.7])
    turned = np.imag(ROD_BY_HAND.distribution(x + 1j * STEP * v)) / STEP
    np.testing.assert_allclose(TURNING["rod"](x, v), turned, rtol=1e-12)
