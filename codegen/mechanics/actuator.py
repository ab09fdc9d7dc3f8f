"""Drives: the actuator chain from a command to the input that acts, and a compliant transmission from motor to load.

The chain is delay → gain → dead zone → threshold → saturation → lag.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import factorial
from typing import Any, Literal

import sympy

from codegen.spec.functions import Magnitude, Sgn

Stage = Literal["delay", "gain", "dead_zone", "threshold", "saturation", "lag"]
"""Kind of a stage, in the order of the chain."""


@dataclass(frozen=True)
class Limit:
    """A saturation of an input.

    Attributes:
        height: L, the largest magnitude of the output, in the input's unit.
        rounding: r, 0 ≤ r < 1, the roundness of the corner; 0 for a sharp one.
    """

    height: sympy.Expr
    rounding: sympy.Expr = sympy.S.Zero

    def of(self, w: sympy.Expr) -> sympy.Expr:
        """The saturated input.

        With a sharp corner clip(w, −L, L) = (|w + L| − |w − L|)/2. With a rounding r each |u| becomes √(u² + (rL)²),
        with u = w ± L√(1 − r²), and the difference is divided by 2√(1 − r²), so that the output is within ±L.
        """
        if self.rounding == 0:
            return (Magnitude(w + self.height) - Magnitude(w - self.height)) / 2
        steep = sympy.sqrt(1 - self.rounding**2)
        corner, width = self.height * steep, self.height * self.rounding
        return (sympy.sqrt((w + corner) ** 2 + width**2) - sympy.sqrt((w - corner) ** 2 + width**2)) / (2 * steep)


@dataclass(frozen=True)
class Actuator:
    """Actuator model of one input: delay → gain → dead zone → threshold → saturation → lag, in this order always.

    Stages of one kind act in series: delays add up, gains multiply, dead zones add up.

    Attributes:
        delay: s.
        gain: 1 if there is none.
        dead_zone: width on either side of zero, in the input's unit.
        thresholds: in the input's unit: a command of smaller magnitude gives 0, a larger one passes unchanged.
        limits: saturations, one after the other.
        lag: time constant of the lags, s; None if there is none.
        order: number of equal lags in series.
    """

    delay: sympy.Expr = sympy.S.Zero
    gain: sympy.Expr = sympy.S.One
    dead_zone: sympy.Expr = sympy.S.Zero
    thresholds: tuple[sympy.Expr, ...] = ()
    limits: tuple[Limit, ...] = ()
    lag: sympy.Expr | None = None
    order: int = 1

    def with_stage(self, stage: Stage, parameter: sympy.Expr, *shape: sympy.Expr) -> Actuator:
        """The chain with one more stage.

        Args:
            parameter: delay, gain, width, threshold, height or time constant.
            shape: the rounding of a saturation, or the number of equal lags; optional.

        Raises:
            ValueError: for a second lag stage.
        """
        match stage:
            case "delay":
                return replace(self, delay=self.delay + parameter)
            case "gain":
                return replace(self, gain=self.gain * parameter)
            case "dead_zone":
                return replace(self, dead_zone=self.dead_zone + parameter)
            case "threshold":
                return replace(self, thresholds=(*self.thresholds, parameter))
            case "saturation":
                return replace(self, limits=(*self.limits, Limit(parameter, *shape)))
            case "lag":
                if self.lag is not None:
                    raise ValueError("a second lag stage on one input")
                return replace(self, lag=parameter, order=int(shape[0]) if shape else 1)

    @property
    def has_memory(self) -> bool:
        """Whether the input that acts depends on earlier commands."""
        return self.delay != 0 or self.lag is not None

    @property
    def has_inverse(self) -> bool:
        """Whether some constant command produces each mean of the effective input over a sample.

        True without a threshold and without a lag.
        """
        return self.lag is None and not self.thresholds

    def static(self, w: sympy.Expr) -> sympy.Expr:
        """The effective input of a constant command ``w``: gain, dead zone, thresholds and saturations in series."""
        w = self.gain * w
        if self.dead_zone != 0:
            w = w - Limit(self.dead_zone).of(w)
        for threshold in self.thresholds:
            above = Sgn(Magnitude(w) - threshold)
            w = w * above * (1 + above) / 2  # zero exactly at the threshold
        for limit in self.limits:
            w = limit.of(w)
        return w

    @property
    def numbers(self) -> tuple[sympy.Expr, ...]:
        """Delay, gain, dead zone, lag (0 for none), each threshold, then height and rounding of each limit."""
        pairs = [number for limit in self.limits for number in (limit.height, limit.rounding)]
        return (self.delay, self.gain, self.dead_zone, self.lag or sympy.S.Zero, *self.thresholds, *pairs)


def decayed(errors: Sequence[Any], ratio: Any, decay: Any) -> list[Any]:
    """Response of n equal first-order lags in series to a constant input w: e_i = y_i − w at the time t.

    tau y_i' = y_(i−1) − y_i with y_0 = w gives e_i(t) = exp(−t/tau) Σ_k (t/tau)^k/k! e_(i−k)(0).

    Args:
        errors: e_1, e_2, … at the time 0; numbers, arrays or expressions.
        ratio: t/tau.
        decay: exp(−t/tau).
    """
    later = []
    for i in range(len(errors)):
        total = errors[i]
        for k in range(1, i + 1):
            total = total + ratio**k / factorial(k) * errors[i - k]
        later.append(total * decay)
    return later


@dataclass(frozen=True)
class Transmission:
    """Compliant transmission: spring and damper between the motor, whose position is the coordinate, and its load.

    Attributes:
        coordinate: index of the coordinate. Encoder, inputs, damping and contacts are at the motor.
        stiffness, damping: k and c, force unit per coordinate unit (times s).
        load_fraction: ρ: the load has the inertia ρM, the motor (1 − ρ)M.
        gap: full width of the backlash, in the coordinate's unit; 0 for none.
        limit: force that the damper approaches at high speeds, as of a belt that slips; 0 for none.
    """

    coordinate: int
    stiffness: sympy.Expr
    damping: sympy.Expr
    load_fraction: sympy.Expr
    gap: sympy.Expr = sympy.S.Zero
    limit: sympy.Expr = sympy.S.Zero

    def force(self, deflection: sympy.Expr, rate: sympy.Expr) -> sympy.Expr:
        """The force F at the deflection dx = x − x_load and its rate dx': −F acts on the motor, +F on the load.

        Without backlash k dx + c dx', or with a limit k dx + c dx'/(1 + |c dx'|/limit). With backlash
        sgn(dx) max(0, k p + c p') where p = |dx| − gap/2 > 0, else 0.
        """
        if self.gap == 0:
            drag = self.damping * rate
            slipping = drag if self.limit == 0 else drag / (1 + Magnitude(drag) / self.limit)
            return self.stiffness * deflection + slipping
        side, depth = Sgn(deflection), Magnitude(deflection) - self.gap / 2
        push = self.stiffness * depth + self.damping * side * rate
        return side * (1 + Sgn(depth)) / 2 * (push + Magnitude(push)) / 2
