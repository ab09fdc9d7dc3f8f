"""Samples that are lost in motion: where the machine goes on as before, so do the estimates."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tests.slow_cases import slow_except

from .build import Built, motion, same_bits
from .specs import spec_text
from .test_recovery import in_lanes

PERIOD, V1, V2 = 0.0005, 124.7, 70.0
MASS = """name: sliders
coordinates:
  x1: {velocity: v1, unit: m}
  x2: {velocity: v2, unit: m}
inputs:
  u1: {unit: N}
  u2: {unit: N}
parameters:
  m1: {value: 1, unit: kg}
  m2: {value: 0.42, unit: kg}
  k: {value: 0, unit: 1/m}
mass_matrix: [[m1, 0.1], [0.1, m2]]
force: [u1, u2]
friction:
  distribution: [[1, 0], [-1, 1 + sin(k*x2)/5]]
  contacts:
    - {name: between, law: dahl, a: 0.06, c: 30, unit: N}
    - {name: ground, law: dahl, a: 3.2, c: 30, unit: N}
effects: []
observer: {OBSERVER, sample_time: 0.0005}
envelope: {v1: [-200, 200], v2: [-200, 200], u1: [-9, 9], u2: [-9, 9]}
"""
KINDS = {
    "gcfo": "kind: gcfo, gains: {K_F: [60, 80], VELOCITY}",
    "gto": "kind: gto, gains: {K_1: 30, K_2: [[-80, 2], [1, -60]], VELOCITY}",
    "mgto": "kind: mgto, gains: {K_1: [[5, 1], [2, 9]], K_2: [[-40, 2], [1, -60]], VELOCITY}",
    "gdfo": "kind: gdfo, gains: {K_a: [-0.02, -0.05], K_f1: 0.4, K_f2: 0.01, VELOCITY}",
}
FULL = "K_v: [[740, 20], [10, 600]]"


def observer(kind: str, integration: str, velocity: str = "estimated", gain: str = "K_v: 740") -> str:
    text = KINDS[kind].replace(", VELOCITY", f", {gain}" if velocity == "estimated" else "")
    text = f"{text}, velocity: {velocity}, integration: {integration}"
    law = MASS.replace("OBSERVER", text)
    return law if kind == "gdfo" else law.replace("law: dahl", "law: coulomb").replace(", c: 30", "")


def steady(samples: int, velocity: str = "estimated", wave: float = 0.0) -> np.ndarray:
    """Both slips forward at constant speed, under just the force that friction takes."""
    t = PERIOD * np.arange(samples)
    x1, x2 = V1 * t, V2 * t
    along = 1 + np.sin(wave * x2) / 5
    force = [0.06 * np.ones(samples), -0.06 + 3.2 * along]
    speeds = [np.full(samples, V1), np.full(samples, V2)] if velocity == "measured" else []
    return np.column_stack([x1, x2, *speeds, *force])


CASES = [
    *((kind, "euler", "estimated", "K_v: 740") for kind in KINDS),
    *((kind, "implicit", "estimated", "K_v: 740") for kind in ("gcfo", "mgto")),
    ("gcfo", "semi_implicit", "estimated", FULL),
    ("gto", "semi_implicit", "estimated", FULL),
    ("gcfo", "exponential", "estimated", "K_v: 740"),
    *((kind, "euler", "measured", "") for kind in ("gcfo", "gto", "gdfo")),
    ("mgto", "implicit", "measured", ""),
]


LOST = {2500: 1, 2900: 3, 3300: 4, 3700: 60}
"""Sample → how many are lost from there on."""


@pytest.mark.parametrize(
    "case",
    slow_except(CASES, [*CASES[:1], *CASES[4:10:2], *CASES[9:]]),
    ids=lambda case: "-".join(case[:3]) + ("-full" if case[3] == FULL else ""),
)
def test_a_machine_that_goes_on_is_estimated_as_if_nothing_was_lost(tmp_path: Path, case: tuple) -> None:
    """Without that a lost sample kicks v_hat by K_v h v = 46 m/s, and friction by its gain times that."""
    built = Built(tmp_path, observer(*case))
    rows = steady(4100, case[2])
    whole = built.c_run(rows)[0]
    assert not built.faults
    gone = [k for at, count in LOST.items() for k in range(at, at + count)]
    rows[gone, 1] = math.inf
    outputs, states = built.c_run(rows)
    twin = built.python_run(rows)
    assert same_bits(outputs, twin[0]) and same_bits(states, twin[1])
    more = set(built.faults) - set(gone)
    assert more == {at + n for at, n in LOST.items() if n >= built.program.most_lost}
    names = [name for name, _, _ in built.program.outputs]
    friction = np.abs(whole[2500, [k for k, name in enumerate(names) if "v" not in name]]).max()
    for at, count in LOST.items():
        drift = np.abs(whole[at + count] - whole[at - 1]).max()
        around = slice(at, at + count + 300)
        assert np.abs(outputs[around] - whole[around]).max() < 20 * drift + 1e-6 * friction


def test_contacts_that_turn_with_the_position_go_on_too(tmp_path: Path) -> None:
    """U(x) of one wave in 7 m, a tenth of a second: the level is off by no more than what U does in a sample or two."""
    wave, at = 0.9, 2500
    built = Built(tmp_path, observer("gcfo", "euler").replace("k: {value: 0,", f"k: {{value: {wave},"))
    rows = steady(4000, wave=wave)
    whole = built.c_run(rows)[0]
    for count in (1, 60):
        lost = rows.copy()
        lost[at : at + count, 0] = math.nan
        late = built.c_run(lost)[0][at + count :] - whole[at + count :]
        names = [name for name, _, _ in built.program.outputs]
        assert np.abs(late[:, :2]).max() < 0.1 < 0.01 * 740 * PERIOD * V1 * 10
        level = names.index("a_hat_ground")
        turned = 80 * PERIOD * V2 * np.cos(0) * wave / 5 * V2
        assert np.abs(late[:, level]).max() < 1.5 * turned * (1 if count == 1 else 2)


def test_a_machine_that_stopped_while_samples_were_lost_starts_from_the_held_velocity(tmp_path: Path) -> None:
    """Whatever way it went in ten thousand samples: the error is the velocity's change, and dies out."""
    built, at, lost = Built(tmp_path, observer("gcfo", "euler")), 2500, 10_000
    rows = steady(at + lost + 3000)
    rows[at:, :2] = rows[at, :2] + 40.0
    rows[at:, 2:] = 0.0
    rows[at : at + lost, 0] = math.nan
    outputs, _ = built.c_run(rows)
    assert built.faults == list(range(at, at + lost + 1))
    assert outputs[at + lost].tobytes() == outputs[at - 1].tobytes()
    decay = 1 - 740 * PERIOD
    np.testing.assert_allclose(outputs[at + lost + 1, :2], [decay * V1, decay * V2], rtol=1e-3)
    assert np.abs(outputs[at + lost :, :2]).max() < 1.01 * V1
    assert np.abs(outputs[-1, :2]).max() < 0.1


@pytest.mark.parametrize(("gain", "most"), [(200, 8), (740, 4), (1300, 2), (1900, 2), (2100, 1)])
def test_an_error_that_was_there_is_not_made_larger(tmp_path: Path, gain: int, most: int) -> None:
    """n samples lost are a step of (n + 1) h, by which an error of v_hat grows where (n + 1) h K_v is above 2."""
    text = observer("gto", "euler", gain=f"K_v: {gain}").replace("K_1: 30, K_2: [[-80, 2], [1, -60]]", "K_2: -1")
    built = Built(tmp_path, text)
    assert built.program.most_lost == most
    rows = np.zeros((60, 4))
    rows[:, 0] = 3.0 * PERIOD * np.arange(60)
    error = np.abs(built.c_run(rows)[0][1:, 0] - 3.0).max()
    assert error > 0.05
    for lost in range(1, 11):
        gone = rows.copy()
        gone[2 : 2 + lost, 0] = math.nan
        assert np.abs(built.c_run(gone)[0][1:, 0] - 3.0).max() <= 1.001 * error


def test_every_second_sample_is_enough_to_follow(tmp_path: Path) -> None:
    """A bus at half the rate, NaN in between: what x tells is not thrown away, so v_hat follows a swing of 2 Hz."""
    built = Built(tmp_path, observer("gto", "euler"))
    t = PERIOD * np.arange(4000)
    x = np.column_stack([np.sin(4 * np.pi * t), np.cos(4 * np.pi * t)])
    rows = np.column_stack([x, np.zeros((len(t), 2))])
    rows[1::2, 0] = math.nan
    outputs, _ = built.c_run(rows)
    v = 4 * np.pi * np.column_stack([np.cos(4 * np.pi * t), -np.sin(4 * np.pi * t)])
    assert built.faults == list(range(1, 4000, 2))
    assert np.abs(outputs[1000:, :2] - v[1000:]).max() < 0.1 * 4 * np.pi


def test_time_goes_on_while_samples_are_lost(tmp_path: Path) -> None:
    """Friction that drifts with T = 0.7 s: after a second without samples its time is as if none had been lost."""
    drift = "effects: [{kind: friction_drift, on: rail, parameters: {delta: -9, T: 0.7}}]"
    built = Built(tmp_path, spec_text("one_mass").replace("effects: []", drift))
    rows = np.zeros((1600, 2))
    states = built.c_run(rows)[1]
    rows[300:1300, 0] = math.nan
    names = [f.name for f in built.program.states]
    assert states[-1, names.index("t")] == built.c_run(rows)[1][-1, names.index("t")] == pytest.approx(1.6)


def losses(rows: np.ndarray, seed: int = 5) -> np.ndarray:
    """Samples lost alone and up to 12 in a row, NaN or infinite, in every column; the first one too."""
    random, rows = np.random.default_rng(seed), rows.copy()
    rows[:2, 0] = math.nan
    for at in random.choice(np.arange(10, len(rows) - 20), len(rows) // 25, replace=False):
        rows[at : at + random.integers(1, 13), random.integers(rows.shape[1])] = random.choice([math.nan, math.inf])
    return rows


@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("case", ["one_mass_domain", "arm", "emps"])
def test_lost_samples_have_the_same_bits_in_c_twin_and_lanes(tmp_path: Path, case: str, precision: str) -> None:
    built = Built(tmp_path, spec_text(case), precision)
    rows = losses(motion(built.program, 1000))
    outputs, states = built.c_run(rows)
    twin = built.python_run(rows)
    assert same_bits(outputs, twin[0]) and same_bits(states, twin[1])
    assert np.isfinite(states).all() and len(built.faults) > np.count_nonzero(~np.isfinite(rows).all(axis=1))
    lanes, faults = in_lanes(built, rows)
    assert same_bits(outputs, lanes) and faults.tolist() == built.faults
