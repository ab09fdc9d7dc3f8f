"""A value in SI bears an SI unit: what stands beside a number in the generated code is the unit of that number."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.base.errors import Place
from codegen.mechanics import build_system
from codegen.spec import parse_spec
from codegen.spec.units import coherent_name, registry

TEXT = """
name: joint
coordinates: {{q: {{velocity: om, unit: rad}}}}
inputs: {{i: {{unit: A}}}}
parameters:
  J: {{value: 300, unit: {inertia}}}
  kt: {{value: 50, unit: {torque}}}
mass_matrix: [[J]]
force: [kt*i]
friction:
  distribution: [[1]]
  contacts: [{{name: bearing, a: 0.01, unit: N*m}}]
"""


@pytest.mark.parametrize(
    ("inertia", "torque"),
    [("g*cm^2", "mN*m/A"), ("kg*m^2", "N*m/A"), ("kg*cm^2", "ozf*inch/A"), ("lb*inch^2", "N*cm/A")],
)
def test_the_unit_of_a_converted_parameter_is_that_of_its_value(inertia: str, torque: str) -> None:
    spec = parse_spec(TEXT.format(inertia=inertia, torque=torque), Path("joint.yaml"))
    system = build_system(spec)
    for parameter in spec.parameters:
        s = spec.symbol(parameter.name)
        declared = registry().Quantity(float(parameter.declared), parameter.unit)
        labelled = registry().Quantity(float(system.values[s]), system.units[s])
        assert labelled.to_base_units().magnitude == pytest.approx(declared.to_base_units().magnitude, rel=1e-12)


@pytest.mark.parametrize(
    ("unit", "name"),
    [
        ("deg", "rad"),
        ("rpm", "rad/s"),
        ("N*m/deg", "N*m/rad"),
        ("1/deg", "1/rad"),
        ("kg", "kg"),
        ("kHz", "1/s"),
        ("mm", "m"),
    ],
)
def test_the_name_of_the_si_unit(unit: str, name: str) -> None:
    assert coherent_name(unit, Place("a.yaml")) == name


@pytest.mark.parametrize(("unit", "shown"), [("A", "A"), ("N*m", "N*m"), ("J", "N*m"), ("V", "V")])
def test_a_balance_in_another_unit_than_newtons_is_told_in_it(unit: str, shown: str) -> None:
    """A motor whose torque constant is not known: inertia in A s², friction and input in A."""
    base = unit if unit in ("A", "V") else "N*m"
    text = f"""name: motor
coordinates: {{q: {{velocity: v, unit: rad}}}}
inputs: {{u: {{unit: {base}}}}}
parameters: {{J: {{value: 2e-4, unit: "{base}*s^2"}}}}
mass_matrix: [[J]]
force: [u]
friction: {{distribution: [[1]], contacts: [{{name: c, a: 1, unit: {unit}}}]}}
"""
    assert build_system(parse_spec(text, Path("motor.yaml"))).force_unit(0) == shown
