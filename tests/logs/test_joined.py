"""Several records as one: each record's samples unchanged, and nothing between them used."""

from __future__ import annotations

import numpy as np
import pytest
from slider_log import write_csv

from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.logs import excerpt, joined, preflight, read_log, read_logs
from tests.expected_errors import refused


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
    assert log.raw_data.rows == sum(one.raw_data.rows for one in alone)


def test_records_of_different_rates_share_the_finest_one(tmp_path, spec):
    """None loses what it shows: 2 ms and 13 ms on a grid of 1.3 ms, as their closed forms have it."""
    steps = (0.002, 0.0013, 0.013)
    paths = [record(tmp_path / f"{k}.csv", step, 5) for k, step in enumerate(steps)]
    log = read_logs(paths, spec)
    assert log.sample_time == 0.0013
    for a, b in log.segments:
        t = 0.0013 * np.arange(b - a)
        assert np.abs(log.positions[a:b, 0] - 0.1 * np.sin(3 * t)).max() < 1e-6
        assert np.abs(np.diff(log.positions[a:b, 0], 2) / 0.0013**2 + 0.9 * np.sin(3 * t[1:-1])).max() < 0.02
    assert [one.sample_time for one in log.records] == list(steps)
    assert log.files == "0.csv, 1.csv, 2.csv" and log.raw_data.rows == 2500 + 3846 + 385
    assert not log.raw_data.resampled and log.raw_data.jitter < 1e-6
    found = {f.topic: f for f in preflight(log, spec)}
    assert found["sample rate"].figures["records"] == 3 and "76.92 to 769.2 Hz" in found["sample rate"].words
    assert "in 1 of them a reversal" in found["sample rate"].words


def test_a_time_of_the_whole_is_one_of_a_record(tmp_path, spec):
    """Records that begin at 10 s and at 0.5 s, each with its own clock, as a reader of the files has them."""
    paths = []
    for k, begins in enumerate((10.0, 0.5)):
        t = 0.002 * np.arange(2500)
        x, v, w = 0.1 * np.sin(3 * t), 0.3 * np.cos(3 * t), np.cos(2 * t)
        paths.append(write_csv(tmp_path / f"{k}.csv", {"t": begins + t, "x": x, "v": v, "w": w}, fmt="%.15g"))
    log = read_logs(paths, spec)
    (a, b), (c, d) = log.segments
    for index, name, time in ((a, "0.csv", 10.0), (b - 1, "0.csv", 14.998), (c, "1.csv", 0.5), (d - 1, "1.csv", 5.498)):
        record, at = log.in_record(float(log.time[index]))
        assert record.path.name == name and at == pytest.approx(time)
    within = float(log.time[b + 100])
    assert log.in_record(within)[1] == pytest.approx(0.5)
    record, at = log.in_record(within, ends=True)
    assert record.path.name == "0.csv" and at == pytest.approx(14.998)
    alone = read_log(paths[1], spec)
    assert alone.in_record(1.25) == (alone, 1.25)


def test_a_common_step_that_keeps_the_experiment_below_what_is_fitted(tmp_path, spec, monkeypatch):
    monkeypatch.setattr(joined, "MOST_SAMPLES", 2000)
    paths = [record(tmp_path / "a.csv", 0.002, 5), record(tmp_path / "b.csv", 0.02, 5)]
    log = read_logs(paths, spec)
    assert log.sample_time == pytest.approx(14 / 2000, rel=1e-2) and log.size <= 2001


def test_joints_are_no_gaps(tmp_path, spec):
    """Ten records of a second: none is long enough alone, and all together are an experiment."""
    paths = []
    for k in range(10):
        t = 0.002 * np.arange(500) + k
        made = {"t": t, "x": 0.1 * np.sin(np.pi * t), "v": 0.1 * np.pi * np.cos(np.pi * t)}
        made["w"] = -2 * 0.1 * np.pi**2 * np.sin(np.pi * t) + 3 * np.sign(made["v"])
        paths.append(write_csv(tmp_path / f"{k}.csv", made, fmt="%.15g"))
    log = read_logs(paths, spec)
    found = {f.topic: f for f in preflight(log, spec)}
    assert len(log.joints) == len(log.gaps) == 9
    assert "gaps" not in found and "5000 samples over 9.98 s, in 10 records" in found["duration"].words
    assert found["duration"].severity == "info"
    assert found["sign and scale of w"].figures["factor"] == pytest.approx(1, abs=0.05)
    part, _ = excerpt(log, 4000)
    assert set(part.joints) == set(part.gaps)


def test_short_records_are_an_experiment_together(tmp_path, spec):
    """Fifteen records of 0.8 s: a segment of five periods of the cut-off would not fit into one of them."""
    (tmp_path / "meta.yaml").write_text("cutoff_hz: 6\n")
    paths = []
    for k in range(15):
        t = 0.002 * np.arange(400) + 0.37 * k
        paths.append(write_csv(tmp_path / f"{k}.csv", {"t": t, "x": np.sin(9 * t), "w": np.cos(9 * t)}, fmt="%.15g"))
    log = read_logs(paths, spec)
    made = record_of(smooth_motion(log), log)
    assert len(made.start) >= 12 and made.length >= 12
    for start in made.start:
        assert any(a <= start and start + made.length <= b for a, b in log.segments)


def test_a_few_seconds_are_cut_into_shorter_segments(tmp_path, spec):
    """Two records of 3.3 s at 10 Hz: five segments of 0.5 s fit into each, and twelve are needed."""
    (tmp_path / "meta.yaml").write_text("cutoff_hz: 10\n")
    paths = []
    for k in range(2):
        t = 0.002 * np.arange(1650)
        paths.append(write_csv(tmp_path / f"{k}.csv", {"t": t, "x": np.sin(9 * t), "w": np.cos(9 * t)}, fmt="%.15g"))
    log = read_logs(paths, spec)
    made = record_of(smooth_motion(log), log)
    assert len(made.start) >= 12 and 0.25 <= made.length * 0.002 < 0.5
    for start in made.start:
        assert any(a <= start and start + made.length <= b for a, b in log.segments)


def test_all_files_are_named(tmp_path, spec):
    paths = [record(tmp_path / f"run_{k:03}.csv", 0.1, 1) for k in range(3)]
    with refused("LOG009 run_000.csv, run_001.csv, run_002.csv: 30"):
        smooth_motion(read_logs(paths, spec))


def test_steady_speeds_are_what_they_are(tmp_path, spec):
    """A ladder of speeds, each of its own rate, with waves of the turn: no inertia is to be learnt from it."""
    paths = []
    for k, speed in enumerate((-0.4, -0.2, -0.1, 0.1, 0.2, 0.4)):
        t = 0.02 / abs(speed) * 0.2 * np.arange(400)
        v = speed * (1 + 0.02 * np.sin(40 * speed * t))
        w = 3 * np.sign(speed) + 2 * speed + 2 * np.sin(40 * speed * t)
        paths.append(write_csv(tmp_path / f"{k}.csv", {"t": t, "v": v, "w": w}, fmt="%.15g"))
    log = read_logs(paths, spec)
    found = {f.topic: f for f in preflight(log, spec)}
    assert found["steady speeds of x"].severity == "info"
    assert found["steady speeds of x"].figures["share"] > 0.95
    assert "in 6 of its 6 records" in found["steady speeds of x"].words
    assert not any("times the declared inertia" in f.words for f in found.values())
    assert not [f.words for f in found.values() if f.severity == "problem"]


def test_one_record_is_itself(tmp_path, spec):
    path = record(tmp_path / "a.csv", 0.002, 5)
    assert np.array_equal(read_logs([path], spec).positions, read_log(path, spec).positions)


def test_a_record_named_twice(tmp_path, spec):
    path = record(tmp_path / "a.csv", 0.002, 5)
    with refused("LOG014 a.csv"):
        read_logs([path, tmp_path / "." / "a.csv"], spec)


def test_records_that_do_not_go_together(tmp_path, spec):
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "meta.yaml").write_text("cutoff_hz: 5\n")
    paths = [record(tmp_path / "a.csv", 0.002, 5), record(tmp_path / "other" / "b.csv", 0.002, 5)]
    with refused("LOG011 b.csv: cutoff_hz a.csv"):
        read_logs(paths, spec)


def test_a_slow_record_on_a_fine_grid_weighs_what_its_own_samples_weigh(tmp_path, spec):
    """30 s at 20 Hz beside 10 s at 500 Hz: 600 rows beside 5000, on a grid that has six times as many."""
    slow, fast = record(tmp_path / "a.csv", 0.05, 30), record(tmp_path / "b.csv", 0.002, 10)
    log = read_logs([slow, fast], spec)
    (a, b), (c, d) = log.segments
    assert b - a > 4000 and log.counted is not None
    assert log.counted[a:b].sum() == 600 and log.counted[c:d].all() and not log.counted[b:c].any()
    motion = smooth_motion(log, 6.0)
    own = np.flatnonzero(motion.counted[a:b])
    assert np.abs(log.sample_time * own - 0.05 * np.arange(600)).max() <= log.sample_time
    made = record_of(motion, log)
    of_slow = sum(start < b for start in made.start)
    of_fast = len(made.start) - of_slow
    assert 0 < of_slow * made.length <= 600 < 2000 < of_fast * made.length
    part, _ = excerpt(log, 6000)
    assert part.counted.shape == (6000,)
    assert read_logs([fast], spec).counted is None
