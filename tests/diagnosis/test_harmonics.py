"""Cogging of several waves: the orders are found by regression, and free runs accept the effect that has them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

import stiction
from codegen.base.resources import resource_folder
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem, inverse_dynamics_residual
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.signals import low_pass, smooth_motion
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.verdict import harmonics
from codegen.diagnosis.verdict.harmonics import _periods, regress, with_harmonics
from codegen.effects import CATALOGUE
from codegen.effects.periodic import CoggingHarmonics
from codegen.spec import read_spec
from tests.diagnosis.stage import diagnosed, log_of, stage, system_of

PERIOD = 0.07
WAVES = {"sin_1": 1.2, "cos_1": -0.5, "sin_3": 0.1, "cos_3": 0.9}
ENTRY = ", ".join(f"{name}: {value}" for name, value in {"period": PERIOD, **WAVES}.items())
UNKNOWN = 0.9
"""RMS of a force that no effect describes, N."""
COGGING = f"[{{kind: cogging_harmonics, on: x, parameters: {{{ENTRY}}}}}]"


def problem_of(folder: Path, effects: str) -> Problem:
    log = log_of(stage(effects, level=4.5), folder, "train.csv")
    return Problem(system_of(stage()), smooth_motion(log), {})


def test_regression_finds_the_orders_and_their_weights_beside_a_level_that_is_off(tmp_path: Path) -> None:
    problem = problem_of(tmp_path, COGGING)
    force = -inverse_dynamics_residual(problem.system, problem.motion)[:, 0]
    waves = regress(problem, force, 0, PERIOD)
    assert waves is not None and waves.orders == (1, 3) and waves.share > 0.95
    assert waves.parameters(CoggingHarmonics()) == pytest.approx({"period": PERIOD} | WAVES, abs=0.06)  # a start
    # Of a period twice as long they are the second and the sixth wave.
    longer = regress(problem, force, 0, 2 * PERIOD)
    assert longer is not None and {2, 6} <= set(longer.orders)


def test_what_is_not_periodic_is_no_sum_of_waves(tmp_path: Path) -> None:
    problem = problem_of(tmp_path, "[]")
    noise = problem.motion.low_pass(np.random.default_rng(0).normal(size=len(problem.motion.time)))
    assert regress(problem, noise, 0, PERIOD) is None


def test_a_short_way_back_hides_no_wave() -> None:
    """A motor that goes back for half a second: offset and level by the other blocks were 7 A and −7 A.

    All waves but the largest were smaller than the share of that error which each has to explain.
    """
    t = 2e-3 * np.arange(8000)
    speed = np.where((t >= 1.4) & (t < 1.952), -3.0, 3.0)
    x = 2e-3 * np.cumsum(speed)
    force = 0.05 * np.sign(speed) + 0.2 * np.sin(9 * x) + 0.03 * np.cos(14 * x) + 0.02 * np.sin(20 * x)
    force += 0.02 * np.random.default_rng(3).normal(size=len(t))
    motion = SimpleNamespace(
        positions=x[:, None], velocities=speed[:, None], cutoff_hz=20.0, sample_time=2e-3, step=lambda dense: 1
    )
    problem: Any = SimpleNamespace(motion=motion, used=np.ones((len(t), 1), dtype=bool))
    waves = regress(problem, low_pass(force[:, None], 20.0, 2e-3)[:, 0], 0, 2 * np.pi)
    assert waves is not None and waves.orders == (9, 14, 20)


@pytest.mark.parametrize(("share", "multiples"), [(0.24, 2), (0.4, 1), (0.6, 0)])
def test_a_period_is_tried_where_the_stroke_repeats_it(tmp_path: Path, share: float, multiples: int) -> None:
    """A joint of an arm was said to have a cogging of 13 orders of 5.53 rad, a sum of sines over its stroke."""
    log = log_of(stage(COGGING, level=4.5), tmp_path, "train.csv")
    problem = Problem(system_of(stage()), smooth_motion(log), {})
    search = search_on(problem, lambda share: record_of(problem.motion, log, share))
    base, sine = search.refit(), part_of(CATALOGUE["cogging"], 0, search.system)
    period = share * float(np.ptp(problem.motion.positions[problem.motion.usable]))
    trial = base.runner.trial.with_part(sine)
    theta = np.append(base.theta, sine.inward({"amplitude": 1.3, "period": period, "phase": -0.4}))
    lone = replace(base, runner=replace(base.runner, trial=trial), theta=theta)
    outcome = Outcome(base, lone, (), (), 0.6)
    tried = sorted(_periods(search, outcome, 0, CoggingHarmonics()))
    assert tried == pytest.approx([period * m for m in range(1, multiples + 1)])


def test_free_runs_put_the_waves_in_the_place_of_a_lone_sine(tmp_path: Path) -> None:
    log = log_of(stage(COGGING, level=4.5), tmp_path, "train.csv")
    problem = Problem(system_of(stage()), smooth_motion(log), {})
    search = search_on(problem, lambda share: record_of(problem.motion, log, share))
    base = search.refit()
    sine = part_of(CATALOGUE["cogging"], 0, search.system)
    lone = search.with_parts(
        base, np.array([4.5]), [sine], [{"amplitude": 1.3, "period": 1.002 * PERIOD, "phase": -0.4}]
    )
    found, _ = with_harmonics(search, Outcome(base, lone, (), (), 0.6))
    (part,) = found.parts
    assert (part.kind, part.on) == ("cogging_harmonics", "x")
    values = found.final.runner.trial.split(found.final.theta)[1][0]
    assert values == pytest.approx({"period": PERIOD} | WAVES, rel=0.01)
    assert found.explained > 0.99 and not found.rivals and found.first[-1].found.part is part
    # With the waves in place there is nothing to put in their place.
    assert with_harmonics(search, found)[0].final is found.final


def test_the_waves_replace_several_effects_that_imitate_them(tmp_path: Path) -> None:
    """Beside a force that no effect describes the waves explain little of what is left, but with one effect, not three.

    A motor's cogging was a sine, a friction over position and a quadratic drag; its sum of sines left a fifth of that.
    """
    log = log_of(stage(COGGING, level=4.5), tmp_path, "train.csv")
    unknown = low_pass(np.random.default_rng(3).normal(size=(len(log.inputs), 1)), 8.0, log.sample_time)
    log = replace(log, inputs=log.inputs + UNKNOWN * unknown / unknown.std())
    problem = Problem(system_of(stage()), smooth_motion(log), {})
    search = search_on(problem, lambda share: record_of(problem.motion, log, share))
    base = search.refit()
    kinds = {"cogging": {"amplitude": 1.3, "period": PERIOD, "phase": -0.4}, "quadratic_drag": {"c": 0.1}}
    kinds |= {"position_dependent_friction": {"amplitude": 0.3, "period": 3 * PERIOD, "phase": 0.1}}
    parts = [part_of(CATALOGUE[kind], 0, search.system) for kind in kinds]
    three = search.with_parts(base, np.array([4.5]), parts, list(kinds.values()))
    outcome = Outcome(base, three, (), (), 0.6)
    found, _ = with_harmonics(search, outcome)
    assert [part.kind for part in found.parts] == ["cogging_harmonics"]
    with patch.object(harmonics, "force_speaks_for", lambda *_: True):  # far from the noise the force must not be worse
        assert with_harmonics(search, outcome)[0].final is three


@pytest.mark.slow
def test_two_waves_are_one_effect(tmp_path: Path) -> None:
    diagnosis, models = diagnosed(COGGING, tmp_path)
    assert diagnosis.verdict == "effect", diagnosis.sentence
    assert [(e.kind, e.on) for e in diagnosis.effects] == [("cogging_harmonics", "x")]
    assert diagnosis.effects[0].parameters == pytest.approx({"period": PERIOD} | WAVES, rel=0.03)
    assert set(diagnosis.effects[0].units) == {"period", *WAVES}
    assert diagnosis.augmented.free_run_rmse < 0.05 * diagnosis.refit.free_run_rmse
    assert "sin_3: " in models.spec_text
    assert ("cogging_harmonics", True) in [(c.kind, c.accepted) for c in diagnosis.candidates]


@pytest.mark.slow
def test_three_waves_of_the_belt_axis(tmp_path: Path) -> None:
    truth = {"period": 0.048, "sin_1": 1.5, "cos_1": -1.0, "sin_2": 0.9, "cos_2": 0.4, "sin_5": -0.8, "cos_5": 0.5}
    entry = "{kind: cogging_harmonics, on: x, parameters: {" + ", ".join(f"{k}: {v}" for k, v in truth.items()) + "}}"
    specs = resource_folder("specs")
    for name, log in (("belt_axis", "train.csv"), ("belt_axis_test", "test.csv")):
        text = (specs / "plants" / f"{name}.yaml").read_text(encoding="utf-8")
        lone = "{kind: cogging, on: x, parameters: {amplitude: 3.4, period: 0.048, phase: 0.7}}"
        assert lone in text
        (tmp_path / f"{name}.yaml").write_text(text.replace(lone, entry), encoding="utf-8")
        stiction.simulate(tmp_path / f"{name}.yaml", tmp_path / log)
    result = stiction.diagnose(
        specs / "belt_axis.yaml", tmp_path / "train.csv", tmp_path / "test.csv", tmp_path / "out"
    ).diagnosis
    (found,) = result.effects
    assert found.kind == "cogging_harmonics" and found.parameters == pytest.approx(truth, rel=0.01)
    assert result.augmented.free_run_rmse < 0.1 * result.refit.free_run_rmse
    assert result.augmented.relative_force < 0.1 * result.refit.relative_force
    assert read_spec(tmp_path / "out" / "spec.yaml").effects[0].kind == "cogging_harmonics"


def test_what_is_left_of_a_sum_is_judged_on_its_segments(tmp_path: Path) -> None:
    """An effect beside harmonics was removed, and the rest compared with a refit on longer segments: a ValueError."""
    log = log_of(stage(level=4.5), tmp_path, "train.csv")
    problem = Problem(system_of(stage()), smooth_motion(log), {})
    search = search_on(problem, lambda share: record_of(problem.motion, log, share))
    base, near = search.refit(), search.on_shorter(0.25)
    final = near.on_another_record(base)
    assert len(final.offsets) > len(base.offsets)
    outcome = Outcome(base, base, (), (), 0.0).with_final(near, final, ())
    assert outcome.final is final and outcome.explained == pytest.approx(0.0, abs=1e-6)
    assert near.on_its_record(final) is final and len(near.on_its_record(base).offsets) == len(final.offsets)
