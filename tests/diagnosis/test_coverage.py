"""Distances after which a residual repeats itself, against waves that were put in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.base.arrays import Array
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.evidence.coverage import _Path, _periods, survey
from codegen.diagnosis.fit.signals import is_resolved, smooth_motion
from codegen.diagnosis.fit.trial import part_of, with_effects
from codegen.diagnosis.results import FoundEffect
from codegen.effects import CATALOGUE
from codegen.spec import parse_spec
from tests.diagnosis.stage import log_of, stage, system_of

SWEEP = "0.15*t + 0.02*sin(2*pi*0.3*t)"
"""A motion at 0.11 to 0.19 m/s, which passes 4.5 mm 25 to 42 times a second: above the cutoff of 20 Hz."""


def path(sits_on: str, x: Array, v: Array) -> _Path:
    """The motion at a place, all of whose samples are used."""
    every = np.ones(len(x), dtype=bool)
    return _Path(sits_on, x, v, every, every, float(np.ptp(x)))


@pytest.mark.parametrize("orders", [(7,), (72, 18), (36, 12)])
def test_waves_of_a_rotor_are_found_over_many_turns(orders: tuple[int, ...]) -> None:
    """Twelve turns at a speed that changes, of a motor without load: 72 waves a turn are 864 over the log."""
    t = np.linspace(0, 16, 16000)
    x = 4.8 * t + 0.3 * np.sin(2 * np.pi * 0.4 * t)
    y = 0.2 * np.random.default_rng(2).normal(size=len(t))
    for k, order in enumerate(orders):
        y += np.sin(order * x + k) / (1 + k)
    found = _periods(path("coordinate", x, np.gradient(x, t)), y, 500.0)
    for order in orders:
        assert min(abs(2 * np.pi / p - order) for p in found) < 0.03


@pytest.mark.parametrize("turns", [1.7, 3.3, 5.2])
def test_a_wave_of_friction_is_found_where_the_motion_dwells_unevenly(turns: float) -> None:
    """Sweeps that turn back near the same places: how long it stays there has a spectrum of its own."""
    t = np.arange(24000) * 1e-3
    x = 0.7 * np.sin(1.9 * t) + 0.35 * np.sin(5.3 * t + 1.0)
    v = np.gradient(x, t)
    span = float(np.ptp(x))
    y = np.sign(v) * (2.0 + 0.5 * np.sin(2 * np.pi * turns * x / span + 0.6)) + 0.8 + 0.3 * np.sin(11 * t)
    found = _periods(path("contact", x, v), y, 20.0)
    assert span / found[0] == pytest.approx(turns, abs=0.1)


def test_a_period_that_is_always_passed_above_the_cutoff_is_not_proposed() -> None:
    """A residual that lives near standstill alone: sines so short that they average out elsewhere would fit it."""
    t = np.arange(24000) * 1e-3
    x = 0.2 * np.sin(0.9 * t) + 0.05 * np.sin(2.3 * t)
    v = np.gradient(x, t)
    y = np.sign(v) * np.exp(-((v / 1e-3) ** 2)) * np.sin(2 * np.pi * x / 1.2e-4)
    used = np.ones(len(t), dtype=bool)
    assert min(_periods(path("contact", x, v), y, 1e6)) < 2e-3
    for period in _periods(path("contact", x, v), y, 20.0):
        assert is_resolved(period, x, v, used, 20.0)


@pytest.mark.parametrize(("ratio", "resolved"), [(0.99, True), (1.01, False)])
def test_a_constant_speed_resolves_periods_up_to_the_cutoff(ratio: float, resolved: bool) -> None:
    t = np.arange(5000) * 1e-3
    period = 0.05 / 20.0
    assert (
        is_resolved(period, ratio * 0.05 * t, np.full(len(t), ratio * 0.05), np.ones(len(t), dtype=bool), 20.0)
        is resolved
    )


def test_a_reversal_resolves_what_it_covers_while_slow() -> None:
    """x = a t²/2 about a reversal: below the speed f p it covers (f p)²/2a on each side, the same way twice."""
    t = np.arange(-1, 1, 1e-5)
    x, v, used = 0.5 * 2.0 * t**2, 2.0 * t, np.ones(len(t), dtype=bool)
    longest = 2 * 2.0 / 20.0**2  # p = (20 p)²/(2·2)
    assert is_resolved(1.02 * longest, x, v, used, 20.0)
    assert not is_resolved(0.98 * longest, x, v, used, 20.0)
    assert not is_resolved(1.02 * longest, x, v, np.abs(t) > 0.03, 20.0)


@pytest.mark.slow
def test_cogging_that_is_passed_above_the_cutoff_is_found(tmp_path: Path) -> None:
    """At 25 to 42 Hz, but for the start, it was friction of twice its period with a second harmonic."""
    cogging = "[{kind: cogging, on: x, parameters: {amplitude: 8, period: 0.0045, phase: 1}}]"
    spec = stage()
    log = log_of(stage(cogging, reference=SWEEP, noise=2e-6), tmp_path, "log.csv")
    diagnosis, _ = diagnose_log(spec, system_of(spec), log)
    (found,) = diagnosis.effects
    assert found.kind == "cogging" and found.parameters["period"] == pytest.approx(0.0045, rel=0.002)
    assert found.parameters["amplitude"] == pytest.approx(8.0, rel=0.01)


def test_a_load_that_carries_a_weight_is_started_along_the_motion_and_another_by_its_resonance(tmp_path: Path) -> None:
    """Without a force at the load its motion is that of the motor, filtered: the regression on it has every start."""
    spec, part = stage(), part_of(CATALOGUE["compliance"], 0, system_of(stage()))
    motion = smooth_motion(log_of(spec, tmp_path, "log.csv"))
    text = spec.text.replace("  b: {value", "  c: {value: 20, unit: N}\n  b: {value").replace("w - b*v", "w - b*v - c")
    weight = parse_spec(text, Path("stage.yaml"))
    found = [survey(system_of(one), motion).covered(part, [4.0], motion.noise) for one in (spec, weight)]
    assert [one.carried for one in found] == [False, True]
    assert not part.effect.followed(found[0]) and part.effect.followed(found[1])
    in_model = with_effects(system_of(spec), [FoundEffect("spring", "x", {"k": 3.0}, {})])  # at the motor
    assert not survey(system_of(spec), motion, in_model).covered(part, [4.0], motion.noise).carried
