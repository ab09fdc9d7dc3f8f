"""Ψ and the sampled matrix three times: from SymPy, by CasADi's differentiation, and from a simulated error.

SymPy and CasADi both differentiate exactly: what is left is rounding, a relative 1e-9 of the largest entry (1e-16
amplified by the inverse of M and a few hundred operations), and by û = z + K_v x, whose last digit 1e-14 is large
beside a slip of 1e-9. A is a difference divided by h, so its entries carry 1e-15/h at least. The simulated Ψ leaves
out what is of second order in its steps, and rounds: 5e-4 of the largest entry.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from codegen.analysis.error_dynamics import derive_error_dynamics
from codegen.observers import OBSERVERS, Observer
from codegen.spec import Spec

from .derived import Derived, random_point
from .simulated import simulated_jacobian
from .true_plant import Point, TruePlant
from .variants import STATE_LAWS, H, Variant, build, variants

EXACT, ROUNDED_SLIP, SIMULATED = 1e-9, 1e-13, 5e-4
SPEEDS = (1.0, 1.0, 1e-3, 1e-6, 1e-9)
SEVEN = "seven_joint_arm"


def is_fast(variant: Variant, number: int) -> bool:
    """Every kind, law, h, velocity and machine at least once; a seven-joint arm is left to the whole product."""
    if variant.machine == SEVEN:
        return False
    if variant.machine == "one_mass":
        return variant.effects and variant.kind not in ("gcfo", "gto", "gdfo")
    if variant.machine == "rod":
        return not variant.effects and variant.velocity == "measured" and variant.option in ("", STATE_LAWS[0])
    return number % (97 if variant.kind in ("gcfo", "gto", "mgto", "gdfo") else 29) == 0


ALL = variants()
CASES = [
    pytest.param(v, marks=[] if is_fast(v, k) else [pytest.mark.slow], id=f"{k}-{v.name}") for k, v in enumerate(ALL)
]


def test_every_kind_of_observer_is_among_them() -> None:
    assert {v.kind for v in ALL} == set(OBSERVERS)


def distance(found: Any, right: Any, floor: float) -> float:
    """The largest difference, relative to the largest entry or ``floor``."""
    assert np.isfinite(right).all() and right.any()
    return float(np.abs(found - right).max() / max(np.abs(right).max(), floor))


def check_derivatives(derived: Derived, plant: TruePlant, p: Point) -> bool:
    """Ψ, and A if no slip reverses within the sample; whether it did not."""
    now, later, _ = plant.slips(p, H)
    allowed = EXACT + ROUNDED_SLIP / np.abs(now).min()
    (psi, sampled), (right, step) = derived.matrices(p, plant, H), plant.matrices(p, H)
    assert distance(psi, right, 0) < allowed
    if (np.sign(now) != np.sign(later)).any():
        return False
    assert distance(sampled, step, 1e-6 / H) < allowed
    return True


def check_simulation(derived: Derived, plant: TruePlant, spec: Spec, observer: Observer, random: Any) -> None:
    """Ψ at a point far from the kinks: of |u| at reversal, and of the reset integrator at |f| = 1."""
    p = random_point(spec, observer, random)
    while np.abs(plant.slips(p, 0)[0]).min() < 0.02 or np.abs(np.abs(p.truth) - 1).min() < 0.02:
        p = random_point(spec, observer, random)
    slip = np.abs(plant.slips(p, 0)[0]).min()
    psi, _ = derived.matrices(p, plant, H)
    acceleration, _, _ = plant.flow(p, plant.states(p, np.zeros(len(psi))))
    span = min(1e-3, 1e-3 / np.linalg.norm(psi, 2), 0.01 * slip / (1 + np.abs(acceleration).max()))
    assert distance(psi, simulated_jacobian(plant, p, 1e-3 * min(slip, 1.0), span), 0) < SIMULATED


@pytest.mark.parametrize("variant", CASES)
def test_three_derivations_agree(variant: Variant) -> None:
    """At two random points of the envelope, at three near standstill, and along a simulated error."""
    spec, observer = build(variant)
    derived, plant = Derived(spec, derive_error_dynamics(observer)), TruePlant(spec, observer)
    random = variant.generator("points")
    kept = [check_derivatives(derived, plant, random_point(spec, observer, random, speed)) for speed in SPEEDS]
    for _ in range(200):
        if any(kept):
            break
        kept = [check_derivatives(derived, plant, random_point(spec, observer, random))]
    assert any(kept), "every slip reversed within the sample"
    check_simulation(derived, plant, spec, observer, random)
