"""A gain's unit is that of what it turns into what, entry by entry, also on a machine that turns and slides."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.mechanics import build_system
from codegen.observers import build_observer
from codegen.spec import parse_spec

SPINDLE = """\
name: spindle
coordinates:
  phi: {velocity: omega, unit: rad}
  x: {velocity: v, unit: m}
inputs:
  w: {unit: N*m}
parameters:
  J: {value: 0.1, unit: kg*m^2}
  m: {value: 2, unit: kg}
mass_matrix: [[J, 0], [0, m]]
force: [w, 0]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {name: nut, LAW, unit: N*m}
    - {name: rail, LAW, unit: N}
"""
FULL = "[[1, 2], [3, 4]]"
ROWS = {"nut": "N*m", "rail": "N"}
CASES = {
    "level": ("gcfo", "law: coulomb, a: 5", f"K_F: {FULL}", "", {"K_F_{i}_{j}": "{force}*s/{slip}"}),
    "exponent": (
        "gcfo",
        "law: coulomb, a: 5",
        f"K_F: {FULL}",
        ", exponent: 2",
        {"K_F_{i}_{j}": "{force}*(s/{slip})^2"},
    ),
    "any h": ("gcfo", "law: coulomb, a: 5", f"K_F: {FULL}", ", h: s + s**2", {"K_F_{i}_{j}": "{force} per unit of h"}),
    "force": (
        "mgto",
        "law: coulomb, a: 5",
        f"K_1: {FULL}, K_2: {FULL}",
        "",
        {"K_1_{i}_{x}": "{force}/{slip}", "K_2_{i}_{x}": "{force}*s/{slip}"},
    ),
    "state": (
        "gdfo",
        "law: dahl, a: 5, c: 100",
        f"K_a: {FULL}, K_f1: {FULL}, K_f2: {FULL}",
        "",
        {"K_a_{i}_{j}": "{force}*s/{slip}", "K_f1_{i}_{x}": "1/{slip}", "K_f2_{i}_{x}": "s/{slip}"},
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_each_entry_has_the_unit_of_its_row_and_column(case: str) -> None:
    kind, law, gains, more, patterns = CASES[case]
    section = f"observer: {{kind: {kind}, velocity: estimated, gains: {{{gains}, K_v: 9}}, sample_time: 0.001{more}}}\n"
    spec = parse_spec(SPINDLE.replace("LAW", law) + section, Path("spindle.yaml"))
    observer = build_observer(spec, build_system(spec))
    found = {s.name: unit for s, unit in observer.gain_units.items()}
    expected = {"K_v_omega": "1/s", "K_v_v": "1/s"}
    for pattern, unit in patterns.items():
        for i, force in ROWS.items():
            for j, x, slip in (("nut", "phi", "rad"), ("rail", "x", "m")):
                expected[pattern.format(i=i, j=j, x=x)] = unit.format(force=force, slip=slip)
    assert found == expected
