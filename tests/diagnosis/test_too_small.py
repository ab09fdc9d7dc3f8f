"""An effect with states is not named for what a force explains better that is too small to matter."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import stiction
from codegen.diagnosis.fit.acceptance import ALPHA, LEAST_NET, LEAST_SIZE
from codegen.diagnosis.selection import ranking, refusals
from codegen.diagnosis.selection.ranking import Ranked
from tests.diagnosis.fakes import Placed

SMALL = "explains less than stribeck on gear, which is too small to matter: 0.3 % of the drive force; 0.5 % is needed"


def candidate(kind: str, share: float, size: float, p: float = 0.0, at: int = 0, why_not: str = "") -> Ranked:
    effect = SimpleNamespace(coordinate=lambda system, place: at)
    part = Placed(kind=kind, on="gear", place=0, effect=effect)
    found: Any = SimpleNamespace(part=part, trial=SimpleNamespace(adds_states=kind in ("compliance", "backlash")))
    evidence: Any = SimpleNamespace(share=share)
    return Ranked(found, evidence, 1.0, size, why_not, p=p)


@pytest.mark.parametrize(
    ("other", "refused"),
    [
        (candidate("stribeck", 0.49, 0.003), True),
        (candidate("stribeck", 0.3, 0.003), False),  # it explains less
        (candidate("stribeck", 0.49, 0.006, why_not="may be chance"), False),  # it is large enough
        (candidate("stribeck", 0.49, 0.003, p=2 * ALPHA), False),  # it may be chance
        (candidate("stribeck", 0.49, 0.003, at=1), False),  # of another joint
        (candidate("backlash", 0.49, LEAST_NET / 2), False),  # a load too, whose size is measured likewise
    ],
)
def test_a_small_load_beside_a_force_that_explains_more(other: Ranked, refused: bool) -> None:
    load = candidate("compliance", 0.38, 0.0012)
    search: Any = SimpleNamespace(system=SimpleNamespace(inputs=("w",)), problem=SimpleNamespace(material=0.02))
    found = ranking._refused_beside_small_force(search, load, [load, other])
    assert found.why_not == (SMALL if refused else "")
    large = candidate("compliance", 0.38, 2 * LEAST_SIZE)
    assert ranking._refused_beside_small_force(search, large, [large, other]) is large


WRIST = """\
name: wrist
coordinates: {pitch: {velocity: dp, unit: rad}, roll: {velocity: dr, unit: rad}}
inputs: {i1: {unit: A}, i2: {unit: A}}
parameters:
  Mp: {value: 0.06972, unit: kg*m^2}
  Mr: {value: 0.064, unit: kg*m^2}
  k: {value: 2.25, unit: N*m/A}
  G: {value: 1.05948, unit: N*m}
mass_matrix: [[Mp, 0], [0, Mr]]
force: [k*(i1 + i2) - G*sin(pitch), k*(i1 - i2)]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts: [{name: pitch_gear, law: coulomb, a: 0.35, unit: N*m}, {name: roll_gear, law: coulomb, a: 0.25, unit: N*m}]
"""
STEP, WIDTH = 1e-3, 2e-3
COUNT = 2 * np.pi / 2**18


def wrist_log(seconds: float, hertz: tuple[float, ...]) -> NDArray[np.float64]:
    """A wrist with cogging on its roll, whose friction is a tanh(v/2 mrad/s) in place of a sign, by SciPy's LSODA."""

    def reference(t: float) -> NDArray[np.float64]:
        one, two, three, four = np.sin(2 * np.pi * np.array(hertz) * t)
        return np.array([0.5 * one + 0.2 * two, 1.2 * three + 0.3 * four])

    def rate(t: float, y: NDArray[np.float64]) -> list[float]:
        pitch, roll, dp, dr = y
        on_pitch = torque[0] - 1.05948 * np.sin(pitch) - 0.38 * np.tanh(dp / WIDTH)
        on_roll = torque[1] - 0.27 * np.tanh(dr / WIDTH) + 0.4 * np.sin(50 * roll + 0.6)
        return [dp, dr, on_pitch / 0.06972, on_roll / 0.064]

    state, rows, before = np.zeros(4), [], None
    for t in STEP * np.arange(round(seconds / STEP)):
        measured = np.round(state[:2] / COUNT) * COUNT
        speed = np.zeros(2) if before is None else (measured - before) / STEP
        before = measured
        slope = (reference(t + 1e-5) - reference(t - 1e-5)) / 2e-5
        one, two = 30 * (reference(t) - measured) + 1.5 * (slope - speed)
        currents = np.clip([(one + two) / 4.5, (one - two) / 4.5], -4, 4)
        torque = 2.25 * np.array([currents[0] + currents[1], currents[0] - currents[1]])
        rows.append([t, *measured, *currents])
        state = solve_ivp(rate, (t, t + STEP), state, method="LSODA", rtol=1e-8, atol=1e-10).y[:, -1]
    return np.array(rows)


@pytest.mark.slow
def test_no_load_is_named_for_friction_that_is_simulated_smoothly(tmp_path: Path) -> None:
    """It was a compliance of the pitch, with a damping between 4e-7 and 2000 N*m*s/rad."""
    (tmp_path / "wrist.yaml").write_text(WRIST)
    for name, log in (
        ("log.csv", wrist_log(14, (0.31, 0.83, 0.23, 0.71))),
        ("test.csv", wrist_log(8, (0.43, 0.61, 0.37, 0.53))),
    ):
        np.savetxt(tmp_path / name, log, "%.9g", ",", header="t,pitch,roll,i1,i2", comments="")
    found = stiction.diagnose(
        tmp_path / "wrist.yaml", tmp_path / "log.csv", tmp_path / "test.csv", tmp_path / "diagnosis"
    )
    assert [(effect.kind, effect.on) for effect in found.effects] == [("cogging", "roll")]
    assert found.effects[0].parameters["amplitude"] == pytest.approx(0.4, rel=0.01)
    later = [one for round_ in found.content["later_rounds"] for one in round_["candidates"]]
    assert any("explains less than stribeck on pitch_gear" in one["evidence"]["why_not"] for one in later)


@pytest.mark.parametrize(("material", "least"), [(0.02, 0.005), (0.003, 0.003), (0.0002, 0.001)])
def test_the_least_force_of_an_effect_follows_the_material_share_down_to_a_tenth_of_a_percent(
    material: float, least: float
) -> None:
    problem: Any = SimpleNamespace(material=material)
    assert refusals.least_force(problem) == least
