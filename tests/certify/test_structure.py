"""Certificates by structure: the robot arm's own M(x), by its composite bodies, at points that were not looked at."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codegen.analysis.analysis import Analysis, analyse
from codegen.analysis.operating_points import evaluate
from codegen.app.derived import Derived
from codegen.certify.certify import Certificate, Refusal, certify
from codegen.certify.remedies.proposals import propose
from codegen.observers import observer_of
from codegen.spec import parse_spec

SPEC = Path(__file__).parents[2] / "specs" / "seven_joint_arm.yaml"
G = np.array([25, 40, 8, 30, 1.5, 12, 0.35])
ESTIMATED = "K_v: [300, 300, 300, 300, 300, 300, 300]"


@cache
def arm(*changes: tuple[str, str]) -> tuple[Analysis, Certificate | Refusal]:
    text = SPEC.read_text("utf-8").replace(f"    {ESTIMATED}\n", "")
    for old, new in (("velocity: estimated", "velocity: measured"), *changes):
        assert old in text
        text = text.replace(old, new)
    spec = parse_spec(text, SPEC)
    analysis = analyse(spec, observer_of(spec))
    return analysis, certify(spec, analysis, {}, "none")


@pytest.mark.parametrize("free", [(), (("K_2: [", "K_1: 0.1\n    K_2: ["),)], ids=["K_1 = 0", "K_1 free"])
def test_v_falls_at_every_posture(free: tuple[tuple[str, str], ...]) -> None:
    analysis, found = arm(*free)
    assert isinstance(found, Certificate)
    assert 0.85 * found.spectral_rate < found.decay_rate < found.spectral_rate
    low, high = (float(Fraction(x)) for x in found.content["variables"]["nu"])
    dice, points = np.random.default_rng(8), analysis.points
    ends = np.array([[float(e) for e in pair] for pair in points.ranges.values()])
    other = replace(points, values=dice.uniform(ends[:, 0], ends[:, 1], (300, len(ends))))
    steps = np.eye(7) + 0.0005 * evaluate(analysis.dynamics, analysis.dynamics.sampled, other)
    falls, e = 1 - 2 * found.decay_rate * 0.0005, np.ones(7)
    for step in steps:
        rates = np.linalg.eigvals(np.eye(7) - step).real / 0.0005
        assert low < rates.min() and rates.max() < high
        after = step @ e
        assert after @ (after / G) <= falls * (e @ (e / G))
        scaled = step / np.sqrt(G)[:, None] * np.sqrt(G)[None, :]
        assert np.linalg.norm(scaled, 2) ** 2 <= falls
        e = after / np.linalg.norm(after)


def test_what_is_assumed_of_the_mass_matrix_is_said() -> None:
    analysis, found = arm()
    assert isinstance(found, Certificate)
    said: Any = found.content["assumptions"]
    rates = np.linalg.eigvals(-evaluate(analysis.dynamics, analysis.dynamics.sampled, analysis.points)).real
    seen = f"from {rates.min():.4g} to {rates.max():.4g} 1/s"
    assert any("not proved over the envelope" in line and seen in line for line in said)
    assert found.content["claim"].startswith("By the structure of the observer, for every mass matrix")


def test_none_where_the_margin_is_not_stable() -> None:
    analysis, found = arm(("sample_time: 0.0005", "sample_time: 0.0015"))
    assert isinstance(found, Refusal) and analysis.stable and found.proof is None


@pytest.mark.slow
def test_where_k_v_differs_between_joints_it_is_proposed_to_measure_velocity() -> None:
    text = SPEC.read_text("utf-8")
    assert ESTIMATED in text
    spec = parse_spec(text.replace(ESTIMATED, "K_v: [300, 300, 300, 300, 300, 300, 299]"), SPEC)
    assert isinstance(certify(spec, analyse(spec, observer_of(spec)), {}, "none"), Refusal)
    proposed = propose(spec, Derived(spec).analysis, Derived, dict).measured
    _, found = arm()
    assert proposed is not None and isinstance(found, Certificate)
    assert proposed.line == "velocity: measured, without K_v" and list(proposed.gains) == ["K_2"]
    assert proposed.decay_rate == pytest.approx(found.decay_rate)
