"""Filters and derivatives against closed forms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from codegen.diagnosis.case import case_of, smoothed
from codegen.diagnosis.fit.measure import free_run_errors
from codegen.diagnosis.fit.signals import SHORTEST_TEST_S, low_pass, quiet_cutoff, smooth_motion
from codegen.logs.description import LogDescription
from tests.diagnosis.stage import log_of, stage, system_of
from tests.expected_errors import refused

H = 0.002


def test_low_pass_has_no_phase_and_minus_six_decibel_at_its_cutoff() -> None:
    t = np.arange(0, 20, H)
    slow = np.sin(2 * np.pi * 1.0 * t)
    middle = slice(2000, -2000)
    np.testing.assert_allclose(low_pass(slow, 20.0, H)[middle], slow[middle], atol=2e-6)
    edge = np.sin(2 * np.pi * 20.0 * t)
    # Forth and back through a filter with half power at the cutoff: half the amplitude, no shift.
    np.testing.assert_allclose(low_pass(edge, 20.0, H)[middle], 0.5 * edge[middle], atol=2e-3)


def test_smooth_motion_recovers_velocity_and_acceleration(tmp_path: Path) -> None:
    log = log_of(stage(), tmp_path, "log.csv")
    t = log.time
    x = 0.1 * np.sin(2 * np.pi * 0.7 * t)
    log.positions[:, 0] = x + 1e-6 * np.random.default_rng(0).normal(size=len(t))
    motion = smooth_motion(log, 15.0)
    used = motion.usable
    v, a = 0.1 * (2 * np.pi * 0.7) * np.cos(2 * np.pi * 0.7 * t), -((2 * np.pi * 0.7) ** 2) * x
    assert np.abs(motion.velocities[used, 0] - v[used]).max() < 1e-3 * np.abs(v).max()
    assert np.sqrt(np.mean((motion.low_pass(motion.accelerations)[used, 0] - a[used]) ** 2)) < 5e-3 * np.abs(a).max()


def test_the_cutoff_rises_where_most_of_the_acceleration_lies_above_twenty_hertz() -> None:
    """A motor at 5 rad/s with 72 waves a turn: 57 Hz. The same waves too small to matter, or hidden in noise: 20 Hz."""
    h, generator = 0.001, np.random.default_rng(8)
    t = np.arange(0, 16, h)
    slow, fast = 5 * t + 0.05 * np.sin(2 * np.pi * 0.7 * t), np.sin(72 * 5 * t)
    found = [
        quiet_cutoff((slow + wave * fast + noise * generator.normal(size=len(t)))[:, None], h)
        for wave, noise in ((1e-3, 1e-6), (1e-6, 1e-7), (0.0, 1e-7))
    ]
    assert found == [80.0, 20.0, 20.0]
    assert quiet_cutoff((slow + 1e-3 * fast + 1e-3 * generator.normal(size=len(t)))[:, None], h) <= 20.0


def test_a_log_that_is_too_short_is_refused(tmp_path: Path) -> None:
    log = log_of(stage(duration=2.0), tmp_path, "short.csv")
    with refused("LOG009 short.csv 4 s"):
        smooth_motion(log)


@pytest.mark.parametrize(("stated", "left_out"), [(None, 1.0), (0.3, 0.3), (0.0, 0.0), (100.0, 1.4)])
def test_the_ends_that_a_log_states_are_left_out(stated: float | None, left_out: float, tmp_path: Path) -> None:
    """14 s, of which a tenth is left out at each end at most."""
    log = log_of(stage(duration=14.0), tmp_path, "log.csv")
    about = LogDescription()
    about = about.model_copy(update={"evaluation": about.evaluation.model_copy(update={"trim_s": stated})})
    usable = smooth_motion(replace(log, description=about)).usable
    first = np.argmax(usable) * log.sample_time
    assert first == pytest.approx(left_out, abs=1.5 * log.sample_time) and np.argmax(usable) == np.argmax(usable[::-1])


def test_a_log_of_the_least_length_is_taken_and_a_shorter_one_is_refused_with_its_length(tmp_path: Path) -> None:
    """1998 rows at 2 ms were refused as of 4 s, where 4 s are enough, and 2000 where the step was rounded down."""
    log = log_of(stage(duration=4.5), tmp_path, "short.csv")
    enough, less = (
        replace(log, time=log.time[:n], positions=log.positions[:n], inputs=log.inputs[:n]) for n in (2000, 1998)
    )
    assert log.sample_time == 0.002 and smooth_motion(replace(enough, sample_time=0.0019999), 15.0).usable.any()
    with refused("LOG009 short.csv 3.996 s"):
        smooth_motion(less, 15.0)


def test_a_log_that_only_tests_may_be_shorter_and_still_has_free_runs(tmp_path: Path) -> None:
    log, system = log_of(stage(duration=3.2), tmp_path, "test.csv"), system_of(stage())
    motion = smooth_motion(log, 15.0, SHORTEST_TEST_S)
    assert np.isfinite(free_run_errors(system, motion, slice(0, len(motion.time)))[0]).all()
    with refused("LOG009 less.csv 3 s"):
        smooth_motion(log_of(stage(duration=2.8), tmp_path, "less.csv"), 15.0, SHORTEST_TEST_S)


def test_the_cutoff_falls_with_noise_until_acceleration_is_motion() -> None:
    t = np.arange(0, 30, H)
    x = 0.2 * np.sin(2 * np.pi * 0.8 * t)[:, None]
    generator = np.random.default_rng(5)
    found = []
    for sigma in (1e-7, 1e-4, 1e-3, 1e-2):
        noisy = x + sigma * generator.normal(size=x.shape)
        cutoff = quiet_cutoff(noisy, H)
        found.append(cutoff)
        if cutoff > 2.5:
            acceleration = np.gradient(np.gradient(low_pass(noisy, cutoff, H), H, axis=0), H, axis=0)
            truth = -((2 * np.pi * 0.8) ** 2) * x
            # At 0.8 Hz the filter itself takes nothing; what is left is noise.
            assert np.std((acceleration - truth)[500:-500]) < 0.08 * np.std(truth)
    assert found == sorted(found, reverse=True)
    assert found[0] == 20.0
    assert found[-1] < 5.0


@pytest.mark.parametrize(("noise", "faster"), [(2e-6, True), (2e-3, False)])
def test_the_cutoff_rises_where_the_current_carries_what_the_motion_does_not_show(
    noise: float, faster: bool, tmp_path: Path
) -> None:
    """At 0.1 m/s a wave of 30 Hz takes 20 N, and the axis turns smoothly; not where the noise of M a is as large."""
    log = log_of(stage(duration=8.0), tmp_path, "log.csv")
    x = 0.1 * log.time + noise * np.random.default_rng(3).normal(size=len(log.time))
    held = replace(log, positions=x[:, None], inputs=4.6 + 20 * np.sin(2 * np.pi * 30 * log.time)[:, None])
    usual = smooth_motion(held).cutoff_hz
    assert usual <= 20
    assert smoothed(held, system_of(stage())).cutoff_hz == (40.0 if faster else usual)
    assert case_of(stage(), system_of(stage()), held, None, 0.02).motion.cutoff_hz == (40.0 if faster else usual)
    assert smoothed(replace(held, inputs=held.inputs * 0 + 4.6), system_of(stage())).cutoff_hz == usual
    hiss = 4.6 + 12 * np.random.default_rng(5).normal(size=(len(log.time), 1))
    assert smoothed(replace(held, inputs=hiss), system_of(stage())).cutoff_hz == usual
