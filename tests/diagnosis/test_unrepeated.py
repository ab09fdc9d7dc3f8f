"""Waves over position of which the log shows no second period."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from codegen.base.arrays import Array
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import with_effects
from codegen.diagnosis.results import MATERIAL, FoundEffect
from codegen.diagnosis.verdict.against_regression import unrepeated
from codegen.logs import Log
from tests.diagnosis.stage import log_of, stage, system_of
from tests.diagnosis.test_varying_parameters import MOTION

KIND = "position_dependent_friction"


def with_friction(level: Array, log: Log) -> Log:
    """The log of a machine with this friction level (N, 1) in addition."""
    return replace(log, inputs=log.inputs + level * np.sign(np.gradient(log.positions, axis=0)))


def judged(log: Log, period: float, amplitude: float = 1.5, phase: float = 0.4) -> str:
    system, values = system_of(stage()), {"amplitude": amplitude, "period": period, "phase": phase}
    found = FoundEffect(KIND, "rail", values, {})
    return unrepeated(Problem(system, smooth_motion(log), {}), with_effects(system, [found]), [found], MATERIAL)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return log_of(stage(reference=MOTION, duration=20.0), tmp_path_factory.mktemp("log"), "train.csv")


def test_patches_of_a_floor_are_no_wave(log: Log) -> None:
    """Friction is higher on two patches: a sine of 1.5 periods followed part of that and was named."""
    x = log.positions
    patches = 3.0 * ((x > -0.12) & (x < -0.03)) + 4.0 * ((x > 0.08) & (x < 0.1))
    words = judged(with_friction(patches, log), float(np.ptp(x)) / 1.5)
    assert "only 1.5 times" in words and "nothing shows that this force repeats" in words


@pytest.mark.parametrize("times", [1.2, 1.6, 4.0])
def test_a_wave_is_not_refused(log: Log, times: float) -> None:
    """Nor beside a vibration in time; one that is covered more than twice also not for another force over position."""
    x, period = log.positions, float(np.ptp(log.positions)) / times
    wave = 1.5 * np.sin(2 * np.pi * x / period + 0.4)
    assert judged(with_friction(wave, log), period) == ""
    time = (log.sample_time * np.arange(log.size))[:, None]
    shaken = replace(log, inputs=log.inputs + 0.8 * np.sin(2 * np.pi * 2.7 * time))
    assert judged(with_friction(wave, shaken), period, amplitude=1.45) == ""
    if times > 2:
        assert judged(with_friction(wave + 20 * x, log), period) == ""


@pytest.mark.parametrize("level", [0.0, 0.5])
def test_an_immaterial_curve_refuses_no_wave_beside_a_wrong_level(log: Log, level: float) -> None:
    """A spring with 1.7 % of the drive force refused a wave, since that of a level, 8 %, was counted with it."""
    x, period = log.positions, float(np.ptp(log.positions)) / 1.6
    more = level + 1.5 * np.sin(2 * np.pi * x / period + 0.4)
    assert judged(with_friction(more, replace(log, inputs=log.inputs + x - x.mean())), period) == ""
