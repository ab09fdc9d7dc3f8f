"""Inputs that act earlier than commands held until the next row: measured at their rows, or written a row late."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from codegen.diagnosis.case import case_of
from codegen.diagnosis.evidence.timing import (
    Lead,
    acting_earlier,
    common_lead,
    input_leads,
    lead_of,
    overcorrection_finding,
)
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.logs import Log
from codegen.logs.description import LogDescription
from codegen.mechanics import build_system
from codegen.spec import parse_spec
from tests.diagnosis.stage import log_of, stage, system_of

EVERY = 4
TWO_AXES = """\
name: two_axes
coordinates: {x: {velocity: v, unit: m}, y: {velocity: u, unit: m}}
inputs: {w: {unit: N}, z: {unit: N}}
parameters: {m: {value: 2, unit: kg}, b: {value: 6, unit: N*s/m}}
mass_matrix: [[m, 0], [0, m]]
force: [w - b*v, z - b*u]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {name: rail, law: coulomb, a: 4, unit: N}
    - {name: cross, law: coulomb, a: 4, unit: N}
"""

TURNTABLE = """\
name: turntable
coordinates: {q: {velocity: v, unit: rad}}
inputs: {u: {unit: N*m}}
parameters: {J: {value: 400, unit: kg*m^2}, b: {value: 150, unit: N*m*s/rad}}
mass_matrix: [[J]]
force: [u - b*v]
friction:
  distribution: [[1]]
  contacts: [{name: bearing, law: coulomb, a: 60, unit: N*m}]
simulation:
  duration: 200
  sample_time: 0.1
  reference: {q: 4*sin(0.069*t) + 0.5*sin(1.3*t) + 0.2*sin(3.1*t)}
  position_gain: {u: 400}
  velocity_gain: {u: 700}
  encoder_step: {q: 1e-4}
"""


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


def leads_of(log: Log) -> tuple[dict, tuple]:
    return input_leads(Problem(system_of(stage()), smooth_motion(log), {}), log)


def found(log: Log) -> dict:
    leads, findings = leads_of(log)
    return dict(zip(leads, findings, strict=True))


def test_one_row_of_four_has_an_input_that_is_not_held(fast: Log) -> None:
    seen = found(every(fast))
    assert list(seen) == [0] and "input_hold" in seen[0].words
    assert seen[0].figures["lead"] == pytest.approx(0.375, abs=0.05)  # 1.5 of the 4 steps


@pytest.mark.parametrize(
    "lacking",
    [
        "[{kind: stribeck, on: rail, parameters: {delta: 2.0, v_s: 0.03, exponent: 1}}]",
        "[{kind: load_dependent_friction, on: rail, parameters: {mu: 0.2}}]",
        "[{kind: position_dependent_friction, on: rail, parameters: {amplitude: 1, period: 0.2, phase: 1}}]",
    ],
)
def test_beside_friction_that_the_spec_lacks_a_lead_is_as_sure(lacking: str, tmp_path: Path) -> None:
    """It was lost in what the missing friction leaves, and ``compliance`` was named beside the friction."""
    log = every(log_of(stage(lacking), tmp_path, "train.csv"))
    lead = lead_of(Problem(system_of(stage()), smooth_motion(log), {}), 0)
    assert lead.matters and lead.rows == pytest.approx(0.375, abs=0.13)
    assert lead.deviation < 0.05
    held = every(log_of(stage(lacking), tmp_path, "train.csv"), means=True)
    assert not found(held)


def test_a_command_that_is_held_is_left_alone(fast: Log) -> None:
    assert not found(every(fast, means=True))
    assert not found(fast)


def a_row_late(log: Log) -> Log:
    """Each input in the row after the one from which it acts."""
    return replace(log, inputs=np.vstack([log.inputs[:1], log.inputs[:-1]]), description=LogDescription())


def test_an_input_that_is_written_a_row_late_is_corrected(fast: Log) -> None:
    log = every(fast, means=True)
    late = a_row_late(log)
    seen = found(late)
    assert seen[0].figures["lead"] == pytest.approx(1.0, abs=0.05)
    assert "`late: {w: 8 ms}` in meta.yaml" in seen[0].words
    case = case_of(stage(), system_of(stage()), late, None, 0.02)
    assert seen[0].words in {f.words for f in case.findings["train"]}
    errors = [np.sqrt(np.mean((one.inputs - log.inputs)[:-1] ** 2)) for one in (case.log, late)]
    assert errors[0] < 0.05 * errors[1]


def test_where_the_hold_is_stated_a_late_row_is_told_and_not_corrected(fast: Log) -> None:
    stated = LogDescription(input_hold="zero-order")
    leads, findings = leads_of(replace(a_row_late(every(fast, means=True)), description=stated))
    assert not leads
    assert "Nothing is corrected" in findings[0].words and "`late: {w: 8 ms}`" in findings[0].words
    assert leads_of(replace(every(fast, means=True), description=stated)) == ({}, ())


def test_an_input_with_a_stated_time_is_left_alone(fast: Log) -> None:
    late = replace(
        a_row_late(every(fast, means=True)), description=LogDescription().model_copy(update={"late": {"w": 0.0}})
    )
    assert leads_of(late) == ({}, ())


def test_a_short_lag_of_a_slow_log_is_corrected(tmp_path: Path) -> None:
    """At 10 Hz a torque behind a filter of 22 ms, 0.2 rows: a heavily damped compliance was named in its place."""
    slow = parse_spec(TURNTABLE, Path("turntable.yaml"))
    log = log_of(slow, tmp_path, "train.csv")
    keep = 0.2
    late = replace(log, inputs=lfilter([1 - keep], [1, -keep], log.inputs, axis=0), description=LogDescription())
    leads, findings = input_leads(Problem(system_of(slow), smooth_motion(late), {}), late)
    assert leads[0] == pytest.approx(0.25, abs=0.1)
    assert "behind a filter of the drive" in findings[0].words and "half a row" not in findings[0].words
    assert input_leads(Problem(system_of(slow), smooth_motion(log), {}), log) == ({}, ())


def test_what_a_lead_must_be_to_be_corrected() -> None:
    lead = Lead(rows=2.0, deviation=0.05, explained=0.8, size=0.02, estimate=2.0)
    assert lead.matters
    assert not replace(lead, rows=2.6).matters
    assert not replace(lead, deviation=0.6).matters
    assert not replace(lead, explained=0.3).matters
    assert not replace(lead, size=0.004).matters
    short = replace(lead, rows=0.2, estimate=0.2)
    assert short.matters and not replace(short, explained=0.4).matters and not replace(short, rows=0.1).matters


def test_held_commands_behind_noise_are_left_alone(fast: Log) -> None:
    """The half row that is corrected was tested in place of the estimate: 8 of 100 such logs showed a lead."""
    log, random = every(fast, means=True), np.random.default_rng(3)
    noisy = [replace(log, positions=log.positions + 2e-4 * random.normal(size=log.positions.shape)) for _ in range(25)]
    leads = [lead_of(Problem(system_of(stage()), smooth_motion(one), {}), 0) for one in noisy]
    assert np.std([lead.estimate for lead in leads]) == pytest.approx(leads[0].deviation, rel=0.3)
    assert not any(lead.matters for lead in leads)


def test_inputs_of_one_log_have_one_lead_unless_their_own_estimates_contradict_it() -> None:
    """Of a seven-joint arm, a joint with a missing cogging did not show that its current was measured as the others."""
    early = Lead(rows=0.5, deviation=0.1, size=0.02, estimate=0.45)
    unseen, held = Lead(rows=0.5, deviation=1.0), Lead(rows=0.02, deviation=0.05, estimate=0.02)
    assert early.matters and not unseen.matters
    assert common_lead([early, unseen]) == common_lead([early, early, unseen, held]) == 0.5
    assert common_lead([early, held]) == common_lead([early, held, unseen]) == 0.0
    assert common_lead([early, replace(early, rows=1.0, explained=0.8), unseen]) == common_lead([unseen, held]) == 0.0
    assert unseen.deviations_from(0.5) == 0.5 and held.deviations_from(0.52) == pytest.approx(10.0)


def test_held_commands_are_left_alone_where_the_description_states_them(fast: Log) -> None:
    assert not found(replace(every(fast), description=LogDescription(input_hold="zero-order")))


def measured(log: Log, lag: float) -> Log:
    """The mean of four inputs as a measurement behind a low-pass of ``lag`` seconds, read as ``input_hold: linear``."""
    keep = np.exp(-log.sample_time / lag) if lag else 0.0
    filtered = lfilter([1 - keep], [1, -keep], log.inputs, axis=0)
    rows = every(replace(log, inputs=filtered), means=True)
    # The mean over the four samples before the row is measured at the row; the reader then takes means of two rows.
    rows = replace(rows, inputs=np.vstack([rows.inputs[:1], rows.inputs[:-1]]))
    between = (rows.inputs + np.vstack([rows.inputs[1:], rows.inputs[-1:]])) / 2
    return replace(rows, inputs=between, description=LogDescription(input_hold="linear"))


def test_a_measured_input_behind_a_filter_of_the_drive_is_taken_earlier(fast: Log) -> None:
    """A current read behind a filter of half a row was named as a heavily damped compliance beside the effect."""
    still, late = measured(fast, 0.0), measured(fast, 2 * fast.sample_time)
    # Half a row is the mean of four itself: it is centred two samples before the row.
    assert found(still)[0].figures["lead"] == pytest.approx(0.5, abs=0.1)
    seen = found(late)
    assert seen[0].figures["lead"] == pytest.approx(0.5 + 2 / EVERY, abs=0.12)
    assert "`late: {w: " in seen[0].words and "`late: {w: 0}`" in seen[0].words
    assert "input_hold" not in seen[0].words
    errors = [np.abs(one.inputs - every(fast, means=True).inputs)[5:-5].mean()
              for one in (acting_earlier(late, {0: seen[0].figures["lead"]}), late)]  # fmt: skip
    assert errors[0] < 0.5 * errors[1]


def test_a_missing_force_does_not_hide_how_late_a_measured_input_is(fast: Log) -> None:
    """With gusts on the machine a lead explains little of the residual, and a compliance was named in its place."""
    late = measured(fast, 4 * fast.sample_time)
    gusts = 0.03 * late.inputs.std() * np.sin(2 * np.pi * 5 * late.time + np.sin(0.9 * late.time))
    blown = replace(late, inputs=late.inputs + gusts[:, None])
    lead = lead_of(Problem(system_of(stage()), smooth_motion(blown), {}), 0)
    assert lead.rows > 0.75 and lead.explained < 0.5 and not lead.is_shown
    seen = found(blown)
    assert seen[0].figures["lead"] == pytest.approx(0.5 + 4 / EVERY, abs=0.2)
    assert found(late)[0].figures["lead"] == pytest.approx(0.5 + 4 / EVERY, abs=0.2)
    assert not replace(lead, expected=True, deviation=lead.estimate / 6).is_shown


@pytest.mark.parametrize("lag", [7, -4])
def test_each_axis_of_two_has_the_lead_that_it_has_alone(fast: Log, lag: int) -> None:
    """A second estimate below 0 was replaced by that of the other axis, which has none: no lead at all."""
    late = measured(fast, lag * fast.sample_time) if lag > 0 else acting_earlier(every(fast, means=True), {0: lag})
    twice = replace(late, positions=np.hstack([late.positions] * 2), inputs=np.hstack([late.inputs] * 2))
    alone = lead_of(Problem(system_of(stage()), smooth_motion(late), {}), 0)
    two = Problem(build_system(parse_spec(TWO_AXES, Path("two_axes.yaml"))), smooth_motion(twice), {})
    for lead in (lead_of(two, 0), lead_of(two, 1)):
        assert lead.rows == pytest.approx(alone.rows, rel=1e-6)
        assert lead.deviation == pytest.approx(alone.deviation, rel=1e-3)
    assert list(input_leads(two, twice)[0]) == ([0, 1] if lag > 0 else [])


def test_a_delay_is_no_lead(fast: Log) -> None:
    late = replace(fast, inputs=np.vstack([fast.inputs[30:], np.tile(fast.inputs[-1:], (30, 1))]))
    assert not found(every(late))


def test_between_two_rows_the_mean_acts(fast: Log) -> None:
    log = every(fast)
    between = acting_earlier(log, {0: 0.5})
    exact = every(fast, means=True).inputs
    used = slice(20, -20)
    errors = [np.sqrt(np.mean((one.inputs - exact)[used] ** 2)) for one in (between, log)]
    assert errors[0] < 0.5 * errors[1]
    np.testing.assert_array_equal(acting_earlier(log, {}).inputs, log.inputs)


def test_a_lead_that_is_too_long_to_be_corrected_is_a_warning(fast: Log) -> None:
    """A screw drive's torque is 5.9 rows late, of which no word was said."""
    log = every(fast, means=True)
    late = replace(log, inputs=np.vstack([log.inputs[:1]] * 5 + [log.inputs[:-5]]), description=LogDescription())
    leads, (finding,) = leads_of(late)
    assert not leads and finding.severity == "warning" and finding.figures["lead"] > 2.5
    assert "only leads up to 2.5 rows are" in finding.words and "`late: {w: " in finding.words


def test_a_measured_input_that_is_taken_less_early_is_no_held_command(fast: Log) -> None:
    measured = replace(fast, description=LogDescription(input_hold="linear"))
    for log, said in ((fast, "held"), (measured, "measured")):
        words = overcorrection_finding("w", "input_delay", 1.0, 1.0, 0.0, log).words
        assert words.count(said) == 2 and ("command" in words) == (log is fast)
