"""Certificates of machines whose friction is a curve of the slip speed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.app.certify import certify
from codegen.base.errors import BadInput
from codegen.certify.certify import Certificate

from .certified import outcome

SPEC = """\
name: axis
source: an example
coordinates: {{x: {{velocity: v, unit: m}}}}
inputs: {{u: {{unit: N}}}}
parameters: {{m: {{value: 1, unit: kg}}}}
mass_matrix: [[m]]
force: [u]
friction: {{distribution: [[1]], contacts: [{{name: rail, law: coulomb, a: 5, unit: N}}]}}
effects: [{effect}]
observer: {{kind: gcfo, velocity: estimated, gains: {{K_F: 10, K_v: 100}}, sample_time: 1 ms}}
envelope: {{x: [-0.5, 0.5], v: [-1, 1]}}
"""


def spec(effect: str, folder: Path) -> Path:
    path = folder / "axis.yaml"
    path.write_text(SPEC.format(effect=effect), encoding="utf-8")
    return path


def test_viscous_friction_that_thins_is_certified(tmp_path: Path) -> None:
    """The rate is below that of the slowest mode, whose matrix has the slope b/(1 + |v|/v_s) by hand."""
    b, v_s, h = 8.0, 0.1, 1e-3
    found = certify(spec(f"{{kind: viscous, on: rail, parameters: {{b: {b}, v_s: {v_s}}}}}", tmp_path))
    assert found.certificate is not None
    slopes = b / (1 + np.linspace(0, 1, 101) / v_s)
    modes = [np.linalg.eigvals([[-100 - c, -1], [1000, 0]]) for c in slopes]
    slowest = min(-np.log(np.abs(1 + h * m)).max() / h for m in modes)
    assert 0.9 * slowest < found.certificate.decay_rate <= 1.01 * slowest
    assert isinstance(found.bounds, str) and "dg/dv is not constant" in found.bounds


def test_a_curve_between_two_masses_is_enclosed_over_their_slip() -> None:
    """Over v1 and v2, as if independent in |v1 - v2|, its slope b/(1 + |u|/v_s) has a divisor that may be 0."""
    b, v_s, h = 8.0, 0.1, 1e-3
    gains = "{kind: gcfo, velocity: estimated, gains: {K_F: [500, 700], K_v: [10, 10]}, sample_time: 0.001}"
    effect = f"[{{kind: viscous, on: between, parameters: {{b: {b}, v_s: {v_s}}}}}]"
    found = outcome("two_mass", gains, "{v1: [-5, 5], v2: [-5, 5]}", effect)
    assert isinstance(found, Certificate)
    U, by_mass, K_F, K_v = np.array([[1, 0], [-1, 1]]), np.diag([1 / 10, 1 / 50]), np.diag([500, 700]), 10
    radii = []
    for c in 3 + b / (1 + np.geomspace(1e-4, 10, 101) / v_s):  # the machine's own damping is 3; slips up to 10 m/s
        slopes = -K_v * np.eye(2) - by_mass @ np.outer(U[:, 0], U[:, 0]) * c
        step = np.eye(4) + h * np.block([[slopes, -by_mass @ U], [K_v * K_F @ U.T, np.zeros((2, 2))]])
        radii.append(np.abs(np.linalg.eigvals(step)).max())
    spectral = (1 - max(radii) ** 2) / (2 * h)
    assert 0.9 * spectral < found.decay_rate <= 1.001 * spectral


@pytest.mark.parametrize(
    ("exponent", "words"),
    [(1.2, "the power 0.2"), (1.4023, "the power 0.4023"), (0.7, "not finite at s_rail = 1, v = 0")],
)
def test_a_stribeck_curve_with_an_exponent_is_refused_in_words(exponent: float, words: str, tmp_path: Path) -> None:
    """Above 1 its slope is finite, and no certificate expresses the power; below 1 it is infinite at standstill."""
    path = spec(f"{{kind: stribeck, on: rail, parameters: {{delta: 2, v_s: 0.1, exponent: {exponent}}}}}", tmp_path)
    try:
        found = certify(path)
    except BadInput as error:
        assert error.code == "SPEC033" and words in error.found
    else:
        assert found.certificate is None and words in getattr(found.outcome, "reason", "")
