"""Over-compensation: limit cycles of the simulated loop against the describing function; the gain that avoids them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiction
from codegen.base.text import render
from codegen.effects.declare import add_declared_effects
from codegen.mechanics.build import build_system
from codegen.simulate.hunting import RegulatorLoop, Trial, at_rest, hunting, limit_cycle
from tests.expected_errors import refused
from tests.machines import read

from .describing import Mass, threshold

TEXT = """name: mass
coordinates:
  x: {{velocity: v, unit: m}}
inputs:
  w: {{unit: N}}
parameters:
  m: {{value: 1, unit: kg}}
mass_matrix: [[m]]
force: [w]
friction:
  distribution: [[1]]
  contacts:
    - {{name: rail, law: coulomb, a: 1, unit: N}}
observer: {{kind: to, {observer}, sample_time: 0.001}}
envelope: {{v: [-5, 5]}}
simulation:
  duration: {duration}
  sample_time: 0.001
  reference: {{x: {swing}*sin(2*t)}}
  position_gain: {{w: {k_p}}}
  velocity_gain: {{w: {k_d}}}
  velocity_noise: {{v: 0}}
"""
RESONANT = Mass(1, 2500, 4, 1, -100, 20)
"""A slow velocity observer makes the tracked estimate ring, Re F̂/F up to 1 / (4 ζ (1 − ζ)): it hunts below gain 1."""
RESONANT_TEXT = TEXT.format(
    observer="velocity: estimated, gains: {K_2: -100, K_v: 20}", duration=2, swing=0.01, k_p=2500, k_d=4
)
QUICK = TEXT.format(observer="velocity: measured, gains: {K_2: -40}", duration=6, swing=0.1, k_p=100, k_d=4)


def machine(text: str):
    spec = read(text)
    return spec, add_declared_effects(build_system(spec), spec)


@pytest.mark.slow
def test_more_than_the_friction_cancelled_is_a_limit_cycle_of_known_size():
    """With the velocity measured G lags and never overshoots: the describing function has cycles for γ > 1 only."""
    mass = Mass(1, 100, 4, 1, -40, h=0.001)
    assert threshold(mass.describing) == pytest.approx(1, abs=1e-3)
    ((w, amplitude),) = mass.describing(1.5)
    loop = RegulatorLoop(*machine(QUICK))
    quiet, hunting_one = loop.trial(0.9), loop.trial(1.5)
    assert quiet.decided and quiet.cycle is None
    for cycle in (hunting_one.from_rest, hunting_one.from_push):
        assert cycle is not None
        assert cycle.amplitude == pytest.approx(amplitude, rel=0.05)
        assert cycle.period == pytest.approx(2 * np.pi / w, rel=0.05)


def test_how_far_the_tracked_estimate_of_the_resonant_mass_rings():
    """The figures of docs/cancellation.md, by the closed forms of a second-order lag."""
    zeta = 20 / (2 * np.sqrt(20 * 100))
    response = replace(RESONANT, h=0.0).tracked(1j * np.linspace(1, 200, 200001))
    assert response.real.max() == pytest.approx(1 / (4 * zeta * (1 - zeta)))
    assert response.real.max() == pytest.approx(1.44, abs=5e-3)
    assert np.abs(response).max() == pytest.approx(1 / (2 * zeta * np.sqrt(1 - zeta**2)))
    assert np.abs(response).max() == pytest.approx(2.29, abs=5e-3)


@pytest.mark.slow
def test_an_estimate_that_overshoots_hunts_from_tsypkin_s_threshold_on():
    mass = replace(RESONANT, h=0.0005)
    least = threshold(mass.tsypkin)
    assert 0.5 < least < 0.6
    loop = RegulatorLoop(*machine(RESONANT_TEXT.replace("sample_time: 0.001", "sample_time: 0.0005")))
    below, above = loop.trial(0.95 * least), loop.trial(0.75)
    assert below.cycle is None
    ((w, amplitude),) = mass.tsypkin(0.75)
    assert above.cycle is not None
    assert above.cycle.amplitude == pytest.approx(amplitude, rel=0.06)
    assert above.cycle.period == pytest.approx(2 * np.pi / w, rel=0.02)


@pytest.mark.slow
def test_the_largest_gain_is_searched_for():
    result = hunting(*machine(RESONANT_TEXT))
    assert result.largest == pytest.approx(threshold(replace(RESONANT, h=0.001).tsypkin), rel=0.08)
    assert [t.cycle is None for t in result.trials] == [t.gain <= result.largest for t in result.trials]
    assert {0.0, 1.0, result.largest, result.largest + 1 / 64} <= {t.gain for t in result.trials}


def test_a_controller_without_reference_has_nothing_to_hunt_about():
    controller = "  reference: {x: 0.1*sin(2*t)}\n  position_gain: {w: 100}\n  velocity_gain: {w: 4}\n"
    assert controller in QUICK
    with refused("SPEC025 `simulation:` `reference:`"):
        hunting(*machine(QUICK.replace(controller, "")))


def test_the_verb_tells(tmp_path):
    spec = tmp_path / "spec.yaml"
    spec.write_text(QUICK.replace("duration: 6", "duration: 1.5").replace("0.1*sin", "0.02*sin"), encoding="utf-8")
    told: list[tuple[str, float]] = []
    report = stiction.cancel(spec, hunt=True, progress=lambda step, share: told.append((step, share)))
    assert told == sorted(told) and {step for step, _ in told} == {"simulate"} and 0 < told[0][1] <= told[-1][1] <= 1
    assert report.hunting is not None and report.hunting.largest == 1
    assert [t["gain"] for t in report.content["hunting"]["trials"]] == [0, 1]
    words = render("text/cancel.txt.j2", **report.view)
    assert "No limit cycle up to full cancellation: gain 1 is admissible." in words


T = np.arange(0, 40, 0.01)


@pytest.mark.parametrize(
    ("x", "hunts", "rests"),
    [
        (0.3 * np.sin(5 * T), True, False),
        (0.3 * np.sin(5 * T) + 7, True, False),
        (0.3 * np.exp(-0.05 * T) * np.sin(5 * T), False, False),
        (np.zeros_like(T), False, True),
        (0.01 * T, False, False),
        (1e-4 * np.sin(5 * T), False, True),
        (np.sign(np.sin(4 * T)), True, False),
        (0.3 * np.sin(0.15 * T), False, False),
        (np.where(T > 15, np.nan, np.exp(T)), True, False),
    ],
)
def test_how_a_limit_cycle_is_recognised(x, hunts, rests):
    floor = np.array([1e-3])
    cycle = limit_cycle(T, x[:, None], floor)
    assert (cycle is not None, at_rest(x[:, None], floor)) == (hunts, rests)
    if hunts and np.isfinite(x).all():
        assert cycle.amplitude == pytest.approx(np.ptp(x) / 2, rel=0.01)
        assert cycle.period == pytest.approx(np.pi / 2 if np.ptp(x) == 2 else 2 * np.pi / 5, rel=0.01)


def test_a_trial_reports_the_larger_cycle():
    small, large = (limit_cycle(T, a * np.sin(5 * T)[:, None], np.array([1e-3])) for a in (0.1, 0.2))
    assert Trial(1.0, small, large, True).cycle is large
