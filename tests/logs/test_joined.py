"""Several records as one: each record's samples unchanged, and nothing between them used."""

from __future__ import annotations

import numpy as np
import pytest
from slider_log import write_csv

from codegen.errors import BadInput
from codegen.logs import read_log, read_logs


def record(path, step, seconds, offset=0.0):
    t = step * np.arange(round(seconds / step))
    return write_csv(
        path, {"t": t, "x": offset + 0.1 * np.sin(3 * t), "v": 0.3 * np.cos(3 * t), "w": np.cos(2 * t)}, fmt="%.15g"
    )


def test_records_of_one_rate_are_kept_as_they_are(tmp_path, spec):
    paths = [record(tmp_path / f"{k}.csv", 0.002, 5 + k, offset=float(k)) for k in range(3)]
    alone = [read_log(p, spec) for p in paths]
    log = read_logs(paths, spec)
    assert len(log.segments) == 3 and log.name == "0+1+2"
    for (a, b), one in zip(log.segments, alone, strict=True):
        assert np.array_equal(log.positions[a:b], one.positions) and np.array_equal(log.inputs[a:b], one.inputs)
        assert np.array_equal(log.velocities[a:b], one.velocities)
    assert np.allclose(np.diff(log.time), 0.002)
    # Across a pause position and speed are continuous: no step of more than the speed that it takes to get there.
    start, stop = log.gaps[0]
    speed = np.abs(np.diff(log.positions[start - 2 : stop + 2, 0])) / 0.002
    assert speed.max() < 2.0 and np.abs(np.diff(speed)).max() < 0.02
    assert log.intake.rows == sum(one.intake.rows for one in alone)


def test_records_of_different_rates_share_the_coarser_one(tmp_path, spec):
    paths = [record(tmp_path / "a.csv", 0.002, 5), record(tmp_path / "b.csv", 0.0013, 5)]
    log = read_logs(paths, spec)
    assert log.sample_time == 0.002
    a, b = log.segments[1]
    assert np.abs(log.positions[a:b, 0] - 0.1 * np.sin(3 * 0.002 * np.arange(b - a))).max() < 1e-5


def test_one_record_is_itself(tmp_path, spec):
    path = record(tmp_path / "a.csv", 0.002, 5)
    assert np.array_equal(read_logs([path], spec).positions, read_log(path, spec).positions)


def test_a_record_named_twice(tmp_path, spec):
    path = record(tmp_path / "a.csv", 0.002, 5)
    with pytest.raises(BadInput, match="the same log twice"):
        read_logs([path, tmp_path / "." / "a.csv"], spec)


def test_records_that_do_not_go_together(tmp_path, spec):
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "meta.yaml").write_text("cutoff_hz: 5\n")
    paths = [record(tmp_path / "a.csv", 0.002, 5), record(tmp_path / "other" / "b.csv", 0.002, 5)]
    with pytest.raises(BadInput, match="cutoff_hz"):
        read_logs(paths, spec)
