"""What a log covers at the place of a candidate, and the periods that stand out in the residual over position."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis.measure import drive_force
from codegen.diagnosis.residual import inverse_dynamics_residual
from codegen.diagnosis.resonance import resonances
from codegen.diagnosis.signals import Motion
from codegen.diagnosis.trial import Part
from codegen.effects import CATALOGUE
from codegen.effects.start import Covered
from codegen.mechanics.system import Matrix, System

Array = NDArray[np.float64]

BINS = 16384
PADDING = 16
"""Frequencies of the scan are a sixteenth of a turn over the whole span apart."""
LEAST_TURNS, MOST_TURNS = 1.0, 2000.0
KEPT_PERIODS = 3
KEPT_RESONANCES = 2


@dataclass(frozen=True, eq=False)
class Survey:
    """What the scales of all candidates come from.

    Attributes:
        residual: (N, n) force residual of the refitted model. drive: (N, n) low-passed.
    """

    system: System
    motion: Motion
    residual: Array
    drive: Array
    mass: Array
    distribution: Array

    def covered(
        self, part: Part, levels: Sequence[float], noise: Array, coupling: Mapping[str, float] | None = None
    ) -> Covered:
        """What the log covers where ``part`` sits.

        Args:
            levels: of the contacts, as refitted. noise: of the positions.
            coupling: of the compliance that was fitted there.
        """
        m = self.motion
        contact = part.place if _sits_on(part) == "contact" else None
        i = CATALOGUE[part.kind].coordinate(self.system, part.place)
        if contact is None:
            x, v, y = m.positions[:, i], m.velocities[:, i], self.residual[:, i]
        else:
            column = self.distribution[:, contact]
            x, v = m.positions @ column, m.velocities @ column
            y = self.residual @ column / (column @ column)
        span = max(float(np.ptp(x)), 1e-12)
        command = m.commands[:, part.place if _sits_on(part) == "input" else 0]
        return Covered(
            force=max(float(self.drive[:, i].std()), self.mass[i, i] * float(m.accelerations[:, i].std()), 1e-12),
            span=span,
            top_speed=max(float(np.quantile(np.abs(v), 0.95)), 1e-12),
            top_input=max(float(np.quantile(np.abs(command), 0.98)), 1e-12),
            inertia=float(self.mass[i, i]),
            level=max(levels[contact], 1e-9) if contact is not None and contact < len(levels) else 1.0,
            noise=float(noise[i]),
            sample_time=m.sample_time,
            duration=float(m.time[-1] - m.time[0]),
            cutoff_hz=m.cutoff_hz,
            periods=partial(_periods, _sits_on(part), x, v, y, m.usable, span),
            coupling=coupling,
            resonances=partial(_resonances, self.residual[:, i], m, i, float(self.mass[i, i])),
        )


def survey(system: System, motion: Motion) -> Survey:
    """Of a system with refitted values."""
    middle = dict(zip(system.positions, motion.positions[motion.usable].mean(axis=0), strict=True))

    def numbers(matrix: Matrix) -> Array:
        return np.array(matrix.subs(middle).subs(system.values).evalf(), dtype=float)

    return Survey(
        system,
        motion,
        inverse_dynamics_residual(system, motion),
        motion.low_pass(drive_force(system, motion)),
        numbers(system.mass_matrix),
        numbers(system.distribution),
    )


def _sits_on(part: Part) -> str:
    return CATALOGUE[part.kind].sits_on


def _resonances(y: Array, motion: Motion, i: int, inertia: float) -> tuple[dict[str, float], ...]:
    """As stiffness, damping and share of the inertia of coordinate ``i``."""
    found = resonances(y, motion.accelerations[:, i], inertia, motion, KEPT_RESONANCES)
    loads = [(r, r.share * inertia) for r in found]
    return tuple(
        {"k": load * r.frequency**2, "c": 2 * r.damping_ratio * r.frequency * load, "load_fraction": r.share}
        for r, load in loads
    )


def _periods(sits_on: str, x: Array, v: Array, y: Array, used: NDArray[np.bool_], span: float) -> tuple[float, ...]:
    """By what a wave multiplies there: the direction of slip, the square of speed, or nothing."""
    carrier = {"contact": np.sign(v), "sensor": v**2}.get(sits_on, np.ones_like(v))
    place = np.clip(((x - x.min()) / span * BINS).astype(int), 0, BINS - 1)
    weights = (carrier * (y - y[used].mean()))[used]
    density = np.bincount(place[used], weights=weights, minlength=BINS)
    power = np.abs(np.fft.rfft(density, PADDING * BINS)) ** 2
    turns = np.arange(len(power)) / PADDING
    power[(turns < LEAST_TURNS) | (turns > min(MOST_TURNS, used.sum() / 8))] = 0.0
    peaks = [
        k
        for k in np.argsort(-power)[:200]
        if power[k] > 0 and power[k] >= power[max(0, k - PADDING // 2) : k + PADDING // 2 + 1].max()
    ]
    return tuple(float(span / turns[k]) for k in peaks[:KEPT_PERIODS])
