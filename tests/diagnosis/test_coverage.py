"""Distances after which a residual repeats itself, against waves that were put in."""

from __future__ import annotations

import numpy as np
import pytest

from codegen.diagnosis.coverage import _periods


@pytest.mark.parametrize("orders", [(7,), (72, 18), (36, 12)])
def test_waves_of_a_rotor_are_found_over_many_turns(orders: tuple[int, ...]) -> None:
    """Twelve turns at a speed that changes, of a motor without load: 72 waves a turn are 864 over the log."""
    t = np.linspace(0, 16, 16000)
    x = 4.8 * t + 0.3 * np.sin(2 * np.pi * 0.4 * t)
    y = 0.2 * np.random.default_rng(2).normal(size=len(t))
    for k, order in enumerate(orders):
        y += np.sin(order * x + k) / (1 + k)
    found = _periods("coordinate", x, np.gradient(x, t), y, np.ones(len(t), dtype=bool), float(np.ptp(x)))
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
    found = _periods("contact", x, v, y, np.ones(len(t), dtype=bool), span)
    assert span / found[0] == pytest.approx(turns, abs=0.1)
