"""A sum of different units names the factors that have none: one of them lacks its unit."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.base.errors import BadInput
from codegen.mechanics import build_system
from codegen.spec import parse_spec

SPEC = """\
name: table
coordinates:
  phi: {velocity: om, unit: rad}
inputs:
  i: {unit: A}
parameters:
  J: {value: 2, unit: kg*m^2}
  n: {value: 72, unit: "1"}
  kt: {value: 0.35, unit: N*m/A}
  b: {value: 3}
  W: {value: 7, unit: N*m}
mass_matrix: [[J]]
force: [n*kt*i - b*om - W*sin(phi)]
friction:
  distribution: [[1]]
  contacts:
    - {name: pivot, law: coulomb, a: 14, unit: N*m}
"""


def test_a_parameter_without_its_unit_is_named() -> None:
    with pytest.raises(BadInput) as told:
        build_system(parse_spec(SPEC, Path("table.yaml")))
    assert told.value.code == "SPEC014"
    assert "(n, b have none)" in told.value.expected


def test_nothing_is_named_where_every_factor_has_a_unit() -> None:
    wrong = SPEC.replace("b: {value: 3}", "b: {value: 3, unit: N*m}").replace("n*kt*i", "kt*i")
    with pytest.raises(BadInput) as told:
        build_system(parse_spec(wrong, Path("table.yaml")))
    assert "none" not in told.value.expected
