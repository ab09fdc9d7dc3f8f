"""Our plant and MuJoCo's on the exported model: the same input gives the same motion, for all that MuJoCo can hold.

Both are time steppers: ours of the second order with set-valued friction, MuJoCo's of the first with Coulomb friction
as a soft constraint. Two things differ therefore, and bound the tolerance. (1) The error of a step of h = 1e-4 s is of
the order h a for the velocity at each reversal and each jump, and h v for the position. (2) A contact at rest creeps,
by less than 1e-7 m/s here (see ``_creep``), and a reversal is met at the end of a step. Positions are compared to
TOLERANCE of the span that they run through; a term left out, or a sign, changes the motion by more than SEEN of it.
"""

from __future__ import annotations

import numpy as np
import pytest

from codegen.export.mujoco_plant import mujoco_plant
from codegen.mechanics.system import System
from codegen.simulate.closed_loop import simulate
from codegen.spec.model import Spec
from tests.machines import COULOMB, axis, effect

pytest.importorskip("mujoco", reason="MuJoCo is not installed")

TOLERANCE = 1e-3
SEEN = 4e-3


def spans_apart(spec: Spec, system: System, other: System | None = None) -> float:
    """The largest difference of the positions of the two plants, as a share of the span."""
    ours = simulate(spec, system).true_positions
    maker, _ = mujoco_plant(spec, other or system)
    theirs = simulate(spec, system, make_plant=maker).true_positions
    return float((np.abs(ours - theirs).max(axis=0) / np.ptp(ours, axis=0)).max())


LAWS = {
    "coulomb": COULOMB,
    "no friction": "law: coulomb, a: 0",
    "polynomial": "law: polynomial, a0: 2, a1: 0.4, a2: 0.3, a3: 0.1",
    "lugre": "law: lugre, sigma_0: 20000, sigma_1: 100, sigma_2: 1.5, F_c: 3, F_s: 4.5, v_s: 0.05",
    "dahl": "law: dahl, a: 3, c: 2000",
    "gaussian": "law: gaussian, F_c: 3, F_s: 4.5, F_v: 0.7, v_s: 0.2",
}
EFFECTS = {
    "viscous": effect("viscous", "rail", b=2),
    "quadratic drag": effect("quadratic_drag", "x", c=1.5),
    "stribeck": effect("stribeck", "rail", delta=1.5, v_s=0.2),
    "presliding": effect("presliding", "rail", sigma=10000),
    "offset": effect("offset", "x", f0=1.5),
    "asymmetry": effect("coulomb_asymmetry", "rail", d=1),
    "cogging": effect("cogging", "x", amplitude=2, period=0.1, phase=0.7),
    "harmonics": effect("cogging_harmonics", "x", period=0.3, sin_1=1, cos_1=0.5, sin_3=0.4, cos_3=-0.7),
    "spring": effect("spring", "x", k=12),
    "hardening spring": effect("hardening_spring", "x", k3=40),
    "inertia": effect("inertia_error", "x", delta=0.5),
    "gain": effect("input_gain", "w", gain=1.2),
    "delay": effect("input_delay", "w", T=0.0113),
    "lag": effect("actuator_lag", "w", tau=0.02),
    "saturation": effect("saturation", "w", limit=12),
    "compliance": effect("compliance", "x", k=4000, c=6, load_fraction=0.4),
}


@pytest.mark.parametrize("law", LAWS)
def test_a_law_moves_alike(law: str) -> None:
    assert spans_apart(*axis(LAWS[law])) < TOLERANCE


QUICK = ("stribeck", "offset", "cogging", "spring", "inertia", "delay", "saturation")
"""One of each way in which MuJoCo holds an effect; the others are left to `make check-all`, to spare a minute."""


@pytest.mark.parametrize(
    "kind", [kind if kind in QUICK else pytest.param(kind, marks=pytest.mark.slow) for kind in EFFECTS]
)
def test_an_effect_moves_alike_and_is_seen(kind: str) -> None:
    """And the model without the effect moves otherwise, so that the comparison sees it."""
    spec, system = axis(effects=EFFECTS[kind])
    assert spans_apart(spec, system) < TOLERANCE
    assert spans_apart(spec, system, axis()[1]) > SEEN


def test_a_turning_axis_with_an_imbalance() -> None:
    spec, system = axis(effects=effect("gravity_imbalance", "x", G=4, phase=0.4), turns=True)
    assert spans_apart(spec, system) < TOLERANCE
