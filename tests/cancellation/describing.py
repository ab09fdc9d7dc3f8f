"""Limit cycles of a mass under PD control, with Coulomb friction and a TO's estimate of it cancelled; not our code.

F = a sgn(v) is a relay, all else is linear: v = −H F, H = s P (1 − γ G Z), P = 1 / (m s² + Z (k_d s + k_p)), with Z the
hold of the sampled input, and its delay; what the sampling folds back is left out.

Describing function (first harmonic of F only): 1 + N(A) H(jω) = 0, N = 4 a / (π A).
Tsypkin (all harmonics, exact while the mass does not stick): Σ Im H(jkω) / k = 0 over odd k, v > 0 for half a period.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import optimize

ODD = np.arange(1, 400, 2)
GRID = np.geomspace(0.5, 500, 3000)


@dataclass(frozen=True)
class Mass:
    m: float
    k_p: float
    k_d: float
    a: float
    K_2: float  # of the TO, negative
    K_v: float | None = None  # of the velocity observer; None where the velocity is measured
    h: float = 0.0  # s, sample time of controller and observer
    delay: int = 0  # samples, of the cancelling input

    def tracked(self, s):
        """F̂ / F: with the velocity measured F̂' = −(K_2/m)(F − F̂); behind (3.6) one pole at K_v more."""
        s = np.expm1(s * self.h) / self.h if self.h else s  # its rates make explicit Euler steps
        rate = -self.K_2 / self.m
        if self.K_v is None:
            return rate / (s + rate)
        return rate * self.K_v / (s * s + self.K_v * s + rate * self.K_v)

    def loop(self, w, gamma: float):
        s = 1j * w
        hold = -np.expm1(-s * self.h) / (s * self.h) if self.h else 1.0
        plant = 1 / (self.m * s * s + hold * (self.k_d * s + self.k_p))
        return s * plant * (1 - gamma * self.tracked(s) * hold * np.exp(-s * self.h * self.delay))

    def describing(self, gamma: float) -> list[tuple[float, float]]:
        """(ω, position amplitude) of every limit cycle that the describing function predicts."""
        found = []
        for w in _roots(lambda w: self.loop(w, gamma).imag):
            real = self.loop(w, gamma).real
            if real < 0:
                found.append((w, 4 * self.a * -real / (np.pi * w)))
        return found

    def tsypkin(self, gamma: float) -> list[tuple[float, float]]:
        """The same, exactly."""
        found = []
        for w in _roots(lambda w: float(np.sum(self.loop(np.outer(w, ODD), gamma).imag / ODD, axis=-1).squeeze())):
            phase = np.linspace(0, np.pi, 201)
            waves = -4 * self.a / np.pi * self.loop(w * ODD, gamma) / ODD
            turned = waves * np.exp(1j * np.outer(phase, ODD))
            if np.all(turned.imag.sum(axis=1)[2:-2] > 0):
                positions = (turned / (1j * w * ODD)).imag.sum(axis=1)
                found.append((w, float(np.abs(positions).max())))
        return found


def threshold(cycles) -> float:
    """The smallest γ up to 2 for which there is any."""
    low, high = 0.0, 2.0
    for _ in range(12):
        middle = (low + high) / 2
        low, high = (low, middle) if cycles(middle) else (middle, high)
    return high


def _roots(function) -> list[float]:
    values = np.array([function(w) for w in GRID])
    return [
        float(optimize.brentq(function, GRID[k], GRID[k + 1])) for k in np.flatnonzero(values[1:] * values[:-1] < 0)
    ]
