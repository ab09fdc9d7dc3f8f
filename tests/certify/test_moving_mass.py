"""Certificates by structure behind a velocity observer: random machines within the figures, the arm by Pinocchio."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import sympy

from codegen.analysis.analysis import Analysis, analyse
from codegen.certify.certify import certify, spectral_rate
from codegen.certify.outcome import Refusal
from codegen.certify.structure import Extremes, MovingMass, certified_mode, extremes, moving_mass, without_formula
from codegen.observers import observer_of
from codegen.spec import parse_spec

SPEC = Path(__file__).parents[2] / "specs" / "seven_joint_arm.yaml"
MACHINE = Extremes(4.0, 900.0, sympy.Integer(30), sympy.Integer(20), sympy.Integer(60), 0)
K, H = 300.0, 0.0005


def of_energy(found: MovingMass, root: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """V's matrix over (e_v, e_f), as the module's head has it, by the root of G."""
    n, inverse = len(root), np.linalg.inv(root)
    a, kappa, beta = (float(x) for x in (found.p[0, 0] / found.p[1, 1], found.kappa, found.beta))
    u, f = np.hstack([root, np.zeros((n, n))]), np.hstack([np.zeros((n, n)), inverse])
    r = u + kappa * f
    return (f + beta * u).T @ (f + beta * u) + a * r.T @ (inverse @ mass @ inverse) @ r


def largest_factor(step: np.ndarray, now: np.ndarray, later: np.ndarray) -> float:
    """The most that V can become of itself in a sample, by the worst error."""
    lower = np.linalg.inv(np.linalg.cholesky(now))
    return float(np.linalg.eigvalsh(lower @ step.T @ later @ step @ lower.T)[-1])


def step_of(inverse: np.ndarray, slope: np.ndarray, gain: np.ndarray) -> np.ndarray:
    """I + hA over (e_v, e_f)."""
    n = len(gain)
    unit = np.eye(n)
    return np.block([[(1 - H * K) * unit + H * slope, -H * inverse], [H * K * gain, unit]])


def test_v_falls_for_every_machine_within_the_figures() -> None:
    """Random M, G and D at the edges of what is assumed: the worst error, by eigenvalues of the whole matrices."""
    found = certified_mode(sympy.Rational("0.0005"), sympy.Integer(300), MACHINE)
    assert found is not None and found.rate > 1
    dice, n, worst = np.random.default_rng(5), 4, 0.0
    for trial in range(400):
        turn = np.linalg.qr(dice.normal(size=(n, n)))[0]
        nu = np.exp(dice.uniform(np.log(4.0), np.log(900.0), n))
        nu[:2] = (4.0, 900.0)
        root = np.diag(np.sqrt(dice.uniform(0.3, 40, n))) if trial % 2 else np.eye(n)
        mass = root @ turn @ np.diag(1 / nu) @ turn.T @ root
        lower = np.linalg.cholesky(mass)
        push = np.linalg.qr(dice.normal(size=(n, n)))[0]
        grown = mass + 30 * H * (lower @ push @ np.diag(dice.choice([-1.0, 1.0], n)) @ push.T @ lower.T)
        left, right = (np.linalg.qr(dice.normal(size=(n, n)))[0] for _ in range(2))
        in_mass = 60 * left @ np.diag(dice.choice([1.0, -1.0, 0.3], n)) @ right - 20 * np.eye(n)
        slope = np.linalg.inv(lower.T) @ in_mass @ lower.T
        step = step_of(np.linalg.inv(mass), slope, root @ root)
        factor = largest_factor(step, of_energy(found, root, mass), of_energy(found, root, grown))
        worst = max(worst, factor)
    assert worst <= 1 - 2 * found.rate * H
    assert worst > 1 - 20 * found.rate * H  # V is not far from rising: the figures matter


def test_the_figures_matter() -> None:
    h, k = sympy.Rational("0.0005"), sympy.Integer(300)
    rates = [found.rate if (found := certified_mode(h, k, machine)) else 0.0 for machine in (
        MACHINE,
        replace(MACHINE, slope=sympy.Integer(90)),
        replace(MACHINE, growth=sympy.Integer(90)),
        replace(MACHINE, slope=sympy.Integer(400)),
        replace(MACHINE, fastest=2100.0),
    )]  # fmt: skip
    assert rates[0] > rates[1] and rates[0] > rates[2] and rates[3:] == [0.0, 0.0]


@pytest.mark.slow
def test_v_falls_on_the_arm_of_pinocchio() -> None:
    """M, the slopes of the Coriolis forces and the next posture by Pinocchio, along random motions of the envelope."""
    spec = parse_spec(SPEC.read_text("utf-8"), SPEC)
    analysis = analyse(spec, observer_of(spec))
    found = moving_mass(analysis)
    assert found is not None
    system = analysis.dynamics.observer.system
    values = {s.name: float(v) for s, v in {**system.values, **analysis.dynamics.observer.gains}.items()}
    joints = [x.name for x in system.positions]
    gain = np.diag([-values[f"K_2_{j}"] for j in joints])
    damping = np.diag([values[f"viscous_{j}_b"] for j in joints])
    model = pin.buildModelFromUrdf(str(SPEC.with_suffix(".urdf")))
    data, dice = model.createData(), np.random.default_rng(11)
    ends = {s.name: [float(e) for e in pair] for s, pair in analysis.points.ranges.items()}
    worst = 0.0
    for _ in range(400):
        x = np.array([dice.uniform(*ends.get(j, (-2.9, 2.9))) for j in joints])
        v = np.array([dice.choice(ends[f"v_{j}"]) for j in joints])
        masses = []
        for at in (x, x + H * v):
            upper = np.triu(pin.crba(model, data, at))
            masses.append(upper + np.triu(upper, 1).T)
        coriolis = pin.computeRNEADerivatives(model, data, x, v, np.zeros(7))[1]
        inverse = np.linalg.inv(masses[0])
        step = step_of(inverse, -inverse @ (coriolis + damping), gain)
        now, later = (of_energy(found, np.sqrt(gain), mass) for mass in masses)
        worst = max(worst, largest_factor(step, now, later))
    assert worst <= 1 - 2 * found.rate * H < 1
    assert found.rate > 0.5 * spectral_rate(analysis)


def changed(*changes: tuple[str, str]) -> Analysis:
    text = SPEC.read_text("utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    spec = parse_spec(text, SPEC)
    return analyse(spec, observer_of(spec))


def test_none_where_k_v_differs_between_joints() -> None:
    gains = "K_v: [300, 300, 300, 300, 300, 300, 300]"
    analysis = changed((gains, "K_v: [300, 300, 300, 300, 300, 300, 299]"))
    assert moving_mass(analysis) is None
    assert "the same K_v at all joints" in without_formula(analysis)


def test_a_refusal_says_that_other_gains_may_have_a_certificate() -> None:
    """It said that a certificate needs a formula, of a form that is certified at smaller gains."""
    spec = parse_spec(SPEC.read_text("utf-8").replace("K_v: [300, 300, 300, 300, 300, 300, 300]", "K_v: 30"), SPEC)
    outcome = certify(spec, analyse(spec, observer_of(spec)), {}, "", further=False)
    assert isinstance(outcome, Refusal) and "other gains" in outcome.reason


def test_none_for_a_level_that_is_learnt_with_the_sign_of_an_estimate() -> None:
    """In the sample in which the sign turns V of a GCFO grew 234-fold."""
    gains = ("K_2: [-25, -40, -8, -30, -1.5, -12, -0.35]", "K_F: [25, 40, 8, 30, 1.5, 12, 0.35]")
    assert moving_mass(changed(("kind: gto", "kind: gcfo"), gains)) is None


@pytest.mark.slow
def test_a_law_that_bends_near_standstill_is_seen() -> None:
    """A Stribeck dip of 1e-4 N m at 3e-4 rad/s on the last joint: 1/142 s at v = v_s/√2, where 77 was found before."""
    dip = "effects: [{kind: stribeck, on: hand_roll, parameters: {delta: 1e-4, v_s: 3e-4}}]\nenvelope:"
    found = extremes(changed(("envelope:", dip)), K, np.diag([25, 40, 8, 30, 1.5, 12, 0.35]))
    assert found is not None and float(found.slope) > 141.9
