"""The third derivation: the error of a simulated plant and observer, by differences; no derivative in it at all."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from .true_plant import Point, TruePlant


def simulated_jacobian(plant: TruePlant, p: Point, size: float, span: float) -> Any:
    """Ψ as (E(span) − E(−span))/(2 span), where E(t) is ∂e(t)/∂e(0) by central differences of ± ``size``.

    E(t) = I + tΨ + t²/2 (Ψ² + Ψ') + …, so that what is left out is of second order in span and in size.
    """
    m = len(plant.observer.errors)

    def after(e: Any, t: float) -> Any:
        start = np.concatenate([p.x, p.v, p.truth, plant.states(p, e)])
        solution = solve_ivp(lambda _, s: _rates(plant, p, s), (0, t), start, "DOP853", rtol=1e-12, atol=1e-13)
        x, v, truth, z = _split(plant, p, solution.y[:, -1])
        return plant.error(Point(x, v, p.w, truth), z)

    columns = []
    for axis in np.eye(m):
        ends = [(after(size * axis, t) - after(-size * axis, t)) / (2 * size) for t in (span, -span)]
        columns.append((ends[0] - ends[1]) / (2 * span))
    return np.array(columns).T


def _split(plant: TruePlant, p: Point, s: Any) -> tuple[Any, Any, Any, Any]:
    n, hidden = plant.n, len(p.truth)
    return s[:n], s[n : 2 * n], s[2 * n : 2 * n + hidden], s[2 * n + hidden :]


def _rates(plant: TruePlant, p: Point, s: Any) -> Any:
    x, v, truth, z = _split(plant, p, s)
    acceleration, truth_rate, z_rate = plant.flow(Point(x, v, p.w, truth), z)
    return np.concatenate([v, acceleration, truth_rate, z_rate])
