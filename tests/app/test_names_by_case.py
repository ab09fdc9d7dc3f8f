"""A cart of mass M and a pole of mass m: names that differ only in case are different names for every verb."""

from __future__ import annotations

import importlib.util
import subprocess
import zipfile
from pathlib import Path

import pytest

from codegen.spec import read_spec

from .command import stiction

# about the upright pole, to first order
CART_POLE = """\
name: cart_pole
coordinates:
  x: {velocity: v, unit: m}
  q: {velocity: V, unit: rad}
inputs:
  w: {unit: N}
  W: {unit: N*m}
parameters:
  M: {value: 2.5, unit: kg}
  m: {value: 0.4, unit: kg}
  L: {value: 0.3, unit: m}
  J: {value: 0.02, unit: kg*m^2}
  g: {value: 9.81, unit: m/s^2}
mass_matrix:
  - [M + m, m*L]
  - [m*L, J + m*L**2]
force:
  - w
  - W + m*g*L*q
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {name: rail, law: coulomb, a: 6, unit: N}
    - {name: Rail, law: coulomb, a: 0.05, unit: N*m}
effects: []
observer:
  kind: gcfo
  velocity: estimated
  gains: {K_F: 3, K_v: [100, 100]}
  sample_time: 0.001
envelope: {q: [-0.3, 0.3], V: [-1, 1], v: [-1, 1], w: [-20, 20], W: [-1, 1]}
simulation:
  duration: 0.2
  sample_time: 0.001
  inputs: {w: 20*sin(2*pi*3*t), W: 0.1*sin(2*pi*2*t)}
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.yaml").write_text(CART_POLE)
    return tmp_path


def values(twin: Path) -> dict[str, float]:
    """The parameters of a generated twin, imported as a package."""
    found = importlib.util.spec_from_file_location("cart_pole", twin / "__init__.py")
    assert found is not None and found.loader is not None
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    parameters = module.Parameters()
    return {name: getattr(parameters, name) for name in ("M", "m", "L", "g")}


@pytest.mark.slow
def test_every_verb_takes_them(folder):
    for words in (
        ("check", "s.yaml"),
        ("certify", "s.yaml"),
        ("generate", "s.yaml", "-o", "made", "--target", "all"),
        ("generate", "s.yaml", "-o", "made", "--target", "fmu"),
        ("simulate", "s.yaml", "-o", "log.csv"),
        ("replay", "s.yaml", "log.csv", "-o", "estimates.csv"),
    ):
        result = stiction(*words)
        assert (result.code, result.err) == (0, ""), (words, result)
    spec = {p.name: float(p.value) for p in read_spec("s.yaml").parameters}
    assert values(folder / "made") == {name: spec[name] for name in ("M", "m", "L", "g")}
    with zipfile.ZipFile("made/cart_pole.fmu") as archive:
        described = archive.read("modelDescription.xml").decode()
    assert all(
        f'name="{name}"' in described for name in ("M", "m", "v_hat", "V_hat", "w", "W", "F_hat_rail", "F_hat_Rail")
    )
    command = ["gcc", "-std=c99", "-Wall", "-Wextra", "-Wshadow", "-Werror", "-c", "cart_pole.c", "cart_pole_lanes.c"]
    done = subprocess.run(command, cwd=folder / "made", capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    heads = [Path(name).read_text().partition("\n")[0].split(",") for name in ("log.csv", "estimates.csv")]
    assert {"x", "q", "w", "W"} <= set(heads[0]) and {"v_hat", "V_hat", "F_hat_rail", "F_hat_Rail"} <= set(heads[1])


@pytest.mark.parametrize(
    "name", ["cart_pole_sign", "CART_POLE_PARAMETERS", "CART_POLE_LANES", "CART_POLE_COLD", "SAMPLE_TIME", "fmi3True"]
)
def test_macros_and_functions_of_the_generated_code_are_refused_by_check(folder, name):
    """A parameter NAME_sign had code, which `verify` bound to no certificate."""
    text = CART_POLE.replace("  M: {", f"  {name}: {{").replace("[M + m", f"[{name} + m")
    (folder / "s.yaml").write_text(text)
    result = stiction("check", "s.yaml")
    assert (
        result.code == 2
        and f"the name `{name}`, a {'function' if name.islower() else 'macro'} of the generated code" in result.err
    )
