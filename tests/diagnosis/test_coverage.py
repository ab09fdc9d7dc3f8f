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
