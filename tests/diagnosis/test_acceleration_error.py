"""The acceleration error of free runs against closed forms, and what it says of a load that is there or not."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.integrate import quad

from codegen.diagnosis.evidence.acceleration_error import WINDOW, acceleration_errors, larger_acceleration_error
from codegen.diagnosis.evidence.force_evidence import ForceCriterion
from codegen.diagnosis.fit.credit import Evidence
from codegen.diagnosis.fit.output_error import Fit, shooting_fit
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import Search, search_on
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection import refusals
from codegen.effects import CATALOGUE
from tests.diagnosis.stage import log_of, stage, system_of

STEP, CUTOFF = 1e-3, 10.0
LOAD = {"k": 3000.0, "c": 4.0, "load_fraction": 0.8}
"""Of the stage's 2 kg: both parts ring at 15 Hz, the cutoff being 20 Hz."""


def fit_with(error: Any) -> Fit:
    """A fit whose free runs leave this error, (S, L, n)."""
    runner = SimpleNamespace(
        record=SimpleNamespace(targets=error, sample_time=STEP, joints=None), run=lambda theta, offsets: 0.0
    )
    return cast(Fit, SimpleNamespace(runner=runner, theta=None, offsets=None))


def windows(length: int) -> int:
    half = round(0.5 * WINDOW / (CUTOFF * STEP))
    return (length - (2 * half + 1)) // half + 1


def test_a_constant_acceleration_is_exact_and_a_straight_line_has_none():
    t = np.arange(500) * STEP
    parabola, line = 3.0 * t**2 / 2, 0.7 + 5 * t
    errors = acceleration_errors(fit_with(np.array([parabola + line, line])[:, :, None]), 0, CUTOFF)
    assert errors[0] == pytest.approx(9.0 * windows(500), rel=1e-9)
    assert errors[1] < 1e-18


def test_a_wave_is_attenuated_as_its_window_says():
    """Mean of −A ω² sin over the window, by scipy's integration in place of the kernel's second derivative."""
    amplitude, frequency = 1e-3, 0.8 * CUTOFF
    reach = 0.5 * WINDOW / CUTOFF
    t, omega = np.arange(500) * STEP, 2 * np.pi * frequency
    weight = quad(lambda s: (1 - s**2) ** 4 * np.cos(omega * reach * s), -1, 1)[0]
    weight /= quad(lambda s: (1 - s**2) ** 4, -1, 1)[0]
    both = np.stack([np.sin(omega * t), np.cos(omega * t)])  # their squares add up to 1 in each window
    errors = acceleration_errors(fit_with(amplitude * both[:, :, None]), 0, CUTOFF)
    assert errors.sum() == pytest.approx(windows(500) * (amplitude * omega**2 * weight) ** 2, rel=2e-3)
    assert weight == pytest.approx(0.5, abs=0.01)


def fits(effects: str, folder: Path) -> tuple[Search, Fit, Fit]:
    """The refit on a plant's log, and free runs with ``LOAD`` in addition, whose start states alone are fitted."""
    log = log_of(stage(effects), folder, "log.csv")
    motion = smooth_motion(log)
    search = search_on(Problem(system_of(stage()), motion, {}), lambda share: record_of(motion, log, share))
    base = search.refit()
    trial = search.declared_trial.with_part(part_of(CATALOGUE["compliance"], 0, search.system))
    theta = trial.theta(base.values[0], [LOAD])
    fit = shooting_fit(search.runners([trial])[0], theta, search.record.at_rest, search.prior(trial, theta), 0)
    return search, base, fit


def test_a_load_that_is_not_there_shakes_the_motion(tmp_path: Path):
    search, base, fit = fits("[{kind: viscous, on: rail, parameters: {b: 10}}]", tmp_path)
    assert larger_acceleration_error(base, fit, 0, search.motion.cutoff_hz).startswith(
        "makes the squared acceleration error of the simulation"
    )


def test_such_a_candidate_is_refused_in_its_round(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the tests by force let it pass, as a backlash, whose load the force residual does not follow."""
    search, base, fit = fits("[{kind: viscous, on: rail, parameters: {b: 10}}]", tmp_path)
    for name in ("admissible", "matters"):
        monkeypatch.setattr(refusals, name, lambda *_: True)
    for name in ("contradicted_by_force", "only_reduces_drive", "acts_as_its_limit", "absorbed_by_refit"):
        monkeypatch.setattr(refusals, name, lambda *_: "")
    credited = Evidence(gain=100.0, share=0.5, t=5.0, won=8, blocks=8)
    why_not = refusals.why_refused(ForceCriterion(search, base), ForceCriterion(search, fit), credited, 0.5)
    assert why_not.startswith("makes the squared acceleration error")


def test_a_load_that_is_there_does_not(tmp_path: Path):
    values = ", ".join(f"{name}: {value}" for name, value in LOAD.items())
    search, base, fit = fits(f"[{{kind: compliance, on: x, parameters: {{{values}}}}}]", tmp_path)
    assert larger_acceleration_error(base, fit, 0, search.motion.cutoff_hz) == ""
    cutoff = search.motion.cutoff_hz
    assert acceleration_errors(fit, 0, cutoff).sum() < 0.1 * acceleration_errors(base, 0, cutoff).sum()


def test_one_coordinate_and_one_run_that_diverges_do_not_hide_it() -> None:
    """Four times the squared error on x; the angle beside it is as it was, and one run has left all bounds."""
    t = np.arange(500) * STEP
    waves = np.random.default_rng(1).normal(size=(24, 2, 1)) * np.sin(2 * np.pi * 6 * t)
    before = np.stack([waves[:, 0], 100 * waves[:, 1]], axis=2)
    after = np.stack([2 * waves[:, 0], 100 * waves[:, 1]], axis=2)
    after[3] = np.nan
    words = larger_acceleration_error(fit_with(before), fit_with(after), 0, CUTOFF)
    assert words.startswith("makes the squared acceleration error of the simulation")
    assert larger_acceleration_error(fit_with(before), fit_with(after), 1, CUTOFF) == ""
