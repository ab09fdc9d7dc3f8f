"""One mass on a law with one state, by SciPy's Radau: independent of the plants under test."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
Law = Callable[[float, float], tuple[float, float]]
"""(u, z) → (λ, z')."""


def dahl(a: float, c: float, i: float = 1) -> Law:
    def law(u: float, f: float) -> tuple[float, float]:
        gap = 1 - f * np.sign(u)
        return a * f, c * u * abs(gap) ** i * np.sign(gap)

    return law


def reset_integrator(a: float, c: float, D1: float, D2: float) -> Law:
    def law(u: float, f: float) -> tuple[float, float]:
        phi = D2 * f if abs(f) < 1 else np.sign(f) * (D1 * (abs(f) - 1) + D2)
        return a * f, c * (u - phi)

    return law


def lugre(s0: float, s1: float, s2: float, F_c: float, F_s: float, v_s: float) -> Law:
    def law(u: float, z: float) -> tuple[float, float]:
        rate = u - s0 * abs(u) * z / (F_c + (F_s - F_c) * np.exp(-((u / v_s) ** 2)))
        return s0 * z + s1 * rate + s2 * u, rate

    return law


def walrath(T: float, tau: float) -> Law:
    return lambda u, f: (T * f, (np.tanh(u / 1e-7) - f) / tau)


def extended(level: Callable[[float], float], carrier: Law) -> Law:
    """``carrier`` with a = 1."""
    return lambda u, f: (level(abs(u)) * f, carrier(u, f)[1])


def integrate(law: Law, m: float, k: float, time: Array, inputs: Array, start: Array) -> Array:
    """(N, 3) rows x, v, z of m v' = w − k x − λ under commands held from t_k to t_(k+1)."""

    def rate(_: float, y: Array, w: float) -> list[float]:
        force, z_rate = law(y[1], y[2])
        return [y[1], (w - k * y[0] - force) / m, z_rate]

    path = [np.asarray(start, dtype=float)]
    for j in range(len(time) - 1):
        span = (time[j], time[j + 1])
        path.append(solve_ivp(rate, span, path[-1], "Radau", args=(inputs[j],), rtol=1e-9, atol=1e-12).y[:, -1])
    return np.array(path)
