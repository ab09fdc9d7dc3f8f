"""Machines with more contacts and pairs than coordinates: candidates at such places, and levels of such contacts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.selection.candidate_fits import every_part, fit_candidates
from codegen.diagnosis.selection.ranking import run_round
from codegen.mechanics import build_system
from codegen.spec import parse_spec
from tests.diagnosis.stage import log_of

FOUR = """\
name: four
coordinates:
  a: {velocity: va, unit: m}
  b: {velocity: vb, unit: m}
  c: {velocity: vc, unit: m}
  d: {velocity: vd, unit: m}
inputs: {w1: {unit: N}, w2: {unit: N}, w3: {unit: N}, w4: {unit: N}}
parameters: {m: {value: 2, unit: kg}}
mass_matrix: [[m, 0, 0, 0], [0, m, 0, 0], [0, 0, m, 0], [0, 0, 0, m]]
force: [w1, w2, w3, w4]
friction:
  distribution: [[1, 0, 0, 0, 0], [0, 1, 0, 0, 0], [0, 0, 1, 0, 1], [0, 0, 0, 1, -1]]
  contacts:
    - {name: rail_a, law: coulomb, a: 1, unit: N}
    - {name: rail_b, law: coulomb, a: 1, unit: N}
    - {name: rail_c, law: coulomb, a: 1, unit: N}
    - {name: rail_d, law: coulomb, a: 1, unit: N}
    - {name: between, law: coulomb, a: 1, unit: N}
"""
MOVING = """effects:
  - {kind: coupling, on: [c, d], parameters: {c: 12}}
simulation:
  duration: 12
  sample_time: 0.005
  reference: {a: "0.2*sin(2.5*t)", b: "0.2*sin(3.1*t)", c: "0.2*sin(2.2*t)", d: "0.2*sin(3.7*t + 1)"}
  position_gain: {w1: 900, w2: 900, w3: 900, w4: 900}
  velocity_gain: {w1: 30, w2: 30, w3: 30, w4: 30}
  encoder_step: {a: 2e-6, b: 2e-6, c: 2e-6, d: 2e-6}
"""


@pytest.mark.slow
def test_more_pairs_and_contacts_than_coordinates_are_ranked(tmp_path: Path) -> None:
    spec = parse_spec(FOUR, Path("four.yaml"))
    system = build_system(spec)
    log = log_of(parse_spec(FOUR + MOVING, Path("four.yaml")), tmp_path, "log.csv")
    motion = smooth_motion(log)
    search = search_on(Problem(system, motion, {}), lambda share: record_of(motion, log, share))
    base = search.refit()
    parts = [p for p in every_part(search, ()) if (p.kind, p.on) in {("coupling", "c, d"), ("viscous", "between")}]
    assert {p.place for p in parts} == {5, 4}
    ranked = run_round(search, base, parts)
    assert {(r.found.part.kind, r.found.part.on) for r in ranked if not r.why_not} == {
        ("coupling", "c, d"),
        ("viscous", "between"),
    }
    assert ranked[0].found.parameters.popitem()[1] == pytest.approx(12, rel=0.05)
    assert np.isfinite(ranked[0].size)


TWO = """\
name: two
coordinates: {c: {velocity: vc, unit: m}, d: {velocity: vd, unit: m}}
inputs: {w3: {unit: N}, w4: {unit: N}}
parameters: {m: {value: 2, unit: kg}}
mass_matrix: [[m, 0], [0, m]]
force: [w3, w4]
friction:
  distribution: [[1, 0, 1], [0, 1, -1]]
  contacts:
    - {name: rail_c, law: coulomb, a: 1, unit: N}
    - {name: rail_d, law: coulomb, a: 1, unit: N}
    - {name: between, law: coulomb, a: 1, unit: N}
"""
MOVING_TWO = """effects:
  - {kind: coupling, on: [c, d], parameters: {c: 20}}
simulation:
  duration: 12
  sample_time: 0.005
  reference: {c: "0.2*sin(2.2*t)", d: "0.2*sin(3.7*t + 1)"}
  position_gain: {w3: 900, w4: 900}
  velocity_gain: {w3: 30, w4: 30}
  encoder_step: {c: 2e-6, d: 2e-6}
"""


def test_a_level_that_a_step_would_make_negative_is_still_found(tmp_path: Path) -> None:
    """Without the coupling the level between the two is fitted as some 12 N; the first step with it goes below zero."""
    spec = parse_spec(TWO, Path("two.yaml"))
    log = log_of(parse_spec(TWO + MOVING_TWO, Path("two.yaml")), tmp_path, "log.csv")
    motion = smooth_motion(log)
    search = search_on(Problem(build_system(spec), motion, {}), lambda share: record_of(motion, log, share))
    base = search.refit()
    (part,) = [p for p in every_part(search, ()) if p.kind == "coupling"]
    (found,) = fit_candidates(search, base, [part])
    assert found.values[0] == pytest.approx([1, 1, 1], rel=1e-3)
    assert found.parameters["c"] == pytest.approx(20, rel=1e-4)
