"""A limit that acts in one event of each log, and segments about single events."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from codegen.base.errors import BadInput
from codegen.diagnosis.case import case_of
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.evidence.residual_regression import events_of
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import TRIM_S, smooth_motion
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import TEST, TRAIN, among, competing, log_of, stage, system_of

LIMIT = 35.0
LIMITED = f"[{{kind: saturation, on: w, parameters: {{limit: {LIMIT}}}}}]"
AT = 7.9, 4.3
"""Time of the one quick move of either log, s; no other move needs ``LIMIT``."""


@competing("saturation", "input_gain", "viscous")
def test_a_limit_that_commands_exceed_many_times_is_found(tmp_path: Path, kinds: tuple[str, ...]) -> None:
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
    with among(*kinds):
        found = diagnose_log(stage(), system_of(stage()), train, test)[0]
    assert found.verdict == "effect", found.sentence
    (effect,) = found.effects
    assert effect.kind == "saturation" and effect.parameters["limit"] == pytest.approx(LIMIT, rel=0.01)


@pytest.mark.parametrize("push", [40.0, 0.0])
def test_a_segment_lies_about_each_event(tmp_path: Path, push: float) -> None:
    """Wherever it is: segments begin at a fast sample nearby, so that gaps remain between some of them."""
    log, spec = log_of(stage(level=4.5), tmp_path, "plain.csv"), stage()
    lacking = 0
    for first in range(1600, 4600, 200) if push else (1600,):
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


def test_a_residual_that_is_as_large_everywhere_is_no_event(tmp_path: Path) -> None:
    """Forces of three times the size leave two thirds of the drive force in each period."""
    log, system = log_of(stage(level=4.5), tmp_path, "plain.csv"), system_of(stage(level=4.5))
    assert events_of(Problem(system, smooth_motion(replace(log, inputs=3 * log.inputs)), {})) == ()


def test_a_log_of_less_than_two_periods_of_the_cutoff_has_no_events(tmp_path: Path) -> None:
    """Its refusal was an internal error; so was the diagnosis with a held-out log that is as short."""
    log, system = log_of(stage(level=4.5, duration=6.0), tmp_path, "short.csv"), system_of(stage())
    problem = Problem(system, smooth_motion(log, 0.3), {})
    assert 2 * problem.motion.step(1) > len(problem.motion.time)
    assert events_of(problem) == ()
    with pytest.raises(BadInput, match=r"short\.csv"):
        diagnose_log(stage(), system, replace(log, cutoff_hz=0.3), None)
