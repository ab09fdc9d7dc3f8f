"""The cells of an envelope are no more than the checker accepts, whatever the step of the observer."""

from __future__ import annotations

from math import prod
from pathlib import Path

import pytest

from codegen.app.derived import derived_from
from codegen.certify.enclosure import enclose_family
from codegen.certify.family import build_family
from codegen.checker.decay import MAX_TOTAL

PAN_TILT = """
name: pan_tilt
coordinates:
  pan: {velocity: w_pan, unit: rad}
  tilt: {velocity: w_tilt, unit: rad}
inputs:
  T1: {unit: N*m}
  T2: {unit: N*m}
parameters:
  Jb: {value: 0.02, unit: kg*m^2}
  Ix: {value: 0.006, unit: kg*m^2}
  Iy: {value: 0.0153, unit: kg*m^2}
  turn: {value: 0.26, unit: N*m}
lagrangian:
  kinetic:
    - Jb*w_pan^2/2
    - (Ix*sin(tilt)^2 + Iy*cos(tilt)^2)*w_pan^2/2
    - Iy*w_tilt^2/2
  potential: turn*sin(tilt)
force: [T1, T2]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {name: azimuth, law: coulomb, a: 0.11, unit: N*m}
    - {name: elevation, law: coulomb, a: 0.08, unit: N*m}
observer:
  kind: gcfo
  velocity: estimated
  integration: INTEGRATION
  gains: {K_F: [1.95, 0.997], K_v: 219}
  sample_time: 1 ms
envelope:
  tilt: [-60 deg, 60 deg]
  w_pan: [-2, 2]
  w_tilt: [-2, 2]
"""


@pytest.mark.parametrize("integration", ["euler", "semi_implicit"])
def test_the_checker_accepts_so_many_vertices(integration: str, tmp_path: Path) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text(PAN_TILT.replace("INTEGRATION", integration))
    analysis = derived_from(spec).analysis
    family = build_family(analysis.dynamics, analysis.points.ranges)
    cells = prod(len(breaks) - 1 for breaks in enclose_family(family).splits.values())
    assert cells > 1 and cells * 2 ** len(family.parameters) <= MAX_TOTAL
