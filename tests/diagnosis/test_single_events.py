"""An effect that acts in one event of each log, pushes that look like it, and an event that nothing explains."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, cast
from unittest.mock import patch

import numpy as np
import pytest

from codegen.base.errors import BadInput
from codegen.diagnosis import free_runs
from codegen.diagnosis.case import case_of
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.evidence.single_events import (
    LEAST_PREDICTED,
    _chance,
    events_of,
    largest_event,
    predicted,
)
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import TRIM_S, smooth_motion
from codegen.diagnosis.fit.trial import with_effects
from codegen.diagnosis.results import FoundEffect
from codegen.diagnosis.verdict.answer import Answer
from codegen.diagnosis.verdict.by_events import unknown_for_an_event
from codegen.logs import Log
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import TEST, TRAIN, log_of, stage, system_of

LIMIT, NOISE = 35.0, 0.6
QUICK = " + 0.1*tanh(20*(t - {at}))"
LIMITED = f"[{{kind: saturation, on: w, parameters: {{limit: {LIMIT}}}}}]"
AT = 7.9, 4.3
"""Time of the one quick move of either log, s; no other move needs ``LIMIT``."""


def logs(folder: Path, effects: str, noise: float = NOISE) -> tuple[Log, Log]:
    """Training and held-out log of a stage with one quick move each, and with noise of the logged force, N."""
    found = []
    for k, (reference, seconds) in enumerate(((TRAIN, 14.0), (TEST, 10.0))):
        plant = stage(effects, 4.5, reference + QUICK.format(at=AT[k]), seconds, noise=2e-6)
        log = log_of(plant, folder, f"{k}.csv")
        added = noise * np.random.default_rng(k).standard_normal(log.inputs.shape)
        found.append(replace(log, inputs=log.inputs + added))
    return found[0], found[1]


def test_a_limit_that_acts_once_in_each_log_is_found_by_that_alone(tmp_path: Path) -> None:
    """The tests on blocks cannot accept it: the noise of the force hides all that free runs show elsewhere."""
    train, test = logs(tmp_path, LIMITED)
    for log, at in zip((train, test), AT, strict=True):
        above = log.time[(np.abs(log.inputs[:, 0]) > LIMIT) & (log.time > TRIM_S)]
        assert 0.05 < np.ptp(above) < 0.2 and abs(above.mean() - at) < 0.2
    found = diagnose_log(stage(), system_of(stage()), train, test)[0]
    assert found.verdict == "effect", found.sentence
    (effect,) = found.effects
    assert effect.kind == "saturation" and effect.parameters["limit"] == pytest.approx(LIMIT, rel=0.01)
    assert any("in one event of the held-out data, from 4.2" in words for words in found.statement.of("evidence"))
    with patch.object(free_runs, "shown_in_events", lambda *given: None):
        assert diagnose_log(stage(), system_of(stage()), train, test)[0].effects == ()


@pytest.mark.parametrize("size", [20.0, 40.0, 80.0])
def test_a_limit_does_not_predict_a_push_that_the_controller_balances(tmp_path: Path, size: float) -> None:
    """The force of the controller rises by that of the push, and the motion stays as it was."""
    log = log_of(stage(level=4.5), tmp_path, "plain.csv")
    inputs, rows = log.inputs.copy(), slice(2400, 2600)
    way = np.sign(inputs[rows, 0].sum())
    usual = float(np.abs(inputs[500:]).max())
    inputs[rows, 0] += way * size * np.sin(np.pi * np.linspace(0, 1, 200))
    shares = [predicted(*pair(log, inputs, limit), 0).share for limit in np.linspace(0.5, 1.5, 41) * usual]
    assert max(shares) < LEAST_PREDICTED and (size < 40 or max(shares) > 0.5)


def pair(log: Log, inputs: Any, limit: float) -> tuple[Problem, Any, Any]:
    """The problem of a log with other inputs, its system, and that with a limit of the input."""
    system = system_of(stage(level=4.5))
    found = FoundEffect("saturation", "w", {"limit": float(limit)}, {}, (), {})
    return Problem(system, smooth_motion(replace(log, inputs=inputs)), {}), system, with_effects(system, (found,))


def test_the_prediction_of_a_limit(tmp_path: Path) -> None:
    """Of a wrong limit more is left, of one that no command reaches all."""
    train = logs(tmp_path, LIMITED)[0]
    right, wrong, none = (predicted(*pair(train, train.inputs, limit), 0) for limit in (LIMIT, 0.8 * LIMIT, 300.0))
    assert right.is_exact and right.p < 0.02
    (start, stop) = right.spans[0]
    assert AT[0] - 0.2 < start < stop < AT[0] + 0.2
    assert not wrong.is_exact and wrong.p > right.p
    assert not none.is_exact and none.share < 1e-6


@pytest.mark.parametrize(("push", "verdict"), [(40.0, "unknown"), (2.0, "none"), (0.0, "none")])
def test_an_event_that_nothing_explains_is_not_none(tmp_path: Path, push: float, verdict: str) -> None:
    log, system = log_of(stage(level=4.5), tmp_path, "plain.csv"), system_of(stage(level=4.5))
    inputs = log.inputs.copy()
    inputs[2430:2480, 0] += push
    problem = Problem(system, smooth_motion(replace(log, inputs=inputs)), {})
    event = largest_event(problem, system, 0)
    assert (event is None) == (verdict == "none")
    if event is not None:
        assert event.start < log.time[2455] < event.stop and event.size > 0.5 * push
    figures = cast(Any, (None, None, None))
    told = unknown_for_an_event(Answer("none", (), system, system, figures), {"held-out": (problem, log)})
    assert told.verdict == verdict
    assert [fact.words.split(" is ")[0] for fact in told.remarks] == (
        [f"The residual force from {event.start:.4g} s to {event.stop:.4g} s of the held-out data"] if event else []
    )


def test_a_limit_that_commands_exceed_many_times_is_found(tmp_path: Path) -> None:
    """Of a stiff position loop after a step: less than a tenth of the commands is left, and it moves the machine."""

    def stiff(effects: str, reference: str, duration: float) -> Spec:
        text = stage(effects, 4.5, reference, duration).text
        for usual, gain in (("{w: 900}", "{w: 20000}"), ("{w: 30}", "{w: 400}")):
            assert text.count(usual) == 1
            text = text.replace(usual, gain)
        return parse_spec(text, Path("stage.yaml"))

    step = " + 0.1*tanh(200*(t - {at}))"
    train = log_of(stiff(LIMITED, TRAIN + step.format(at=AT[0]), 14.0), tmp_path, "0.csv")
    test = log_of(stiff(LIMITED, TEST + step.format(at=AT[1]), 10.0), tmp_path, "1.csv")
    moved = train.inputs[train.time > TRIM_S]
    assert np.mean(np.clip(moved, -LIMIT, LIMIT) ** 2) < 0.01 * np.mean(moved**2)
    found = diagnose_log(stage(), system_of(stage()), train, test)[0]
    assert found.verdict == "effect", found.sentence
    (effect,) = found.effects
    assert effect.kind == "saturation" and effect.parameters["limit"] == pytest.approx(LIMIT, rel=0.01)


@pytest.mark.parametrize("push", [40.0, 0.0])
def test_a_segment_lies_about_each_event(tmp_path: Path, push: float) -> None:
    """Wherever it is: segments begin at a fast sample nearby, so that gaps remain between some of them."""
    log, spec = log_of(stage(level=4.5), tmp_path, "plain.csv"), stage()
    lacking = 0
    for first in range(1500, 4600, 100):
        inputs = log.inputs.copy()
        inputs[first : first + 30, 0] += push
        case = case_of(spec, system_of(spec), replace(log, inputs=inputs), None, 0.02)
        motion = case.problem.motion
        plain, record = record_of(motion, case.log), record_of(motion, case.log, 1.0, case.events)
        if not push or np.abs(motion.velocities[first : first + 30, 0]).min() < 0.2:  # about a reversal
            continue
        inside = [any(s <= first + 15 < s + r.length for s in r.start) for r in (plain, record)]
        lacking += not inside[0]
        assert inside[1] and len(record.start) == len(plain.start) + (not inside[0])
        assert (np.diff(record.start) > 0).all()
    assert case.events == () or push
    assert bool(lacking) is bool(push)


def test_a_log_of_less_than_two_periods_of_the_cutoff_has_no_events(tmp_path: Path) -> None:
    """Its refusal was an internal error; so was the diagnosis with a held-out log that is as short."""
    log, system = log_of(stage(level=4.5, duration=6.0), tmp_path, "short.csv"), system_of(stage())
    problem = Problem(system, smooth_motion(log, 0.3), {})
    assert 2 * problem.motion.step(1) > len(problem.motion.time)
    assert events_of(problem) == () and largest_event(problem, system, 0) is None
    with pytest.raises(BadInput, match=r"short\.csv"):
        diagnose_log(stage(), system, replace(log, cutoff_hz=0.3), None)


@pytest.mark.parametrize("events", [1, 2, 5])
def test_the_p_of_several_events_is_as_likely_as_it_says(events: int) -> None:
    """Of chance alone; that the product of two is below 1 % has a probability of 5.6 %."""
    nats = np.random.default_rng(1).exponential(size=(20_000, events)).sum(axis=1)
    found = np.array([_chance(float(x), events) for x in nats])
    assert np.mean(found <= 0.01) == pytest.approx(0.01, abs=0.003)
    assert np.mean(found <= 0.3) == pytest.approx(0.3, abs=0.02) and _chance(0.0, 0) == 1
