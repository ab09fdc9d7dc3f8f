"""Irregular time stamps and gaps against signals known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from slider_log import rows, write_csv

from codegen.logs import read_log


def test_jitter(tmp_path, spec):
    generator = np.random.default_rng(3)
    t = np.cumsum(0.002 * (1 + 0.2 * generator.uniform(-1, 1, 4000)))
    made = {"t": t, "x": np.sin(3 * t), "w": np.cos(2 * t)}
    log = read_log(write_csv(tmp_path / "a.csv", made), spec)
    assert log.raw_data.resampled and "irregular time stamps" in log.notes[0]
    assert log.raw_data.jitter == pytest.approx(0.2 / np.sqrt(3), rel=0.05)
    assert np.allclose(np.diff(log.time), log.sample_time)
    assert np.abs(log.positions[:, 0] - np.sin(3 * log.time)).max() < 1e-5  # linear interpolation: 9 h²/8
    # The held input lags half a step in the file as on the grid.
    held = np.cos(2 * (log.time + log.sample_time / 2 - 0.001))
    assert np.abs(log.inputs[:, 0] - held).max() < 2e-3


def test_held_inputs_keep_their_impulse(tmp_path, spec):
    generator = np.random.default_rng(4)
    t = np.cumsum(0.002 * (1 + 0.3 * generator.uniform(-1, 1, 3000)))
    w = generator.normal(size=3000)
    log = read_log(write_csv(tmp_path / "a.csv", {"t": t, "x": t, "w": w}, fmt="%.15g"), spec)
    end = log.time[-1] + log.sample_time
    known = np.sum(w[:-1] * np.diff(t)) + w[-1] * (end - t[-1])
    assert log.inputs.sum() * log.sample_time == pytest.approx(known, abs=1e-10)


def test_one_late_row_leaves_the_rest_as_it_was(tmp_path, spec):
    made = rows(4)
    made["t"][1:] += 0.0013
    log = read_log(write_csv(tmp_path / "a.csv", made, fmt="%.15g"), spec)
    assert log.raw_data.resampled and log.size == len(made["t"])
    assert np.abs(log.positions[2:, 0] - made["x"][2:]).max() < 1e-9
    assert np.abs(log.inputs[2:, 0] - made["w"][2:]).max() < 1e-6


def test_gaps(tmp_path, spec):
    made = rows(10)
    keep = np.ones(5000, dtype=bool)
    keep[1000:1300] = False  # a gap
    keep[2000:2003] = False  # three rows missing: interpolated
    keep[4000:4050] = False
    log = read_log(write_csv(tmp_path / "a.csv", {k: v[keep] for k, v in made.items()}), spec)
    assert log.gaps == ((1000, 1300), (4000, 4050))
    assert log.segments == ((0, 1000), (1300, 4000), (4050, 5000))
    assert log.size == 5000 and log.sample_time == 0.002
    use = np.concatenate([np.arange(a, b) for a, b in log.segments])
    assert np.abs(log.positions[use, 0] - made["x"][use]).max() < 1e-5
    assert "2 gaps longer than 5 steps, 0.7 s in all" in log.notes[1]


def test_long_steps_that_come_again_and_again_are_no_gaps(tmp_path, spec):
    """Of a firmware that sends 8 rows at 2 ms, then waits for 12 ms, 38 % were left out, and no stretch was left."""
    made = rows(6.0)
    times = np.cumsum(np.where(np.arange(1800) % 8 == 7, 0.012, 0.002))
    kept = {name: np.interp(times, made["t"], made[name]) for name in ("x", "w")}
    log = read_log(write_csv(tmp_path / "a.csv", {"t": times, **kept}), spec)
    assert log.gaps == () and log.sample_time == pytest.approx(0.002)
    assert np.allclose(log.positions[:, 0], np.interp(log.time, made["t"], made["x"]), atol=2e-5)
    times[900:] += 0.3
    log = read_log(write_csv(tmp_path / "a.csv", {"t": times, **kept}), spec)
    assert len(log.gaps) == 1


def test_rounded_stamps_are_taken_as_regular(tmp_path, spec):
    made = rows(10, 300)
    made["t"] = np.round(made["t"], 5)  # 0.3 % of a step
    log = read_log(write_csv(tmp_path / "a.csv", made), spec)
    assert not log.raw_data.resampled and log.sample_time == pytest.approx(1 / 300, rel=1e-5)
