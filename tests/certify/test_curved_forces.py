"""Bounds in newtons where a force is not affine in the position: gravity on a tilting axis, cogging, a hard spring."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codegen.app.derived import Derived
from codegen.certify.bound.disturbances import ModelError, disturbances
from codegen.certify.bound.error_response import error_response
from codegen.certify.certify import Certificate
from codegen.checker import verify
from codegen.replay.engine import Engine
from codegen.spec import parse_spec

H, MASS, LEVEL, NOISE, SPEED, TOP = 0.001, 2.5, 30.0, 1e-4, 0.1, 4.0
TEXT = """
name: rail
coordinates: {x: {velocity: v, unit: m}}
inputs: {w: {unit: N}}
parameters: {m: {value: 2.5, unit: kg}, k: {value: 20, unit: N}, d: {value: 0.004, unit: m}}
mass_matrix: [[m]]
force: [FORCE]
friction:
  distribution: [[1]]
  contacts: [{name: rail, law: coulomb, a: 30, unit: N}]
effects: [EFFECTS]
observer: {kind: cfo, velocity: estimated, gains: {K_F: 40, K_v: 90}, sample_time: 0.001, integration: euler}
envelope: {RANGE v: [-0.1, 0.1], v_dot: [-4, 4], x_noise: [-1e-4, 1e-4]}
"""


@cache
def rail(force: str = "w", effects: str = "", ranges: str = "") -> Derived:
    text = TEXT.replace("FORCE", force).replace("EFFECTS", effects).replace("RANGE", ranges)
    return Derived(parse_spec(text, Path("rail.yaml")))


COGGING = "{kind: cogging, on: x, parameters: {amplitude: 20, period: 0.0251, phase: 0.3}}"
BY_POSITION = "{kind: position_dependent_friction, on: rail, parameters: {amplitude: 20, period: 0.0251, phase: 0.3}}"
HARD = "{kind: hardening_spring, on: x, parameters: {k3: 7}}"
BY_LOAD = "{kind: load_dependent_friction, on: rail, parameters: {mu: 0.1}}"
SLOPES: dict[str, tuple[Derived, float, float]] = {  # largest |∂a/∂x| by hand, in 1/s², and of what is left affine
    "gravity": (rail("w - k*sin(x/d)"), 20 / 0.004 / MASS, 0),
    "gravity on a spring": (rail("w - k*sin(x/d) - 3*k/d*x"), 4 * 20 / 0.004 / MASS, 0),
    "a spring, by load": (rail("w - 3*k/d*x", effects=BY_LOAD), 0, 3 * 20 / 0.004 / MASS),
    "cogging": (rail(effects=COGGING), 20 * 2 * math.pi / 0.0251 / MASS, 0),
    "position_dependent_friction": (rail(effects=BY_POSITION), 20 * 2 * math.pi / 0.0251 / MASS, 0),
    "hardening_spring": (rail(effects=HARD, ranges="x: [-2, 1], "), 3 * 7 * (2 + NOISE) ** 2 / MASS, 0),
    "load_dependent_friction": (rail(effects=BY_LOAD), 0, 0),
}


@pytest.mark.parametrize("case", SLOPES)
def test_the_drift_of_the_velocity_is_that_of_the_steepest_slope(case: str) -> None:
    """|d_v| ≤ h L |noise| + h² (L + |affine slope|) V/2."""
    machine, steepest, affine = SLOPES[case]
    response = error_response(machine.observer)
    assert not isinstance(response, str)
    sizes = disturbances(machine.spec, machine.observer, response)
    assert not isinstance(sizes, str)
    by_hand = H * steepest * NOISE + H * H * (steepest + affine) * SPEED / 2
    assert float(sizes["velocity"][0]) == pytest.approx(by_hand, rel=1e-11)
    assert float(sizes["acceleration"][0]) == pytest.approx(TOP + steepest * NOISE, rel=1e-11)
    assert sizes["noise"] == [Fraction(1, 10**4)] and float(sizes["displacement"][0]) == pytest.approx(H * H * TOP / 2)


def test_a_cubic_force_needs_a_range() -> None:
    machine = rail(effects=HARD)
    outcome = machine.outcome
    assert isinstance(outcome, Certificate) and isinstance(outcome.bounds, str)
    assert outcome.bounds == "the force is not linear in position and input, and the envelope has no range for x"


@pytest.mark.parametrize(
    ("force", "said"),
    [
        ("w + k*sgn(x)", "the force jumps where x changes its sign"),
        ("w + k*sgn(x)*cos(x/d)", "the force jumps where x changes its sign"),
        ("w - k/(2 + x/d)", "no bound of"),
    ],
)
def test_a_force_that_jumps_or_whose_slope_is_not_known_has_no_bound(force: str, said: str) -> None:
    """Noise moves the place of a jump: the code errs by the whole jump, for as long as the machine is that near."""
    outcome = rail(force, ranges="x: [-0.001, 0.001], ").outcome
    assert isinstance(outcome, Certificate) and isinstance(outcome.bounds, str) and said in outcome.bounds


@pytest.mark.parametrize("case", SLOPES)
def test_each_has_a_bound_of_the_c(case: str) -> None:
    machine = SLOPES[case][0]
    outcome = machine.outcome
    assert isinstance(outcome, Certificate) and not isinstance(outcome.bounds, str)
    (bound,) = outcome.bounds
    assert bound.proved
    by_position = case != "load_dependent_friction" and "by load" not in case
    assert ('"forces": "measured"' in (outcome.ellipsoid or "")) == by_position


def test_a_gain_error_counts_where_the_force_is_steepest_with_it() -> None:
    """w + w²/k at 1 % more of |w| = 50 N: 0.5 + 2500 (1.01² − 1)/20 N more, by hand."""
    machine = rail("w + w*abs(w)/k", ranges="w: [-50, 50], ")
    response = error_response(machine.observer)
    assert not isinstance(response, str)
    plain, off = (
        disturbances(machine.spec, machine.observer, response, ModelError(gain=g))
        for g in (Fraction(0), Fraction(1, 100))
    )
    assert not isinstance(plain, str) and not isinstance(off, str)
    more = float(off["velocity"][0] - plain["velocity"][0]) / H * MASS
    assert 0.5 + 2500 * (1.01**2 - 1) / 20 <= more <= 1.01 * (0.5 + 2500 * (1.01**2 - 1) / 20)


def errors(machine: Derived, force: Callable[[float], float], noise: float) -> Any:
    """|F − F̂| of the compiled C while the machine creeps through a period of its force, measured off by ``noise``.

    The input is held from sample to sample; the machine moves by classical Runge–Kutta steps.
    """
    x, v, rows = 0.0, 0.02, []
    for _ in range(6000):
        w = LEVEL - force(x) + MASS * 20 * (0.02 - v)
        rows.append([x + noise, w])

        def rate(at: tuple[float, float], w: float = w) -> tuple[float, float]:
            return at[1], (w + force(at[0]) - LEVEL) / MASS

        k1 = rate((x, v))
        k2 = rate((x + H / 2 * k1[0], v + H / 2 * k1[1]))
        k3 = rate((x + H / 2 * k2[0], v + H / 2 * k2[1]))
        k4 = rate((x + H * k3[0], v + H * k3[1]))
        assert abs(v) <= SPEED and max(abs(k[1]) for k in (k1, k2, k3, k4)) <= TOP
        x, v = (y + H / 6 * (a + 2 * b + 2 * c + d) for y, a, b, c, d in zip((x, v), k1, k2, k3, k4, strict=True))
    engine = Engine(machine.program, machine.sources)
    engine.start(np.array(rows[0]))
    at = [name for name, _, _ in machine.program.outputs].index("a_hat_rail")
    return np.abs(LEVEL - engine.run(np.array(rows))[0][3000:, at])


@pytest.mark.parametrize("noise", [NOISE, -NOISE])
def test_the_compiled_code_stays_within_the_part_of_the_bound_that_is_the_slope_s(noise: float) -> None:
    """A wrong zero of the encoder moves the cogging by up to 0.5 N; of a smooth force it makes no error at all."""
    machine = rail(effects=COGGING)
    outcome = machine.outcome
    assert isinstance(outcome, Certificate) and not isinstance(outcome.bounds, str)
    (bound,) = outcome.bounds
    worst = errors(machine, lambda x: 20 * math.sin(2 * math.pi * x / 0.0251 + 0.3), noise).max()
    assert worst == pytest.approx(20 * 2 * math.pi / 0.0251 * NOISE, rel=0.2)
    assert worst <= bound.parts["velocity"] + bound.parts["displacement"] < 2 * worst
    assert bound.proved and worst <= bound.steady
    assert errors(rail(), lambda x: 0.0, noise).max() < 0.02 * worst


def test_the_claim_says_where_its_forces_are_and_is_none_without_that() -> None:
    machine = rail(effects=COGGING)
    files = {name: text.encode() for name, text in machine.files.items()}
    certificate = files["certificate.json"].decode()
    report = verify.check(certificate, sources=files)
    assert verify.status(report) == 0
    assert "(accelerations at the measured positions)" in "\n".join(report.proved)
    claim = json.loads(files["ellipsoid.json"])
    assert claim.pop("forces") == "measured"
    for other in (claim, claim | {"forces": "true"}):
        with pytest.raises(verify.Refused, match=r"do not act on the errors as claimed|of other forces"):
            verify.check(certificate, sources=files | {"ellipsoid.json": json.dumps(other).encode()})
