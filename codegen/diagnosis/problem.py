"""One log and one System as a regression: what is declared, the friction levels, and what an effect would add."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.diagnosis.balance import evaluate_forces, level_columns, level_parameters
from codegen.diagnosis.gram import Blocks, Grams, cut_blocks, gram
from codegen.diagnosis.residual import Masks, effective_inputs, masks
from codegen.diagnosis.signals import Motion, delayed
from codegen.effects import Effect
from codegen.effects.declare import effect_symbols, places_of
from codegen.mechanics.system import Matrix, System

Array = NDArray[np.float64]

BLOCKS = 12
CORRELATED = 2.0
"""Samples kept after the coarse filter (four a period of its cutoff) for one independent sample."""


@dataclass(frozen=True, eq=False)
class Problem:
    """The regression of a System's force balance on a Motion.

    Attributes:
        system: as declared, with effects found so far.
        motion: smoothed.
        tolerance: relative uncertainty of each declared parameter that has one.
    """

    system: System
    motion: Motion
    tolerance: Mapping[sympy.Symbol, float]

    @cached_property
    def masks(self) -> Masks:
        return masks(self.system, self.motion, self.noise_speed)

    @cached_property
    def noise_speed(self) -> float:
        """Three times the velocity noise that is left after the fine filter, from the noise of the positions."""
        motion = self.motion
        noise = float(np.max(np.std(motion.measured - motion.positions, axis=0)))
        band = motion.fine_hz
        return float(3 * noise * 2 * np.pi * band / np.sqrt(3) * np.sqrt(2 * band * motion.sample_time))

    @cached_property
    def levels(self) -> list[sympy.Symbol]:
        """The friction levels that every fit re-estimates."""
        return level_parameters(self.system)

    @cached_property
    def uncertain(self) -> list[sympy.Symbol]:
        """Declared parameters that may move within their tolerance."""
        error = self.system.equation_error
        return [s for s, share in self.tolerance.items() if share > 0 and error.has(s) and s not in self.levels]

    def refitted(self, weights: Array) -> dict[str, float]:
        """Values of the levels and uncertain parameters from the first weights of a fit."""
        count = len(self.levels)
        found = {s.name: float(w) for s, w in zip(self.levels, weights[:count], strict=True)}
        moves = weights[count : count + len(self.uncertain)]
        return found | {
            s.name: float(self.system.values[s]) + float(w) for s, w in zip(self.uncertain, moves, strict=True)
        }

    @cached_property
    def blocks(self) -> list[Blocks]:
        return [
            cut_blocks(self.masks.rows[:, i], self.motion.stride, BLOCKS) for i in range(self.system.degrees_of_freedom)
        ]

    @cached_property
    def inputs(self) -> Array:
        return effective_inputs(self.system, self.motion)

    @cached_property
    def target(self) -> Array:
        """g − M a − U λ with all levels at zero, low-passed, (N, n)."""
        bare = Matrix(self.system.equation_error.subs(dict.fromkeys(self.levels, 0)))
        return np.asarray(self.filtered([bare])[0])

    @cached_property
    def base_columns(self) -> Array:
        """(levels + uncertain parameters, N, n)."""
        parameters = [Matrix(-self.system.equation_error.diff(s)) for s in self.uncertain]
        return self.filtered([*level_columns(self.system, self.levels), *parameters])

    @cached_property
    def base_ridge(self) -> Array:
        """A parameter with tolerance is held to its declared value by that tolerance; levels are free."""
        held = [CORRELATED / (self.tolerance[s] * abs(float(self.system.values[s]))) ** 2 for s in self.uncertain]
        return np.array([0.0] * len(self.levels) + held)

    @cached_property
    def scale(self) -> Array:
        """(n,) RMS of each row's residual after a first fit with rows as they are."""
        n = self.system.degrees_of_freedom
        size = np.array([_rms(self.target[b.index >= 0, i]) for i, b in enumerate(self.blocks)])
        size = np.where(size > 0, size, 1.0)
        for _ in range(2):
            weights = gram(self.target, self.base_columns, self.base_ridge, self.blocks, size).fit()
            left = self.target - np.tensordot(weights, self.base_columns, axes=1)
            new = np.array([_rms(left[self.blocks[i].index >= 0, i]) for i in range(n)])
            size = np.where(new > 0, new, size)
        return size

    @cached_property
    def base(self) -> Grams:
        """The refit: levels (and uncertain parameters) alone."""
        return self.grams(np.empty((0, *self.target.shape)))

    def filtered(self, columns: Sequence[Matrix], values: Mapping[sympy.Symbol, float] | None = None) -> Array:
        """Force columns over the motion, low-passed, (k, N, n)."""
        if not columns:
            return np.empty((0, len(self.motion.time), self.system.degrees_of_freedom))
        raw = evaluate_forces(self.system, columns, self.motion, self.inputs, values)
        return self.motion.low_pass(raw.transpose(1, 0, 2)).transpose(1, 0, 2)

    def grams(self, extra: Array, target: Array | None = None) -> Grams:
        """Products with further columns, and another target where the effect has no free weight."""
        columns = np.concatenate([self.base_columns, extra]) if len(extra) else self.base_columns
        ridge = np.concatenate([self.base_ridge, np.zeros(len(extra))])
        return gram(self.target if target is None else target, columns, ridge, self.blocks, self.scale)

    def effect_columns(self, effect: Effect, place: int, shape: Mapping[str, float]) -> Array:
        """What one unit of each weight of the effect adds, low-passed, with the sign of the target."""
        p = effect_symbols(effect, places_of(effect, self.system)[place], self.system)
        columns, names = effect.regressors(self.system, place, p)
        return self.filtered([Matrix(-c) for c in columns], {p[name]: shape[name] for name in names})

    def delayed_target(self, place: int, delay: float) -> Array:
        """The target with one input delayed."""
        inputs = self.inputs.copy()
        inputs[:, [place]] = delayed(self.motion.commands[:, [place]], delay, self.motion.sample_time)
        bare = Matrix(self.system.equation_error.subs(dict.fromkeys(self.levels, 0)))
        return self.motion.low_pass(evaluate_forces(self.system, [bare], self.motion, inputs)[0])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
