"""The shipped seven-joint arm from spec to generated code."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from codegen.analysis.analysis import Analysis
from codegen.certify.certify import spectral_rate
from mechanics.robots import SPECS
from stiction import derive

SPEC = SPECS / "seven_joint_arm.yaml"


GENERATED = SPECS.parent / "generated" / "seven_joint_arm"
"""As committed; tests/compiled/test_goldens.py sees that it is current."""


@cache
def analysis() -> Analysis:
    return derive(SPEC)


def _load(folder: Path):
    module_spec = importlib.util.spec_from_file_location("arm_twin", folder / "__init__.py")
    assert module_spec is not None and module_spec.loader is not None
    twin = importlib.util.module_from_spec(module_spec)
    sys.modules["arm_twin"] = twin
    module_spec.loader.exec_module(twin)
    return twin


def test_psi_of_the_arm_is_short_and_stable() -> None:
    found = analysis()
    assert found.stable and found.spectral_abscissa < 0
    assert max(len(str(entry)) for entry in found.dynamics.jacobian) < 400
    assert not found.points.missing


def test_a_certificate_by_structure_says_what_it_assumes() -> None:
    content = json.loads((GENERATED / "certificate.json").read_text(encoding="utf-8"))
    figures = next(line for line in content["assumptions"] if "not proved over the envelope" in line)
    assert "a local search from the worst" in figures
    assert content["claim"].startswith("By the structure of the observer, for every mass matrix")
    low, high = (float(Fraction(x)) for x in content["variables"]["sigma"])
    assert 1.9 < low < 2.0 and 37 < high < 39  # the roots of 4.2 and 1300 1/s with 10 % added
    spectral = spectral_rate(analysis())
    assert 0.5 * spectral < float(Fraction(content["decay_rate"])) < spectral


def test_the_manifest_names_the_robot_file() -> None:
    manifest = json.loads((GENERATED / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["robot"]["file"] == "seven_joint_arm.urdf" and len(manifest["robot"]["sha256"]) == 64


def test_the_python_twin_does_what_the_equations_say() -> None:
    """A step of the GTO written with NumPy on Pinocchio's M and h."""
    twin = _load(GENERATED)
    model = pin.buildModelFromUrdf(str(SPECS / "seven_joint_arm.urdf"))
    data, dynamics = model.createData(), analysis().dynamics
    system, gains = dynamics.observer.system, dynamics.observer.gains
    value = {s.name: float(v) for s, v in {**system.values, **gains}.items()}
    joints = [x.name for x in system.positions]
    k2, kv = (np.array([value[f"{k}{j}"] for j in joints]) for k in ("K_2_", "K_v_v_"))
    damping = np.array([value[f"viscous_{j}_b"] for j in joints])
    h = float(dynamics.observer.sample_time)
    parameters, state = twin.Parameters(), None
    z_v = z_f = np.zeros(7)
    generator = np.random.default_rng(8)
    x = generator.uniform(-1, 1, 7)
    for _ in range(50):
        x = x + generator.normal(scale=2e-3, size=7)
        w = generator.normal(scale=5, size=7)
        named = dict(zip(joints, x, strict=True)) | {f"w_{j}": u for j, u in zip(joints, w, strict=True)}
        inputs = twin.Inputs(**{name: float(value) for name, value in named.items()})
        if state is None:
            state, z_v, z_f = twin.init(parameters, inputs), -kv * x, 0 * x
        output = twin.step(state, parameters, inputs)
        v_hat = z_v + kv * x
        tracked = z_f + k2 * v_hat
        upper = np.triu(pin.crba(model, data, x))
        mass = upper + np.triu(upper, 1).T
        total = tracked + damping * v_hat
        acceleration = np.linalg.solve(mass, w - pin.nonLinearEffects(model, data, x, v_hat) - total)
        for joint, f, v in zip(joints, tracked, v_hat, strict=True):
            assert getattr(output, f"tracked_{joint}") == pytest.approx(f, rel=1e-9, abs=1e-9)
            assert getattr(output, f"v_{joint}_hat") == pytest.approx(v, rel=1e-9, abs=1e-9)
        z_v, z_f = z_v + h * (-kv * v_hat + acceleration), z_f + h * (-k2 * acceleration)


def test_the_c_compiles_without_a_warning(tmp_path: Path) -> None:
    flags = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off"]
    sources = [str(GENERATED / "seven_joint_arm.c"), str(GENERATED / "example_main.c")]
    command = ["gcc", *flags, *sources, "-o", str(tmp_path / "arm"), "-lm"]
    assert subprocess.run(command, capture_output=True, text=True, check=False).stderr == ""
    samples = np.random.default_rng(3).uniform(-1, 1, (5, 14))
    lines = "".join(" ".join(repr(float(value)) for value in row) + "\n" for row in samples)
    done = subprocess.run([tmp_path / "arm"], input=lines, capture_output=True, text=True, check=True)
    twin = _load(GENERATED)
    names, state = list(twin.Inputs.__dataclass_fields__), None
    for row, line in zip(samples, done.stdout.splitlines()[-5:], strict=True):
        inputs = twin.Inputs(**dict(zip(names, map(float, row), strict=True)))
        state = twin.init(twin.Parameters(), inputs) if state is None else state
        output = twin.step(state, twin.Parameters(), inputs)
        ours = [getattr(output, name) for name in twin.Outputs.__dataclass_fields__]
        assert [float(word) for word in line.split()] == ours  # the same bits
