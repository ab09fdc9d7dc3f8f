"""Extra motions that could be logged, within the ranges of the log or of the spec's envelope."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.diagnosis.record import LEAST_SEGMENTS, PERIODS
from codegen.diagnosis.signals import Motion
from codegen.mechanics.system import TIME, System

Array = NDArray[np.float64]

SEGMENTS = 3 * LEAST_SEGMENTS
"""Segments in the shortest motion: enough for a diagnosis that holds the last part out."""
LENGTHS = (1, 2)
LEAST_PERIODS = 4.0
MARGIN = 0.95
"""Share of a range that is used."""
PACES = 0.87
"""Ratio of the pace of one coordinate to the one before, so that several are not in phase."""
CENTRED = 0.02
"""A range whose middle is this near to zero, over its half width, is centred at zero."""
SLOW, SLOW_TURNS = 0.06, 3
DIGITS = 4


@dataclass(frozen=True, eq=False)
class Reach:
    """The ranges in which the machine may be moved.

    Attributes:
        centre, half: (n,) of the positions. speed: (n,) largest. inputs: (m,) largest magnitudes.
    """

    centre: Array
    half: Array
    speed: Array
    inputs: Array


@dataclass(frozen=True, eq=False)
class ExtraMotion:
    """A reference motion.

    Attributes:
        name: in words.
        duration: s, a whole number of samples.
        references: of each coordinate, over t in s, with plain decimals.
    """

    name: str
    duration: float
    references: tuple[sympy.Expr, ...]

    def at(self, time: Array) -> tuple[Array, Array]:
        """References and their rates at (N,) times, both (N, n)."""
        rows = []
        for expressions in (self.references, [r.diff(TIME) for r in self.references]):
            columns = [np.broadcast_to(sympy.lambdify(TIME, e, "numpy")(time), time.shape) for e in expressions]
            rows.append(np.column_stack(columns).astype(np.float64))
        return rows[0], rows[1]


def reach_of(system: System, motion: Motion, envelope: Mapping[str, tuple[Any, Any]]) -> Reach:
    """The ranges of a log, extended to the spec's envelope where that is larger."""
    low, high = motion.positions.min(axis=0), motion.positions.max(axis=0)
    speed = np.quantile(np.abs(motion.velocities), 0.99, axis=0)
    inputs = np.abs(motion.commands).max(axis=0)
    for i, (x, v) in enumerate(zip(system.positions, system.velocities, strict=True)):
        if x.name in envelope:
            bounds = [float(b) for b in envelope[x.name]]
            low[i], high[i] = min(low[i], bounds[0]), max(high[i], bounds[1])
        speed[i] = max(speed[i], _both_ways(envelope, v))
    for j, w in enumerate(system.inputs):
        inputs[j] = max(inputs[j], _both_ways(envelope, w))
    centre, half = (low + high) / 2, (high - low) / 2
    return Reach(np.where(np.abs(centre) > CENTRED * half, centre, 0.0), MARGIN * half, MARGIN * speed, inputs)


def _both_ways(envelope: Mapping[str, tuple[Any, Any]], symbol: sympy.Symbol) -> float:
    """The magnitude allowed in both directions; 0 where the envelope gives none."""
    return min((abs(float(b)) for b in envelope.get(symbol.name, ())), default=0.0)


def library(reach: Reach, motion: Motion) -> list[ExtraMotion]:
    """Reference motions of two lengths, shortest first; deterministic for a log."""
    shortest = SEGMENTS * PERIODS / motion.cutoff_hz
    moves = []
    for factor in LENGTHS:
        samples = round(factor * shortest / motion.sample_time)
        duration = samples * motion.sample_time
        for name, shape in SHAPES.items():
            references = tuple(
                _plain(reach.centre[i] + shape(*_size(reach, i, duration), duration)) for i in range(len(reach.centre))
            )
            moves.append(ExtraMotion(name, duration, references))
    return moves


def _size(reach: Reach, i: int, duration: float) -> tuple[float, float]:
    """Amplitude a and frequency Ω = speed/a in rad/s of one coordinate."""
    half, speed = float(reach.half[i]), float(reach.speed[i])
    pace = max(speed / half if half > 0 else 0.0, LEAST_PERIODS * 2 * np.pi / duration) * PACES ** (i % 4)
    return min(half, speed / pace), pace


Shape = Callable[[float, float, float], sympy.Expr]
"""(a, Ω, duration) → a motion about zero that stays within ±a and ±aΩ."""


def _two_tones(a: float, pace: float, duration: float) -> sympy.Expr:
    return 0.6 * a * sympy.sin(0.8 * pace * TIME) + 0.35 * a * sympy.sin(1.3 * pace * TIME)


def _slow_sweep(a: float, pace: float, duration: float) -> sympy.Expr:
    turn = 2 * np.pi * SLOW_TURNS / duration
    return min(a, SLOW * a * pace / turn) * sympy.sin(turn * TIME)


def _fast_reversals(a: float, pace: float, duration: float) -> sympy.Expr:
    return a / 6 * sympy.sin(6 * pace * TIME)


def _sweep_and_reversals(a: float, pace: float, duration: float) -> sympy.Expr:
    turn = 2 * np.pi * SLOW_TURNS / duration
    return min(0.7 * a, 0.3 * a * pace / turn) * sympy.sin(turn * TIME) + 0.1 * a * sympy.sin(7 * pace * TIME)


def _chirp(a: float, pace: float, duration: float) -> sympy.Expr:
    """Up and down twice between Ω and 8 Ω, at a nearly constant top speed."""
    turn = 4 * np.pi / duration
    phase = 4.5 * pace * TIME - 3.5 * pace / turn * sympy.sin(turn * TIME)
    return 0.8 * a / (4.5 - 3.5 * sympy.cos(turn * TIME)) * sympy.sin(phase)


def _dwells(a: float, pace: float, duration: float) -> sympy.Expr:
    return a * sympy.tanh(4 * sympy.sin(pace / 4 * TIME))


def _other_range(a: float, pace: float, duration: float) -> sympy.Expr:
    turn = 2 * np.pi / duration
    return 0.5 * a * sympy.tanh(3 * sympy.sin(turn * TIME)) + 0.45 * a * sympy.sin(pace * TIME)


SHAPES: dict[str, Shape] = {
    "two tones over the whole range": _two_tones,
    "slow sweep both ways": _slow_sweep,
    "fast reversals": _fast_reversals,
    "sweep with fast reversals on it": _sweep_and_reversals,
    "chirp up and down": _chirp,
    "quick moves with rests at both ends": _dwells,
    "one half of the range, then the other": _other_range,
}


def _plain(expression: sympy.Expr) -> sympy.Expr:
    """The expression with rounded numbers, so that its short text is exactly what was simulated."""
    rounded = {n: sympy.Float(f"{float(n):.{DIGITS}g}") for n in expression.atoms(sympy.Float)}
    return expression.xreplace(rounded)


def reference_text(expression: sympy.Expr) -> str:
    """As a spec's ``simulation.reference`` takes it."""
    return str(sympy.sstr(expression, full_prec=False))
