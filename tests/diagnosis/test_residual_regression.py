"""The regression without laws: shares against those that the making of the data fixes, and what it must not see."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom

from codegen.base.resources import resource_folder
from codegen.diagnosis.evidence import residual_regression
from codegen.diagnosis.evidence.residual_regression import (
    CHUNKS,
    FOLDS,
    LONGER,
    added_share,
    explained_over,
    line,
    remainders,
    repeated_share,
    since_reversal,
    sliding,
    splines,
)
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import low_pass, smooth_motion
from codegen.diagnosis.results import Remainder
from codegen.diagnosis.verdict.answer import is_small
from codegen.diagnosis.verdict.statement import main_variables
from codegen.logs import read_log
from codegen.simulate.closed_loop import simulate
from codegen.simulate.loop_run import write_log
from codegen.spec import parse_spec
from tests.diagnosis.stage import RESTS, log_of, stage, system_of

COUNT = 6000
TIME = np.linspace(0.0, 30.0, COUNT)
X = np.sin(1.3 * TIME) + 0.4 * np.sin(4.1 * TIME)
EVERY = np.ones(COUNT, dtype=bool)


@pytest.mark.parametrize("noise", [0.1, 0.5, 2.0])
def test_a_function_of_one_variable_is_explained_up_to_the_noise(noise: float) -> None:
    shape = np.tanh(4 * X)
    r = shape + noise * np.random.default_rng(3).normal(size=COUNT)
    share = np.mean(shape**2) / (np.mean(shape**2) + noise**2)
    assert explained_over(r, EVERY, [splines(X, 14)]) == pytest.approx(share, abs=0.03)
    assert explained_over(r, EVERY, [splines(np.random.default_rng(4).normal(size=COUNT), 14)]) < 0.01


def test_noise_is_explained_by_nothing_however_many_columns_there_are() -> None:
    r = np.random.default_rng(5).normal(size=COUNT)
    assert explained_over(r, EVERY, [splines(X, 40), splines(TIME, 14), splines(np.gradient(X), 14)]) < 0.01


def test_the_distance_since_a_reversal_starts_anew_at_each() -> None:
    x = np.array([0.0, 1.0, 4.0, 3.0, 2.0, 2.5])
    v = np.array([1.0, 1.0, 1.0, -1.0, -1.0, 1.0])
    assert since_reversal(x, v) == pytest.approx(np.sqrt([0, 1, 4, 0, 1, 0]))


def test_a_spring_that_is_lacking_is_told_over_position(tmp_path: Path) -> None:
    """And nothing of material size where nothing is lacking."""
    left = {}
    for name, effects in (("spring", "[{kind: spring, on: x, parameters: {k: 30}}]"), ("none", "[]")):
        log = log_of(stage(effects), tmp_path, f"{name}.csv")
        problem = Problem(system_of(stage()), smooth_motion(log), {})
        (left[name],) = remainders(problem.system, problem.motion, problem.used)
    assert left["spring"].over["position"] > 0.95 and left["spring"].material > 0.1
    assert left["none"].material < 0.02


def test_a_vibration_is_told_between_rests(tmp_path: Path) -> None:
    """At rest static friction balances the drive, so that the residual there has the spectrum of the rests."""
    log = log_of(stage(reference=RESTS), tmp_path, "rests.csv")
    shaken = replace(log, inputs=log.inputs + 0.4 * np.sin(2 * np.pi * 7.3 * log.time)[:, None])
    problem = Problem(system_of(stage()), smooth_motion(shaken), {})
    (left,) = remainders(problem.system, problem.motion, problem.used)
    assert left.over["frequency"] > 0.8


def test_a_coordinate_that_no_input_reaches_has_the_load_of_its_inertia(tmp_path: Path) -> None:
    """Its residual is in no input: taken off the load of zero it would explain itself, and be as large as the drive."""
    text = (resource_folder("specs") / "two_mass.yaml").read_text(encoding="utf-8")
    text = text.replace("duration: 30", "duration: 8").replace("sample_time: 0.002", "sample_time: 0.005")
    pushed = text.replace("effects: []", "effects: [{kind: offset, on: x1, parameters: {f0: 5}}]")
    spec, plant = (parse_spec(t, tmp_path / "spec.yaml") for t in (text, pushed))
    write_log(tmp_path / "log.csv", plant, simulate(plant, system_of(plant)))
    problem = Problem(system_of(spec), smooth_motion(read_log(tmp_path / "log.csv", spec)), {})
    left = remainders(problem.system, problem.motion, problem.used)[0]
    inertia = 10.0 * problem.motion.low_pass(problem.motion.accelerations)[:, 0]  # m1 is 10 kg
    rows = sliding(problem.system, problem.motion, problem.used, 0)
    assert left.rms == pytest.approx(5.0, rel=1e-3)
    assert left.share == pytest.approx(5.0 / np.sqrt(np.mean(inertia[rows] ** 2)), rel=1e-2)
    # A push that is always the same is a constant, and no variable's.
    assert left.over["constant"] > 0.999 and max(s for name, s in left.over.items() if name != "constant") < 0.001
    truth = system_of(plant)
    noise = remainders(truth, problem.motion, problem.used)[0]
    assert noise.over["load"] < 0.5


CRANE = """\
name: crane
coordinates:
  x: {velocity: v, unit: m}
  q: {velocity: w, unit: rad}
inputs:
  f: {unit: N}
parameters:
  c: {value: 0.9, unit: N*m*s/rad}
  m: {value: 60, unit: kg}
  ml: {value: 25.2, unit: kg*m}
  J: {value: 35.28, unit: kg*m^2}
  G: {value: 247.2, unit: N*m}
  b: {value: 30, unit: N*s/m}
mass_matrix: [["m", "ml*cos(q)"], ["ml*cos(q)", "J"]]
force: ["f - b*v + ml*w**2*sin(q)", "-G*sin(q) - c*w"]
friction:
  distribution: [[1], [0]]
  contacts: [{name: rail, law: coulomb, a: 20, unit: N}]
"""


def crane_log() -> np.ndarray:
    """Rows t, x, q, f of a trolley between places, semi-implicit steps of 0.5 ms; the encoders have noise."""
    draw, rows, h = np.random.default_rng(3), list[tuple[float, ...]](), 5e-4
    places, position, speed, f = draw.uniform(-1.5, 1.5, size=30), np.zeros(2), np.zeros(2), 0.0
    for k in range(80000):
        t = k * h
        if k % 20 == 0:
            move, since = divmod(t, 3.0)
            s = min(1.0, since / 2.0)
            goal = places[int(move)] + (places[int(move) + 1] - places[int(move)]) * s**3 * (10 - 15 * s + 6 * s**2)
            f = 600 * (goal - position[0]) - 250 * speed[0]
            rows.append((t, *(position + draw.normal(size=2) * (2e-5, 4e-4)), f))
        c, s = np.cos(position[1]), np.sin(position[1])
        mass = np.array([[60, 25.2 * c], [25.2 * c, 35.28]])
        rub = 20 * np.tanh(speed[0] / 1e-3)
        force = np.array([f - 30 * speed[0] + 25.2 * speed[1] ** 2 * s - rub, -247.2 * s - 0.9 * speed[1]])
        speed = speed + h * np.linalg.solve(mass, force)
        position = position + h * speed
    return np.array(rows)


@pytest.mark.parametrize(("damping", "structured"), [(0.9, False), (8.0, True)])
def test_noise_on_a_coordinate_that_no_input_reaches_is_not_structured(
    tmp_path: Path, damping: float, structured: bool
) -> None:
    """M a of a swinging load is the model's force less the residual: with speed and position it gave all of that.

    99.997 % of it, which was noise: "another effect is missing too". A wrong damping is still seen.
    """
    np.savetxt(tmp_path / "log.csv", crane_log(), delimiter=",", header="t,x,q,f", comments="", fmt="%.9g")
    spec = parse_spec(CRANE.replace("c: {value: 0.9", f"c: {{value: {damping}"), tmp_path / "spec.yaml")
    system = system_of(spec)
    problem = Problem(system, smooth_motion(read_log(tmp_path / "log.csv", spec)), {})
    left = remainders(system, problem.motion, problem.used)[1]
    assert (left.structured > 0.5) == structured, left


def test_a_share_in_which_the_held_out_parts_do_not_agree_is_none() -> None:
    """A step in one place of a curve, passed once, is no function that repeats; the same step passed often is."""
    generator = np.random.default_rng(11)
    noise = generator.normal(size=COUNT)
    for z, known in ((X, True), (generator.normal(size=COUNT), False)):
        r = 0.3 * np.sign(X) + noise
        share = repeated_share(r, EVERY, [splines(z, 14)])
        assert share == (explained_over(r, EVERY, [splines(z, 14)]) if known else 0.0)
    lone = np.where(np.arange(COUNT) < COUNT // 40, 3.0, 0.0) + noise
    few = repeated_share(lone, EVERY, [splines(TIME, 40)])
    assert few == 0.0 < explained_over(lone, EVERY, [splines(TIME, 40)])


def test_a_curve_is_seen_that_few_parts_of_the_log_reach_with_the_most_force() -> None:
    """A soft stop that an axis met often, but twice with most of the force: 95 % was said to change in time."""
    reach = np.array([1.0, 1.0, 1.0, 1.6, 1.0, 1.0, 1.0, 2.4, 1.0, 1.0, 1.0, 1.0])
    x = np.repeat(reach, COUNT // 12) * np.sin(2 * np.pi * TIME / 2.5)
    r = np.maximum(0.0, x - 0.4) ** 2 + 0.01 * np.random.default_rng(13).normal(size=COUNT)
    gains = residual_regression._gains(r, EVERY, [splines(x, 40)])
    assert gains.sum() < 2 * np.linalg.norm(gains)
    assert repeated_share(r, EVERY, [splines(x, 40)]) > 0.9


@pytest.mark.parametrize("large", [4, 8, CHUNKS])
def test_an_added_share_that_is_chance_is_significant_as_rarely_as_stated(
    large: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Gains of random signs in few parts: 2.3 %. The z-score of four equal gains is 2, in one of 16 draws."""
    draw, draws = np.random.default_rng(12), 500
    sizes = np.where(np.arange(CHUNKS) < large, 1.0, 0.0)
    monkeypatch.setattr(
        residual_regression,
        "_gains",
        lambda r, rows, columns: len(columns) * sizes * draw.choice((-1, 1), CHUNKS) / CHUNKS,
    )
    shares = [added_share(X, EVERY, [], [X]) for _ in range(draws)]
    assert np.count_nonzero(shares) <= binom.ppf(0.999, draws, 0.0228)


def short(seconds: float, step: float = 0.005, cutoff_hz: float = 10.0) -> Any:
    """What the tests below take of a motion."""
    time = np.arange(round(seconds / step)) * step
    return SimpleNamespace(time=time, sample_time=step, cutoff_hz=cutoff_hz)


def test_the_highest_peak_of_noise_is_seldom_a_line_and_a_vibration_in_it_is_one() -> None:
    """Any spectrum has a highest peak; the five bins about it held up to 40 % of low-passed noise."""
    motion, draws, found = short(10.0), 60, {0.0: 0, 0.8: 0}
    rows = np.ones(len(motion.time), dtype=bool)
    for k in range(draws):
        noise = low_pass(np.random.default_rng(k).normal(size=(len(rows), 1)), motion.cutoff_hz, motion.sample_time)
        for size in found:
            shaken = noise[:, 0] / noise.std() + size * np.sqrt(2) * np.sin(2 * np.pi * 6.3 * motion.time + k)
            found[size] += line(shaken, rows, motion).shape[1] > 1
    assert found[0.0] <= 0.15 * draws and found[0.8] >= 0.95 * draws


@pytest.mark.parametrize(("seconds", "count"), [(1.2, FOLDS), (3.0, 15), (30.0, CHUNKS)])
def test_the_pieces_of_a_short_log_are_longer_than_noise_is_alike(seconds: float, count: int) -> None:
    motion = short(seconds)
    piece = residual_regression._pieces(np.ones(len(motion.time), dtype=bool), motion)
    sizes = np.bincount(piece)
    assert len(sizes) == count and np.ptp(sizes) <= 1
    assert count == FOLDS or (sizes.min() + 1) * motion.sample_time >= LONGER / motion.cutoff_hz


def test_the_sentence_names_a_variable_by_its_force_and_not_only_by_its_share() -> None:
    left = Remainder(1.0, 0.3, 0.06, {"input rate": 0.06, "speed": 0.0, "load": 0.002})
    assert main_variables(left, 0.02) == [("input rate", 0.06)]
    assert main_variables(Remainder(1.0, 0.01, 0.5, {"load": 0.2, "speed": 0.5}), 0.02) == [
        ("speed", 0.5),
        ("load", 0.2),
    ]


def test_what_is_left_is_small_where_every_coordinate_that_can_be_judged_says_so() -> None:
    nothing, some, unseen = Remainder(1.0, 0.1, 0.01), Remainder(1.0, 0.1, 0.09), Remainder(np.nan, np.nan, 0.0)
    assert is_small([nothing], 0.02) and not is_small([some], 0.02) and is_small([some], 0.04)
    assert is_small([nothing, unseen], 0.02) and is_small([unseen, nothing], 0.02)
    assert not is_small([unseen, some], 0.02) and not is_small([unseen], 0.02)
