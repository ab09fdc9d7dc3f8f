"""A Coulomb friction observer on a law without force at standstill starts from level zero."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.mechanics import build_system
from codegen.observers import build_observer
from codegen.program import build_program
from codegen.spec import parse_spec

SPEC = """
name: rock
coordinates: {x: {velocity: v, unit: m}}
inputs: {w: {unit: N}}
parameters: {m: {value: 2, unit: kg}}
mass_matrix: [[m]]
force: [w]
friction:
  distribution: [[1]]
  contacts: [{name: fault, law: LAW, F_0: 3, a: 0.2, b: 0.1, L: 0.01, v_0: 0.1, unit: N}]
observer: {kind: cfo, velocity: VELOCITY, gains: GAINS, sample_time: 0.001}
envelope: {v: [-1, 1]}
"""


@pytest.mark.parametrize("law", ["ruina", "linker_dieterich"])
@pytest.mark.parametrize(("velocity", "gains"), [("measured", "{K_F: 10}"), ("estimated", "{K_F: 10, K_v: 50}")])
def test_start_is_finite(law: str, velocity: str, gains: str):
    text = SPEC.replace("LAW", law).replace("VELOCITY", velocity).replace("GAINS", gains)
    spec = parse_spec(text, Path("rock.yaml"))
    observer = build_observer(spec, build_system(spec))
    level = observer.initial[-1]
    assert level.subs(dict.fromkeys(level.free_symbols, 0)) == 0
    build_program(observer)
