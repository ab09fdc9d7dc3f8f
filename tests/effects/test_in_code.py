"""Effects before and behind an observer's model: the generated code against the plain one fed what the effect makes."""

from __future__ import annotations

from math import exp, pi
from pathlib import Path

import numpy as np
from compiled.build import Built

from tests.machines import SPRING_MASS

OBSERVER = """
observer: {kind: cfo, velocity: estimated, gains: {K_F: 10, K_v: 100}, sample_time: 0.001}
envelope: {v: [-5, 5]}
"""
TIME = 0.001 * np.arange(600)
X = 0.1 * np.sin(7 * TIME) + 0.02 * np.sin(31 * TIME)
W = np.round(20 * np.sin(13 * TIME), 1)


def estimates(folder: Path, effects: str, x: np.ndarray, w: np.ndarray) -> np.ndarray:
    folder.mkdir()
    built = Built(folder, SPRING_MASS.format(m=2, k=0, b=0, a=3) + f"effects: [{effects}]\n" + OBSERVER)
    return built.python_run(np.column_stack([x, w]))[0]


def test_the_observer_sees_the_true_position(tmp_path: Path) -> None:
    effect = "{kind: encoder_eccentricity, on: x, parameters: {amplitude: 0.004, period: 0.06, phase: 0.5}}"
    readings = X + 0.004 * np.sin(2 * pi * X / 0.06 + 0.5)
    plain = estimates(tmp_path / "plain", "", X, W)
    np.testing.assert_allclose(estimates(tmp_path / "wrong", effect, readings, W), plain, atol=1e-8)
    assert np.abs(estimates(tmp_path / "raw", "", readings, W) - plain).max() > 1


def test_the_observer_is_driven_by_what_acts(tmp_path: Path) -> None:
    """Delay of 2.5 ms, gain, dead zone, limit and lag by a loop over held values, a tenth of a sample at a time."""
    stages = {
        "actuator_lag": "tau: 0.006",
        "saturation": "limit: 15",
        "dead_zone": "width: 3",
        "input_gain": "gain: 1.2",
        "input_delay": "T: 0.002",
    }
    effects = ", ".join(f"{{kind: {kind}, on: w, parameters: {{{p}}}}}" for kind, p in stages.items())
    late = np.concatenate([np.repeat(W[0], 2), W[:-2]])
    held = np.clip(np.sign(late) * np.maximum(np.abs(1.2 * late) - 3, 0), -15, 15)
    acting, y = [], held[0]
    for w in held:
        ends = [w + (y - w) * exp(-k * 1e-5 / 0.006) for k in range(101)]
        acting.append(np.mean(ends[:-1]) / 2 + np.mean(ends[1:]) / 2)
        y = ends[-1]
    plain = estimates(tmp_path / "plain", "", X, np.array(acting))
    np.testing.assert_allclose(estimates(tmp_path / "chain", effects, X, W), plain, atol=1e-4)
    assert np.abs(estimates(tmp_path / "raw", "", X, W) - plain).max() > 0.1


def test_time_runs_from_the_first_sample(tmp_path: Path) -> None:
    """The drift is known, so the estimated force has it in full and the estimated level has none of it."""
    effect = "{kind: friction_drift, on: rail, parameters: {delta: 2, T: 0.3}}"
    folder = tmp_path / "drift"
    folder.mkdir()
    built = Built(folder, SPRING_MASS.format(m=2, k=0, b=0, a=3) + f"effects: [{effect}]\n" + OBSERVER)
    outputs, _ = built.python_run(np.column_stack([X, W]))
    column = {name: outputs[:, k] for k, (name, _, _) in enumerate(built.program.outputs)}
    slip = np.sign(column["v_hat"])
    known = column["F_hat_rail"] - slip * column["a_hat_rail"]
    np.testing.assert_allclose(known, slip * 2 * np.exp(-TIME / 0.3), atol=1e-12)
