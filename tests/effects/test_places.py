"""Where an effect acts: on a coordinate, whatever its place is an index of."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnosis.results import FoundEffect
from codegen.diagnosis.verdict.against_regression import acts_on
from codegen.effects import CATALOGUE
from codegen.effects.declare import places_of
from codegen.mechanics import System, build_system
from codegen.spec import parse_spec

CARTS = """\
name: carts
coordinates:
  a: {velocity: va, unit: m}
  b: {velocity: vb, unit: m}
  c: {velocity: vc, unit: m}
  d: {velocity: vd, unit: m}
inputs: {w1: {unit: N}, w2: {unit: N}}
parameters: {m: {value: 2, unit: kg}}
mass_matrix: [[m, 0, 0, 0], [0, m, 0, 0], [0, 0, m, 0], [0, 0, 0, m]]
force: [0.1*w1, w2, 3*w1, 0]   # the first input mostly drives c
friction:
  distribution: [[1, 0, 0, 0, 1], [0, 1, 0, 0, 0], [0, 0, 1, 0, 0], [0, 0, 0, 1, -3]]
  contacts:
    - {name: rail_a, law: coulomb, a: 1, unit: N}
    - {name: rail_b, law: coulomb, a: 1, unit: N}
    - {name: rail_c, law: coulomb, a: 1, unit: N}
    - {name: rail_d, law: coulomb, a: 1, unit: N}
    - {name: belt, law: coulomb, a: 1, unit: N}
"""


def carts() -> System:
    return build_system(parse_spec(CARTS, Path("carts.yaml")))


@pytest.mark.parametrize(
    ("kind", "on", "coordinate"),
    [
        ("viscous", "rail_b", "b"),
        ("viscous", "belt", "d"),
        ("cogging", "c", "c"),
        ("coupling", "b, d", "b"),
        ("coupling", "c, d", "c"),
        ("dead_zone", "w1", "c"),
        ("dead_zone", "w2", "b"),
        ("encoder_eccentricity", "d", "d"),
    ],
)
def test_an_effect_says_on_which_coordinate_it_acts(kind: str, on: str, coordinate: str) -> None:
    system, effect = carts(), CATALOGUE[kind]
    place = places_of(effect, system).index(on)
    assert system.positions[effect.coordinate(system, place)].name == coordinate
    assert system.positions[acts_on(FoundEffect(kind, on, {}, {}), system)].name == coordinate


def test_every_effect_at_every_place_acts_on_some_coordinate() -> None:
    system = carts()
    for effect in CATALOGUE.values():
        for place in range(len(places_of(effect, system))):
            assert effect.coordinate(system, place) in range(system.degrees_of_freedom)
