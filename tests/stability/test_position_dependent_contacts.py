"""A contact whose direction turns with position: what the equations leave out is refused, not certified."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen import pipeline
from codegen.stability.certify import Certificate, Refusal

TEXT = """
name: slider
coordinates: {{x: {{velocity: v, unit: m}}}}
inputs: {{w: {{unit: N}}}}
parameters: {{m: {{value: 2, unit: kg}}, r: {{value: 1, unit: 1/m}}}}
mass_matrix: [[m]]
force: [w]
friction:
  distribution: [[{u}]]
  contacts: [{{name: rail, a: 3, unit: N}}]
observer: {{kind: gcfo, velocity: measured, gains: {{K_F: 10}}, sample_time: 0.001}}
envelope: {{x: [-0.5, 0.5], v: [-1, 1]}}
"""


@pytest.mark.parametrize(("u", "given"), [("1", True), ("1 + 0.5*sin(r*x)", False)])
def test_gcfo_with_a_position_dependent_distribution_gets_no_certificate(u: str, given: bool, tmp_path: Path) -> None:
    path = tmp_path / "slider.yaml"
    path.write_text(TEXT.format(u=u))
    outcome = pipeline.certify(path)
    assert isinstance(outcome, Certificate if given else Refusal)
    if isinstance(outcome, Refusal):
        assert "U varies with position" in outcome.reason
