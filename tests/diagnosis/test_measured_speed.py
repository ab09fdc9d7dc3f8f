"""Logs of a measured speed without a position: what is compared and told is the speed, whose noise is white."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from codegen.diagnosis.case import unknown_starts
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.evidence.residual_regression import remainders
from codegen.diagnosis.fit.acceptance import noise_ratio
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.signals import derivative_noise, quiet_cutoff, smooth_motion, white_noise
from codegen.logs import Log, read_log
from tests.diagnosis.stage import among, log_of, stage, system_of
from tests.slow_cases import slow_except

SIGMA = 5e-3
"""Noise of the speed, m/s: a hundredth of its RMS."""
VISCOUS = "[{kind: viscous, on: rail, parameters: {b: 4}}]"


def speed_only(log: Log, folder: Path, sigma: float = SIGMA) -> Log:
    """The log as a drive would export it that shows its speed alone."""
    v = np.gradient(log.positions[:, 0], log.sample_time)
    v = v + sigma * np.random.default_rng(7).standard_normal(len(v))
    path = folder / "speed.csv"
    rows = (f"{t:.6f},{a:.9g},{w:.9g}" for t, a, w in zip(log.time, v, log.inputs[:, 0], strict=True))
    path.write_text("\n".join(["t,v,w", *rows]) + "\n")
    return read_log(path, stage())


def test_the_noise_is_that_of_the_speed(tmp_path: Path) -> None:
    """And what it makes of the acceleration is what differs from the acceleration of the same motion without noise."""
    clean = log_of(stage(), tmp_path, "train.csv")
    log = speed_only(clean, tmp_path)
    assert log.raw_data.integrated == (True,) and clean.raw_data.integrated == (False,)
    motion, quiet = (smooth_motion(one, 10.0) for one in (log, clean))
    assert motion.noise[0] == pytest.approx(SIGMA, rel=0.1)
    off = motion.low_pass(motion.accelerations - quiet.accelerations)[motion.usable, 0]
    assert motion.noise_after(10.0, 2)[0] == pytest.approx(np.std(off), rel=0.25)
    loud = speed_only(clean, tmp_path, 20 * SIGMA)
    assert quiet_cutoff(loud.positions, loud.sample_time, (True,)) < quiet_cutoff(loud.positions, loud.sample_time)


def test_an_unknown_start_is_told_where_a_force_depends_on_the_position(tmp_path: Path) -> None:
    """The integral of the speed begins at zero, wherever the machine was."""
    clean = log_of(stage(), tmp_path, "train.csv")
    log = speed_only(clean, tmp_path)
    spring = system_of(stage("[{kind: spring, on: x, parameters: {k: 18}}]"))
    (told,) = unknown_starts(spring, log)
    assert told.severity == "warning" and "x is the integral of its speed, from zero where the log begins" in told.words
    assert unknown_starts(system_of(stage()), log) == () and unknown_starts(spring, clean) == ()


@pytest.mark.parametrize("order", [1, 2])
def test_derivatives_of_white_noise_have_the_power_of_their_spectrum(order: int) -> None:
    """Of positions, and of a walk of positions whose steps are white."""
    h, generator = 0.002, np.random.default_rng(1)
    white = generator.standard_normal((200_000, 1))
    white -= white.mean()  # so that the walk ends where it began, as the spectrum takes for granted
    for integrated, x in ((False, white), (True, np.cumsum(white, axis=0) * h)):
        spectrum = np.fft.rfft(x, axis=0)
        f = np.fft.rfftfreq(len(x), h)[:, None]
        below = np.fft.irfft(np.where(f <= 20.0, spectrum * (2j * np.pi * f) ** order, 0), axis=0)
        expected = derivative_noise(np.ones(1), 20.0, h, order, (integrated,))[0]
        assert np.std(below) == pytest.approx(expected, rel=0.03)
    assert white_noise(white, np.zeros_like(white), 0.0, h)[0] == pytest.approx(1.0, rel=0.01)


def test_free_runs_of_the_true_model_are_as_far_off_as_the_noise(tmp_path: Path) -> None:
    log = speed_only(log_of(stage(), tmp_path, "train.csv"), tmp_path)
    motion = smooth_motion(log)
    search = search_on(Problem(system_of(stage()), motion, {}), lambda share: record_of(motion, log, share))
    assert 0.8 < noise_ratio(search.refit()) < 1.2


def test_noise_of_the_speed_is_told_over_nothing(tmp_path: Path) -> None:
    """It is in the residual and in what a load or an acceleration is computed from, and would explain itself."""
    log = speed_only(log_of(stage(), tmp_path, "train.csv"), tmp_path, 4 * SIGMA)
    problem = Problem(system_of(stage()), smooth_motion(log, 20.0), {})
    (left,) = remainders(problem.system, problem.motion, problem.used)
    assert left.share > 0.05  # the noise is no small part of the force
    assert max(left.over["load"], left.over["acceleration"]) < 0.02 and not left.changes


@pytest.mark.parametrize(
    ("effects", "verdict"), slow_except([("[]", "none"), (VISCOUS, "effect")], [(VISCOUS, "effect")], several=True)
)
def test_what_is_lacking_is_found_by_speed_alone(effects: str, verdict: str, tmp_path: Path) -> None:
    log = speed_only(log_of(stage(effects), tmp_path, "train.csv"), tmp_path)
    with among("viscous", "stribeck", "position_dependent_friction"):
        found, _ = diagnose_log(stage(), system_of(stage()), replace(log, path=tmp_path / "speed.csv"))
    assert found.verdict == verdict, found.sentence
    if verdict == "none":
        return
    (one,) = found.effects
    assert (one.kind, one.on) == ("viscous", "rail")
    assert one.parameters["b"] == pytest.approx(4.0, rel=0.05)


def test_a_vibration_is_no_noise_of_the_speed(tmp_path: Path) -> None:
    """A loop that hums at 170 Hz, ten times as loud as the noise."""
    log = speed_only(log_of(stage(), tmp_path, "train.csv"), tmp_path)
    hum = 10 * SIGMA * np.sqrt(2) * np.sin(2 * np.pi * 170 * log.time) / (2 * np.pi * 170)
    humming = replace(log, positions=log.positions + hum[:, None])
    assert smooth_motion(humming, 10.0).noise[0] == pytest.approx(SIGMA, rel=0.15)
