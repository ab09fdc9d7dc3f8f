"""Inputs that were measured at the rows of a log, told from commands that are held until the next row."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from codegen.diagnosis.evidence.input_timing import acting_between_rows, measured_inputs
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.logs import Log
from codegen.logs.description import LogDescription
from tests.diagnosis.stage import log_of, stage, system_of

EVERY = 4


@pytest.fixture(scope="module")
def fast(tmp_path_factory: pytest.TempPathFactory) -> Log:
    """At the rate of the loop, which holds its command from sample to sample."""
    return log_of(stage(), tmp_path_factory.mktemp("log"), "train.csv")


def every(log: Log, means: bool = False) -> Log:
    """One row of four, as a data logger stores; with the mean command of the four, or with the one at the row."""
    count = log.size // EVERY * EVERY
    held = log.inputs[:count].reshape(-1, EVERY, log.inputs.shape[1])
    return replace(
        log,
        time=log.time[:count:EVERY],
        positions=log.positions[:count:EVERY],
        velocities=None,
        inputs=held.mean(axis=1) if means else held[:, 0],
        sample_time=EVERY * log.sample_time,
        description=LogDescription(),
    )


def found(log: Log) -> dict:
    return measured_inputs(Problem(system_of(stage()), smooth_motion(log), {}), log)


def test_one_row_of_four_has_an_input_that_is_not_held(fast: Log) -> None:
    seen = found(every(fast))
    assert list(seen) == [0] and "input_hold" in seen[0].words
    assert seen[0].figures["lead"] == pytest.approx(0.75, abs=0.1)  # 1.5 of the 4 steps, of half a row


def test_a_command_that_is_held_is_left_alone(fast: Log) -> None:
    assert not found(every(fast, means=True))
    assert not found(fast)


def test_the_description_decides(fast: Log) -> None:
    for hold in ("zero-order", "linear"):
        assert not found(replace(every(fast), description=LogDescription(input_hold=hold)))


def test_a_delay_is_no_lead(fast: Log) -> None:
    late = replace(fast, inputs=np.vstack([fast.inputs[30:], np.tile(fast.inputs[-1:], (30, 1))]))
    assert not found(every(late))


def test_between_two_rows_the_mean_acts(fast: Log) -> None:
    log = every(fast)
    between = acting_between_rows(log, {0})
    exact = every(fast, means=True).inputs
    used = slice(20, -20)
    errors = [np.sqrt(np.mean((one.inputs - exact)[used] ** 2)) for one in (between, log)]
    assert errors[0] < 0.5 * errors[1]
    np.testing.assert_array_equal(acting_between_rows(log, set()).inputs, log.inputs)
