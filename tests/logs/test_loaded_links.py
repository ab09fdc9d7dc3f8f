"""The preflight of an arm with an unknown load: friction tells other masses of links from an input's wrong scale."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mechanics.robots import TWO_LINKS

from codegen.logs import Log, preflight
from codegen.logs.log import Finding
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import log_of

TOLERANCE = ", tolerance: {mass: 20 %, centre_of_mass: 20 %, inertia: 40 %}"
ARM = """name: arm
urdf: {{file: arm.urdf{tolerance}}}
friction:
  contacts:
    - {{name: q_1, law: coulomb, a: 0.4, unit: N*m}}
    - {{name: q_2, law: coulomb, a: 0.7, unit: N*m}}
log: {{cutoff_hz: 20}}
"""
MOTION = """simulation:
  duration: 20
  sample_time: 0.002
  reference: {q_1: "0.5*sin(1.3*t) + 0.2*sin(3.7*t) - 1.4", q_2: "0.8*sin(2.1*t) + 0.3*sin(5*t)"}
  position_gain: {w_q_1: 900, w_q_2: 400}
  velocity_gain: {w_q_1: 90, w_q_2: 40}
  position_noise: {q_1: 1e-5, q_2: 1e-5}
"""


def read(folder: Path, robot: str, simulated: str = "", tolerance: str = TOLERANCE) -> Spec:
    (folder / "arm.urdf").write_text(robot)
    return parse_spec(ARM.format(tolerance=tolerance) + simulated, folder / "arm.yaml")


def scale_of_elbow(log: Log, spec: Spec) -> Finding:
    return next(f for f in preflight(log, spec) if f.topic == "sign and scale of w_q_2")


@pytest.fixture(scope="module")
def loaded(tmp_path_factory: pytest.TempPathFactory) -> Log:
    """The log of the arm with five times the mass, and of the moment about the axis, of its last link."""
    folder = tmp_path_factory.mktemp("loaded")
    heavy = TWO_LINKS.replace('<mass value="1"/>', '<mass value="5"/>')
    heavy = heavy.replace('iyy="0.05" iyz="0" izz="0.12"', 'iyy="0.25" iyz="0" izz="0.3"')
    return log_of(read(folder, heavy, MOTION), folder, "log.csv")


def test_a_load_is_no_wrong_scale(loaded: Log, tmp_path: Path) -> None:
    found = scale_of_elbow(loaded, read(tmp_path, TWO_LINKS))
    assert found.figures["factor"] < 1 / 3
    assert found.severity == "warning" and "unknown load" in found.words


def test_links_without_tolerance_are_not_fitted(loaded: Log, tmp_path: Path) -> None:
    found = scale_of_elbow(loaded, read(tmp_path, TWO_LINKS, tolerance=""))
    assert found.severity == "problem" and "off by a factor" in found.words


def test_a_wrong_scale_stays_a_problem(tmp_path: Path) -> None:
    spec = read(tmp_path, TWO_LINKS)
    log = log_of(read(tmp_path, TWO_LINKS, MOTION), tmp_path, "log.csv")
    for scale in (0.2, 5.0):
        found = scale_of_elbow(replace(log, inputs=log.inputs * np.array([1.0, scale])), spec)
        assert found.severity == "problem" and "off by a factor" in found.words
