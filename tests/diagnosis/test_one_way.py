"""Logs that move one way only: what they cannot show is not claimed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.base.arrays import Array
from codegen.diagnosis import force_led
from codegen.diagnosis.examination import takes_the_level
from codegen.diagnosis.force_led import ForceFits, force_round
from codegen.diagnosis.output_error import Fit
from codegen.diagnosis.residual import Problem
from codegen.diagnosis.signals import smooth_motion
from codegen.diagnosis.trial import Trial, with_values
from codegen.logs import read_log
from codegen.mechanics.system import System
from tests.diagnosis.stage import log_of, stage, system_of
from tests.diagnosis.test_force_led import searched

RAIL = "rail_a"


def one_way(folder: Path, turns: bool) -> Problem:
    """A stage that runs at 0.1 m/s with a wave of its speed, or the same there and back."""
    t = np.arange(6000) / 1000
    v = (np.sign(np.sin(t)) if turns else 1.0) * 0.1 * (1 + 0.02 * np.sin(20 * t))
    x = np.cumsum(v) / 1000
    path = folder / f"{turns}.csv"
    rows = (f"{a:.4f},{b:.9g},{c:.9g}" for a, b, c in zip(t, x, 5 + np.sin(20 * t), strict=True))
    path.write_text("\n".join(["t,x,w", *rows]) + "\n")
    return Problem(system_of(stage()), smooth_motion(read_log(path, stage())), {})


def with_level(system: System, level: float) -> System:
    return with_values(system, {RAIL: level})


@pytest.mark.parametrize("turns", [False, True])
def test_a_level_is_not_taken_to_zero_where_nothing_reverses(tmp_path: Path, turns: bool) -> None:
    """A gantry at constant speed: a drive gain of 0.12 and no friction at all were named at 0.93."""
    problem = one_way(tmp_path, turns)
    declared, none = problem.system, with_level(problem.system, 0.0)
    objection = takes_the_level(problem, declared, none)
    assert bool(objection) is not turns
    assert turns or RAIL in objection
    assert takes_the_level(problem, declared, declared) == ""
    assert takes_the_level(problem, none, none) == ""  # the refit has it too, so the effects do not take it


def test_a_start_that_leaves_no_drive_is_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its residual was divided by that share: a division by zero that was told as a fault of the spec."""
    search, problem = searched(log_of(stage(duration=5.0), tmp_path, "train.csv"))
    fits = ForceFits(search, problem, search.refit())
    before = force_led.drive_kept

    def kept(fits: ForceFits, plain: Fit, trial: Trial, theta: Array) -> float:
        none = trial.parts[-1].kind == "input_gain"
        return 0.0 if none else before(fits, plain, trial, theta)

    monkeypatch.setattr(force_led, "drive_kept", kept)
    monkeypatch.setattr(force_led, "FITTED", 1)
    kinds = {r.found.part.kind for r in force_round(fits, fits.plain, lambda share: None)}
    assert "input_gain" not in kinds
