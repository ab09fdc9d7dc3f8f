"""A log that is too long: which part is looked at, that it says so, and that the part is the same experiment."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from slider_log import TEXT, rows, write_csv

from codegen.logs import Log, excerpt, read_log
from codegen.spec.reader import parse_spec


def slider(folder: Path, **made: float) -> Log:
    return read_log(write_csv(folder / "a.csv", rows(**made), fmt="%.12g"), parse_spec(TEXT, Path("slider.yaml")))


def test_a_short_log_is_left_as_it_is(tmp_path):
    log = slider(tmp_path)
    assert excerpt(log) == (log, ())


def test_the_stretch_in_which_most_happens_is_taken(tmp_path):
    log = slider(tmp_path, duration=20.0)
    still = log.time < 12.0
    log = replace(log, positions=np.where(still[:, None], 0.1, log.positions), gaps=((6500, 6600), (9000, 9100)))
    part, (told,) = excerpt(log, most=2000)
    first = int(np.searchsorted(log.time, part.time[0]))
    assert part.size == 2000 and log.time[first] >= 12.0
    for name in ("time", "positions", "velocities", "inputs"):
        assert np.array_equal(getattr(part, name), getattr(log, name)[first : first + 2000])
    assert all(a + first in (6500, 9000, first) for a, _ in part.gaps)
    assert told.severity == "warning" and f"from {part.time[0]:.6g} to {part.time[-1]:.6g} s" in told.words
    assert told.figures["used"] == 2000 and told.figures["samples"] == log.size


def test_a_fast_log_loses_samples_before_time_and_keeps_the_impulse(tmp_path):
    log = slider(tmp_path, duration=5.0, rate=20000.0)
    part, (told,) = excerpt(log, most=20000)
    assert told.figures["every"] == 5 and part.sample_time == pytest.approx(5 * log.sample_time)
    assert part.size == 20000 and part.duration == pytest.approx(log.duration, abs=1e-3)
    assert np.array_equal(part.positions, log.positions[::5])
    assert part.inputs.sum() * part.sample_time == pytest.approx(log.inputs.sum() * log.sample_time)
    assert part.inputs[7, 0] == pytest.approx(log.inputs[35:40, 0].mean())
    # Below 2 kHz no sample is spared: there time goes.
    slow, (told,) = excerpt(slider(tmp_path, duration=20.0), most=5000)
    assert told.figures["every"] == 1 and slow.duration == pytest.approx(10.0, abs=0.01)
