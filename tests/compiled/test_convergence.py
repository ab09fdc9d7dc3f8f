"""The generated observer does its work: on a simulated plant its estimate goes to the true friction."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.effects.declare import add_declared_effects
from codegen.mechanics.build import build_system
from codegen.simulate.closed_loop import simulate
from codegen.spec.reader import parse_spec

from .build import Built
from .specs import spec_text


def replayed(folder, text: str, plant: str):
    """Outputs by name, and what the simulation knows."""
    spec = parse_spec(plant, Path("plant.yaml"))
    truth = simulate(spec, add_declared_effects(build_system(spec), spec))
    built = Built(folder, text)
    outputs, _ = built.python_run(np.column_stack([truth.positions, truth.inputs]))
    return {name: outputs[:, k] for k, (name, _, _) in enumerate(built.program.outputs)}, truth


def settled(truth, contact: np.ndarray, samples: int) -> np.ndarray:
    """Samples before which the slip kept its sign for so long."""
    same = np.concatenate([[False], np.sign(contact[1:]) == np.sign(contact[:-1])]) & (np.abs(contact) > 1e-3)
    length = np.zeros(len(same), dtype=int)
    for k in range(1, len(same)):
        length[k] = length[k - 1] + 1 if same[k] else 0
    return length > samples


@pytest.mark.parametrize("level", [50, 35])
def test_one_mass(tmp_path, level):
    text = spec_text("one_mass").replace("61*sin(2*pi*0.5*t) + 8*sin", "120*sin(2*pi*0.5*t) + 40*sin")
    assert "120*sin" in text  # strong: it slips nearly always
    plant = text.replace("encoder_step: {x: 1e-5}", "encoder_step: {}").replace("a: 50", f"a: {level}")
    found, truth = replayed(tmp_path, text, plant)
    at = settled(truth, truth.true_velocities[:, 0], 300) & (truth.time > 4)
    assert np.sum(at) > 2000
    assert np.mean(found["a_hat_rail"][at]) == pytest.approx(level, rel=0.03)
    error = found["F_hat_rail"][at] - truth.contact_forces[at, 0]
    assert np.sqrt(np.mean(error**2)) < 0.08 * level


@pytest.mark.slow
def test_two_mass(tmp_path):
    text = spec_text("two_mass").replace("  sample_time: 0.002", "  sample_time: 0.001")
    plant = text.replace("encoder_step: {x1: 1e-5, x2: 1e-5}", "encoder_step: {}")
    plant = plant.replace("a: 10,", "a: 12,").replace("a: 20,", "a: 17,")
    found, truth = replayed(tmp_path, text, plant)
    slips = truth.true_velocities @ np.array([[1.0, 0.0], [-1.0, 1.0]])
    at = settled(truth, slips[:, 0], 300) & settled(truth, slips[:, 1], 300) & (truth.time > 6)
    assert np.sum(at) > 2000
    for c, (name, level) in enumerate({"between": 12, "ground": 17}.items()):
        assert np.median(found[f"a_hat_{name}"][at]) == pytest.approx(level, rel=0.05)
        assert np.median(found[f"F_hat_{name}"][at] / truth.contact_forces[at, c]) == pytest.approx(1, rel=0.05)
