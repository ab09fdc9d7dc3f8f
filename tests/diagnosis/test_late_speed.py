"""Speeds that are differences of positions over several rows: told by their noise, and late by half of these rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from codegen.diagnosis.case import case_of
from codegen.diagnosis.evidence.timing import SURE, late_speeds, lead_of, rows_of_difference
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.logs import Log
from codegen.logs.description import LogDescription
from codegen.logs.log import RawData
from tests.diagnosis.stage import log_of, stage, system_of

STEP = 1e-4
"""Of the encoder, m."""


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return log_of(stage(), tmp_path_factory.mktemp("log"), "train.csv")


def of_speed(log: Log, rows: int, ahead: int = 0, noise: float = 0.0, **description: object) -> Log:
    """The log of a speed alone: (q_(k + ahead) − q_(k + ahead − rows))/(rows h) of encoder positions q, and noise."""
    h, x = log.sample_time, np.floor(log.positions[:, 0] / STEP) * STEP
    k = np.arange(log.size) + ahead
    now, before = (x[np.clip(one, 0, log.size - 1)] for one in (k, k - rows))
    speed = (now - before) / (rows * h) + noise * np.random.default_rng(2).normal(size=log.size)
    positions = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * h)])[:, None]
    about = LogDescription().model_copy(update=description)
    return replace(
        log, positions=positions, velocities=speed[:, None], description=about, raw_data=RawData(integrated=(True,))
    )


def found(log: Log) -> tuple[float, tuple]:
    return late_speeds(Problem(system_of(stage()), smooth_motion(log), {}), log)


@pytest.mark.parametrize("rows", [1, 3, 8, 20])
def test_the_noise_tells_the_rows_of_a_difference(log: Log, rows: int) -> None:
    assert rows_of_difference(of_speed(log, rows).velocities[:, 0], log.sample_time) == rows


def test_other_noise_is_of_no_difference(log: Log) -> None:
    speed = np.gradient(log.positions[:, 0], log.sample_time)
    white = speed + 0.01 * np.random.default_rng(3).normal(size=log.size)
    filtered = np.convolve(np.random.default_rng(4).normal(size=log.size), np.exp(-np.arange(40) / 6), "same")
    for one in (white, speed + 0.01 * filtered, np.sin(0.9 * np.arange(log.size)), np.zeros(log.size)):
        assert rows_of_difference(one, log.sample_time) == 0


def test_a_difference_over_eight_rows_is_four_rows_late(log: Log) -> None:
    late, findings = found(of_speed(log, 8))
    assert late == 4
    assert "over 8 rows, which is 8 ms late" in findings[0].words and "`late: {v: 8 ms}`" in findings[0].words
    case = case_of(stage(), system_of(stage()), of_speed(log, 8), None, 0.02)
    assert findings[0].words in {f.words for f in case.findings["train"]}
    left = lead_of(case.problem, 0)
    assert abs(left.rows) < SURE * left.deviation < 1  # of 4 rows
    np.testing.assert_allclose(case.log.inputs[4:], log.inputs[:-4], atol=1e-12)


def test_a_delay_of_the_input_remains_beside_a_late_speed(log: Log) -> None:
    delayed = replace(log, inputs=np.vstack([log.inputs[6:], np.repeat(log.inputs[-1:], 6, axis=0)]))
    case = case_of(stage(), system_of(stage()), of_speed(delayed, 8), None, 0.02)
    assert lead_of(case.problem, 0).rows == pytest.approx(-6, abs=0.3)


def test_a_difference_that_is_not_late_or_a_stated_time_is_left_alone(log: Log) -> None:
    assert found(of_speed(log, 8, ahead=4)) == (0.0, ())
    assert found(of_speed(log, 2)) == (0.0, ())
    assert found(of_speed(log, 8, late={"v": 0.0})) == (0.0, ())
