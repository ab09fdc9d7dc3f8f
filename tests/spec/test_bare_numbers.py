"""Terms whose units do not match: the message has the names in them, and which of these have no unit."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.base.errors import BadInput
from codegen.mechanics import build_system
from codegen.spec import parse_spec
from tests.expected_errors import matches

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


@pytest.mark.parametrize(
    ("replaced", "by"),
    [
        # n or kt may be the one that is in N*m/A
        (" - b*om", ""),
        # the fault is not one of a missing unit: the sum stays wrong with any unit of b
        (" - b*om", " - b*om - i"),
    ],
)
def test_no_parameter_is_blamed_where_the_units_do_not_tell_which(replaced: str, by: str) -> None:
    spec = SPEC.replace(', unit: "1"}', "}").replace(", unit: N*m/A}", "}").replace(replaced, by)
    with pytest.raises(BadInput) as told:
        build_system(parse_spec(spec, Path("table.yaml")))
    assert told.value.place.key == "force[0]" and told.value.code == "SPEC014"


def test_a_unit_that_is_written_as_one_is_meant() -> None:
    with pytest.raises(BadInput) as told:
        build_system(parse_spec(SPEC.replace("b: {value: 3}", 'b: {value: 3, unit: "1"}'), Path("table.yaml")))
    assert matches(told.value, "SPEC014 force[0]") and all(f"{x} without unit" in told.value.expected for x in "nb")


def test_nothing_is_named_where_every_factor_has_a_unit() -> None:
    wrong = SPEC.replace("b: {value: 3}", "b: {value: 3, unit: N*m}").replace("n*kt*i", "kt*i")
    with pytest.raises(BadInput) as told:
        build_system(parse_spec(wrong, Path("table.yaml")))
    assert "none" not in told.value.expected
