"""Short logs with a low cutoff, whose segments are shorter than usual."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.record import LEAST_SEGMENTS, is_shortened, record_of
from codegen.diagnosis.fit.signals import smooth_motion
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
        def _residual_of(self, trial: Any, theta: Any) -> Any:
            return np.array([[1.0], [np.inf], [np.nan]])

        def _rows(self, forces: Any) -> Any:
            return forces[:, 0]

    left, theta = Diverged(cast(Any, None), base).with_levels(cast(Any, None), np.array([4.0, 1e9]))
    assert left == np.inf and list(theta) == [4.0, 1e9]
