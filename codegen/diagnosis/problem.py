"""A System on a Motion: the samples that show sliding friction, and the parameters that a refit may change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import sympy

from codegen.diagnosis.balance import level_parameters
from codegen.diagnosis.residual import Masks, masks
from codegen.diagnosis.signals import Motion
from codegen.mechanics.system import System


@dataclass(frozen=True, eq=False)
class Problem:
    """A System and the Motion on which it is judged.

    Attributes:
        system: as declared.
        motion: smoothed.
        deviation: standard deviation, in SI, of each declared parameter that is uncertain.
    """

    system: System
    motion: Motion
    deviation: Mapping[sympy.Symbol, float]

    @cached_property
    def masks(self) -> Masks:
        return masks(self.system, self.motion, self.noise_speed)

    @cached_property
    def noise_speed(self) -> float:
        """Three standard deviations of the velocity noise after the fine filter, from the noise of the positions."""
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
        """Parameters that may move within their tolerance."""
        error = self.system.equation_error
        return [s for s, size in self.deviation.items() if size > 0 and error.has(s) and s not in self.levels]
