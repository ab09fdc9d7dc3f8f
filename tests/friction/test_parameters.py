"""A spec names any law; parameters out of range, missing or unknown are refused where they stand."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.base.errors import BadInput
from codegen.friction import LAWS
from codegen.mechanics import build_system
from codegen.spec import parse_spec
from tests.expected_errors import refused
from tests.friction.samples import draw

SPEC = """\
name: slider
coordinates:
  x: {{velocity: v, unit: m}}
inputs:
  w: {{unit: N}}
parameters:
  m: {{value: 1, unit: kg}}
mass_matrix: [[m]]
force: [w]
friction:
  distribution: [[1]]
  contacts:
    - {{name: rail, law: {law}, unit: N{entries}}}
"""


def system(law: str, entries: dict[str, float]):
    text = "".join(f", {k}: {v!r}" for k, v in entries.items())
    return build_system(parse_spec(SPEC.format(law=law, entries=text), Path("slider.yaml")))


@pytest.mark.parametrize("name", LAWS)
def test_a_spec_may_name_the_law(name: str) -> None:
    p = draw(name, 1)
    (contact,) = system(name, p).contacts
    assert contact.law is LAWS[name]
    assert {k: float(system(name, p).values[s]) for k, s in contact.law_parameters.items()} == p


@pytest.mark.parametrize("name", LAWS)
def test_what_has_a_default_may_be_left_out_and_nothing_else(name: str) -> None:
    for q in LAWS[name].parameters:
        entries = {k: v for k, v in draw(name, 1).items() if k != q.name}
        if q.default is None:
            with refused(f"SPEC003 `{q.name}` `{q.name}:`"):
                system(name, entries)
        else:
            (contact,) = system(name, entries).contacts
            assert system(name, entries).values[contact.law_parameters[q.name]] == pytest.approx(float(q.default))


CASES = [(name, q.name) for name, law in LAWS.items() for q in law.parameters if q.lowest is not None]


@pytest.mark.parametrize(("name", "parameter"), CASES)
def test_a_parameter_below_its_range_is_refused_where_it_stands(name: str, parameter: str) -> None:
    (q,) = [q for q in LAWS[name].parameters if q.name == parameter]
    for wrong in (float(q.lowest) - 0.5, *([float(q.lowest)] if q.positive else [])):
        with pytest.raises(BadInput) as fault:
            system(name, draw(name, 1) | {parameter: wrong})
        assert f"slider.yaml:13: friction.contacts[0].{parameter}" in str(fault.value)
        assert q.meaning in str(fault.value)


def test_a_lowest_value_that_is_admitted_passes() -> None:
    for name, parameter in CASES:
        (q,) = [q for q in LAWS[name].parameters if q.name == parameter]
        if not q.positive:
            system(name, draw(name, 1) | {parameter: float(q.lowest)})


def test_a_name_that_the_law_has_not_is_refused_with_the_nearest() -> None:
    with refused("SPEC004 `sigma_3` 'sigma_"):
        system("lugre", draw("lugre", 1) | {"sigma_3": 1.0})
    with refused("SPEC008 `luger` 'lugre'"):
        system("luger", {})
