"""Short logs with a low cutoff, whose segments are shorter than usual."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from codegen.diagnosis.case import case_of, cutoff_with_segments
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.record import LEAST_SEGMENTS, is_shortened, record_of
from codegen.diagnosis.fit.signals import CUTOFFS_HZ, quiet_cutoff, smooth_motion
from codegen.diagnosis.fit.starting_values import ForceStart
from codegen.logs import Log
from tests.diagnosis.stage import among, log_of, stage, system_of
from tests.expected_errors import refused

CUTOFF_HZ = 2.5
"""As of a drive sampled at 25 Hz, whose cutoff is a tenth of that."""


def slow_log(folder: Path, duration: float, effects: str = "[]") -> Log:
    log = log_of(stage(effects, 4.5, duration=duration), folder, f"log_{duration:g}.csv")
    return replace(log, cutoff_hz=CUTOFF_HZ)


def test_a_short_log_has_shorter_segments_and_a_verdict(tmp_path: Path) -> None:
    """15 s, the last 30 % held out: five segments of five periods of the cutoff, nine of half of that."""
    spec, log = stage(), slow_log(tmp_path, 15.0, "[{kind: spring, on: x, parameters: {k: 60}}]")
    with among("spring", "offset", "viscous"):
        found, _ = diagnose_log(spec, system_of(spec), log)
    assert found.verdict == "effect"
    assert [(e.kind, e.on) for e in found.effects] == [("spring", "x")]
    assert abs(found.effects[0].parameters["k"] / 60 - 1) < 0.1
    assert found.reliability is None  # counted on logs with longer segments


def test_a_segment_has_at_least_two_periods_of_the_cutoff(tmp_path: Path) -> None:
    log = slow_log(tmp_path, 11.5)
    motion = smooth_motion(log)
    record = record_of(motion, log)
    assert len(record.start) >= LEAST_SEGMENTS
    assert 2.0 <= record.length * log.sample_time * CUTOFF_HZ < 2.5
    with refused("LOG009 at least 12"):
        record_of(smooth_motion(slow_log(tmp_path, 8.0)), slow_log(tmp_path, 8.0))


def test_a_short_log_with_noise_has_a_higher_cutoff(tmp_path: Path) -> None:
    """At the cutoff that the noise suggests, 8 s hold too few segments: the log was refused, with that advice."""
    noisy = stage("[]", 4.5, duration=8.0, noise=1e-2)
    log = log_of(noisy, tmp_path, "noisy.csv")
    quiet = smooth_motion(log)
    assert quiet.cutoff_hz <= 3.5
    case = case_of(stage(), system_of(stage()), log, None, 0.02)
    assert quiet.cutoff_hz < case.motion.cutoff_hz <= 7.0
    assert len(record_of(case.problem.motion, case.log).start) >= LEAST_SEGMENTS
    told = [f.words for f in case.findings["train"] if f.topic == "cutoff"]
    assert len(told) == 1 and f"at {case.motion.cutoff_hz:g} Hz" in told[0]
    stated = replace(log, cutoff_hz=2.5)
    assert cutoff_with_segments(stated, smooth_motion(stated), log.size) is None
    longer = log_of(stage("[]", 4.5, duration=40.0, noise=1e-2), tmp_path, "longer.csv")
    case = case_of(stage(), system_of(stage()), longer, None, 0.02)
    assert case.motion.cutoff_hz == smooth_motion(longer).cutoff_hz
    assert not [f for f in case.findings["train"] if f.topic == "cutoff"]


@pytest.mark.parametrize("rate", [200, 100, 50, 25])
def test_a_clock_that_is_somewhat_slow_takes_no_cutoff_away(rate: int, tmp_path: Path) -> None:
    """A tenth of the rate of a wheel logged at 100 Hz, with 10.001 ms by its clock, was 9.999 Hz: it had 7 Hz."""
    t = np.arange(20 * rate) / rate
    x = np.sin(3 * t)[:, None]
    assert rate / 10 in CUTOFFS_HZ
    assert [quiet_cutoff(x, h / rate) for h in (1.0, 1.0001, 1.009)] == [rate / 10] * 3
    assert quiet_cutoff(x, 1.02 / rate) < rate / 10


def test_a_short_log_of_a_slow_clock_has_a_higher_cutoff_too(tmp_path: Path) -> None:
    log = log_of(stage("[]", 4.5, duration=8.0, noise=1e-2), tmp_path, "noisy.csv")
    rows = slice(0, None, 10)  # 20 ms a step
    coarse = replace(
        log,
        **{name: getattr(log, name)[rows] for name in ("time", "positions", "inputs")},
        sample_time=0.02,
    )
    chosen = [
        cutoff_with_segments(one, smooth_motion(one, 2.5), round(0.7 * one.size))
        for one in (coarse, replace(coarse, time=1.0005 * coarse.time, sample_time=0.02001))
    ]
    assert chosen[0] == chosen[1] == 5.0


def test_segments_of_half_the_usual_length_are_counted_with_any_cutoff(tmp_path: Path) -> None:
    """Five periods are 1001.3 samples: half of the 1001 of a segment is 500, half of 1001.3 was rounded to 501."""
    log = replace(slow_log(tmp_path, 14.5), cutoff_hz=5 / (1001.3 * 0.002))
    motion = smooth_motion(log)
    record = record_of(motion, log)
    assert record.length == 500 and not is_shortened(record, motion)
    log = slow_log(tmp_path, 11.5)
    assert is_shortened(record_of(smooth_motion(log), log), smooth_motion(log))


def test_a_start_whose_states_diverge_is_the_last_choice() -> None:
    """A stiff bristle along a motion sampled at 25 Hz can diverge: its force residual is no number."""
    base: Any = SimpleNamespace(theta=np.array([4.0]))

    class Diverged(ForceStart):
        def _residuals_of(self, trial: Any, thetas: Any) -> Any:
            return [np.array([[1.0], [np.inf], [np.nan]])]

        def _rows(self, forces: Any) -> Any:
            return forces[:, 0]

    ((left, theta),) = Diverged(cast(Any, None), base).with_levels(cast(Any, None), [np.array([4.0, 1e9])])
    assert left == np.inf and list(theta) == [4.0, 1e9]
